"""What the polynomial filter takes: arrays of the right shape, times that do not go back."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ConfigurationError, ShapeError, TimeOrderError

Floats = NDArray[np.float64]


def shaped(values: ArrayLike, shape: tuple[int, ...], name: str) -> Floats:
    """Return finite numbers of a shape.

    Raises
    ------
    ShapeError
        They are of another shape, or one is not finite.
    """
    numbers = np.asarray(values, np.float64)
    if numbers.shape != shape:
        raise ShapeError(name, f"the shape {shape}", numbers.shape)
    if not np.isfinite(numbers).all():
        raise ShapeError(name, "finite numbers", numbers.shape)
    return numbers


def positive(values: ArrayLike, shape: tuple[int, ...], name: str) -> Floats:
    """Return numbers above 0, one for all or one for each.

    Raises
    ------
    ShapeError
        They are of another shape.
    ConfigurationError
        One is not above 0, or not finite.
    """
    numbers = np.asarray(values, np.float64)
    if numbers.shape not in ((), shape):
        raise ShapeError(name, f"one number or the shape {shape}", numbers.shape)
    wrong = numbers[~((numbers > 0.0) & (numbers < np.inf))]
    if wrong.size:
        raise ConfigurationError(f"{name}: expected a finite number above 0, was {wrong[0]}")
    return np.broadcast_to(numbers, shape)


def ascending(times_s: ArrayLike, last_s: float, name: str) -> Floats:
    """Return times of which none is before the one before it; equal ones may be.

    Raises
    ------
    ShapeError
        They are of another shape.
    TimeOrderError
        A time goes back, or is not finite.
    """
    times = np.asarray(times_s, np.float64)
    if times.ndim != 1:
        raise ShapeError(name, "one dimension", times.shape)
    before = np.concatenate([[last_s], times[:-1]])
    wrong = np.flatnonzero(~((times >= before) & (times < np.inf)))
    if len(wrong):
        raise TimeOrderError(name, float(times[wrong[0]]), float(before[wrong[0]]))
    return times


def edges(times_s: ArrayLike, last_s: float, name: str) -> Floats:
    """Return at least two times, each after the one before it.

    Raises
    ------
    ShapeError
        They are of another shape.
    TimeOrderError
        A time goes back or stands still, or is not finite.
    """
    times = ascending(times_s, last_s, name)
    if len(times) < 2:
        raise ShapeError(name, "at least 2 times", times.shape)
    still = np.flatnonzero(np.diff(times) == 0.0)
    if len(still):
        raise TimeOrderError(name, float(times[still[0] + 1]), float(times[still[0]]))
    return times
