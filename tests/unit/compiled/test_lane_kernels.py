"""Lanes equal single numbers, compiled or not, and write no other columns."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar_compiled.kernels import loop
from multiradar_compiled.lane_function_kernels import angle_of, exponential, sine_and_cosine
from multiradar_compiled.lane_kernels import (
    LANES,
    broadcast_like,
    chosen,
    every_lane,
    fused_lanes,
    lane_of,
    larger,
    largest_of,
    load_lanes,
    load_row,
    nearest_whole,
    root,
    store_lanes,
    store_row,
    sum_of,
    sums_of,
    transposed,
    two_to_the,
)

Floats = NDArray[np.float64]


@loop
def combine(a: Floats, b: Floats, factor: float, out: Floats) -> None:
    """Set out to factor a + b − a b, by lanes."""
    n = a.shape[2]
    for row in range(a.shape[0]):
        for part in range(a.shape[1]):
            for c in range(0, n, LANES):
                count = min(LANES, n - c)
                one = load_lanes(a, row, part, c, count)
                other = load_lanes(b, row, part, c, count)
                store_lanes(out, row, part, c, count, factor * one + other - one * other)


@loop
def rearrange(square: Floats, out: Floats) -> None:
    """Set out to the transpose of the square, its row sums, and three numbers of its first row."""
    a, b, c, d = (load_row(square, 0, 0, LANES), load_row(square, 1, 0, LANES),
                  load_row(square, 2, 0, LANES), load_row(square, 3, 0, LANES))  # fmt: skip
    e, f, g, h = (load_row(square, 4, 0, LANES), load_row(square, 5, 0, LANES),
                  load_row(square, 6, 0, LANES), load_row(square, 7, 0, LANES))  # fmt: skip
    columns = transposed(a, b, c, d, e, f, g, h)
    for row in range(LANES):
        store_row(out, row, 0, LANES, columns[row])
    store_row(out, LANES, 0, LANES, sums_of(a, b, c, d, e, f, g, h))
    out[LANES + 1, 0] = sum_of(a)
    out[LANES + 1, 1] = largest_of(a)
    out[LANES + 1, 2] = lane_of(a, 5)


@loop
def calculate(values: Floats, out: Floats) -> None:
    """Set out to functions of numbers and of lanes, of two rows."""
    a, b = load_row(values, 0, 0, LANES), load_row(values, 1, 0, LANES)
    store_row(out, 0, 0, LANES, fused_lanes(a, 3.0, b))
    store_row(out, 1, 0, LANES, chosen(a, b, a, -1.0))
    store_row(out, 2, 0, LANES, larger(a, b) / every_lane(3.0))
    store_row(out, 3, 0, LANES, root(a * a))
    store_row(out, 4, 0, LANES, nearest_whole(b))
    store_row(out, 5, 0, LANES, two_to_the(nearest_whole(b)))
    store_row(out, 6, 0, LANES, broadcast_like(2.0, a) - b)
    out[7, 0] = chosen(values[0, 0], values[1, 0], values[0, 0], -1.0)
    out[7, 1] = larger(values[0, 0], values[1, 0])
    out[7, 2] = root(larger(values[0, 0], 0.0))
    out[7, 3] = broadcast_like(2.0, values[0, 0])


@loop
def transcend(values: Floats, out: Floats) -> None:
    """Set out to exponential, sine, cosine and direction."""
    a, b = load_row(values, 0, 0, LANES), load_row(values, 1, 0, LANES)
    store_row(out, 0, 0, LANES, exponential(-(a * a)))
    sine, cosine = sine_and_cosine(b)
    store_row(out, 1, 0, LANES, sine)
    store_row(out, 2, 0, LANES, cosine)
    store_row(out, 3, 0, LANES, angle_of(a, b, root(a * a + b * b)))


def both(function: Callable[..., None]) -> list[Callable[..., None]]:
    return [function, getattr(function, "py_func", function)]


@pytest.mark.parametrize("columns", [1, 3, 4, 6, 8, 16, 17])
def test_every_column_is_computed_as_by_itself_and_none_beside(columns: int) -> None:
    rng = np.random.default_rng(columns)
    a, b = rng.normal(size=(2, 3, 2, columns)) * 10.0 ** rng.integers(-9, 9, (2, 3, 2, columns))
    for function in both(combine):
        # Rows of a wider array: later columns must not be written.
        room = np.full((3, 2, columns + LANES), np.nan)
        function(a, b, 0.1, room[:, :, :columns])
        assert (room[:, :, :columns] == 0.1 * a + b - a * b).all()
        assert np.isnan(room[:, :, columns:]).all()


def test_lanes_are_turned_and_summed() -> None:
    square = np.random.default_rng(1).normal(size=(LANES, LANES))
    for function in both(rearrange):
        out = np.empty((LANES + 2, LANES))
        function(square, out)
        assert (out[:LANES] == square.T).all()
        # Sums of eight numbers of size one: rounded in another order.
        np.testing.assert_allclose(out[LANES], square.sum(axis=1), rtol=0, atol=1e-14)
        assert out[LANES + 1, 0] == out[LANES, 0]
        assert out[LANES + 1, 1] == square[0].max()
        assert out[LANES + 1, 2] == square[0, 5]


def test_functions_of_numbers_and_of_lanes_are_those_of_numpy() -> None:
    values = np.array(
        [
            [1.5, -2.0, 7.0, np.nan, 0.0, 3.0, -1e150, 4.0],
            [0.5, 1.5, -2.5, 1.0, -0.49, 1023.0, -1022.0, 1e-9],
        ]
    )
    a, b = values
    for function in both(calculate):
        out = np.full((8, LANES), np.nan)
        function(values, out)
        np.testing.assert_allclose(out[0], 3.0 * a + b, rtol=1e-15)
        np.testing.assert_array_equal(out[1], np.where(np.greater(a, b), a, -1.0))
        np.testing.assert_array_equal(out[2], np.where(np.greater(a, b), a, b) / 3.0)
        np.testing.assert_allclose(out[3], np.abs(a), rtol=1e-15)
        np.testing.assert_array_equal(out[4], np.rint(b))
        np.testing.assert_array_equal(out[5], np.exp2(np.rint(b)))
        np.testing.assert_array_equal(out[6], 2.0 - b)
        assert out[7, :4].tolist() == [1.5, 1.5, np.sqrt(1.5), 2.0]


@pytest.mark.parametrize("seed", range(30))
def test_exponentials_and_angles_are_right_to_the_last_places(seed: int) -> None:
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(2, LANES)) * 10.0 ** rng.uniform(-6.0, [[1.3], [5.0]], (2, LANES))
    a, b = values
    for function in both(transcend):
        out = np.empty((4, LANES))
        function(values, out)
        # A few units in the last place; below 1e-300 an exponential is negligible. Uncompiled,
        # products are rounded before addition, which matters for large angles.
        np.testing.assert_allclose(out[0], np.exp(-(a * a)), rtol=2e-14, atol=1e-300)
        np.testing.assert_allclose(out[1], np.sin(b), rtol=0, atol=1e-14)
        np.testing.assert_allclose(out[2], np.cos(b), rtol=0, atol=1e-14)
        np.testing.assert_allclose(out[3], np.arctan2(a, b), rtol=1e-14)


def test_there_is_no_angle_without_a_length_and_every_direction_has_its_own() -> None:
    x = np.array([0.0, 1.0, -1.0, 0.0, 0.0, -1.0, 1.0, 1e-300])
    y = np.array([0.0, 0.0, 0.0, 1.0, -1.0, -1e-12, -1.0, 0.0])
    for function in both(transcend):
        out = np.empty((4, LANES))
        function(np.array([y, x]), out)
        np.testing.assert_allclose(out[3], np.arctan2(y, x), rtol=1e-14)
