"""Data times are shown in UTC where the date is known, as times of day otherwise."""

import pytest

from multiradar.report.times import axis_label, clock_text, time_text

EIGHT = 1533110400.0


@pytest.mark.parametrize(
    ("time_s", "text"),
    [
        (EIGHT + 751.0, "2018-08-01 08:12:31 UTC"),
        (EIGHT + 751.999, "2018-08-01 08:12:31 UTC"),
        (EIGHT + 57_600.0, "2018-08-02 00:00:00 UTC"),
        (0.0, "00:00:00"),
        (29_551.5, "08:12:31"),
        (86_400.0 + 751.0, "00:12:31 (day 2)"),
        (-1.0, "23:59:59 (day 0)"),
        (-400 * 86_400.0, "1968-11-27 00:00:00 UTC"),
        (EIGHT * 1000.0, "day 17744333 08:00:00 UTC"),
    ],
)
def test_a_data_time_as_text(time_s: float, text: str) -> None:
    assert time_text(time_s) == text


def test_a_clock_shows_whole_seconds() -> None:
    assert clock_text(EIGHT + 0.999999) == "08:00:00"


@pytest.mark.parametrize(
    ("times", "label"),
    [
        ([EIGHT, EIGHT + 60.0], "UTC, 2018-08-01"),
        ([EIGHT, EIGHT + 86_400.0], "UTC, 2018-08-01 to 2018-08-02"),
        ([28_800.0, 30_000.0], "time of day"),
        ([], "time of day"),
    ],
)
def test_the_label_of_an_axis(times: list[float], label: str) -> None:
    assert axis_label(times) == label
