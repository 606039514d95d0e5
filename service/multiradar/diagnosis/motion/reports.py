"""Checks of reported positions without any other sensor: units, missing values, times."""

from dataclasses import replace

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.cross_sensor.plausibility import (
    CEILING_M,
    HIGH_MAX,
    SPEED_MAX_MPS,
    SPEED_MIN_MPS,
)
from multiradar.diagnosis.losses import LOST_MAX, SAME_MIN
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.motion.height_steps import HIGHEST_M, are_in
from multiradar.diagnosis.motion.vertical_rates import check_vertical_rates, pairs_apart
from multiradar.diagnosis.plots import Booleans, Floats, Integers, Plots, reported
from multiradar_schemas.measurements.units import FOOT_M

#: Time between two reports of an aircraft from which a speed is computed, s; times often have a
#: resolution of 1 s.
_APART_MAX_S, _STEP_S = 60.0, 1.0
#: Speed above which a step is a jump, m/s (Mach 2).
_JUMP_MPS = 600.0
#: Aircraft above this fly faster than `SPEED_MIN_MPS`, m. All of them at a median speed above the
#: second, m/s, are not all below the third, m; and at one above the last, not below the ceiling in
#: feet that were metres.
_HIGH_M, _FAST_MPS, _LOW_M, _CRUISE_MPS = 3000.0, 130.0, 610.0, 190.0
#: Minutes as a fraction of a degree end here; steps over a whole degree that show it.
_MINUTES_END, _MINUTES_STEPS = 0.6, 3
#: Aircraft that are not all at one latitude or longitude.
_CONSTANT_AIRCRAFT_MIN = 3
#: Fewer low aircraft may all be fast.
_LOW_AIRCRAFT_MIN = 5
#: Jets cruise above this, m, at about one speed in all directions, with wind: the 16th and 84th
#: percentile of its logarithm are 0.1 to 0.25 apart. Latitudes for longitudes stretch a direction.
_CRUISE_M, _CRUISING_MIN, _SPREAD_MIN, _SPREAD_RATIO = 7500.0, 10, 0.2, 2.0
#: Least half logarithm of the ratio of speeds on two courses, in itself, in standard deviations and
#: over that with the columns swapped; time between two positions, s; variance of the cosine of
#: twice the course of an aircraft that turns, and number of such aircraft.
_STRETCH_MIN, _STRETCH_SIGMAS, _STRETCH_RATIO = 0.08, 5.0, 3.0
_LEG_S, _TURNING_MIN, _TURNING_AIRCRAFT_MIN = 15.0, 0.1, 5
#: Fraction of positions of 0°, 0° that is reported, and above which the tracks suffer.
_NOWHERE_MIN, _NOWHERE_MAX = 0.02, 0.1
_TIME_UNITS = {"minutes": 60.0, "hours": 3600.0, "days": 86_400.0}


def check_nowhere(name: str, plots: Plots) -> Diagnosis | None:
    """Diagnose reported positions of 0°, 0°: no aircraft stays there.

    Parameters
    ----------
    name : str
        The sensor.
    plots : Plots
        Its reports.
    """
    nowhere = (plots.latitude_deg == 0.0) & (plots.longitude_deg == 0.0)
    share = float(np.mean(nowhere)) if plots.size else 0.0
    least = _NOWHERE_MIN if np.count_nonzero(nowhere) >= TESTED_MIN else LOST_MAX
    if share <= least:
        return None
    return Diagnosis(
        name,
        "position_missing",
        f"{name}: {share:.0%} of its positions are 0°, 0°, which probably stands for an unknown "
        "position; remove these rows",
        "error" if share > _NOWHERE_MAX else "warning",
    )


