"""Detection opportunities of a radar, and the plots it makes of an aircraft."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_COSINE,
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_AZIMUTH_SINE,
    PARAMETER_FRAME_EAST,
    PARAMETER_FRAME_NORTH,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
)
from multiradar.simulation.scenario.model import Sensor, Span

Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

TURN_RAD = 2.0 * np.pi
# Iterations for the time at which the beam meets the moving aircraft: two digits or more each.
_ROUNDS = 2
# Errors of an outlier.
_OUTLIER_RANGE_M: Span = (2e3, 2e4)
_OUTLIER_AZIMUTH_RAD = 0.2


@dataclass(frozen=True, slots=True)
class LineOfSight:
    """The true line of sight from a radar to an aircraft at times (n,).

    Attributes
    ----------
    range_m, azimuth_rad : (n,) ndarray
        Slant range and azimuth.
    visible : (n,) ndarray of bool
        Whether the aircraft is within the coverage.
    elevation_rad : (n,) ndarray, optional
        Elevation; None on a flat plane.
    """

    range_m: Floats
    azimuth_rad: Floats
    visible: Bools
    elevation_rad: Floats | None = None


#: Returns the line of sight at times (n,).
LineOfSightAt = Callable[[Floats], LineOfSight]


@dataclass(frozen=True, slots=True)
class Plots:
    """The plots of one aircraft by one radar, by ascending true time.

    Attributes
    ----------
    true_s, time_s : (n,) ndarray
        Time of measurement, and its time stamp.
    range_m, azimuth_rad : (n,) ndarray
        Measured; the azimuth in [0, 2π).
    outlier : (n,) ndarray of bool
        Plots with gross errors.
    elevation_rad : (n,) ndarray, optional
        Measured elevation, where the sensor measures it.
    """

    true_s: Floats
    time_s: Floats
    range_m: Floats
    azimuth_rad: Floats
    outlier: Bools
    elevation_rad: Floats | None = None


def detection_opportunities(
    sensor: Sensor, phase: float, life_s: Span, line_of_sight: LineOfSightAt | None = None
) -> Floats:
    """Return the detection opportunities of an aircraft by a sensor.

    Parameters
    ----------
    sensor : Sensor
        A rotating antenna, or one that measures at multiples of an interval.
    phase : float
        Fraction of a scan (or interval) at which the first one starts, in [0, 1).
    life_s : (from, until)
        Only times after the first and not after the second.
    line_of_sight : callable, optional
        The line of sight; needed for a rotating antenna.

    Returns
    -------
    (n,) ndarray
        Ascending times.

    References
    ----------
    The project's own: a uniformly rotating antenna and a moving aircraft.
    """
    start, end = life_s
    period = sensor.rotation_period_s or sensor.interval_s
    first = np.floor(start / period) - 1.0
    scans = np.arange(first, np.ceil(end / period) + 1.0)
    time_s = period * (scans + phase)
    if sensor.rotation_period_s is not None and line_of_sight is not None:
        north = time_s
        for _ in range(_ROUNDS):
            seen = line_of_sight(np.clip(time_s, start, end))
            time_s = north + period * seen.azimuth_rad / TURN_RAD
    return time_s[(time_s > start) & (time_s <= end)]


def make_plots(
    sensor: Sensor,
    time_s: Floats,
    line_of_sight: LineOfSightAt,
    bias_at: Callable[[Floats], Floats],
    rng: np.random.Generator,
) -> tuple[Plots, int]:
    """Simulate the plots of an aircraft.

    Parameters
    ----------
    sensor : Sensor
        Its errors and coverage.
    time_s : (n,) ndarray
        Detection opportunities.
    line_of_sight : callable
        The line of sight.
    bias_at : callable
        Times (n,) to biases (p, n), in the order of `PARAMETER_NAMES`; measured minus true.
    rng : Generator
        For noise, detections and outliers.

    Returns
    -------
    Plots
        Plots; opportunities in gaps, outside the coverage or without detection give none.
    int
        Number of opportunities within the coverage.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.5), in polar form.
    """
    line, bias, count = line_of_sight(time_s), bias_at(time_s), len(time_s)
    noise = rng.normal(size=(2, count))
    draws = rng.uniform(size=(4, count))
    outlier = draws[0] < sensor.outlier_probability
    far, aside = _outlier(draws[2], draws[3])
    measured = line.range_m * (1.0 + bias[PARAMETER_RANGE_GAIN]) + bias[PARAMETER_RANGE_OFFSET]
    measured += sensor.range_sigma_m * noise[0] + outlier * far
    pointed = line.azimuth_rad + bias[PARAMETER_AZIMUTH_OFFSET]
    if bias[PARAMETER_AZIMUTH_SINE:].any():
        along, across = _by_direction(line, bias)
        measured += along
        pointed += across
    pointed += sensor.azimuth_sigma_rad * noise[1] + outlier * aside
    seen = line.visible & (draws[1] < sensor.detection_probability) & (measured > 0.0)
    seen &= outside_gaps(sensor, time_s)
    stamp = time_s + bias[PARAMETER_TIME_OFFSET]
    raised = None
    if sensor.elevation_sigma_rad is not None and line.elevation_rad is not None:
        # Drawn last, so that no other number of a stream depends on it.
        raised = line.elevation_rad + sensor.elevation_sigma_rad * rng.normal(size=count)
        raised = np.clip(raised, -0.5 * np.pi, 0.5 * np.pi)[seen]
    plots = Plots(
        time_s[seen], stamp[seen], measured[seen], wrapped(pointed[seen]), outlier[seen], raised
    )
    return plots, int(np.count_nonzero(line.visible))


# Effects of eccentricity, and of a site displaced by a vector, on range (m) and azimuth (rad).
def _by_direction(line: LineOfSight, bias: Floats) -> tuple[Floats, Floats]:
    sine, cosine = np.sin(line.azimuth_rad), np.cos(line.azimuth_rad)
    slant = np.maximum(line.range_m, 1.0)
    level = 1.0 if line.elevation_rad is None else np.cos(line.elevation_rad)
    east = slant * level * sine + bias[PARAMETER_FRAME_EAST]
    north = slant * level * cosine + bias[PARAMETER_FRAME_NORTH]
    rise = slant**2 - (slant * level) ** 2
    along = np.sqrt(east**2 + north**2 + rise) - slant
    across = np.arctan2(east * cosine - north * sine, east * sine + north * cosine)
    wave = bias[PARAMETER_AZIMUTH_SINE] * sine + bias[PARAMETER_AZIMUTH_COSINE] * cosine
    return along, across + wave


def outside_gaps(sensor: Sensor, time_s: Floats) -> Bools:
    """Return (n,) whether the sensor provides data at times (n,)."""
    inside = np.zeros(len(time_s), np.bool_)
    for start, end in sensor.gaps_s:
        inside |= (time_s >= start) & (time_s < end)
    return ~inside


def wrapped(azimuth_rad: Floats) -> Floats:
    """Return angles in [0, 2π).

    References
    ----------
    D. E. Knuth, "The Art of Computer Programming", volume 1, section 1.2.4: the remainder modulo
    2π.
    """
    angle = np.mod(azimuth_rad, TURN_RAD)
    # np.mod of a tiny negative number rounds to 2π itself.
    return np.where(angle >= TURN_RAD, 0.0, angle)


# Range and azimuth error of an outlier, from two numbers in [0, 1).
def _outlier(first: Floats, second: Floats) -> tuple[Floats, Floats]:
    least, most = _OUTLIER_RANGE_M
    sign = np.where(first < 0.5, -1.0, 1.0)
    far = sign * (least + (most - least) * np.mod(2.0 * first, 1.0))
    return far, _OUTLIER_AZIMUTH_RAD * (2.0 * second - 1.0)
