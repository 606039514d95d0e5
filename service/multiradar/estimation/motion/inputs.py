"""What motion models take: parameters not below zero, states of the right shape, time going on."""

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import MotionParameterError, ShapeError, TimeOrderError

Floats = NDArray[np.float64]


def require_not_negative(name: str, value: float) -> None:
    """Raise `MotionParameterError` unless a parameter is a finite number of 0 or more."""
    if not (value >= 0.0 and math.isfinite(value)):
        raise MotionParameterError(name, "a finite number of 0 or more", value)


def require_positive(name: str, value: float) -> None:
    """Raise `MotionParameterError` unless a parameter is a finite number above 0."""
    if not (value > 0.0 and math.isfinite(value)):
        raise MotionParameterError(name, "a finite number above 0", value)


def per_axis(name: str, values: ArrayLike) -> tuple[float, float, float]:
    """Return three parameters, east, north and up, each 0 or more.

    Raises
    ------
    ShapeError
        There are not three.
    MotionParameterError
        One is negative or no finite number.
    """
    numbers = np.asarray(values, np.float64)
    if numbers.shape != (3,):
        raise ShapeError(name, "three numbers (east, north, up)", numbers.shape)
    for number in numbers.tolist():
        require_not_negative(name, number)
    return (float(numbers[0]), float(numbers[1]), float(numbers[2]))


def components(name: str, values: ArrayLike, size: int) -> Floats:
    """Return an array whose last axis has a given length.

    Raises
    ------
    ShapeError
        It has another.
    """
    numbers = np.asarray(values, np.float64)
    if numbers.ndim == 0 or numbers.shape[-1] != size:
        raise ShapeError(name, f"{size} components in the last axis", numbers.shape)
    return numbers


def forward(interval_s: float) -> float:
    """Return an interval that does not go back.

    Raises
    ------
    TimeOrderError
        It is negative or no finite number.
    """
    if not (interval_s >= 0.0 and math.isfinite(interval_s)):
        raise TimeOrderError("interval of motion", interval_s, 0.0)
    return float(interval_s)