def check_reports(name: str, plots: Plots) -> Diagnosis | None:
    """Diagnose positions, heights or times of reports in another unit, and missing positions.

    Parameters
    ----------
    name : str
        The sensor.
    plots : Plots
        Its reports.
    """
    if plots.size < TESTED_MIN:
        return None
    if (nowhere := check_nowhere(name, plots)) is not None:
        return nowhere
    constant = _of_constant(name, plots)
    if constant is not None:
        return constant
    if np.ptp(plots.time_s) == 0.0 and len(np.unique(plots.latitude_deg)) >= TESTED_MIN:
        return Diagnosis(
            name,
            "column_constant",
            f"{name}: all its times are {plots.time_s[0]:.10g} s, which is probably not the time "
            "of the reports; write the time of each report",
        )
    first, last = _steps(plots)
    if len(first) < TESTED_MIN:
        return None
    where = reported(plots)
    flown_m = np.linalg.norm(where[last] - where[first], axis=1)
    apart_s = plots.time_s[last] - plots.time_s[first]
    return (
        _of_minutes(name, plots, first, last, flown_m / np.maximum(apart_s, _STEP_S) > _JUMP_MPS)
        or _of_times(name, flown_m, apart_s)
        or _of_radians(name, plots, plots.height_m[first], flown_m / apart_s)
        or _of_heights(name, plots, flown_m / apart_s)
        or _of_exchanged(name, plots, first, last)
        or _of_courses(name, plots)
    )


def check_minutes(name: str, plots: Plots) -> Diagnosis | None:
    """Diagnose positions in degrees and minutes, written as one number.

    Parameters
    ----------
    name : str
        The sensor.
    plots : Plots
        Its reports.
    """
    first, last = _steps(plots)
    where = reported(plots)
    flown_m = np.linalg.norm(where[last] - where[first], axis=1)
    apart_s = np.maximum(plots.time_s[last] - plots.time_s[first], _STEP_S)
    return _of_minutes(name, plots, first, last, flown_m / apart_s > _JUMP_MPS)


# One latitude or longitude of several aircraft.
def _of_constant(name: str, plots: Plots) -> Diagnosis | None:
    names = _names(plots)
    for column in ("latitude_deg", "longitude_deg"):
        values: Floats = getattr(plots, column)
        known, counts = np.unique(values[np.isfinite(values)], return_counts=True)
        if not len(known) or counts.max() < max(SAME_MIN * counts.sum(), TESTED_MIN):
            continue
        value = known[counts.argmax()]
        if len(np.unique(names[(values == value) & (names >= 0)])) >= _CONSTANT_AIRCRAFT_MIN:
            return Diagnosis(
                name,
                "column_constant",
                f"{name}: its {column} is probably a placeholder: the value is {value:.10g} in "
                f"{counts.max() / counts.sum():.0%} of its positions, of several aircraft; fill "
                "the column with the reported values",
            )
    return None


# Successive reports of one aircraft.
def _steps(plots: Plots) -> tuple[Integers, Integers]:
    names = _names(plots)
    order = np.lexsort((plots.time_s, names))
    first, last = order[:-1], order[1:]
    apart_s = plots.time_s[last] - plots.time_s[first]
    good = (names[first] == names[last]) & (names[first] >= 0)
    good &= (apart_s > 0.0) & (apart_s <= _APART_MAX_S)
    good &= np.isfinite(plots.latitude_deg[first]) & np.isfinite(plots.latitude_deg[last])
    return first[good], last[good]


def _of_minutes(
    name: str, plots: Plots, first: Integers, last: Integers, jumps: Booleans
) -> Diagnosis | None:
    steps, largest = 0, 0.0
    for degrees in (plots.latitude_deg, plots.longitude_deg):
        minutes = np.abs(degrees) % 1.0
        low = np.minimum(minutes[first], minutes[last])
        high = np.maximum(minutes[first], minutes[last])
        over = jumps & (low < 0.1) & (high > _MINUTES_END - 0.1)
        steps += int(np.count_nonzero(over))
        largest = max(largest, float(np.nanmax(minutes, initial=0.0)))
    # Rounding may give 0.6.
    if steps < _MINUTES_STEPS or 2 * steps < np.count_nonzero(jumps) or largest > _MINUTES_END:
        return None
    return Diagnosis(
        name,
        "position_minutes",
        f"{name}: its positions are probably in degrees and minutes (46.30 for 46° 30'): no "
        f"decimal part exceeds {_MINUTES_END:g}, and {steps} steps jump across that gap; convert "
        "them to decimal degrees",
    )


