"""Aircraft that a radar cannot tell apart: one plot of several."""

from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from multiradar.simulation.observation.looks import TURN_RAD, wrapped
from multiradar.simulation.observation.measurements import NO_AIRCRAFT, Measurements
from multiradar.simulation.scenario.scene import Sensor

Integers = NDArray[np.int64]


def unresolved(seen: Measurements, sensors: tuple[Sensor, ...]) -> Measurements:
    """Make one plot of the plots of one turn of a radar that are closer than it resolves.

    Parameters
    ----------
    seen : Measurements
        What would be measured of each aircraft by itself.
    sensors : tuple of Sensor
        The sensors.

    Returns
    -------
    Measurements
        The same with fewer rows: a plot of several aircraft lies in their middle, and is told as
        that of the first of them in the scene, as a formation answers by its leader alone. What is
        closer than the resolution to one of them belongs to all of them. Clutter and outliers stay.

    References
    ----------
    The project's own: a resolution cell without a blurred edge.
    """
    keep = np.ones(len(seen), np.bool_)
    range_m, azimuth_rad = seen.range_m.copy(), seen.azimuth_rad.copy()
    for index, sensor in enumerate(sensors):
        if sensor.range_resolution_m <= 0.0:
            continue
        shows = (seen.sensor == index) & (seen.aircraft != NO_AIRCRAFT) & ~seen.outlier
        for group in _groups(np.flatnonzero(shows), seen, sensor):
            told = group[np.argmin(seen.aircraft[group])]
            away = _apart(seen.azimuth_rad[group], seen.azimuth_rad[told])
            range_m[told] = seen.range_m[group].mean()
            azimuth_rad[told] = wrapped(seen.azimuth_rad[told] + away.mean())
            keep[group] = False
            keep[told] = True
    if keep.all():
        return seen
    placed = replace(seen, range_m=range_m, azimuth_rad=azimuth_rad)
    return Measurements(**{one.name: getattr(placed, one.name)[keep] for one in fields(placed)})


def _groups(rows: Integers, seen: Measurements, sensor: Sensor) -> list[Integers]:
    # Rows, by ascending time, that hang together by pairs closer than the resolution.
    first = {int(row): int(row) for row in rows}

    def leader(row: int) -> int:
        while first[row] != row:
            row = first[row]
        return row

    for row, other in _pairs(rows, seen, sensor):
        one, two = sorted((leader(row), leader(other)))
        first[two] = one
    groups: dict[int, list[int]] = {}
    for row in first:
        groups.setdefault(leader(row), []).append(row)
    return [np.array(group) for group in groups.values() if len(group) > 1]


def _pairs(rows: Integers, seen: Measurements, sensor: Sensor) -> list[tuple[int, int]]:
    within_s = 0.5 * (sensor.rotation_period_s or sensor.interval_s)
    if sensor.rotation_period_s is not None:
        # What the beam passes in one turn one after the other; noise and motion are far less.
        within_s *= min(1.0, 4.0 * sensor.azimuth_resolution_rad / TURN_RAD)
    found: list[tuple[int, int]] = []
    for step in range(1, len(rows)):
        one, other = rows[:-step], rows[step:]
        near = seen.time_s[other] - seen.time_s[one] < within_s
        if not near.any():
            break
        away = np.abs(_apart(seen.azimuth_rad[other], seen.azimuth_rad[one]))
        near &= seen.aircraft[one] != seen.aircraft[other]
        near &= np.abs(seen.range_m[other] - seen.range_m[one]) < sensor.range_resolution_m
        near &= away < sensor.azimuth_resolution_rad
        found += zip(one[near].tolist(), other[near].tolist(), strict=True)
    return found


def _apart(one: NDArray[np.float64], other: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.mod(one - other + 0.5 * TURN_RAD, TURN_RAD) - 0.5 * TURN_RAD
