"""Columns that are not filled as measured: constant values, times in other units or coarse."""

import polars as pl
import pytest

from multiradar.diagnosis.evidence import COLUMNS, Source
from multiradar.diagnosis.same_aircraft.outages import check_gaps
from multiradar_schemas.sensors.sensor import Sensor
from support.inputs.mistaken import START_S, Edit, Recording, recording

NAME = "1-10"
OTHERS = ("2-10", "3-10")
AZIMUTH, HEIGHT, RANGE, TIME = (
    pl.col(one) for one in ("azimuth_deg", "height_m", "range_m", "time_s")
)


@pytest.mark.parametrize("named", [True, False])
@pytest.mark.parametrize(
    ("edit", "code", "words"),
    [
        (
            lambda one: one.changed(NAME, azimuth_deg=pl.lit(10.0)),
            "column_constant", "its azimuth_deg is probably a placeholder: the value is 10 in",
        ),
        (
            lambda one: one.changed(NAME, range_m=pl.lit(0.0)),
            "column_constant", "its range_m is probably a placeholder: the value is 0 in 100%",
        ),
        (
            lambda one: one.changed(NAME, time_s=pl.lit(START_S)),
            "column_constant", "its time_s is probably a placeholder",
        ),
        (
            lambda one: one.changed(NAME, azimuth_deg=10.0 * AZIMUTH),
            "azimuth_unit", "in tenths of a degree",
        ),
        (
            lambda one: one.changed(NAME, azimuth_deg=100.0 * AZIMUTH),
            "azimuth_unit", "in hundredths of a degree",
        ),
        (
            lambda one: one.changed(NAME, height_m=pl.lit(-9999.0)),
            "column_constant", "height_m is probably a placeholder: the value is -9999 in all",
        ),
        (
            lambda one: one.changed(NAME, time_s=TIME.floor()),
            "time_resolution", "all are multiples of 1 s, in which an aircraft flies 250 m",
        ),
        (
            lambda one: one.changed(NAME, time_s=0.5 * (2.0 * TIME).floor()),
            "time_resolution", "all are multiples of 0.5 s, in which an aircraft flies 125 m",
        ),
        (
            lambda one: one.changed(NAME, time_s=10.0 * (TIME / 10.0).floor()),
            "time_resolution", "all are multiples of 10 s",
        ),
        (
            lambda one: one.changed(
                NAME, *OTHERS, time_s=TIME.cast(pl.Float32).cast(pl.Float64)
            ),
            "time_resolution", "stored as 32-bit floating-point numbers: all are multiples of 128",
        ),
        (
            lambda one: one.changed(NAME, *OTHERS, time_s=1e3 * TIME),
            "time_unit", "in milliseconds",
        ),
    ],
)  # fmt: skip
@pytest.mark.fault(16)
def test_a_column_that_is_not_as_measured_is_named(
    edit: Edit, code: str, words: str, *, named: bool
) -> None:
    found = edit(recording(named=named)).diagnosed()
    of_it = [one for one in found if one.sensor_id in (NAME, "")]
    assert [one.code for one in of_it] == [code]
    assert words in of_it[0].sentence
    # The others are not blamed for it.
    assert {one.code for one in found} == {code}


@pytest.mark.parametrize(("unit", "factor"), [("minutes", 60.0), ("hours", 3600.0)])
def test_times_in_another_unit_are_named_by_the_scan_period(unit: str, factor: float) -> None:
    slow = recording().changed(NAME, time_s=START_S + (TIME - START_S) / factor)
    assert [
        one.sentence
        for one in slow.diagnosed()
        if f"{NAME}: its times are probably in {unit}" in one.sentence
    ]


@pytest.mark.parametrize(
    ("unit", "factor"), [("milliseconds", 1e3), ("microseconds", 1e6), ("minutes", 1.0 / 60.0)]
)
def test_times_of_plots_without_numbers_are_named_by_the_rotation(unit: str, factor: float) -> None:
    """Times of day in another unit, of a radar alone."""
    one = recording(named=False).only(NAME)
    found = one.changed(NAME, time_s=factor * (TIME - START_S + 36_000.0)).diagnosed()
    assert [(one.sensor_id, one.code) for one in found] == [(NAME, "time_unit")]
    assert f"probably in {unit}: its azimuths advance by one revolution" in found[0].sentence


@pytest.mark.parametrize(("factor", "word"), [(0.5, "half"), (2.0, "twice")])
def test_ranges_of_the_way_there_and_back_are_named(factor: float, word: str) -> None:
    """Regression: half the ranges ended the run with an internal error."""
    found = recording().changed(NAME, range_m=factor * RANGE).diagnosed()
    assert [(one.sensor_id, one.code) for one in found] == [(NAME, "range_factor")]
    assert f"its ranges are probably {word} the true distances" in found[0].sentence


