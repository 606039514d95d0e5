"""Positions that ADS-B reports wrong are named, and not the radars beside it."""

import re

import polars as pl
import pytest

from multiradar_schemas.measurements.units import FOOT_M
from support.inputs.mistaken import METRES_PER_DEGREE, RADARS, Recording, recording, with_reports

NAME = "1-10"
SITE = RADARS[NAME][0]


LATITUDE, LONGITUDE = pl.col("latitude_deg"), pl.col("longitude_deg")


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_reports_beside_plots_have_no_diagnosis(seed: int) -> None:
    assert with_reports(recording(seed, positions=True)).diagnosed() == []


# Regression: the site of every radar was said to be wrong.
@pytest.mark.parametrize("offset_deg", [0.01, -0.02])
def test_displaced_reports_are_named_and_not_the_radars(offset_deg: float) -> None:
    one = with_reports(recording(positions=True)).changed(
        "adsb", latitude_deg=LATITUDE + offset_deg
    )
    (said,) = one.diagnosed()
    assert (said.sensor_id, said.code) == ("adsb", "positions_displaced")
    found = re.search(r"displaced by ([\d.]+) km (north|south) \(", said.sentence)
    assert found is not None
    assert float(found[1]) == pytest.approx(abs(offset_deg) * METRES_PER_DEGREE / 1e3, abs=0.1)
    assert found[2] == ("north" if offset_deg > 0.0 else "south")


def test_a_site_beside_reports_is_still_that_of_the_radar() -> None:
    one = with_reports(recording(positions=True))
    shifted = one.configured(NAME, longitude_deg=SITE[1] + 0.01)
    assert shifted.codes() == [(NAME, "site")]
    assert shifted.only(NAME, "adsb").codes() == [(NAME, "site")]


def test_reported_positions_that_are_rounded_are_named() -> None:
    one = with_reports(recording(positions=True))
    rounded = one.changed("adsb", latitude_deg=LATITUDE.round(2), longitude_deg=LONGITUDE.round(2))
    (said,) = rounded.diagnosed()
    assert (said.sensor_id, said.code) == ("adsb", "resolution")
    assert (
        "all values are multiples of 0.01°, which adds an error of 321 m (1 sigma)" in said.sentence
    )


# Regression: where traffic turns about a radar in one sense, its azimuth offset moves all aircraft
# forward or back along their tracks, and healthy reports were said to be 1.6 s ahead.
def test_an_azimuth_offset_of_a_radar_is_no_clock_of_the_reports() -> None:
    one = with_reports(recording(positions=True)).only(NAME, "adsb")
    turned = (pl.col("azimuth_deg").last() - pl.col("azimuth_deg").first() + 180.0) % 360.0 - 180.0
    plots = one.frame.filter(sensor_id=NAME).group_by("track_number").agg(turned=turned)
    names = plots.filter(pl.col("turned") < 0.0)["track_number"].implode()
    same = Recording(one.frame.filter(pl.col("track_number").is_in(names)), one.sensors)
    assert same.diagnosed() == []
    (said,) = same.changed("adsb", time_s=pl.col("time_s") + 1.8).diagnosed()
    assert "adsb: its clock is probably 1.8 s ahead" in said.sentence


@pytest.mark.parametrize(("sigma_m", "codes"), [(5000.0, [("adsb", "noise")]), (300.0, [])])
def test_an_accuracy_far_above_the_scatter_is_reported(
    sigma_m: float, codes: list[tuple[str, str]]
) -> None:
    one = with_reports(recording(positions=True)).configured("adsb", position_sigma_m=sigma_m)
    assert one.codes() == codes


@pytest.mark.parametrize("column", ["latitude_deg", "longitude_deg"])
@pytest.mark.parametrize("alone", [False, True])
def test_a_coordinate_of_the_row_before_is_named(column: str, *, alone: bool) -> None:
    one = with_reports(recording(positions=True))
    one = one.only("adsb") if alone else one
    other = pl.col(column).shift(1).over("sensor_id").fill_null(strategy="backward")
    (found,) = one.changed("adsb", **{column: other}).diagnosed()
    assert (found.sensor_id, found.code) == ("adsb", "other_rows")
    assert f"its {column} probably belongs to other rows: with that of the row after" in (
        found.sentence
    )


@pytest.mark.parametrize("column", ["latitude_deg", "longitude_deg"])
def test_a_coordinate_of_the_report_before_of_each_aircraft_is_named(column: str) -> None:
    one = with_reports(recording(positions=True))
    earlier = pl.col(column).shift(1).over("sensor_id", "track_number", order_by="time_s")
    frame = one.changed("adsb", **{column: earlier}).frame.filter(
        (pl.col("sensor_id") != "adsb") | pl.col(column).is_not_null()
    )
    (found,) = Recording(frame, one.sensors).diagnosed()
    assert (found.sensor_id, found.code) == ("adsb", "other_rows")
    assert f"its {column} probably belongs to other rows: it is that of the aircraft " in (
        found.sentence
    )


# Regression: with one radar nothing was said; with three, one of the radars was blamed.
@pytest.mark.parametrize(
    ("radars", "aircraft", "step_ft"),
    [((), 3, 25.0), ((NAME,), 3, 25.0), (("1-10", "2-10", "3-10"), 25, 25.0), ((NAME,), 3, 1.0)],
)
def test_reported_heights_in_feet_are_those_of_the_reports(
    radars: tuple[str, ...], aircraft: int, step_ft: float
) -> None:
    one = with_reports(recording(aircraft=aircraft, positions=True)).only(*radars, "adsb")
    assert one.codes() == []
    feet = (pl.col("height_m") / FOOT_M / step_ft).round(0) * step_ft
    (found,) = one.changed("adsb", height_m=feet).diagnosed()
    assert (found.sensor_id, found.code) == ("adsb", "height_unit")
    assert "its heights are probably in feet" in found.sentence


# Regression: track numbers were said to be those of other rows.
@pytest.mark.parametrize(
    ("every", "share", "severity"), [(1, 100, "error"), (3, 33, "error"), (20, 5, "warning")]
)
def test_positions_of_0_0_are_none(every: int, share: int, severity: str) -> None:
    one = with_reports(recording(positions=True))
    none = pl.col("time_s").rank("ordinal").cast(pl.Int64) % every == 0
    none &= pl.col("sensor_id") == "adsb"
    frame = one.frame.with_columns(
        pl.when(none.over("sensor_id")).then(0.0).otherwise(pl.col(name)).alias(name)
        for name in ("latitude_deg", "longitude_deg")
    )
    (said,) = Recording(frame, one.sensors).diagnosed()
    assert (said.sensor_id, said.code, said.severity) == ("adsb", "position_missing", severity)
    assert f"{share}% of its positions are 0°, 0°" in said.sentence
