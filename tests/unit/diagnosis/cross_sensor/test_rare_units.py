"""Ranges in rarer units, and what only looks like a rounding or a loss."""

import numpy as np
import polars as pl
import pytest

from support.inputs.mistaken import RADARS, recording

NAME = "1-10"
RANGE, AZIMUTH, TIME = (pl.col(name) for name in ("range_m", "azimuth_deg", "time_s"))


@pytest.mark.parametrize(
    ("metres", "words"),
    [
        (1609.344, "in statute miles"),
        (0.1, "in decimetres"),
        (10.0, "in decametres"),
        (1852.0 / 16.0, "in units of 1/16 NM"),
        (149.896, "in microseconds from pulse to echo"),
        (1852.0 / 1609.344, "nautical miles that were converted as statute miles"),
        (1.0 / 0.9144, "metres that were converted as yards"),
        (0.7, "1.43 times the true distances"),
    ],
)
def test_any_factor_of_the_ranges_of_a_radar_is_named(metres: float, words: str) -> None:
    (found,) = recording().changed(NAME, range_m=RANGE / metres).diagnosed()
    assert found.sentence.startswith(f"{NAME}: its ranges are probably {words}: ")


def test_all_radars_may_have_ranges_in_statute_miles() -> None:
    found = recording().changed(*RADARS, range_m=RANGE / 1609.344).diagnosed()
    assert [one.sensor_id for one in found] == [*RADARS]
    assert all("in statute miles, like those of all radars" in one.sentence for one in found)


def test_all_radars_may_have_nautical_miles_converted_as_statute_miles() -> None:
    found = recording().changed(*RADARS, range_m=RANGE * 1609.344 / 1852.0).diagnosed()
    assert [one.sensor_id for one in found] == [*RADARS]
    assert all("nautical miles that were converted as statute" in one.sentence for one in found)


@pytest.mark.parametrize("counts", [8192, 16_384])
def test_counts_of_more_bits_are_named(counts: int) -> None:
    (found,) = recording().changed(NAME, azimuth_deg=AZIMUTH / 360.0 * counts).diagnosed()
    assert (found.sensor_id, found.code) == (NAME, "azimuth_unit")


def test_counts_modulo_360_are_no_rounded_azimuths() -> None:
    folded = (AZIMUTH / 360.0 * 4096.0).floor() % 360.0
    assert (NAME, "resolution") not in recording().changed(NAME, azimuth_deg=folded).codes()
    rounded = AZIMUTH.round() % 360.0
    assert (NAME, "resolution") in recording().changed(NAME, azimuth_deg=rounded).codes()


@pytest.mark.parametrize(
    ("column", "words"),
    [
        (pl.lit(np.nan).alias("height_m"), "height_m is not a number (NaN); leave it empty (null)"),
        ((-RANGE).alias("range_m"), "range_m is negative (-"),
    ],
)
def test_values_that_are_none_are_named(column: pl.Expr, words: str) -> None:
    one = recording().changed(NAME, **{column.meta.output_name(): column})
    (found,) = one.diagnosed()
    assert (found.sensor_id, found.code) == (NAME, "measurements_lost")
    assert words in found.sentence
    assert "no single mistake" not in found.sentence


def test_plots_of_all_radars_under_one_name_are_named() -> None:
    one = recording()
    mixed = one.changed(*RADARS, sensor_id=pl.lit(NAME))
    (found,) = mixed.diagnosed()
    assert (found.sensor_id, found.code) == (NAME, "two_radars")
    assert "its plots are probably also those of 2-10, 3-10, which have no" in found.sentence


@pytest.mark.parametrize(
    ("time_s", "words"),
    [
        (TIME / 86_400.0 + 25_569.0, "in days since 1899-12-30"),
        (TIME / 3600.0, "in hours"),
        (TIME / 86_400.0, "in days"),
    ],
)
def test_times_of_one_radar_in_hours_or_days_are_named(time_s: pl.Expr, words: str) -> None:
    (found,) = recording().changed(NAME, time_s=time_s).diagnosed()
    assert found.sentence.startswith(f"{NAME}: its times are probably {words}")


@pytest.mark.parametrize("unit_m", [1000.0, 1852.0])
@pytest.mark.parametrize("alone", [True, False])
def test_swapped_columns_with_ranges_in_other_units_are_named(
    unit_m: float, *, alone: bool
) -> None:
    one = recording()
    one = one.only(NAME) if alone else one
    changed = one.changed(
        NAME, range_m=pl.col("azimuth_deg"), azimuth_deg=pl.col("range_m") / unit_m
    )
    (found,) = changed.diagnosed()
    assert (found.sensor_id, found.code) == (NAME, "columns_exchanged")
    assert "its range and azimuth columns are probably swapped" in found.sentence
    assert found.sentence.endswith("convert the ranges to metres")
