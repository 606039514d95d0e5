"""Times of all radars that run at another rate, or are in another unit."""

import polars as pl
import pytest

from support.inputs.mistaken import RADARS, START_S, recording

TIME = pl.col("time_s")


# The scan periods of the radars differ, and all are wrong by the same factor.
@pytest.mark.parametrize("factor", [2.0, 0.5, 1.2])
def test_times_that_run_at_another_rate_are_no_error_of_the_radars(factor: float) -> None:
    (said,) = recording().changed(*RADARS, time_s=START_S + factor * (TIME - START_S)).diagnosed()
    assert (said.sensor_id, said.code) == ("", "time_rate")
    assert said.sentence.startswith(f"the times probably advance {factor:g} s per second: all 3 ra")


# Times of day are then those of months, with gaps of hours.
@pytest.mark.parametrize("begin_s", [START_S, START_S % 86_400.0])
def test_times_of_all_radars_in_milliseconds_are_named_once(begin_s: float) -> None:
    (said,) = recording().changed(*RADARS, time_s=(TIME - START_S + begin_s) * 1e3).diagnosed()
    assert (said.sensor_id, said.code) == ("", "time_unit")
    assert said.sentence.startswith("the times are probably in milliseconds: all 3 radars comp")


def test_the_same_wrong_period_of_all_radars_is_no_rate_of_the_times() -> None:
    one = recording()
    for name in RADARS:
        one = one.configured(name, rotation_period_s=12.0)
    assert one.codes() == [(name, "rotation_period") for name in RADARS]
