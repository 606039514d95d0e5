"""Eight numbers per vector (SIMD) in compiled functions, where the compiler does not vectorise.

The compiler vectorises a loop over columns only if it can show that the arrays do not overlap; for
loops with many arrays it gives up. Here vectorisation is explicit: `load_lanes`, operators and
`store_lanes` process eight numbers. Each lane is computed as a single number would be, so that
results are the same to the last bit on every processor; one with registers of four numbers uses two
of them. Uncompiled, lanes are arrays of NumPy.

`root`, `chosen`, `larger` and `broadcast_like` accept numbers and lanes, and so do functions made
of them.

References
----------
The project's own.
"""

import math
import operator
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numba.extending import overload
from numpy.typing import NDArray

from multiradar_compiled._lane_intrinsics import LANES as LANES
from multiradar_compiled._lane_intrinsics import (
    LanesType,
    add,
    broadcast,
    divide,
    evens,
    extract_lane,
    first_halves,
    first_pairs,
    fuse,
    greater_of,
    last_halves,
    last_pairs,
    multiply,
    negate,
    odds,
    power_of_two,
    read_columns,
    read_part,
    round_off,
    series,
    square_root,
    subtract,
    write_columns,
    write_part,
)
from multiradar_compiled.kernels import IN_LOOP

Lanes = NDArray[np.float64]
#: A number, or lanes of them.
Numbers = TypeVar("Numbers", float, Lanes)


def load_lanes(array: NDArray[np.float64], row: int, part: int, first: int, count: int) -> Lanes:
    """Return columns of an array.

    Parameters
    ----------
    array : (r, p, c) ndarray of float64
        The array, contiguous along its last axis.
    row, part : int
        Indices along its first and second axis.
    first, count : int
        First column, and their number: `LANES`, or fewer at the end; the other lanes are zero.

    Returns
    -------
    lanes
        The numbers.
    """
    return _filled(array[row, part, first : first + count])


def load_row(array: NDArray[np.float64], row: int, first: int, count: int) -> Lanes:
    """Return columns of a two-dimensional array: as `load_lanes`."""
    return _filled(array[row, first : first + count])


def store_lanes(
    array: NDArray[np.float64], row: int, part: int, first: int, count: int, lanes: Lanes
) -> None:
    """Set columns of an array: arguments as in `load_lanes`."""
    array[row, part, first : first + count] = lanes[:count]


def store_row(array: NDArray[np.float64], row: int, first: int, count: int, lanes: Lanes) -> None:
    """Set columns of a two-dimensional array: as `store_lanes`."""
    array[row, first : first + count] = lanes[:count]


def every_lane(value: float) -> Lanes:
    """Return a number in every lane."""
    return np.full(LANES, value)


def lane_of(lanes: Lanes, place: int) -> float:
    """Return one of the numbers.

    Parameters
    ----------
    lanes : lanes
        The numbers.
    place : int
        Index, 0 to 7.

    Returns
    -------
    float
        The number.
    """
    return float(lanes[place])


def sum_of(lanes: Lanes) -> float:
    """Return the sum of all lanes: pairwise, then of these pairs, then of both halves."""
    pairs = lanes[::2] + lanes[1::2]
    fours = pairs[::2] + pairs[1::2]
    return float(fours[0] + fours[1])


def largest_of(lanes: Lanes) -> float:
    """Return the largest of all lanes."""
    return float(np.max(lanes))


def sums_of(
    a: Lanes, b: Lanes, c: Lanes, d: Lanes, e: Lanes, f: Lanes, g: Lanes, h: Lanes
) -> Lanes:
    """Return the sums of eight vectors as lanes, each as `sum_of`."""
    return np.array([sum_of(lanes) for lanes in (a, b, c, d, e, f, g, h)])


def transposed(
    a: Lanes, b: Lanes, c: Lanes, d: Lanes, e: Lanes, f: Lanes, g: Lanes, h: Lanes
) -> tuple[Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes, Lanes]:
    """Return the transpose of eight vectors: first the first lanes of all."""
    z = np.array([a, b, c, d, e, f, g, h])
    return z[:, 0], z[:, 1], z[:, 2], z[:, 3], z[:, 4], z[:, 5], z[:, 6], z[:, 7]


def fused_lanes(first: Any, second: Any, third: Any) -> Lanes:
    """Return first · second + third, rounded once (uncompiled twice), as `kernels.fused`.

    Parameters
    ----------
    first, second, third : lanes or float
        The numbers; a single number is broadcast.

    Returns
    -------
    lanes
        The sums.
    """
    return np.asarray(first * second + third)


