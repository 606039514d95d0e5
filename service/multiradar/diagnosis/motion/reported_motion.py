"""Motion that aircraft report, against their positions and heights."""

from typing import NamedTuple

import numpy as np
import polars as pl

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.motion.vertical_rates import pairs_apart
from multiradar.diagnosis.plots import Floats, Integers, Plots, plots_of, reported
from multiradar_schemas.measurements.units import FOOT_M, KNOT_MPS

#: Time between the two reports that are compared, s, and change of height, m, and speeds, m/s, that
#: are large enough.
APART_MIN_S, APART_MAX_S = 8.0, 30.0
CHANGE_MIN_M, SPEED_MIN_MPS, RATE_MIN_MPS = 20.0, 20.0, 0.01
#: Deviation of the median ratio from that of a unit, and of half of the ratios from the median: in
#: turns the distance between two positions is shorter than the path.
WITHIN, SPREAD_MAX = 0.03, 0.25
_KILOMETRE_PER_HOUR_MPS = 1.0 / 3.6
_FOOT_PER_MIN_MPS = FOOT_M / 60.0
#: Speed by positions over reported speed, by unit and the unit of the column.
_SPEED_UNITS = {
    ("m/s", "knots"): 1.0 / KNOT_MPS,
    ("knots", "m/s"): KNOT_MPS,
    ("km/h", "m/s"): _KILOMETRE_PER_HOUR_MPS,
    ("km/h", "knots"): _KILOMETRE_PER_HOUR_MPS / KNOT_MPS,
}
_SIGNS = {"latitude": "northern latitudes", "longitude": "eastern longitudes"}
#: Rate of the heights over reported vertical rate, by the column at fault, its unit and the other.
_RATE_UNITS = {
    ("heights", "metres", "feet"): FOOT_M,
    ("heights", "feet", "metres"): 1.0 / FOOT_M,
    ("vertical rates", "m/s", "ft/min"): 1.0 / _FOOT_PER_MIN_MPS,
    ("vertical rates", "ft/min", "m/s"): _FOOT_PER_MIN_MPS,
    ("heights and vertical rates", "metres and m/s", "feet and ft/min"): 60.0,
    ("heights and vertical rates", "feet and ft/min", "metres and m/s"): 1.0 / 60.0,
}
#: Columns that are used, beside those of `plots_of`.
COLUMNS = ("ground_speed_m_s", "vertical_rate_m_s", "track_angle_deg")
#: Difference between course and reported track angle that still agrees, and change of the track
#: angle between the two reports, degrees.
_COURSE_WITHIN_DEG, _TURNED_MAX_DEG = 30.0, 20.0
#: Share of agreeing courses of right columns, and of the most of wrong ones; courses along one line
#: may agree with both.
_AGREE_MIN, _AGREE_MAX = 0.9, 0.7


class Legs(NamedTuple):
    """Pairs of reports of one aircraft, and the motion reported in them.

    Attributes
    ----------
    plots : Plots
        All reports.
    first, last : (n,) int64
        The reports of each pair.
    flown_mps : (n,) float64
        Speed from one position to the other.
    speed_mps, rate_mps, track_deg : (r,) float64, optional
        What each report states, NaN where it does not; None without the column.
    """

    plots: Plots
    first: Integers
    last: Integers
    flown_mps: Floats
    speed_mps: Floats | None
    rate_mps: Floats | None
    track_deg: Floats | None


def legs_of(frame: pl.DataFrame) -> Legs:
    """Return the pairs of reports of a sensor; none if no column of `COLUMNS` is there."""
    plots = plots_of(frame)
    speed_mps, rate_mps, track_deg = (_column(frame, one) for one in COLUMNS)
    aircraft = plots.keys[:, :2].max(axis=1)
    moves = not (speed_mps is None and rate_mps is None and track_deg is None)
    named = np.flatnonzero((aircraft >= 0) & moves)
    first, last = pairs_apart(plots.time_s[named], aircraft[named], APART_MIN_S, APART_MAX_S)
    first, last = named[first], named[last]
    where = reported(plots)
    flown_m = np.linalg.norm(where[last] - where[first], axis=1)
    flown_mps = flown_m / (plots.time_s[last] - plots.time_s[first])
    return Legs(plots, first, last, flown_mps, speed_mps, rate_mps, track_deg)


def check_reported_motion(name: str, legs: Legs) -> list[Diagnosis]:
    """Diagnose reported speeds, vertical rates or heights in another unit.

    Parameters
    ----------
    name : str
        The sensor.
    legs : Legs
        Its reports.
    """
    plots, first, last, flown_mps, speed_mps, rate_mps, _ = legs
    apart_s = plots.time_s[last] - plots.time_s[first]
    climbed_m = plots.height_m[last] - plots.height_m[first]
    found = []
    if speed_mps is not None:
        mean_mps = 0.5 * (speed_mps[first] + speed_mps[last])
        moving = (flown_mps >= SPEED_MIN_MPS) & (mean_mps >= SPEED_MIN_MPS)
        found += _of_speeds(name, flown_mps[moving] / mean_mps[moving])
    if rate_mps is not None:
        mean_mps = 0.5 * (rate_mps[first] + rate_mps[last])
        climbing = (np.abs(climbed_m) >= CHANGE_MIN_M) & (np.abs(mean_mps) >= RATE_MIN_MPS)
        # A climb that starts or ends between the two is not at one rate.
        climbing &= np.abs(rate_mps[last] - rate_mps[first]) <= 0.2 * np.abs(mean_mps)
        found += _of_rates(name, climbed_m[climbing] / apart_s[climbing] / mean_mps[climbing])
    return found


