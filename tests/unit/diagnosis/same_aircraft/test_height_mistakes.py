"""Heights that are the same for all aircraft, missing, or off by one value."""

import polars as pl
import pytest

from support.inputs.mistaken import RADARS, recording, with_reports

NAME, OTHERS = "1-10", ("2-10", "3-10")
HEIGHT = pl.col("height_m")
NOTHING = pl.lit(None, pl.Float64)


def placeholder(height_m: float) -> pl.Expr:
    return pl.lit(height_m)


@pytest.mark.parametrize("height_m", [500.0, 7000.0, 10_000.0])
def test_one_height_of_a_radar_is_a_placeholder(height_m: float) -> None:
    (found,) = recording().changed(NAME, height_m=placeholder(height_m)).diagnosed()
    assert (found.sensor_id, found.code, found.severity) == (NAME, "column_constant", "error")
    assert f"its height_m is probably a placeholder: the value is {height_m:g} " in found.sentence


def test_one_height_of_all_sensors_contradicts_their_ranges() -> None:
    one = with_reports(recording(positions=True))
    found = one.changed(*RADARS, "adsb", height_m=placeholder(5000.0)).diagnosed()
    assert {(one.sensor_id, one.code) for one in found} == {
        (name, "column_constant") for name in (*RADARS, "adsb")
    }


@pytest.mark.parametrize(("names", "severity"), [((NAME,), "warning"), ((NAME, "adsb"), "error")])
def test_one_height_of_a_radar_without_others_may_be_a_placeholder(
    names: tuple[str, ...], severity: str
) -> None:
    one = with_reports(recording(positions=True)).only(*names)
    found = one.changed(*names, height_m=placeholder(6000.0)).diagnosed()
    # Alone, its aircraft may all fly at one level.
    assert {(it.sensor_id, it.code, it.severity) for it in found} == {
        (name, "column_constant", severity) for name in names
    }


def test_one_flight_level_of_a_radar_alone_is_no_placeholder() -> None:
    assert recording().only(NAME).changed(NAME, height_m=placeholder(10_668.0)).codes() == []


def test_one_height_of_traffic_on_the_ground_is_no_placeholder() -> None:
    one = with_reports(recording(positions=True)).only("adsb")
    where = {name: pl.col(name) / 50.0 for name in ("latitude_deg", "longitude_deg")}
    level = one.changed("adsb", height_m=placeholder(22.86))
    assert level.codes() == [("adsb", "column_constant")]
    assert level.changed("adsb", **where).codes() == []


def test_heights_of_reports_that_are_0_or_missing_are_named() -> None:
    one = with_reports(recording(positions=True))
    (zero,) = one.changed("adsb", height_m=placeholder(0.0)).diagnosed()
    assert (zero.sensor_id, zero.code) == ("adsb", "column_constant")
    (missing,) = one.changed("adsb", height_m=NOTHING).diagnosed()
    assert (missing.sensor_id, missing.code) == ("adsb", "heights_missing")
    assert "although 1-10, 2-10, 3-10 report heights for the same aircraft" in missing.sentence


def test_radars_without_heights_beside_reports_are_no_mistake() -> None:
    assert with_reports(recording(positions=True)).changed(*RADARS, height_m=NOTHING).codes() == []


@pytest.mark.parametrize("off_m", [300.0, -400.0, 1000.0])
def test_the_sensor_whose_heights_are_off_is_named(off_m: float) -> None:
    one = with_reports(recording(positions=True))
    assert one.changed(NAME, height_m=HEIGHT + off_m).codes() == [(NAME, "height_offset")]
    two = one.only(NAME, "2-10", "adsb")
    assert two.changed(NAME, height_m=HEIGHT + off_m).codes() == [(NAME, "height_offset")]
    (found,) = one.changed(*RADARS, height_m=HEIGHT + off_m).diagnosed()
    assert (found.sensor_id, found.code) == ("adsb", "height_offset")
    assert "or those of the radars have the opposite offset" in found.sentence
    sense = "below" if off_m > 0.0 else "above"
    assert f" m {sense} the heights that all radars (1-10, 2-10, 3-10) report" in found.sentence


def test_two_sensors_do_not_show_whose_heights_are_off() -> None:
    one = recording().only(NAME, "2-10").changed("2-10", height_m=HEIGHT + 500.0)
    (found,) = one.diagnosed()
    assert found.code == "height_offset"
    assert "have the opposite offset" in found.sentence


@pytest.mark.parametrize("off_m", [100.0, -120.0])
def test_pressure_and_geometric_heights_are_no_mistake(off_m: float) -> None:
    one = with_reports(recording(positions=True))
    assert one.changed("adsb", height_m=HEIGHT + off_m).codes() == []


def test_heights_that_others_do_not_report_are_not_compared() -> None:
    """Regression: light aircraft at 0.3 of the height that is assumed for those without one."""
    one = recording().changed(*RADARS, height_m=pl.lit(2100.0) + 3.0 * pl.col("track_number"))
    assert one.changed(*OTHERS, height_m=NOTHING).codes() == []