def chosen(one: Any, other: Any, more: Any, less: Any) -> Any:
    """Return ``more`` where ``one`` exceeds ``other``, else ``less``, also where one is NaN.

    Parameters
    ----------
    one, other, more, less : lanes or float
        The numbers; a single number is broadcast.

    Returns
    -------
    lanes or float
        Lanes where any of the arguments is.
    """
    if all(isinstance(given, float | int) for given in (one, other, more, less)):
        return more if one > other else less
    return np.where(np.greater(one, other), more, less)


def larger(one: Any, other: Any) -> Any:
    """Return the larger of two numbers, or of lanes; the other one where one is NaN."""
    return chosen(one, other, one, other)


def root(value: Any) -> Any:
    """Return the square root of a number, or of lanes."""
    return math.sqrt(value) if isinstance(value, float) else np.sqrt(value)


def broadcast_like(value: float, pattern: Any) -> Any:
    """Return a number, or its broadcast if the pattern is a vector."""
    return value if isinstance(pattern, float) else every_lane(value)


def nearest_whole(lanes: Lanes) -> Lanes:
    """Return the nearest whole numbers of lanes below 2⁵¹; halves to even."""
    return np.asarray(np.rint(lanes))


def two_to_the(lanes: Lanes) -> Lanes:
    """Return powers of two of whole exponents from −1022 to 1023."""
    return np.asarray(np.ldexp(1.0, lanes.astype(np.int64)))


def polynomial(*coefficients: float) -> Callable[[Lanes], Lanes]:
    """Make a polynomial that compiled functions can call.

    Parameters
    ----------
    coefficients : float
        Coefficients, of the highest power first.

    Returns
    -------
    callable
        Function of lanes, rounded as by `fused_lanes`.
    """
    made = series(coefficients)

    def plain(lanes: Lanes) -> Lanes:
        value = every_lane(coefficients[0])
        for coefficient in coefficients[1:]:
            value = fused_lanes(value, lanes, coefficient)
        return value

    @overload(plain, jit_options=IN_LOOP)
    def form(lanes: Any) -> Any:
        def compiled(lanes: Any) -> Any:
            return made(lanes)

        return compiled

    return plain


def _filled(values: NDArray[np.float64]) -> Lanes:
    lanes = np.zeros(LANES)
    lanes[: len(values)] = values
    return lanes


@overload(load_lanes, jit_options=IN_LOOP)
def _load_lanes(array: Any, row: Any, part: Any, first: Any, count: Any) -> Any:
    def compiled(array: Any, row: Any, part: Any, first: Any, count: Any) -> Any:
        return read_part(array, row, part, first, count)

    return compiled


@overload(load_row, jit_options=IN_LOOP)
def _load_row(array: Any, row: Any, first: Any, count: Any) -> Any:
    def compiled(array: Any, row: Any, first: Any, count: Any) -> Any:
        return read_columns(array, row, first, count)

    return compiled


@overload(store_lanes, jit_options=IN_LOOP)
def _store_lanes(array: Any, row: Any, part: Any, first: Any, count: Any, lanes: Any) -> Any:
    def compiled(array: Any, row: Any, part: Any, first: Any, count: Any, lanes: Any) -> None:
        write_part(array, row, part, first, count, lanes)

    return compiled


@overload(store_row, jit_options=IN_LOOP)
def _store_row(array: Any, row: Any, first: Any, count: Any, lanes: Any) -> Any:
    def compiled(array: Any, row: Any, first: Any, count: Any, lanes: Any) -> None:
        write_columns(array, row, first, count, lanes)

    return compiled


@overload(every_lane, jit_options=IN_LOOP)
def _every_lane(value: Any) -> Any:
    def compiled(value: Any) -> Any:
        return broadcast(value)

    return compiled


@overload(lane_of, jit_options=IN_LOOP)
def _lane_of(lanes: Any, place: Any) -> Any:
    def compiled(lanes: Any, place: Any) -> Any:
        return extract_lane(lanes, place)

    return compiled


@overload(sum_of, jit_options=IN_LOOP)
def _sum_of(lanes: Any) -> Any:
    def compiled(lanes: Any) -> Any:
        pairs = add(evens(lanes, lanes), odds(lanes, lanes))
        fours = add(first_pairs(pairs, pairs), last_pairs(pairs, pairs))
        return extract_lane(fours, 0) + extract_lane(fours, 4)

    return compiled


@overload(largest_of, jit_options=IN_LOOP)
def _largest_of(lanes: Any) -> Any:
    def compiled(lanes: Any) -> Any:
        pairs = larger(evens(lanes, lanes), odds(lanes, lanes))
        fours = larger(first_pairs(pairs, pairs), last_pairs(pairs, pairs))
        return larger(extract_lane(fours, 0), extract_lane(fours, 4))

    return compiled


