"""Checks of numeric arguments: type, shape, finiteness, sign, order."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ConfigurationError, ShapeError, TimeOrderError

Floats = NDArray[np.float64]

# Maximum number of characters of a non-numeric argument that an error shows.
_SHOWN_MAX = 60


def require_numbers(values: ArrayLike, name: str) -> Floats:
    """Return numbers as a float array; raise if they are not numbers.

    Parameters
    ----------
    values : (...) array_like
        Numbers, in any units, finite or not.
    name : str
        Their name in the message.

    Returns
    -------
    (...) float64
        The same numbers; a float64 array is not copied.

    Raises
    ------
    ShapeError
        If they contain text, None, dates or complex numbers, or rows of unequal length.
    """
    try:
        array = np.asarray(values)
        plain = array.dtype.kind in "biuf"
        exact = array.dtype.kind == "O" and not any(
            one is None or isinstance(one, str | bytes) for one in array.ravel().tolist()
        )
        if plain or exact:
            return array.astype(np.float64, copy=False)
    except (TypeError, ValueError, OverflowError) as error:
        raise ShapeError(name, "numbers", (), _shown(values)) from error
    raise ShapeError(name, "numbers", array.shape, _shown(values))


def is_integer(value: object) -> bool:
    """Return whether a value is a Python or NumPy integer; booleans are not.

    Parameters
    ----------
    value : object
        Any value.

    Returns
    -------
    bool
        Whether it is an integer.
    """
    return isinstance(value, int | np.integer) and not isinstance(value, bool)


def _shown(values: object) -> str:
    text = repr(values)
    return text if len(text) <= _SHOWN_MAX else f"{text[:_SHOWN_MAX]} …"


def require_shape(values: ArrayLike, name: str, shape: tuple[int | None, ...]) -> Floats:
    """Return the numbers if they have a shape; raise otherwise.

    Parameters
    ----------
    values : (...) array_like
        Numbers, in any units.
    name : str
        Their name in the message.
    shape : tuple of int or None
        Length of each dimension; None for any length.

    Returns
    -------
    (*shape) float64
        The same numbers.

    Raises
    ------
    ShapeError
        If the shape differs, or they are not numbers.
    """
    numbers = require_numbers(values, name)
    agree = len(numbers.shape) == len(shape) and all(
        wanted in (None, length) for wanted, length in zip(shape, numbers.shape, strict=True)
    )
    if not agree:
        wanted = str(shape).replace("None", "any")
        raise ShapeError(name, f"the shape {wanted}", numbers.shape)
    return numbers


def finite_array(
    values: ArrayLike, name: str, shape: tuple[int | None, ...] | None = None
) -> Floats:
    """Return a copy of numbers that are all finite.

    Parameters
    ----------
    values : (...) array_like
        Numbers, in any units.
    name : str
        Their name in the message.
    shape : tuple of int or None, optional
        As in `require_shape`; any shape by default.

    Returns
    -------
    (*shape) float64
        A copy of the numbers.

    Raises
    ------
    ShapeError
        If the shape differs, or a number is not finite.
    """
    numbers = require_numbers(values, name).copy()
    if shape is not None:
        require_shape(numbers, name, shape)
    wrong = np.argwhere(~np.isfinite(numbers))
    if len(wrong):
        place = tuple(wrong[0].tolist())
        found = f"{numbers[place]:g}" + (f" at {place}" if place else "")
        raise ShapeError(name, "finite numbers", numbers.shape, found)
    return numbers


def positive_array(
    values: ArrayLike,
    name: str,
    shape: tuple[int, ...],
    error: Callable[[str], ConfigurationError] = ConfigurationError,
) -> Floats:
    """Return numbers above 0, one for all or one for each.

    Parameters
    ----------
    values : () or (*shape) array_like
        Numbers, in any units.
    name : str
        Their name in the message.
    shape : tuple of int
        Shape of the result.
    error : callable, optional
        Creates the error from its message.

    Returns
    -------
    (*shape) float64
        The numbers, a single one broadcast; read-only.

    Raises
    ------
    ShapeError
        If the shape differs, or they are not numbers.
    ConfigurationError
        If one is not above 0 or not finite; of the class of `error`.
    """
    numbers = require_numbers(values, name)
    if numbers.shape not in ((), shape):
        raise ShapeError(name, f"one number or the shape {shape}", numbers.shape)
    wrong = numbers[~((numbers > 0.0) & (numbers < np.inf))]
    if wrong.size:
        raise error(f"{name}: expected a finite number above 0, was {wrong[0]}")
    return np.broadcast_to(numbers, shape)


def component_array(values: ArrayLike, name: str, count: int) -> Floats:
    """Return vectors with a given number of components.

    Parameters
    ----------
    values : (..., count) array_like
        One vector or several, in any units.
    name : str
        Their name in the message.
    count : int
        Length of the last axis.

    Returns
    -------
    (..., count) float64
        The same numbers, finite or not.

    Raises
    ------
    ShapeError
        If the last axis has another length, or they are not numbers.
    """
    numbers = require_numbers(values, name)
    if numbers.ndim == 0 or numbers.shape[-1] != count:
        raise ShapeError(name, f"{count} components in the last axis", numbers.shape)
    return numbers


def ascending_times(times_s: ArrayLike, name: str, after_s: float) -> Floats:
    """Return non-decreasing times.

    Parameters
    ----------
    times_s : (n,) array_like
        Times, s.
    name : str
        Name of one of them in the message.
    after_s : float
        Earliest allowed first time, s; −inf for none.

    Returns
    -------
    (n,) float64
        The same times, s.

    Raises
    ------
    ShapeError
        If they are not one-dimensional, or not numbers.
    TimeOrderError
        If the times decrease, or one is NaN or +inf.
    """
    times = require_numbers(times_s, name)
    if times.ndim != 1:
        raise ShapeError(name, "one dimension", times.shape)
    before = np.concatenate([[after_s], times[:-1]])
    wrong = np.flatnonzero(~((times >= before) & (times < np.inf)))
    if len(wrong):
        raise TimeOrderError(name, float(times[wrong[0]]), float(before[wrong[0]]))
    return times


def interval_edges(times_s: ArrayLike, name: str, after_s: float) -> Floats:
    """Return at least two strictly increasing times.

    Parameters
    ----------
    times_s : (n + 1,) array_like
        Edges of n intervals, s.
    name : str
        Name of one of them in the message.
    after_s : float
        Earliest allowed first time, s; −inf for none.

    Returns
    -------
    (n + 1,) float64
        The same times, s.

    Raises
    ------
    ShapeError
        If they are not one-dimensional, fewer than two, or not numbers.
    TimeOrderError
        If the times do not strictly increase, or one is NaN or +inf.
    """
    times = ascending_times(times_s, name, after_s)
    if len(times) < 2:
        raise ShapeError(name, "at least 2 times", times.shape)
    still = np.flatnonzero(np.diff(times) == 0.0)
    if len(still):
        raise TimeOrderError(name, float(times[still[0] + 1]), float(times[still[0]]))
    return times
