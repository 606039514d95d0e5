"""Clocks of minutes, and positions or sites of all radars that are displaced by a little."""

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


@pytest.mark.parametrize("north_m", [100.0, -150.0])
def test_reports_displaced_by_100_m_against_all_radars_are_named(north_m: float) -> None:
    one = with_reports(recording(positions=True))
    moved = pl.col("latitude_deg") + north_m / METRES_PER_DEGREE
    (found,) = one.changed("adsb", latitude_deg=moved).diagnosed()
    assert (found.sensor_id, found.code) == ("adsb", "positions_displaced")
    assert ("north" if north_m > 0.0 else "south") in found.sentence


def test_sites_that_are_all_displaced_are_the_other_reading() -> None:
    one = with_reports(recording(positions=True))
    for name, (site, _, _) in RADARS.items():
        one = one.configured(name, latitude_deg=site[0] + 2000.0 / METRES_PER_DEGREE)
    (found,) = one.diagnosed()
    assert (found.sensor_id, found.code) == ("adsb", "positions_displaced")
    assert "or the sites of all radars (1-10, 2-10, 3-10) by as much the other way" in (
        found.sentence
    )


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_right_positions_are_no_mistake(seed: int) -> None:
    assert with_reports(recording(seed, positions=True)).codes() == []
