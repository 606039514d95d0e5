"""What motion models take: parameters that are not below zero, and time that goes on."""

import math

import numpy as np
from numpy.typing import ArrayLike

from multiradar.errors import MotionParameterError, ShapeError, TimeOrderError


def require_not_negative(value: float, name: str) -> None:
    """Say what is wrong with a parameter that is below 0, or no finite number.

    Parameters
    ----------
    value : float
        The parameter, in any unit.
    name : str
        What it is, for the message.

    Raises
    ------
    MotionParameterError
        If it is negative or no finite number.
    """
    if not (value >= 0.0 and math.isfinite(value)):
        raise MotionParameterError(name, "a finite number of 0 or more", value)


def require_positive(value: float, name: str) -> None:
    """Say what is wrong with a parameter that is not above 0, or no finite number.

    Parameters
    ----------
    value : float
        The parameter, in any unit.
    name : str
        What it is, for the message.

    Raises
    ------
    MotionParameterError
        If it is not above 0, or no finite number.
    """
    if not (value > 0.0 and math.isfinite(value)):
        raise MotionParameterError(name, "a finite number above 0", value)


def axis_parameters(values: ArrayLike, name: str) -> tuple[float, float, float]:
    """Return three parameters, east, north and up, each 0 or more.

    Parameters
    ----------
    values : (3,) array_like
        The parameters, in any unit.
    name : str
        What they are, for the message.

    Returns
    -------
    tuple of three floats
        The same numbers.

    Raises
    ------
    ShapeError
        If there are not three.
    MotionParameterError
        If one is negative or no finite number.
    """
    numbers = np.asarray(values, np.float64)
    if numbers.shape != (3,):
        raise ShapeError(name, "three numbers (east, north, up)", numbers.shape)
    for number in numbers.tolist():
        require_not_negative(number, name)
    return (float(numbers[0]), float(numbers[1]), float(numbers[2]))


def forward_interval(interval_s: float) -> float:
    """Return an interval that does not go back.

    Parameters
    ----------
    interval_s : float
        The interval, s.

    Returns
    -------
    float
        The same, s.

    Raises
    ------
    TimeOrderError
        If it is negative or no finite number.
    """
    if not (interval_s >= 0.0 and math.isfinite(interval_s)):
        raise TimeOrderError("interval of motion", interval_s, 0.0)
    return float(interval_s)
