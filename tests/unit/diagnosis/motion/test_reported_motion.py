"""Speeds and vertical rates that aircraft report, against their positions and heights."""

import numpy as np
import polars as pl
import pytest

from multiradar.diagnosis.motion.reported_motion import (
    check_courses,
    check_reported_motion,
    legs_of,
)

KNOT, FOOT_M = 1852.0 / 3600.0, 0.3048
SPEED_MPS, RATE_MPS = 150.0, 8.0
METRES_PER_DEGREE = 111_195.0


def reports(speed: float = 1.0, rate: float = 1.0, height: float = 1.0) -> pl.DataFrame:
    """Return reports of five climbing aircraft, with values times factors."""
    time_s = np.arange(0.0, 300.0, 5.0)
    return pl.concat(
        pl.DataFrame(
            {
                "time_s": time_s,
                "latitude_deg": 46.0 + SPEED_MPS * time_s / METRES_PER_DEGREE,
                "longitude_deg": np.full(len(time_s), 7.0),
                "height_m": (3000.0 + 100.0 * number + RATE_MPS * time_s) * height,
                "mode_s_address": [f"4b180{number}"] * len(time_s),
                "ground_speed_m_s": np.full(len(time_s), SPEED_MPS * speed),
                "vertical_rate_m_s": np.full(len(time_s), RATE_MPS * rate),
                "range_m": pl.repeat(None, len(time_s), dtype=pl.Float64, eager=True),
                "azimuth_deg": pl.repeat(None, len(time_s), dtype=pl.Float64, eager=True),
                "track_number": pl.repeat(None, len(time_s), dtype=pl.Int64, eager=True),
                "mode_3a": pl.repeat(None, len(time_s), dtype=pl.String, eager=True),
            }
        )
        for number in range(5)
    )


def test_right_units_are_right() -> None:
    assert check_reported_motion("adsb", legs_of(reports(0.99, 1.02))) == []


@pytest.mark.parametrize(
    ("factor", "words"),
    [
        (KNOT, "ground speeds are probably in m/s in a column of knots"),
        (1 / KNOT, "ground speeds are probably in knots in a column of m/s"),
        (3.6, "ground speeds are probably in km/h in a column of m/s"),
        (3.6 * KNOT, "ground speeds are probably in km/h in a column of knots"),
    ],
)
def test_units_of_speeds_are_named(factor: float, words: str) -> None:
    (found,) = check_reported_motion("adsb", legs_of(reports(speed=factor)))
    assert words in found.sentence
    assert found.severity == "error"


@pytest.mark.parametrize(
    ("rate", "height", "words"),
    [
        (1.0, FOOT_M, "its heights are probably in metres in columns of feet"),
        (1.0, 1 / FOOT_M, "its heights are probably in feet in columns of metres"),
        (FOOT_M / 60, 1.0, "its vertical rates are probably in m/s in columns of ft/min"),
        (60 / FOOT_M, 1.0, "its vertical rates are probably in ft/min in columns of m/s"),
        (FOOT_M / 60, FOOT_M, "its heights and vertical rates are probably in metres and m/s"),
        (60 / FOOT_M, 1 / FOOT_M, "its heights and vertical rates are probably in feet and ft/min"),
    ],
)
def test_units_of_heights_and_rates_are_named(rate: float, height: float, words: str) -> None:
    (found,) = check_reported_motion("adsb", legs_of(reports(rate=rate, height=height)))
    assert words in found.sentence


def test_missing_columns_show_nothing() -> None:
    frame = reports(KNOT, 60 / FOOT_M)
    without = frame.drop("ground_speed_m_s", "vertical_rate_m_s")
    assert check_reported_motion("adsb", legs_of(without)) == []
    (found,) = check_reported_motion("adsb", legs_of(frame.drop("vertical_rate_m_s")))
    assert "ground speeds" in found.sentence
    nameless = frame.with_columns(mode_s_address=pl.lit(None, pl.String))
    assert check_reported_motion("adsb", legs_of(nameless)) == []


def test_speeds_that_follow_no_unit_show_nothing() -> None:
    rng = np.random.default_rng(1)
    frame = reports()
    mixed = frame["ground_speed_m_s"].to_numpy() * rng.choice([0.3, 1.0, 2.5], frame.height)
    assert check_reported_motion("adsb", legs_of(frame.with_columns(ground_speed_m_s=mixed))) == []


def flown(*courses_deg: float, reported_deg: float = 0.0) -> pl.DataFrame:
    """Return reports of an aircraft on each course, with track angles so far from it."""
    parts = []
    for number, course_deg in enumerate(courses_deg):
        frame = reports().filter(pl.col("mode_s_address") == f"4b180{number % 5}")
        distance = SPEED_MPS * frame["time_s"] / METRES_PER_DEGREE
        course = np.radians(course_deg)
        parts.append(
            frame.with_columns(
                latitude_deg=46.0 + distance * np.cos(course),
                longitude_deg=7.0 + distance * np.sin(course) / np.cos(np.radians(46.0)),
                track_angle_deg=pl.lit((course_deg + reported_deg) % 360.0),
                mode_s_address=pl.lit(f"4b18{number:02}"),
            )
        )
    return pl.concat(parts)


COURSES_DEG = (5.0, 75.0, 160.0, 250.0, 310.0, 359.0)


@pytest.mark.parametrize("off_deg", [0.0, -20.0, 20.0])
def test_track_angles_near_the_courses_are_right(off_deg: float) -> None:
    assert check_courses("adsb", legs_of(flown(*COURSES_DEG, reported_deg=off_deg))) == []


@pytest.mark.parametrize(
    ("changes", "code", "words"),
    [
        ({"latitude_deg": "longitude_deg", "longitude_deg": "latitude_deg"}, "columns_exchanged",
         "latitude and longitude are probably swapped"),
        ({"latitude_deg": "-latitude_deg"}, "position_sign",
         "latitudes probably have the wrong sign"),
        ({"longitude_deg": "-longitude_deg"}, "position_sign",
         "longitudes probably have the wrong sign"),
    ],
)  # fmt: skip
def test_positions_that_contradict_track_angles_are_named(
    changes: dict[str, str], code: str, words: str
) -> None:
    columns = {
        name: -pl.col(of[1:]) if of.startswith("-") else pl.col(of) for name, of in changes.items()
    }
    (found,) = check_courses("adsb", legs_of(flown(*COURSES_DEG).with_columns(**columns)))
    assert (found.code, found.severity) == (code, "error")
    assert words in found.sentence


def test_courses_that_agree_both_ways_say_nothing() -> None:
    frame = flown(45.0, 225.0, 45.0, 225.0)
    swapped = frame.rename({"latitude_deg": "longitude_deg", "longitude_deg": "latitude_deg"})
    assert check_courses("adsb", legs_of(swapped)) == []


def test_track_angles_at_random_are_not_blamed_on_positions() -> None:
    frame = flown(*COURSES_DEG)
    angles = pl.Series((np.arange(len(frame)) // 12 * 97.0) % 360.0)
    (found,) = check_courses("adsb", legs_of(frame.with_columns(track_angle_deg=angles)))
    assert (found.code, found.severity) == ("track_angles", "warning")
    assert "its track angles are probably wrong" in found.sentence
