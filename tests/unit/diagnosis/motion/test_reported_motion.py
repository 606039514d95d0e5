"""Speeds and vertical rates that aircraft report, against their positions and heights."""

from dataclasses import replace

import numpy as np
import polars as pl
import pytest
from numpy.typing import ArrayLike

from multiradar.diagnosis.motion.reported_motion import (
    Legs,
    check_courses,
    check_reported_motion,
    legs_of,
)
from multiradar.diagnosis.plots import Plots

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


def test_the_track_number_0_is_one_of_an_aircraft() -> None:
    one = reports().filter(mode_s_address="4b1800")
    numbered = one.with_columns(mode_s_address=pl.lit(None, pl.String), track_number=0)
    assert len(legs_of(numbered).first) == len(legs_of(one).first) > 0


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


def legs(
    count: int = 20,
    *,
    flown_mps: ArrayLike = 150.0,
    speed_mps: ArrayLike | None = None,
    climbed_m: ArrayLike = 0.0,
    rate_mps: tuple[float, float] | None = None,
    track_deg: tuple[ArrayLike, float] | None = None,
    course_deg: ArrayLike = 0.0,
) -> Legs:
    """Return pairs of reports, 10 s apart, of which the first reports come first."""
    first, last = np.arange(count), count + np.arange(count)
    none = np.full(2 * count, np.nan)
    course = np.radians(np.broadcast_to(course_deg, count))
    height_m = np.concatenate([np.zeros(count), np.broadcast_to(climbed_m, count)])
    # Near the equator, a degree has the same length in both directions.
    latitude_deg = np.concatenate([np.full(count, 0.5), 0.5 + 0.01 * np.cos(course)])
    longitude_deg = np.concatenate([np.full(count, 9.0), 9.0 + 0.01 * np.sin(course)])
    time_s = np.repeat([0.0, 10.0], count)
    keys = np.full((2 * count, 3), -1, np.int64)
    plots = Plots(time_s, none, none, latitude_deg, longitude_deg, height_m, keys)

    def of_both(values: tuple[ArrayLike, ArrayLike] | None) -> np.ndarray | None:
        if values is None:
            return None
        return np.concatenate([np.broadcast_to(one, count) for one in values]).astype(np.float64)

    return Legs(
        plots, first, last, np.array(np.broadcast_to(flown_mps, count), np.float64),
        of_both(None if speed_mps is None else (speed_mps, speed_mps)), of_both(rate_mps),
        of_both(None if track_deg is None else (track_deg[0], track_deg[1])),
    )  # fmt: skip


# Knots in a column of m/s: the positions change 0.514 times as fast.
@pytest.mark.parametrize(
    ("made", "known"),
    [
        (legs(speed_mps=150.0 / KNOT / 1.029), True),
        (legs(speed_mps=150.0 / KNOT / 1.029, count=19), False),
        (legs(speed_mps=150.0 / KNOT / 0.971), True),
        (legs(speed_mps=150.0 * KNOT / 1.029), True),
        (legs(speed_mps=150.0 * KNOT / 1.031), False),
        (legs(speed_mps=150.0 * KNOT / 0.971), True),
        (legs(speed_mps=150.0 * KNOT / 0.969), False),
        # Both speeds from 20 m/s on.
        (legs(flown_mps=20.0, speed_mps=20.0 / KNOT), True),
        (legs(flown_mps=19.9, speed_mps=19.9 / KNOT), False),
        (legs(flown_mps=20.0 / KNOT, speed_mps=20.0), True),
        (legs(flown_mps=19.9 / KNOT, speed_mps=19.9), False),
        # The quartiles are apart by half of the median.
        (legs(flown_mps=[150.0, 112.6, 150.0, 187.4] * 5, speed_mps=150.0 / KNOT), True),
        (legs(40, flown_mps=[112.6, 150.0, 187.4, 150.0] * 10, speed_mps=150.0 / KNOT), True),
        (legs(40, flown_mps=([111.0] * 3 + [150.0] * 2 + [189.0] * 3) * 5,
              speed_mps=150.0 / KNOT), False),
        (legs(40, flown_mps=([113.0] * 3 + [150.0] * 2 + [187.0] * 3) * 5,
              speed_mps=150.0 / KNOT), True),
    ],
)  # fmt: skip
def test_speeds_show_a_unit_from_their_bounds_on(made: Legs, *, known: bool) -> None:
    assert bool(check_reported_motion("adsb", made)) is known


