"""Missing ranges: of direction finders always, of radars while they are jammed."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from multiradar.simulation.observation.measurements import Measurements
from multiradar.simulation.scenario.model import Sensor


def without_lost_ranges(made: Measurements, sensors: Sequence[Sensor]) -> Measurements:
    """Return measurements without the ranges that are lost.

    Parameters
    ----------
    made : Measurements
        As if every sensor measured ranges.
    sensors : sequence of Sensor
        The sensors, with their jammed periods.

    Returns
    -------
    Measurements
        The measurements, lost ranges as NaN.

    References
    ----------
    The project's own: jamming denies the range and leaves the azimuth.
    """
    lost = np.zeros(len(made), np.bool_)
    for number, sensor in enumerate(sensors):
        own = made.sensor == number
        if sensor.kind == "direction-finder":
            lost |= own
        for start_s, end_s in sensor.jammed_s:
            lost |= own & (made.time_s >= start_s) & (made.time_s < end_s)
    if not lost.any():
        return made
    return replace(made, range_m=np.where(lost, np.nan, made.range_m))
