"""Unresolved aircraft: one plot of several."""

from dataclasses import fields, replace

import numpy as np
from numpy.typing import NDArray

from multiradar.simulation.observation.detections import TURN_RAD, wrapped
from multiradar.simulation.observation.measurements import NO_AIRCRAFT, Measurements
from multiradar.simulation.scenario.model import Sensor

Integers = NDArray[np.int64]


def merge_unresolved(seen: Measurements, sensors: tuple[Sensor, ...]) -> Measurements:
    """Merge plots of one scan of a radar that are closer than its resolution.

    Parameters
    ----------
    seen : Measurements
        Plots of each aircraft by itself.
    sensors : tuple of Sensor
        The sensors.

    Returns
    -------
    Measurements
        Fewer rows: a plot of several aircraft lies in their middle and has the identity of the
        first of them in the scenario, as only the leader of a formation answers. Merging is
        transitive. Clutter and outliers stay.

    References
    ----------
    The project's own: a resolution cell with sharp edges.
    """
    keep = np.ones(len(seen), np.bool_)
    range_m, azimuth_rad = seen.range_m.copy(), seen.azimuth_rad.copy()
    for index, sensor in enumerate(sensors):
        if sensor.range_resolution_m <= 0.0:
            continue
        shows = (seen.sensor == index) & (seen.aircraft != NO_AIRCRAFT) & ~seen.outlier
        for group in _groups(np.flatnonzero(shows), seen, sensor):
            kept = group[np.argmin(seen.aircraft[group])]
            away = _apart(seen.azimuth_rad[group], seen.azimuth_rad[kept])
            range_m[kept] = seen.range_m[group].mean()
            azimuth_rad[kept] = wrapped(seen.azimuth_rad[kept] + away.mean())
            keep[group] = False
            keep[kept] = True
    if keep.all():
        return seen
    merged = replace(seen, range_m=range_m, azimuth_rad=azimuth_rad)
    return Measurements(**{one.name: getattr(merged, one.name)[keep] for one in fields(merged)})


def _groups(rows: Integers, seen: Measurements, sensor: Sensor) -> list[Integers]:
    # Groups of rows, sorted by time, connected by pairs closer than the resolution.
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
        # Time for the beam to sweep four resolution widths; noise and motion are far less.
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