# Heights in feet in a column of metres: they change 3.28 times as fast as reported.
@pytest.mark.parametrize(
    ("climbed_m", "rate_mps", "known"),
    [
        (80.0, (8.0 * FOOT_M / 1.059,) * 2, True),
        (80.0, (8.0 * FOOT_M / 1.061,) * 2, False),
        (80.0, (8.0 * FOOT_M / 0.941,) * 2, True),
        (80.0, (8.0 * FOOT_M / 0.939,) * 2, False),
        (20.0, (2.0 * FOOT_M,) * 2, True),
        (19.9, (1.99 * FOOT_M,) * 2, False),
        (-80.0, (-8.0 * FOOT_M,) * 2, True),
        # The rates are apart by a fifth of their mean.
        (80.0, (8.0 * FOOT_M * 0.901, 8.0 * FOOT_M * 1.099), True),
        (80.0, (8.0 * FOOT_M * 0.899, 8.0 * FOOT_M * 1.101), False),
    ],
)
def test_rates_show_a_unit_from_their_bounds_on(
    climbed_m: float, rate_mps: tuple[float, float], *, known: bool
) -> None:
    found = check_reported_motion("adsb", legs(climbed_m=climbed_m, rate_mps=rate_mps))
    assert bool(found) is known


# Rates of 0.01 m/s and less are rounding errors.
@pytest.mark.parametrize(("rate_mps", "known"), [(0.0101, True), (0.0099, False)])
def test_rates_of_nothing_show_no_unit(rate_mps: float, *, known: bool) -> None:
    made = legs(climbed_m=20.0 * rate_mps * 60.0 / FOOT_M, rate_mps=(rate_mps, rate_mps))
    made = made._replace(plots=replace(made.plots, time_s=2.0 * made.plots.time_s))
    assert bool(check_reported_motion("adsb", made)) is known


def _codes(made: Legs) -> list[str]:
    return [one.code for one in check_courses("adsb", made)]


# Northward courses that are reported as southward are those of the wrong sign; a fraction agrees.
@pytest.mark.parametrize(
    ("agreeing", "codes"),
    [(0, ["position_sign"]), (2, ["position_sign"]), (3, ["track_angles"]),
     (14, ["track_angles"]), (15, [])],
)  # fmt: skip
def test_courses_agree_from_their_bounds_on(agreeing: int, codes: list[str]) -> None:
    track_deg = np.where(np.arange(20) < agreeing, 10.0, 170.0)
    # Two reports of one course, of which the second is along it.
    made = legs(course_deg=10.0)._replace(track_deg=np.tile(track_deg, 2))
    assert _codes(made) == codes
    few = legs(19, course_deg=10.0)._replace(track_deg=np.tile(track_deg[1:], 2))
    assert _codes(few) == []


@pytest.mark.parametrize(("course_deg", "off_deg", "codes"), [
    (10.0, 29.9, []), (10.0, 30.1, ["track_angles"]),
    (80.0, -29.9, []), (80.0, -30.1, ["track_angles"]),
])  # fmt: skip
def test_a_course_agrees_within_30_degrees(
    course_deg: float, off_deg: float, codes: list[str]
) -> None:
    """The mirrored courses differ by more, too."""
    made = legs(course_deg=course_deg)._replace(track_deg=np.full(40, course_deg + off_deg))
    assert _codes(made) == codes


@pytest.mark.parametrize(("turned_deg", "codes"), [
    (19.9, ["track_angles"]), (20.1, []), (-19.9, ["track_angles"]), (-20.1, []),
])  # fmt: skip
def test_courses_are_compared_where_aircraft_do_not_turn(
    turned_deg: float, codes: list[str]
) -> None:
    """Their middle counts: the course is 100° away from it."""
    made = legs(course_deg=20.0, track_deg=(120.0 - turned_deg / 2.0, 120.0 + turned_deg / 2.0))
    assert _codes(made) == codes
    assert _codes(made._replace(flown_mps=np.full(20, 20.0))) == codes
    assert _codes(made._replace(flown_mps=np.full(20, 19.9))) == []
