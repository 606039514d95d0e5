"""Checks of the arguments of motion models: parameters and intervals."""

import math

from numpy.typing import ArrayLike

from multiradar.errors import ConfigurationError, MotionParameterError, ShapeError, TimeOrderError
from multiradar.estimation.array_checks import require_numbers, require_shape

#: Maximum parameter of a motion model in SI units; its square is finite.
PARAMETER_MAX = 1e12
#: Maximum interval of a prediction, s; its cube is finite.
INTERVAL_MAX_S = 1e9


def require_not_negative(value: float, name: str) -> None:
    """Raise if a parameter is negative or above `PARAMETER_MAX`.

    Parameters
    ----------
    value : float
        The parameter, in any unit.
    name : str
        Its name in the message.

    Raises
    ------
    MotionParameterError
        If it is negative, above `PARAMETER_MAX` or NaN.
    ShapeError
        If it is not numeric.
    """
    number = float(require_shape(value, name, ()))
    if not (number >= 0.0 and math.isfinite(number)):
        raise MotionParameterError(name, "a finite number of 0 or more", number)
    _require_bounded(number, name)


def require_positive(value: float, name: str) -> None:
    """Raise if a parameter is not above 0, or above `PARAMETER_MAX`.

    Parameters
    ----------
    value : float
        The parameter, in any unit.
    name : str
        Its name in the message.

    Raises
    ------
    MotionParameterError
        If it is not above 0, above `PARAMETER_MAX` or NaN.
    ShapeError
        If it is not numeric.
    """
    number = float(require_shape(value, name, ()))
    if not (number > 0.0 and math.isfinite(number)):
        raise MotionParameterError(name, "a finite number above 0", number)
    _require_bounded(number, name)


def _require_bounded(number: float, name: str) -> None:
    if number > PARAMETER_MAX:
        raise MotionParameterError(name, f"a number of at most {PARAMETER_MAX:g}", number)


def axis_parameters(values: ArrayLike, name: str) -> tuple[float, float, float]:
    """Return three parameters, east, north and up, each 0 or more.

    Parameters
    ----------
    values : (3,) array_like
        The parameters, in any unit.
    name : str
        Their name in the message.

    Returns
    -------
    tuple of three floats
        The same numbers.

    Raises
    ------
    ShapeError
        If there are not three numbers.
    MotionParameterError
        If one is negative, above `PARAMETER_MAX` or NaN.
    """
    numbers = require_numbers(values, name)
    if numbers.shape != (3,):
        raise ShapeError(name, "three numbers (east, north, up)", numbers.shape)
    for number in numbers.tolist():
        require_not_negative(number, name)
    return (float(numbers[0]), float(numbers[1]), float(numbers[2]))


def forward_interval(interval_s: float) -> float:
    """Return an interval that is not negative.

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
        If it is negative or not finite.
    ConfigurationError
        If it is longer than `INTERVAL_MAX_S`.
    ShapeError
        If it is not numeric.
    """
    interval = float(require_shape(interval_s, "prediction interval", ()))
    if not (interval >= 0.0 and math.isfinite(interval)):
        raise TimeOrderError("prediction interval", interval, 0.0)
    if interval > INTERVAL_MAX_S:
        raise ConfigurationError(
            f"prediction interval: expected at most {INTERVAL_MAX_S:g} s, was {interval:g} s"
        )
    return interval
