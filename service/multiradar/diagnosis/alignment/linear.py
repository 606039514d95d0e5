"""Effects of biases and of noise on the positions of pairs, linear in both."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.diagnosis.alignment.pairs import HEIGHT_SIGMA_M, Pairs, Side
from multiradar.diagnosis.plots import Floats
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_COSINE,
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_AZIMUTH_SINE,
    PARAMETER_FRAME_EAST,
    PARAMETER_FRAME_NORTH,
    PARAMETER_FRAME_ROTATION,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
    SensorTable,
)

_FRAME_AXES = (PARAMETER_FRAME_EAST, PARAMETER_FRAME_NORTH)


@dataclass(frozen=True, slots=True)
class Noise:
    """Variances of random errors by sensor.

    Attributes
    ----------
    range_m2, azimuth_rad2, position_m2 : (m,) float64
        Of range, azimuth, and each axis of a reported position.
    """

    range_m2: Floats
    azimuth_rad2: Floats
    position_m2: Floats


@dataclass(frozen=True, slots=True)
class Group:
    """Pairs of the same two sensors.

    Attributes
    ----------
    first, second : int
        The sensors.
    rows : (k,) int64
        Rows of the pairs.
    columns : (q,) int64
        Bias parameters of both sensors.
    effects : (k, 2, q) float64
        Effect of each parameter on the position by the first minus that by the second, east and
        north, m per unit.
    """

    first: int
    second: int
    rows: NDArray[np.intp]
    columns: NDArray[np.intp]
    effects: Floats


def configured_noise(sensors: SensorTable) -> Noise:
    """Return the variances of the sensors file."""
    return Noise(
        sensors.range_sigma_m**2, sensors.azimuth_sigma_rad**2, sensors.position_sigma_m**2
    )


def groups_of(pairs: Pairs, sensors: SensorTable) -> list[Group]:
    """Return the pairs by pair of sensors, with the effects of the biases.

    Parameters
    ----------
    pairs : Pairs
        The pairs.
    sensors : SensorTable
        The sensors and their bias parameters.
    """
    found = []
    for first, second, rows in pairs.groups():
        own = pairs.select(rows)
        parts, columns = [], []
        for number, side, sign in ((first, own.first, 1.0), (second, own.second, -1.0)):
            for column in np.flatnonzero(sensors.parameter_sensor == number).tolist():
                effect = _effect(int(sensors.parameter_kind[column]), side, own.velocity_mps)
                parts.append(sign * effect)
                columns.append(column)
        effects = np.stack(parts, axis=2) if parts else np.empty((len(rows), 2, 0))
        found.append(Group(first, second, rows, np.array(columns, np.intp), effects))
    return found


def _effect(kind: int, side: Side, velocity_mps: Floats) -> Floats:
    """Return the effect (n, 2) of one unit; see `multiradar.estimation.…bias_parameters`."""
    if kind == PARAMETER_TIME_OFFSET:
        # A plot with a late time is moved too little by the velocity.
        return -velocity_mps
    if kind == PARAMETER_FRAME_ROTATION:
        return np.stack([side.north_m, -side.east_m], axis=1)
    if kind in _FRAME_AXES and not side.range_m.any():
        return np.tile(np.eye(2)[_FRAME_AXES.index(kind)], (side.size, 1))
    return _polar_effect(kind, side)


def _polar_effect(kind: int, side: Side) -> Floats:
    per_range = (side.range_m / np.maximum(side.ground_m, 1.0))[:, None] * side.along
    per_azimuth = side.ground_m[:, None] * side.across
    sine, cosine = np.sin(side.azimuth_rad), np.cos(side.azimuth_rad)
    nothing, distance = np.zeros_like(sine), np.maximum(side.range_m, 1.0)
    by_range, by_azimuth = {
        PARAMETER_RANGE_OFFSET: (nothing + 1.0, nothing),
        PARAMETER_AZIMUTH_OFFSET: (nothing, nothing + 1.0),
        PARAMETER_RANGE_GAIN: (side.range_m, nothing),
        PARAMETER_AZIMUTH_SINE: (nothing, sine),
        PARAMETER_AZIMUTH_COSINE: (nothing, cosine),
        PARAMETER_FRAME_EAST: (sine, cosine / distance),
        PARAMETER_FRAME_NORTH: (cosine, -sine / distance),
    }[kind]
    return np.asarray(by_range[:, None] * per_range + by_azimuth[:, None] * per_azimuth)


def covariances(pairs: Pairs, group: Group, noise: Noise, sensors: SensorTable) -> Floats:
    """Return the covariance of `apart_m` of the pairs of a group by the random errors.

    Parameters
    ----------
    pairs : Pairs
        All pairs.
    group : Group
        Those of two sensors.
    noise : Noise
        Variances of the sensors.
    sensors : SensorTable
        The sensors.

    Returns
    -------
    (k, 2, 2) float64
        m².
    """
    rows = group.rows
    moved = pairs.velocity_variance[rows] * pairs.apart_s[rows] ** 2
    total = moved[:, None, None] * np.eye(2)
    for number, side in ((group.first, pairs.first), (group.second, pairs.second)):
        own = side.select(rows)
        if sensors.kinds[number] != KIND_RADAR:
            total = total + noise.position_m2[number] * np.eye(2)
            continue
        along, across = range_and_azimuth(own, noise, number)
        total = total + along + across + _of_height(own)
    return total


def range_and_azimuth(side: Side, noise: Noise, number: int) -> tuple[Floats, Floats]:
    """Return the covariances (k, 2, 2) of positions by the errors of range and of azimuth."""
    per_range = (side.range_m / np.maximum(side.ground_m, 1.0))[:, None] * side.along
    per_azimuth = side.ground_m[:, None] * side.across
    return (
        noise.range_m2[number] * per_range[:, :, None] * per_range[:, None, :],
        noise.azimuth_rad2[number] * per_azimuth[:, :, None] * per_azimuth[:, None, :],
    )


def _of_height(side: Side) -> Floats:
    variance = (HEIGHT_SIGMA_M * side.slope) ** 2
    return variance[:, None, None] * side.along[:, :, None] * side.along[:, None, :]