def check_courses(name: str, legs: Legs) -> list[Diagnosis]:
    """Diagnose positions swapped or of the wrong sign by the track angles that aircraft report.

    Either mistake mirrors the courses, so it shows without any other sensor. Track angles that
    agree with no such courses are a warning.

    Parameters
    ----------
    name : str
        The sensor.
    legs : Legs
        Its reports.
    """
    shares = _agreement(legs)
    given = shares.pop("", 1.0)
    if given > _AGREE_MAX:
        return []
    what = max(shares, key=shares.__getitem__)
    agree = f"{given:.0%} of the courses of its aircraft agree with the track angles they report"
    if shares[what] < _AGREE_MIN:
        return [
            Diagnosis(
                name,
                "track_angles",
                f"{name}: its track angles are probably wrong: {agree}; correct or remove the "
                "column",
                "warning",
            )
        ]
    if what == "swapped":
        code, cause = "columns_exchanged", "latitude and longitude are probably swapped"
        remedy, then = "swap the columns", "if they are swapped"
    else:
        code, cause = "position_sign", f"its {what}s probably have the wrong sign"
        remedy, then = f"write {_SIGNS[what]} as positive numbers", "with the other sign"
    return [
        Diagnosis(name, code, f"{name}: {cause}: {agree}, and {shares[what]:.0%} {then}; {remedy}")
    ]


# Share of courses that agree with the reported track angles: as given, and after each correction;
# empty if there are too few.
def _agreement(legs: Legs) -> dict[str, float]:
    plots, first, last, flown_mps, *_, track_deg = legs
    if track_deg is None:
        return {}
    turned_deg = _difference(track_deg[last], track_deg[first])
    straight = (flown_mps >= SPEED_MIN_MPS) & (np.abs(turned_deg) <= _TURNED_MAX_DEG)
    first, last = first[straight], last[straight]
    if len(first) < TESTED_MIN:
        return {}
    middle_deg = track_deg[first] + 0.5 * turned_deg[straight]
    latitude, longitude = plots.latitude_deg, plots.longitude_deg
    return {
        what: float(np.mean(np.abs(_difference(course, middle_deg)) <= _COURSE_WITHIN_DEG))
        for what, course in {
            "": _courses(latitude, longitude, first, last),
            "swapped": _courses(longitude, latitude, first, last),
            "latitude": _courses(-latitude, longitude, first, last),
            "longitude": _courses(latitude, -longitude, first, last),
        }.items()
    }


def _column(frame: pl.DataFrame, column: str) -> Floats | None:
    if column not in frame.columns:
        return None
    return frame[column].cast(pl.Float64).fill_null(np.nan).to_numpy()


# Courses between two reports, degrees clockwise from north.
def _courses(latitude: Floats, longitude: Floats, first: Integers, last: Integers) -> Floats:
    middle = np.radians(0.5 * (latitude[first] + latitude[last]))
    east = _difference(longitude[last], longitude[first]) * np.cos(middle)
    return np.degrees(np.arctan2(east, latitude[last] - latitude[first]))


def _difference(angle_deg: Floats, other_deg: Floats) -> Floats:
    return (angle_deg - other_deg + 180.0) % 360.0 - 180.0


def _of_speeds(name: str, ratios: Floats) -> list[Diagnosis]:
    ratio = _typical(ratios)
    return [
        Diagnosis(
            name,
            "speed_unit",
            f"{name}: its ground speeds are probably in {unit} in a column of {column}: the "
            f"positions of its aircraft change {ratio:.3g} times as fast as reported; rename the "
            f"column, or convert it to {column}",
        )
        for (unit, column), expected in _SPEED_UNITS.items()
        if abs(ratio / expected - 1.0) <= WITHIN
    ][:1]


def _of_rates(name: str, ratios: Floats) -> list[Diagnosis]:
    ratio = _typical(ratios)
    return [
        Diagnosis(
            name,
            "height_unit" if what == "heights" else "vertical_rate_unit",
            f"{name}: its {what} are probably in {unit} in columns of {column}: the heights of its "
            f"aircraft change {ratio:.3g} times as fast as the vertical rates they report; rename "
            f"the columns, or convert them to {column}",
        )
        for (what, unit, column), expected in _RATE_UNITS.items()
        if abs(ratio / expected - 1.0) <= 2.0 * WITHIN
    ][:1]


# The median of ratios that agree; NaN otherwise.
def _typical(ratios: Floats) -> float:
    ratios = ratios[np.isfinite(ratios)]
    if len(ratios) < TESTED_MIN:
        return np.nan
    low, middle, high = np.quantile(ratios, (0.25, 0.5, 0.75))
    return float(middle) if high - low <= 2.0 * SPREAD_MAX * abs(middle) else np.nan
