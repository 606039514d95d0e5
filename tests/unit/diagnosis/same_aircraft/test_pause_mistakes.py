"""A missing part of a recording, and times that jump although aircraft have not flown on."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from numpy.typing import NDArray

from multiradar.diagnosis.evidence import COLUMNS, ROWS_MAX, Source
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.same_aircraft.pauses import check_pauses
from support.inputs.mistaken import START_S, Recording, recording

NAME = "1-10"
TIME = pl.col("time_s")
FROM_S = START_S + 70.0


def pauses(one: Recording) -> list[Diagnosis]:
    return [one for one in one.diagnosed() if one.code in ("pause", "times_jump")]


def without(length_s: float, *names: str) -> Recording:
    one = recording()
    inside = (TIME > FROM_S) & (FROM_S + length_s > TIME)
    chosen = pl.col("sensor_id").is_in(names) if names else pl.lit(1) == 1
    return replace(one, frame=one.frame.filter(~(inside & chosen)))


@pytest.mark.parametrize("names", [(), (NAME,)])
def test_a_missing_part_of_the_recording_is_named_by_its_times(names: tuple[str, ...]) -> None:
    one = without(120.0)
    (found,) = pauses(one.only(*names) if names else one)
    assert (found.code, found.severity) == ("pause", "error")
    assert "08:01:" in found.sentence
    assert "08:03:1" in found.sentence
    assert "25 aircraft fly before and after it" in found.sentence


@pytest.mark.parametrize("length_s", [30.0, 60.0])
def test_a_short_pause_is_no_mistake(length_s: float) -> None:
    assert pauses(without(length_s)) == []


def test_a_pause_of_one_radar_is_no_missing_part() -> None:
    assert pauses(without(120.0, NAME)) == []


@pytest.mark.parametrize("names", [(), (NAME,)])
def test_an_hour_that_no_aircraft_has_flown_is_a_jump_of_the_times(names: tuple[str, ...]) -> None:
    one = recording()
    later = TIME + pl.when(FROM_S < TIME).then(3600.0).otherwise(0.0)
    changed = one.changed(*(names or ("1-10", "2-10", "3-10")), time_s=later)
    (found,) = pauses(changed)
    assert (found.sensor_id, found.code) == ("".join(names), "times_jump")
    assert "jump by 1 h, from 2018-08-01 08:01:0" in found.sentence
    assert "change of daylight saving time" in found.sentence


def test_other_aircraft_after_an_hour_are_two_recordings() -> None:
    one = recording()
    after = FROM_S < TIME
    frame = one.frame.with_columns(
        time_s=TIME + pl.when(after).then(3600.0).otherwise(0.0),
        track_number=pl.col("track_number") + pl.when(after).then(100).otherwise(0),
    )
    found = pauses(replace(one, frame=frame))
    assert [(one.code, one.severity) for one in found] == [("pause", "warning")]


# At night a few aircraft leave, and others come later; a radar with clutter never pauses.
@pytest.mark.parametrize(("aircraft", "clutter", "known"), [
    (5, False, False), (12, False, True), (5, True, True),
])  # fmt: skip
def test_few_aircraft_that_leave_are_no_missing_part(
    aircraft: int, *, clutter: bool, known: bool
) -> None:
    one = recording(2, aircraft)
    after = FROM_S < TIME
    unnamed = pl.int_range(pl.len()) % 9 == 0 if clutter else pl.lit(0) == 1
    number = pl.col("track_number") + pl.when(after).then(100).otherwise(0)
    frame = one.frame.with_columns(
        time_s=TIME + pl.when(after).then(1200.0).otherwise(0.0),
        track_number=pl.when(~unnamed).then(number),
    )
    found = [(one.code, one.severity) for one in pauses(replace(one, frame=frame))]
    assert found == ([("pause", "warning")] if known else [])


# Local times at the end of daylight saving time: the rows are sorted by them.
@pytest.mark.parametrize("names", [(), (NAME,)])
def test_times_that_go_back_by_an_hour_are_named(names: tuple[str, ...]) -> None:
    one = recording()
    earlier = TIME - pl.when(FROM_S < TIME).then(3600.0).otherwise(0.0)
    changed = one.changed(*(names or ("1-10", "2-10", "3-10")), time_s=earlier)
    (found,) = pauses(replace(changed, frame=changed.frame.sort("time_s")))
    assert (found.sensor_id, found.code) == ("".join(names), "times_jump")
    assert "times probably go back by 1 h, from 2018-08-01 08:01:" in found.sentence
    assert "change of daylight saving time" in found.sentence


def reports(time_s: NDArray[np.float64], parts: int) -> Source:
    """Return a source of reports at times since the start, received in so many parts."""
    made = Source()
    for part in np.array_split(START_S + time_s, parts):
        nothing = {one: pl.lit(None).alias(one) for one in COLUMNS if one != "time_s"}
        made.add(pl.DataFrame({"time_s": part}).with_columns(**nothing).select(COLUMNS))
    return made


# Beyond the plots that are retained, the traffic before a gap shows whether it is a lull.
@pytest.mark.parametrize("parts", [1, 200])
@pytest.mark.parametrize(("lull_s", "known"), [(0.0, True), (70.0, False), (4000.0, False)])
def test_a_lull_of_a_long_recording_is_no_missing_part(
    parts: int, lull_s: float, *, known: bool
) -> None:
    """Regression: each gap of 90 s of a night was one, by the rate of the whole day."""
    day = np.arange(0.0, 9000.0, 1.0 / 7.0)
    night = np.arange(9000.0, 9000.0 + lull_s, 20.0)
    again = 9000.0 + lull_s + 100.0 + day
    one = reports(np.concatenate([day, night, again]), parts)
    assert len(day) > ROWS_MAX
    found = [(one.code, one.severity) for one in check_pauses({"adsb": one})]
    assert found == ([("pause", "error")] if known else [])