@overload(sums_of, jit_options=IN_LOOP)
def _sums_of(a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    def compiled(a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
        ab, cd = add(evens(a, b), odds(a, b)), add(evens(c, d), odds(c, d))
        ef, gh = add(evens(e, f), odds(e, f)), add(evens(g, h), odds(g, h))
        front = add(first_pairs(ab, cd), last_pairs(ab, cd))
        back = add(first_pairs(ef, gh), last_pairs(ef, gh))
        return add(first_halves(front, back), last_halves(front, back))

    return compiled


@overload(transposed, jit_options=IN_LOOP)
def _transposed(a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
    def compiled(a: Any, b: Any, c: Any, d: Any, e: Any, f: Any, g: Any, h: Any) -> Any:
        # The digits are the columns.
        ab02, ab13, cd02, cd13 = evens(a, b), odds(a, b), evens(c, d), odds(c, d)
        ef02, ef13, gh02, gh13 = evens(e, f), odds(e, f), evens(g, h), odds(g, h)
        front04, front26 = first_pairs(ab02, cd02), last_pairs(ab02, cd02)
        front15, front37 = first_pairs(ab13, cd13), last_pairs(ab13, cd13)
        back04, back26 = first_pairs(ef02, gh02), last_pairs(ef02, gh02)
        back15, back37 = first_pairs(ef13, gh13), last_pairs(ef13, gh13)
        return (
            first_halves(front04, back04),
            first_halves(front15, back15),
            first_halves(front26, back26),
            first_halves(front37, back37),
            last_halves(front04, back04),
            last_halves(front15, back15),
            last_halves(front26, back26),
            last_halves(front37, back37),
        )

    return compiled


@overload(fused_lanes, jit_options=IN_LOOP)
def _fused_lanes(first: Any, second: Any, third: Any) -> Any:
    def compiled(first: Any, second: Any, third: Any) -> Any:
        return fuse(first, second, third)

    return compiled


@overload(chosen, jit_options=IN_LOOP)
def _chosen(one: Any, other: Any, more: Any, less: Any) -> Any:
    def of_lanes(one: Any, other: Any, more: Any, less: Any) -> Any:
        return greater_of(one, other, more, less)

    def of_numbers(one: Any, other: Any, more: Any, less: Any) -> Any:
        return more if one > other else less

    any_lanes = any(isinstance(given, LanesType) for given in (one, other, more, less))
    return of_lanes if any_lanes else of_numbers


@overload(larger, jit_options=IN_LOOP)
def _larger(one: Any, other: Any) -> Any:
    def compiled(one: Any, other: Any) -> Any:
        return chosen(one, other, one, other)

    return compiled


@overload(root, jit_options=IN_LOOP)
def _root(value: Any) -> Any:
    def of_lanes(value: Any) -> Any:
        return square_root(value)

    def of_number(value: Any) -> Any:
        return math.sqrt(value)

    return of_lanes if isinstance(value, LanesType) else of_number


@overload(broadcast_like, jit_options=IN_LOOP)
def _broadcast_like(value: Any, pattern: Any) -> Any:
    def of_lanes(value: Any, pattern: Any) -> Any:
        return broadcast(value)

    def of_number(value: Any, pattern: Any) -> Any:
        return value

    return of_lanes if isinstance(pattern, LanesType) else of_number


@overload(nearest_whole, jit_options=IN_LOOP)
def _nearest_whole(lanes: Any) -> Any:
    def compiled(lanes: Any) -> Any:
        return round_off(lanes)

    return compiled


@overload(two_to_the, jit_options=IN_LOOP)
def _two_to_the(lanes: Any) -> Any:
    def compiled(lanes: Any) -> Any:
        return power_of_two(lanes)

    return compiled


def _operator_of(python: Any, made: Any) -> None:
    # Lanes with lanes, or with a number, which is broadcast.
    @overload(python, jit_options=IN_LOOP)
    def form(one: Any, other: Any) -> Any:
        def compiled(one: Any, other: Any) -> Any:
            return made(one, other)

        return compiled if isinstance(one, LanesType) or isinstance(other, LanesType) else None


_operator_of(operator.add, add)
_operator_of(operator.sub, subtract)
_operator_of(operator.mul, multiply)
_operator_of(operator.truediv, divide)


@overload(operator.neg, jit_options=IN_LOOP)
def _negative(lanes: Any) -> Any:
    def compiled(lanes: Any) -> Any:
        return negate(lanes)

    return compiled if isinstance(lanes, LanesType) else None
