"""Accepted arrays of numbers and of times, and the errors of others."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from multiradar.errors import ConfigurationError, PriorError, ShapeError, TimeOrderError
from multiradar.estimation.array_checks import (
    ascending_times,
    component_array,
    finite_array,
    interval_edges,
    is_integer,
    positive_array,
    require_numbers,
    require_shape,
)


@pytest.mark.parametrize(
    "given",
    [
        "12", ["1", "2"], [1.0, None], None, [[1.0, 2.0], [3.0]], [1j], [10**400], {"a": 1}, b"1",
        np.array(["2026-01-01"], "datetime64[D]"), ["x" * 500],
    ],
)  # fmt: skip
def test_invalid_numbers_are_rejected_with_their_value(given: Any) -> None:
    with pytest.raises(ShapeError, match=r"^sites: expected numbers, was .") as caught:
        require_numbers(given, "sites")
    assert len(str(caught.value)) < 100


def test_whole_numbers_and_fractions_are_numbers() -> None:
    given: Any
    for given in (True, 3, [Fraction(1, 2), 2], np.float32(0.5), np.arange(3, dtype=np.uint8)):
        assert require_numbers(given, "sites").dtype == np.float64
    assert [is_integer(one) for one in (3, np.int32(3), True, 3.0, "3")] == [True, True] + 3 * [
        False
    ]


def test_a_shape_may_leave_a_length_open() -> None:
    assert require_shape([[1, 2], [3, 4], [5, 6]], "sites", (None, 2)).dtype == np.float64
    with pytest.raises(
        ShapeError, match=r"sites: expected the shape \(any, 2\), was of shape \(2, 3\)"
    ):
        require_shape(np.zeros((2, 3)), "sites", (None, 2))
    with pytest.raises(ShapeError, match=r"was of shape \(2,\)"):
        require_shape([1.0, 2.0], "sites", (None, 2))
    with pytest.raises(ShapeError, match=r"was of shape \(\)"):
        require_shape(1.0, "times", (None,))


def test_finite_numbers_are_copied_so_that_the_caller_may_write_on() -> None:
    given = np.array([1.0, 2.0])
    kept = finite_array(given, "mean", (2,))
    given[0] = np.nan
    np.testing.assert_array_equal(kept, [1.0, 2.0])
    with pytest.raises(ShapeError, match=r"mean: expected finite numbers, was nan at \(0,\)"):
        finite_array(given, "mean")
    with pytest.raises(ShapeError, match=r"mean: expected the shape \(3,\)"):
        finite_array(given, "mean", (3,))


def test_one_positive_number_stands_for_all() -> None:
    np.testing.assert_array_equal(positive_array(2.0, "sigma", (3,)), [2.0, 2.0, 2.0])
    np.testing.assert_array_equal(positive_array([1.0, 2.0], "sigma", (2,)), [1.0, 2.0])
    with pytest.raises(ShapeError, match=r"sigma: expected one number or the shape \(3,\)"):
        positive_array([1.0, 2.0], "sigma", (3,))


@pytest.mark.parametrize("wrong", [0.0, -0.1, np.inf, np.nan])
def test_a_nonpositive_number_raises_the_given_error(wrong: float) -> None:
    message = f"sigma: expected a finite number above 0, was {wrong}"
    with pytest.raises(ConfigurationError, match=message) as caught:
        positive_array([1.0, wrong], "sigma", (2,))
    assert caught.type is ConfigurationError
    with pytest.raises(PriorError, match=message):
        positive_array([1.0, wrong], "sigma", (2,), PriorError)


def test_vectors_are_counted_by_their_last_axis() -> None:
    assert component_array(np.zeros((4, 5, 3)), "position", 3).shape == (4, 5, 3)
    for wrong in (np.zeros((3, 4)), np.zeros(())):
        with pytest.raises(ShapeError, match="position: expected 3 components in the last axis"):
            component_array(wrong, "position", 3)


def test_times_may_repeat_but_not_decrease() -> None:
    np.testing.assert_array_equal(ascending_times([1.0, 1.0, 2.0], "plot", 1.0), [1.0, 1.0, 2.0])
    assert len(ascending_times([], "plot", 5.0)) == 0
    with pytest.raises(TimeOrderError, match=r"3.0 s or later, was 2.0 s"):
        ascending_times([1.0, 3.0, 2.0], "plot", -np.inf)
    with pytest.raises(TimeOrderError, match=r"1.5 s or later, was 1.0 s"):
        ascending_times([1.0], "plot", 1.5)
    for wrong in (np.nan, np.inf):
        with pytest.raises(TimeOrderError, match=f"was {wrong}"):
            ascending_times([0.0, wrong], "plot", -np.inf)
    with pytest.raises(ShapeError, match="plot: expected one dimension"):
        ascending_times(1.0, "plot", 0.0)


def test_an_interval_has_positive_length() -> None:
    np.testing.assert_array_equal(interval_edges([0.0, 1.0], "edge", 0.0), [0.0, 1.0])
    with pytest.raises(TimeOrderError, match=r"1.0 s or later, was 1.0 s"):
        interval_edges([0.0, 1.0, 1.0], "edge", 0.0)
    with pytest.raises(ShapeError, match="edge: expected at least 2 times"):
        interval_edges([0.0], "edge", 0.0)
