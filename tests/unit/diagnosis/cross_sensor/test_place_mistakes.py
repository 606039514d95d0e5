"""Clocks of minutes, and positions or sites of all radars that are displaced by a little."""

from dataclasses import replace

import polars as pl
import pytest

from support.inputs.mistaken import METRES_PER_DEGREE, RADARS, recording, with_reports

NAME = "1-10"
TIME = pl.col("time_s")


@pytest.mark.parametrize("late_s", [10.0, 18.0, -60.0, 120.0, 420.0, -560.0])
def test_a_clock_of_seconds_to_minutes_is_named_alone(late_s: float) -> None:
    (found,) = recording().changed(NAME, time_s=TIME + late_s).diagnosed()
    assert (found.sensor_id, found.code, found.severity) == (NAME, "clock", "error")
    assert ("ahead" if late_s > 0.0 else "behind") in found.sentence
    said = float(found.sentence.partition("its clock is probably ")[2].partition(" s ")[0])
    assert said == pytest.approx(abs(late_s), abs=3.0)


def test_a_clock_of_minutes_of_one_of_two_radars_is_named_with_both() -> None:
    two = recording().only(NAME, "2-10")
    (found,) = two.changed(NAME, time_s=TIME + 500.0).diagnosed()
    assert found.code == "clock"
    assert "there is no third sensor to decide which is wrong" in found.sentence
    assert " s ahead (8.3 min)" in found.sentence


def test_a_clock_is_named_beside_sensors_that_share_other_identities() -> None:
    """One radar has addresses and codes, the others have codes, and ADS-B has addresses."""
    one = with_reports(recording(positions=True))
    number, sensor = pl.col("track_number"), pl.col("sensor_id")
    one = replace(
        one,
        frame=one.frame.with_columns(
            track_number=pl.lit(None, pl.Int64),
            mode_3a=pl.when(sensor != "adsb").then(
                pl.format("43{}", number.map_elements(lambda x: f"{x:02o}", pl.String))
            ),
            mode_s_address=pl.when(sensor.is_in([NAME, "adsb"])).then(
                pl.format("4B18{}", (number + 16).cast(pl.String))
            ),
            latitude_deg=pl.when(sensor == "adsb").then(pl.col("latitude_deg")),
            longitude_deg=pl.when(sensor == "adsb").then(pl.col("longitude_deg")),
        ),
    )
    assert one.codes() == []
    (found,) = one.changed("adsb", time_s=TIME + 18.0).diagnosed()
    assert (found.sensor_id, found.code) == ("adsb", "clock")
    assert "18.0 s ahead (GPS time instead of UTC?)" in found.sentence


@pytest.mark.parametrize("late_s", [3.0, -3.0, 0.0])
def test_a_clock_is_named_beside_sensors_that_share_no_identity(late_s: float) -> None:
    """The tracks of the run show which plots are of one aircraft."""
    one = with_reports(recording(positions=True))
    of_reports = pl.col("sensor_id") == "adsb"
    address = pl.format("4B18{}", (pl.col("track_number") + 16).cast(pl.String))
    frame = one.frame.with_columns(
        track_number=pl.when(~of_reports).then(pl.col("track_number")),
        mode_s_address=pl.when(of_reports).then(address),
        latitude_deg=pl.when(of_reports).then(pl.col("latitude_deg")),
        longitude_deg=pl.when(of_reports).then(pl.col("longitude_deg")),
    )
    tracks = one.frame["track_number"].to_numpy()
    found = replace(one, frame=frame).changed("adsb", time_s=TIME + late_s).diagnosed(tracks)
    assert [(one.sensor_id, one.code) for one in found] == ([("adsb", "clock")] if late_s else [])
    assert not found or f"2.9 s {'ahead' if late_s > 0.0 else 'behind'}" in found[0].sentence


@pytest.mark.parametrize("north_m", [100.0, -150.0])
def test_reports_displaced_by_100_m_against_all_radars_are_named(north_m: float) -> None:
    one = with_reports(recording(positions=True))
    moved = pl.col("latitude_deg") + north_m / METRES_PER_DEGREE
    (found,) = one.changed("adsb", latitude_deg=moved).diagnosed()
    assert (found.sensor_id, found.code) == ("adsb", "positions_displaced")
    assert ("north" if north_m > 0.0 else "south") in found.sentence


@pytest.mark.parametrize("north_m", [5_000.0, -30_000.0])
def test_reports_displaced_by_kilometres_are_named(north_m: float) -> None:
    one = with_reports(recording(positions=True))
    latitude = pl.col("latitude_deg") + north_m / METRES_PER_DEGREE
    (found,) = one.changed("adsb", latitude_deg=latitude).diagnosed()
    assert (found.sensor_id, found.code, found.severity) == (
        "adsb",
        "positions_displaced",
        "error",
    )
    said_km, course = found.sentence.partition("displaced by ")[2].split()[::2][:2]
    assert float(said_km) == pytest.approx(abs(north_m) / 1e3, abs=0.5)
    assert course.startswith("north" if north_m > 0.0 else "south")


@pytest.mark.parametrize("heights", [True, False])
def test_reports_of_another_area_are_named(*, heights: bool) -> None:
    one = with_reports(recording(positions=True))
    if not heights:
        one = one.changed("adsb", height_m=pl.lit(None, pl.Float64))
        assert one.codes() == [("adsb", "heights_missing")]
    latitude, longitude = pl.col("latitude_deg"), pl.col("longitude_deg")
    (found,) = one.changed(
        "adsb", latitude_deg=latitude - 20.0, longitude_deg=longitude + 7.0
    ).diagnosed()
    assert (found.sensor_id, found.code) == ("adsb", "positions_elsewhere")
    assert "only 0% of its positions lie where other sensors detect the same" in found.sentence
    assert "probably of another recording" in found.sentence


def test_reports_that_contradict_one_radar_are_not_displaced() -> None:
    one = with_reports(recording(positions=True)).only(NAME, "adsb")
    site = RADARS[NAME][0][0] + 20_000.0 / METRES_PER_DEGREE
    (found,) = one.configured(NAME, latitude_deg=site).diagnosed()
    assert (found.sensor_id, found.code) == (NAME, "site")


def test_sites_that_are_all_displaced_are_the_other_reading() -> None:
    one = with_reports(recording(positions=True))
    for name, (site, _, _) in RADARS.items():
        one = one.configured(name, latitude_deg=site[0] + 2000.0 / METRES_PER_DEGREE)
    (found,) = one.diagnosed()
    assert (found.sensor_id, found.code) == ("adsb", "positions_displaced")
    radars = "or the sites of all radars (1-10, 2-10, 3-10)"
    assert f"{radars} by the same distance in the opposite direction" in found.sentence


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_right_positions_are_no_mistake(seed: int) -> None:
    assert with_reports(recording(seed, positions=True)).codes() == []
