"""Sensors that were switched off or replaced have no wrong times."""

from dataclasses import replace

import polars as pl
import pytest

from multiradar.diagnosis.evidence import Source
from multiradar.diagnosis.same_aircraft.outages import check_gaps, check_outages
from multiradar.diagnosis.times import check_times
from support.inputs.mistaken import recording

HOUR_S, START_S = 3600.0, 1_533_081_600.0


def source(first_h: float, last_h: float, from_h: float = 0.0, hours: float = 0.0) -> Source:
    """Return a source with its longest gap, h."""
    made = Source()
    made.first_s, made.last_s = START_S + first_h * HOUR_S, START_S + last_h * HOUR_S
    made.gap_s, made.gap_from_s = hours * HOUR_S, START_S + from_h * HOUR_S
    made.read = 100
    return made


@pytest.mark.parametrize(
    ("one", "off"),
    [
        # Off for 13 hours, or a day, of three.
        (source(0.0, 72.0, 20.0, 13.0), True),
        (source(0.5, 71.5, 20.0, 24.0), True),
        # A date that jumps or falls back by a day starts or ends on another day than the others.
        (source(0.0, 96.0, 20.0, 24.0), False),
        (source(-24.0, 72.0, -4.0, 24.0), False),
        # Two recordings, of which the others cover the first one.
        (source(0.0, 144.0, 20.0, 72.0), False),
    ],
)
def test_a_radar_that_was_off_while_others_continue_causes_a_warning(
    one: Source, *, off: bool
) -> None:
    sources = {"1-10": one, "2-10": source(0.0, 72.0), "3-10": source(0.0, 72.0, 50.0, 0.1)}
    found = check_outages(sources)
    assert [(one.sensor_id, one.code, one.severity) for one in found] == (
        [("1-10", "pause", "warning")] if off else []
    )
    assert not off or "in which 2-10, 3-10 continue: switched off" in found[0].sentence
    jumps = check_gaps(sources)
    assert [(one.sensor_id, one.severity) for one in jumps] == ([] if off else [("1-10", "error")])


@pytest.mark.parametrize(("from_h", "off"), [(20.0, []), (27.0, ["1-10", "2-10"]), (45.0, [])])
def test_sensors_that_are_off_one_after_the_other_continue_for_each_other(
    from_h: float, off: list[str]
) -> None:
    """At the same time they are no outages, and the last one ends in its own."""
    sources = {"1-10": source(0.0, 50.0, 20.0, 13.0), "2-10": source(0.0, 50.0, from_h, 13.0)}
    if from_h == 45.0:
        sources["2-10"].gap_s = sources["2-10"].gap_from_s = 0.0
        sources["2-10"].last_s = START_S + 30.0 * HOUR_S
    assert [one.sensor_id for one in check_outages(sources)] == off
    assert bool(check_gaps(sources)) == (not off)


def test_an_outage_disturbs_no_other_check() -> None:
    """Two of three radars are off for a day, after which other aircraft fly."""
    first = recording().frame
    second = first.with_columns(
        time_s=pl.col("time_s") + 24.0 * HOUR_S, track_number=pl.col("track_number") + 100
    )
    clutter = first.filter(sensor_id="2-10").head(432).with_columns(
        time_s=pl.lit(first["time_s"].min()) + 200.0 * pl.int_range(1, 433),
        track_number=pl.lit(None, pl.Int64),
    )  # fmt: skip
    one = replace(recording(), frame=pl.concat([first, clutter, second]).sort("time_s"))
    found = one.diagnosed()
    assert [(one.sensor_id, one.code, one.severity) for one in found] == [
        (name, "pause", "warning") for name in ("1-10", "3-10")
    ]
    assert one.changed("3-10", range_m=pl.col("range_m") / 1852.0).diagnosed()[0].code == (
        "range_unit"
    )


@pytest.mark.parametrize(
    ("later", "severity"),
    [
        # A quarter of an hour after the other one, of as many hours or not.
        (source(2.25, 4.25), "warning"),
        (source(3.0, 9.0), "warning"),
        # An hour off, which is a time zone; more than an hour after it.
        (source(3.0, 5.75), "error"),
        (source(3.8, 5.0), "error"),
    ],
)
def test_a_radar_that_replaces_another_has_no_other_time_zone(later: Source, severity: str) -> None:
    first = source(0.0, 2.75 if later.first_s == START_S + 3.0 * HOUR_S else 2.0)
    (found,) = check_times({"1-10": first, "2-10": later})
    assert (found.sensor_id, found.code, found.severity) == ("", "times_apart", severity)
    assert ("probably one replaced the other" in found.sentence) == (severity == "warning")
