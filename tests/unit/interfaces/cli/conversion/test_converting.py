"""The line about the time of a recording."""

import pytest

from multiradar.cli.conversion.outcome import times_line


@pytest.mark.parametrize(
    ("first_s", "last_s", "line"),
    [
        (None, None, "times: none"),
        (1533110400.2, 1533112200.9, "times: 2018-08-01 08:00:00 UTC to 2018-08-01 08:30:00 UTC"),
        (
            28_800.0,
            90_000.0,
            "times: 08:00:00 to 01:00:00 (day 2), without a date; convert with --date YYYY-MM-DD "
            "to compare with other data",
        ),
    ],
)
def test_times_are_in_utc_or_ask_for_a_date(
    first_s: float | None, last_s: float | None, line: str
) -> None:
    assert times_line(first_s, last_s) == line
