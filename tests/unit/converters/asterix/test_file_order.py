"""Days of files in order of time."""

import numpy as np
import pytest

from multiradar_converters.asterix.file_order import FileOrder

DAY_S = 86_400.0


def added(*spans_s: tuple[float, float]) -> tuple[list[float], list[tuple[str, str]]]:
    """Return the days added to files of these spans, and which were exchanged."""
    order = FileOrder()
    days = [
        order.add(f"{number}", [np.array(span_s), np.array([np.nan])]) / DAY_S
        for number, span_s in enumerate(spans_s)
    ]
    return days, order.exchanged


@pytest.mark.parametrize(
    ("spans_s", "days"),
    [
        (((0.0, 3600.0), (3600.0, 7200.0)), [0, 0]),
        # Two recorders at the same time.
        (((100.0, 3600.0), (0.0, 3500.0)), [0, 0]),
        # Past midnight, and past the next one.
        (((82_800.0, 86_399.0), (0.0, 3600.0), (80_000.0, 86_000.0), (5.0, 9.0)), [0, 1, 1, 2]),
        # The first one goes on past midnight itself.
        (((82_800.0, 90_000.0), (3600.0, 7200.0)), [0, 1]),
    ],
)
def test_files_in_order_of_time(spans_s: tuple[tuple[float, float], ...], days: list[int]) -> None:
    assert added(*spans_s) == (days, [])


def test_a_file_before_the_previous_one_is_named() -> None:
    assert added((3600.0, 7200.0), (0.0, 3000.0)) == ([0.0, 0.0], [("1", "0")])


def test_a_file_without_times_changes_nothing() -> None:
    order = FileOrder()
    assert order.add("a", [np.array([80_000.0])]) == 0.0
    assert order.add("b", []) == 0.0
    assert order.add("c", [np.array([10.0])]) == DAY_S