def _of_times(name: str, flown_m: Floats, apart_s: Floats) -> Diagnosis | None:
    jumping = float(np.mean(flown_m / np.maximum(apart_s, _STEP_S) > _JUMP_MPS))
    speed = float(np.median(flown_m / apart_s))
    if speed <= SPEED_MAX_MPS:
        return None
    for unit, seconds in _TIME_UNITS.items():
        if SPEED_MIN_MPS <= speed / seconds <= SPEED_MAX_MPS:
            return Diagnosis(
                name,
                "time_unit",
                f"{name}: its times are probably in {unit}: the median speed of aircraft is "
                f"{speed:.3g} m/s, and {speed / seconds:.0f} m/s after conversion; convert them to "
                "seconds",
            )
    if jumping < SAME_MIN:
        return None
    return Diagnosis(
        name,
        "speeds_impossible",
        f"{name}: {jumping:.0%} of its positions are farther from the previous position of the "
        "same address than any aircraft can fly: its times or addresses are probably wrong; check "
        "that each address belongs to one aircraft, and check the unit of the times",
    )


def _of_radians(
    name: str, plots: Plots, height_m: Floats, speed_mps: Floats
) -> Diagnosis | None:  # fmt: skip
    high = height_m > _HIGH_M
    # Balloons, and aircraft that taxi at La Paz, are slow there, too.
    known = np.isfinite(plots.latitude_deg + plots.longitude_deg)
    radians = np.abs(plots.latitude_deg) <= np.pi / 2.0
    radians &= np.abs(plots.longitude_deg) <= np.pi
    if np.count_nonzero(high) < TESTED_MIN or np.mean(radians[known]) < SAME_MIN:
        return None
    speed = float(np.median(speed_mps[high]))
    with_it = float(np.degrees(speed))
    if not (speed < SPEED_MIN_MPS / 2.0 and SPEED_MIN_MPS <= with_it <= SPEED_MAX_MPS):
        return None
    return Diagnosis(
        name,
        "position_unit",
        f"{name}: its positions are probably in radians: the median speed of aircraft above "
        f"{_HIGH_M:.0f} m is {speed:.1f} m/s, and {with_it:.0f} m/s after conversion; convert them "
        "to degrees",
    )


def _of_heights(name: str, plots: Plots, speed_mps: Floats) -> Diagnosis | None:
    known = plots.height_m[np.isfinite(plots.height_m)]
    speed = float(np.median(speed_mps))
    if len(known) < TESTED_MIN:
        return None
    if are_in(known, 1.0):
        # Low and fast, or high: military aircraft.
        return check_vertical_rates(name, plots.time_s, plots.height_m, _names(plots))
    ceiling_m = CEILING_M if are_in(known, FOOT_M) else HIGHEST_M
    high = float(np.mean(known > ceiling_m))
    if high > HIGH_MAX and np.mean(known * FOOT_M > CEILING_M) < HIGH_MAX / 5.0:
        why = f"{high:.0%} of them are above {ceiling_m:.0f} m"
        return _unit_of_heights(name, "feet", why, "convert them to metres")
    why = f"all are below {known.max():.0f} m, but the median speed is {speed:.0f} m/s"
    if known.max() <= _LOW_M and _FAST_MPS < speed <= SPEED_MAX_MPS:
        remedy = "check the unit of the altitude column, which must be feet"
        return _unit_of_heights(name, "hundreds of feet or metres", why, remedy)
    aircraft = len(np.unique(_names(plots)))
    if (
        known.max() <= CEILING_M * FOOT_M
        and _CRUISE_MPS < speed <= SPEED_MAX_MPS
        and aircraft >= _LOW_AIRCRAFT_MIN
    ):
        remedy = (
            "convert them to feet, or rename the column altitude_m (height in [units] of a profile)"
        )
        return _unit_of_heights(name, "metres in a column of feet", why, remedy)
    return check_vertical_rates(name, plots.time_s, plots.height_m, _names(plots))


def _unit_of_heights(name: str, unit: str, why: str, remedy: str) -> Diagnosis:
    return Diagnosis(
        name, "height_unit", f"{name}: its heights are probably in {unit}: {why}; {remedy}"
    )


def _of_exchanged(name: str, plots: Plots, first: Integers, last: Integers) -> Diagnosis | None:
    high = plots.height_m[first] > _CRUISE_M
    first, last = first[high], last[high]
    if len(np.unique(_names(plots)[first])) < _CRUISING_MIN:
        return None
    other = replace(plots, latitude_deg=plots.longitude_deg, longitude_deg=plots.latitude_deg)
    spread, exchanged = _speed_spread(plots, first, last), _speed_spread(other, first, last)
    if spread < max(_SPREAD_MIN, _SPREAD_RATIO * exchanged):
        return None
    return Diagnosis(
        name,
        "columns_exchanged",
        f"{name}: latitude and longitude are probably swapped: the speeds of its aircraft above "
        f"{_CRUISE_M:.0f} m differ by {spread:.0%} between directions, and by {exchanged:.0%} if "
        "they are swapped; swap the columns",
    )


