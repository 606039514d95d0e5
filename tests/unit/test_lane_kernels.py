"""Lanes are what numbers by themselves would be, compiled or not, and touch no column too many."""

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.kernels import loop
from multiradar.lane_kernels import LANES, lane_of, lanes_of, load_lanes, store_lanes

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
def taken_apart(values: Floats, out: Floats) -> None:
    lanes = lanes_of(values[0], values[1], values[2], values[3])
    for place in range(LANES):
        out[place] = lane_of(lanes + lanes * 2.0, place)


def both(function: Callable[..., None]) -> list[Callable[..., None]]:
    return [function, getattr(function, "py_func", function)]


@pytest.mark.parametrize("columns", [1, 3, 4, 6, 8, 16, 17])
def test_every_column_is_computed_as_by_itself_and_none_beside(columns: int) -> None:
    rng = np.random.default_rng(columns)
    a, b = rng.normal(size=(2, 3, 2, columns)) * 10.0 ** rng.integers(-9, 9, (2, 3, 2, columns))
    for function in both(combine):
        # Rows of a wider array: what follows the last column belongs to somebody else.
        room = np.full((3, 2, columns + LANES), np.nan)
        function(a, b, 0.1, room[:, :, :columns])
        assert (room[:, :, :columns] == 0.1 * a + b - a * b).all()
        assert np.isnan(room[:, :, columns:]).all()


def test_four_numbers_are_put_together_and_taken_apart() -> None:
    values = np.array([1.5, -2.0, np.inf, 1e-300])
    for function in both(taken_apart):
        out = np.empty(LANES)
        function(values, out)
        assert (out == values + values * 2.0).all()
