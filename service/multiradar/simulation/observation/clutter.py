"""Clutter plots."""

import numpy as np

from multiradar.simulation.observation.detections import TURN_RAD, Plots, outside_gaps
from multiradar.simulation.scenario.model import Sensor

# Maximum clutter range of a radar without instrumented range.
_RANGE_MAX_M = 200e3


def clutter_plots(sensor: Sensor, duration_s: float, rng: np.random.Generator) -> Plots:
    """Draw the clutter of a radar, uniform over area and time.

    Parameters
    ----------
    sensor : Sensor
        Its mean number of clutter plots per scan, clutter bursts, coverage and gaps.
    duration_s : float
        Duration of the scenario.
    rng : Generator
        Random generator.

    Returns
    -------
    Plots
        Unsorted; all are outliers.

    References
    ----------
    The project's own: a Poisson number of plots per scan, uniform over the area.
    """
    period = sensor.rotation_period_s or sensor.interval_s
    count = rng.poisson(sensor.clutter_per_turn * duration_s / period)
    parts = [rng.uniform(0.0, duration_s, count)]
    for storm in sensor.clutter_bursts:
        end_s = min(storm.end_s, duration_s)
        lasts_s = max(end_s - storm.start_s, 0.0)
        more = rng.poisson(storm.plots_per_turn * lasts_s / period)
        parts.append(storm.start_s + lasts_s * rng.uniform(size=more))
    time_s = np.concatenate(parts)
    count = len(time_s)
    squares = np.square([sensor.range_min_m, min(sensor.range_max_m, _RANGE_MAX_M)])
    range_m = np.sqrt(squares[0] + (squares[1] - squares[0]) * rng.uniform(size=count))
    azimuth_rad = rng.uniform(0.0, TURN_RAD, count)
    seen = outside_gaps(sensor, time_s) & (range_m > 0.0)
    time_s = time_s[seen]
    return Plots(time_s, time_s, range_m[seen], azimuth_rad[seen], np.ones(len(time_s), np.bool_))