# Speeds that change with the course of each aircraft as those of a stretched map do: a wind changes
# them once in a circle, a stretch twice.
def _of_courses(name: str, plots: Plots) -> Diagnosis | None:
    high = plots.select(plots.height_m > _CRUISE_M)
    other = replace(high, latitude_deg=high.longitude_deg, longitude_deg=high.latitude_deg)
    found, exchanged = _stretch(high), _stretch(other)
    if found is None or exchanged is None:
        return None
    (stretch, sigma), (then, _) = found, exchanged
    if abs(stretch) < max(_STRETCH_MIN, _STRETCH_SIGMAS * sigma, _STRETCH_RATIO * abs(then)):
        return None
    return Diagnosis(
        name,
        "columns_exchanged",
        f"{name}: latitude and longitude are probably swapped: the speeds of its aircraft above "
        f"{_CRUISE_M:.0f} m change by {abs(np.expm1(2.0 * stretch)):.0%} between northward and "
        f"eastward courses, and by {abs(np.expm1(2.0 * then)):.0%} if they are swapped; swap the "
        "columns",
    )


# Half the logarithm of the ratio of speeds on northward and eastward courses of the same aircraft,
# with its standard deviation; None where too few aircraft turn.
def _stretch(plots: Plots) -> tuple[float, float] | None:
    first, last = pairs_apart(plots.time_s, _names(plots), _LEG_S, 2.0 * _LEG_S)
    known = _names(plots)[first] >= 0
    first, last = first[known], last[known]
    latitude = np.radians(plots.latitude_deg)
    north = latitude[last] - latitude[first]
    east = plots.longitude_deg[last] - plots.longitude_deg[first]
    east = np.radians((east + 180.0) % 360.0 - 180.0)
    east = east * np.cos(0.5 * (latitude[last] + latitude[first]))
    speed = np.hypot(north, east) / (plots.time_s[last] - plots.time_s[first])
    flying = np.isfinite(speed) & (speed > 0.0)
    _, of = np.unique(_names(plots)[first][flying], return_inverse=True)
    course = np.arctan2(east, north)[flying]
    waves = [np.cos(2.0 * course), np.cos(course), np.sin(course), np.sin(2.0 * course)]
    columns = np.column_stack([*waves, np.log(speed[flying])])
    counts = np.maximum(np.bincount(of), 1)
    means = np.column_stack([np.bincount(of, one) / counts for one in columns.T])
    within = columns - means[of]
    # Aircraft that turn: their courses spread.
    turning = np.bincount(of, within[:, 0] ** 2) / counts > _TURNING_MIN
    if np.count_nonzero(turning) < _TURNING_AIRCRAFT_MIN:
        return None
    rows = within[turning[of]]
    solution, *_ = np.linalg.lstsq(rows[:, :-1], rows[:, -1], rcond=None)
    # Of the aircraft, whose legs are not independent.
    part = rows[:, 0] * (rows[:, -1] - rows[:, 1:-1] @ solution[1:])
    sums = np.bincount(of[turning[of]], part, len(turning))[turning]
    each = sums / np.bincount(of, within[:, 0] ** 2, len(turning))[turning]
    return float(solution[0]), float(np.std(each) / np.sqrt(len(each)))


# Between the 16th and 84th percentile of the logarithm of the median speeds of aircraft.
def _speed_spread(plots: Plots, first: Integers, last: Integers) -> float:
    where = reported(plots)
    apart_s = plots.time_s[last] - plots.time_s[first]
    speed = np.linalg.norm(where[last] - where[first], axis=1) / apart_s
    names = _names(plots)[first]
    medians = [np.median(speed[names == one]) for one in np.unique(names)]
    return float(np.ptp(np.percentile(np.log(np.maximum(medians, 1.0)), [16.0, 84.0])))


def _names(plots: Plots) -> Integers:
    found: Integers = plots.keys[:, :2].max(axis=1)
    return found
