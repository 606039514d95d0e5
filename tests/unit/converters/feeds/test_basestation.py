"""Times of BaseStation messages."""

import pytest

from multiradar_converters.feeds import basestation
from multiradar_converters.vid.text.lines import RejectedError


def fields(time: str) -> list[str]:
    return ["MSG", "3", "1", "1", "3C6444", "1", "2016/12/31", time, *[""] * 14]


@pytest.mark.parametrize(
    ("time", "second"), [("23:59:60.250", 0.25), ("23:59:60", 0.0), ("23:59:59.5", -0.5)]
)
def test_a_leap_second_is_read(time: str, second: float) -> None:
    assert basestation._time_s(fields(time)) == 1_483_228_800.0 + second


def test_other_times_of_day_do_not_exist() -> None:
    with pytest.raises(RejectedError, match="expected a valid date and time"):
        basestation._time_s(fields("23:59:61.000"))
