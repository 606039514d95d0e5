"""Rows that are missing from a recording, and values that were rounded or limited in it."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.plots import Plots
from multiradar.diagnosis.single_sensor.steps import check_rounded, step_of
from support.inputs.mistaken import RADARS, Recording, recording

NAME = "1-10"
RANGE, AZIMUTH = pl.col("range_m"), pl.col("azimuth_deg")


def coded(aircraft: int = 25) -> Recording:
    """Return a recording of secondary radars."""
    one = recording(aircraft=aircraft)
    code = pl.format("43{}", pl.col("track_number").map_elements(lambda x: f"{x:02o}", pl.String))
    return replace(one, frame=one.frame.with_columns(mode_3a=code))


def kept(one: Recording, which: pl.Series) -> Recording:
    return replace(one, frame=one.frame.filter(which))


@pytest.mark.parametrize("every", [2, 3])
def test_every_second_or_third_row_of_secondary_radars_is_named(every: int) -> None:
    one = coded(aircraft=23)
    rows = pl.Series(np.arange(len(one.frame)) % every == 0)
    found = kept(one, rows).diagnosed()
    assert [(one.sensor_id, one.code) for one in found] == [
        (name, "plots_missing") for name in RADARS
    ]
    assert f"only once in about {every} scans" in found[0].sentence


def test_every_second_scan_is_named_without_codes() -> None:
    one = recording()
    number = one.frame.select(pl.int_range(pl.len()).over("sensor_id", "track_number"))
    rows = (number.to_series() % 2 == 0) | (one.frame["sensor_id"] != NAME)
    assert kept(one, rows).codes() == [(NAME, "plots_missing")]


@pytest.mark.parametrize(("probability", "aircraft"), [(0.7, 25), (0.75, 5), (0.8, 3)])
def test_a_low_probability_of_detection_is_no_mistake(probability: float, aircraft: int) -> None:
    one = coded(aircraft=aircraft)
    rows = pl.Series(np.random.default_rng(2).random(len(one.frame)) < probability)
    assert kept(one, rows).codes() == []


# A secondary radar that is alone in detecting few, or detects fewer than the others, may be weak.
@pytest.mark.parametrize("probabilities", [(0.45, 0.95, 0.95), (0.35, 0.45, 0.55)])
def test_a_weak_secondary_radar_lacks_no_rows(probabilities: tuple[float, ...]) -> None:
    one = coded()
    by_name = dict(zip(RADARS, probabilities, strict=True))
    wanted = one.frame["sensor_id"].replace_strict(by_name, return_dtype=pl.Float64)
    rows = pl.Series(np.random.default_rng(3).random(len(one.frame))) < wanted
    assert kept(one, rows).codes() == []
    if min(probabilities) == probabilities[0]:
        assert kept(one, rows).only(NAME).codes() == []


def test_random_rows_that_all_radars_lack_are_a_warning() -> None:
    one = coded()
    rows = pl.Series(np.random.default_rng(3).random(len(one.frame)) < 0.45)
    found = kept(one, rows).diagnosed()
    assert [(one.sensor_id, one.code, one.severity) for one in found] == [
        (name, "plots_missing", "warning") for name in RADARS
    ]
    assert "like those of all radars (4" in found[0].sentence


def test_every_second_row_of_one_radar_is_named() -> None:
    one = coded(aircraft=23)
    number = one.frame.select(pl.int_range(pl.len()).over("sensor_id")).to_series()
    found = kept(one, (number % 2 == 0) | (one.frame["sensor_id"] != NAME)).diagnosed()
    assert [(one.sensor_id, one.code, one.severity) for one in found] == [
        (NAME, "plots_missing", "error")
    ]


@pytest.mark.parametrize("factor", [0.9, 1.1, 1.2])
def test_a_period_that_is_off_by_a_tenth_is_named(factor: float) -> None:
    period_s = round(RADARS[NAME][1] * factor, 2)
    (found,) = recording().configured(NAME, rotation_period_s=period_s).diagnosed()
    assert (found.sensor_id, found.code) == (NAME, "rotation_period")
    assert "in 4.90 s" in found.sentence


@pytest.mark.parametrize("factor", [0.98, 1.02])
def test_a_nominal_period_is_no_mistake(factor: float) -> None:
    period_s = RADARS[NAME][1] * factor
    assert recording().configured(NAME, rotation_period_s=period_s).codes() == []


@pytest.mark.parametrize(
    ("column", "values", "words"),
    [
        ("range_m", (RANGE / 185.2).round() * 185.2, "multiples of 185.2 m"),
        ("range_m", ((RANGE / 185.2).round() * 185.2).round(), "multiples of 185.2 m"),
        # As well of three significant digits, but their step does not grow.
        ("range_m", (RANGE / 1000.0).round() * 1000.0, "multiples of 1000 m"),
        ("range_m", (RANGE / 200.0).floor() * 200.0 + 7.0, "multiples of 200 m"),
        ("azimuth_deg", (AZIMUTH * 1024.0 / 360.0).floor() * 360.0 / 1024.0, "of 0.3516°"),
    ],
)
def test_values_rounded_more_than_their_sigma_are_named(
    column: str, values: pl.Expr, words: str
) -> None:
    (found,) = recording().changed(NAME, **{column: values}).diagnosed()
    assert (found.sensor_id, found.code) == (NAME, "resolution")
    assert words in found.sentence


@pytest.mark.parametrize("step_m", [1.0, 14.47, 57.9, 115.75])
def test_usual_steps_of_ranges_are_no_mistake(step_m: float) -> None:
    assert recording().changed(NAME, range_m=(RANGE / step_m).round() * step_m).codes() == []


def test_values_without_a_step_have_none() -> None:
    values = np.sort(np.random.default_rng(1).uniform(0.0, 1e5, 500))
    assert step_of(values, 10.0) == 0.0
    assert step_of(np.array([1.0]), 10.0) == 0.0
    assert step_of(np.array([0.0, 300.0, 500.0, 1200.0]), 100.0) == 0.0


@pytest.mark.parametrize("limit_m", [65_535.0, 131_071.0])
def test_ranges_that_end_at_one_value_are_named(limit_m: float) -> None:
    found = recording().changed(NAME, range_m=pl.min_horizontal(RANGE, pl.lit(limit_m)))
    (said,) = found.diagnosed()
    assert (said.sensor_id, said.code) == (NAME, "range_limit")
    assert f"limited to {limit_m:g} m" in said.sentence


def test_a_transponder_at_a_fixed_place_is_no_limit() -> None:
    one = recording()
    far = one.frame.filter(sensor_id=NAME).head(200).with_columns(
        range_m=pl.lit(399_000.0), azimuth_deg=pl.lit(45.0) + pl.col("time_s") % 1.0 * 0.1,
        track_number=pl.lit(99, pl.Int64),
    )  # fmt: skip
    beside = replace(one, frame=pl.concat([one.frame, far]).sort("time_s"))
    assert "range_limit" not in [code for _, code in beside.codes()]


@pytest.mark.parametrize(("digits", "found"), [(1, True), (6, False)])
@pytest.mark.parametrize("span_deg", [0.9, 4.0])
def test_positions_that_stay_at_a_coarse_value_are_rounded(
    span_deg: float, digits: int, *, found: bool
) -> None:
    """Reports of every second, of which a hundred have one value of latitude."""
    aircraft, time_s = np.divmod(np.arange(4000), 400)
    latitude = 50.0 + span_deg * aircraft / 10.0 + 0.0013 * time_s * (-1.0) ** aircraft
    missing, order = np.full(4000, np.nan), np.argsort(time_s, kind="stable")
    keys = np.column_stack([aircraft, np.full((4000, 2), -1)])
    latitude = np.round(latitude, digits)
    reports = Plots(
        time_s.astype(np.float64), missing, missing, latitude, missing, missing, keys
    ).select(order)
    said = check_rounded("adsb", reports, {"latitude_deg": 30.0})
    assert (said is not None) == found
    assert said is None or "all values are multiples of 0.1°" in said.sentence