@pytest.mark.parametrize(
    ("off_m", "words"),
    [
        (-1600.0, "1600 m below the heights that 2-10, 3-10 report"),
        (300.0, "300 m above the heights that 2-10, 3-10 report"),
    ],
)
def test_heights_of_another_reference_are_named(off_m: float, words: str) -> None:
    found = recording().changed(NAME, height_m=HEIGHT + off_m).diagnosed()
    assert [(one.sensor_id, one.code) for one in found] == [(NAME, "height_offset")]
    assert words in found[0].sentence
    assert ("heights above its site" in found[0].sentence) == (off_m == -1600.0)


def test_a_clock_that_is_off_by_a_second_is_named() -> None:
    found = recording().changed(NAME, time_s=TIME + 1.0).diagnosed()
    assert [(one.sensor_id, one.code) for one in found] == [(NAME, "clock")]
    assert "its clock is probably 0.9 s ahead" in found[0].sentence


def with_reports(late_s: float) -> Recording:
    """Return the recording with reported positions of the same aircraft, each 2 s."""
    one = recording(positions=True)
    reports = one.frame.filter(sensor_id="2-10").with_columns(
        pl.lit("adsb").alias("sensor_id"),
        pl.lit("adsb").alias("kind"),
        pl.lit(None, pl.Float64).alias("range_m"),
        pl.lit(None, pl.Float64).alias("azimuth_deg"),
        TIME + late_s,
    )
    radars = one.frame.with_columns(
        pl.lit(None, pl.Float64).alias(name) for name in ("latitude_deg", "longitude_deg")
    )
    frame = pl.concat([radars, reports]).sort("time_s")
    return Recording(frame, (*one.sensors, Sensor(id="adsb", kind="adsb")))


@pytest.mark.parametrize(
    ("late_s", "words"),
    [
        (-1.5, "s behind: "),
        (5.0, "s ahead: "),
        (18.0, "s ahead (GPS time instead of UTC?): "),
        (-40.0, "s behind: "),
    ],
)
def test_a_clock_of_reported_positions_is_named(late_s: float, words: str) -> None:
    """Regression: the loss of nearly all reports was explained by no mistake."""
    found = with_reports(late_s).diagnosed()
    assert [(one.sensor_id, one.code) for one in found] == [("adsb", "clock")]
    assert words in found[0].sentence


@pytest.mark.parametrize("late_s", [0.0, 0.5])
def test_a_latency_of_reported_positions_is_no_mistake(late_s: float) -> None:
    assert with_reports(late_s).diagnosed() == []


def test_exchanged_radars_are_named_from_a_few_seconds() -> None:
    """Regression: 16 plots that fit the site of the other radar were too few."""
    one = recording().only("1-10", "2-10", "3-10")
    short = one.frame.filter(TIME < START_S + 14.0)
    exchanged = short.with_columns(pl.col("sensor_id").replace({"1-10": "2-10", "2-10": "1-10"}))
    found = Recording(exchanged, one.sensors).diagnosed()
    assert "its site is probably the site of" in " ".join(each.sentence for each in found)
    assert Recording(short, one.sensors).diagnosed() == []


@pytest.mark.parametrize(
    ("times", "words"),
    [
        (TIME + pl.when(TIME > START_S + 100.0).then(86_400.0).otherwise(0.0), "jump by a day"),
        (TIME - pl.when(TIME > START_S + 100.0).then(172_800.0).otherwise(0.0), "gap of 47.9 h"),
    ],
)
def test_times_of_two_days_are_named(times: pl.Expr, words: str) -> None:
    found = recording().changed(NAME, *OTHERS, time_s=times).diagnosed()
    assert [(one.sensor_id, one.code) for one in found] == [("", "times_jump")]
    assert words in found[0].sentence


def test_a_gap_is_found_between_parts_and_a_night_is_none() -> None:
    source = Source()
    for start_s in (0.0, 30_000.0, 40.0):
        nothing = {name: [None] * 30 for name in COLUMNS}
        frame = pl.DataFrame(nothing | {"time_s": [start_s + k for k in range(30)]})
        source.add(frame)
    assert (source.gap_s, source.gap_from_s) == (29_971.0, 29.0)
    assert check_gaps({NAME: source}) == []


def test_a_loss_without_a_cause_gives_the_first_reason() -> None:
    found = recording().changed(NAME, height_m=-HEIGHT).diagnosed()
    (of_it,) = (one for one in found if one.sensor_id == NAME)
    assert "the first OUT_OF_RANGE: height_m: expected" in of_it.sentence
    assert "check the values and the unit of height_m" in of_it.sentence


@pytest.mark.parametrize(("digits", "named"), [(3, True), (4, False)])
def test_ranges_of_few_significant_digits_are_named(digits: int, *, named: bool) -> None:
    """As spreadsheets write them, 5.70E+04."""
    found = recording().changed(NAME, range_m=RANGE.round_sig_figs(digits)).diagnosed()
    assert [(one.sensor_id, one.code) for one in found] == ([(NAME, "resolution")] if named else [])
    assert not named or f"rounded to {digits} significant digits" in found[0].sentence
