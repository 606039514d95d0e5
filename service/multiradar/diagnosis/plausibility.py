"""What the plots of a radar show without any other sensor: scans, speeds, ranges, heights."""

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.cross_sensor.hypotheses import AZIMUTH_UNITS, RANGE_UNITS, Reading
from multiradar.diagnosis.diagnosis import Diagnosis
from multiradar.diagnosis.plots import EARTH_RADIUS_M, Floats, Integers, Plots, Site, located
from multiradar.diagnosis.scans import Rotation, coherence_at, rotation

#: Azimuths that go with time so closely are those of a rotating antenna; a unit is another one when
#: it leaves a fifth of what is missing.
ROTATES_MIN, CLOSER = 0.998, 5.0
#: Nothing can be so much closer than this: other units need not be tried.
SURELY = 0.9997
#: Scans that a period is measured from.
SCANS_MIN = 3.0
#: Half of the aircraft of a radar fly at speeds in this range, m/s.
SPEED_MIN_MPS, SPEED_MAX_MPS = 25.0, 400.0
#: The farthest plot of a radar is farther than this part of its instrumented range, and none is
#: farther than a radar on the ground sees, m.
FARTHEST_MIN, RANGE_END_M = 0.1, 600e3
#: Of what fits, the speed nearest to this is preferred, m/s.
SPEED_USUAL_MPS = 200.0
#: Plots of an aircraft from which its speed is taken are so far apart, s.
_APART_MIN_S, _APART_MAX_S = 20.0, 60.0
#: A range below this is not one of a radar in metres when all of them are.
RANGES_SMALL_M = 2000.0
#: Rows of the Earth in radio waves: four thirds of its radius (ITU-R P.834).
_RADIO_RADIUS_M = EARTH_RADIUS_M * 4.0 / 3.0
#: Part of the heights that may be above it: garbled Mode C.
HIGH_MAX = 0.05
#: Part of the plots that must be impossible one way and possible the other.
MOST = 0.5
FLIGHT_LEVEL_M = 30.48
FOOT_M = 0.3048
#: Aircraft under air traffic control fly lower than this, m.
CEILING_M = 16_000.0


def exchanged_columns(name: str, plots: Plots) -> Diagnosis | None:
    """Say so where ranges look like azimuths and azimuths look like ranges."""
    if plots.size < TESTED_MIN or not np.isfinite(plots.azimuth_deg).any():
        return None
    if plots.range_m.max() <= 360.0 and np.nanmedian(plots.azimuth_deg) > 360.0:
        return Diagnosis(
            name,
            "columns_exchanged",
            f"{name}: its range and azimuth columns are probably exchanged: ranges end at "
            f"{plots.range_m.max():.1f}, azimuths at {np.nanmax(plots.azimuth_deg):.1f}; exchange "
            "range_m and azimuth_deg",
        )
    return None


def azimuth_unit(name: str, plots: Plots) -> Diagnosis | None:
    """Say so where azimuths go round with time in another unit than degrees, or the other way."""
    time_s, azimuth = plots.time_s, plots.azimuth_deg
    good = np.isfinite(azimuth)
    time_s, azimuth = time_s[good], azimuth[good]
    given = rotation(time_s, np.radians(azimuth))
    best, unit = given, None
    for reading in AZIMUTH_UNITS if given.coherence < SURELY else ():
        largest = float(np.max(reading.polar(azimuth, azimuth)[1], initial=0.0))
        if not 0.5 * np.pi <= largest <= 2.01 * np.pi:
            continue
        found = rotation(time_s, reading.polar(azimuth, azimuth)[1])
        if _closer(found, best, time_s):
            best, unit = found, reading
    if unit is not None:
        return _of_unit(name, unit, azimuth, best)
    if _rotates(given, time_s) and given.period_s < 0.0:
        return Diagnosis(
            name,
            "azimuth_anticlockwise",
            f"{name}: its azimuths are probably counted anticlockwise: plot by plot they decrease "
            f"with time, a scan in {-given.period_s:.2f} s; count them clockwise from true north",
        )
    return None


def scan_period(name: str, plots: Plots, configured_s: float) -> Diagnosis | None:
    """Say so where the scan period is not the one configured."""
    if not np.isfinite(configured_s):
        return None
    azimuth = np.radians(plots.azimuth_deg)
    found = rotation(plots.time_s, azimuth)
    if not _rotates(found, plots.time_s):
        between_s = _between_plots(plots)
        if np.isnan(between_s) or 0.6 <= between_s / configured_s <= 1.6:
            return None
        return _of_period(name, configured_s, between_s, "plots of one aircraft follow each other")
    if found.period_s < 0.0:
        return None
    at = Rotation(configured_s, coherence_at(plots.time_s, azimuth, configured_s))
    if abs(found.period_s / configured_s - 1.0) <= 0.1 or not _closer(found, at, plots.time_s):
        return None
    return _of_period(name, configured_s, found.period_s, "the azimuths of the plots go round")


# The time from one plot of an aircraft to the next, where most scans see it; NaN where unknown.
def _between_plots(plots: Plots) -> float:
    names = plots.keys[:, :2].max(axis=1)
    order = np.lexsort((plots.time_s, names))
    same = (np.diff(names[order]) == 0) & (names[order][1:] >= 0)
    gaps = np.diff(plots.time_s[order])[same]
    gaps = gaps[gaps > 0.1]
    if len(gaps) < TESTED_MIN:
        return np.nan
    low, middle = np.quantile(gaps, (0.25, 0.5))
    # A quarter and a half of the gaps are alike: that is one scan.
    return float(middle) if middle - low <= 0.1 * middle else np.nan


def _of_period(name: str, configured_s: float, found_s: float, what: str) -> Diagnosis:
    rpm = 60.0 / found_s
    hint = f", {rpm:.1f} revolutions a minute" if abs(configured_s / rpm - 1.0) < 0.1 else ""
    return Diagnosis(
        name,
        "rotation_period",
        f"{name}: rotation_period_s is probably wrong: it is {configured_s:g} in the sensors file, "
        f"and {what} in {found_s:.2f} s{hint}; correct it there",
    )


def range_unit(
    name: str, plots: Plots, site: Site, paths: Integers, range_max_m: float
) -> Diagnosis | None:
    """Say so where aircraft fly impossibly fast or slowly, and another unit of range mends that.

    Parameters
    ----------
    name : str
        The radar.
    plots : Plots
        Its plots.
    site : Site
        Where it stands, rad and m.
    paths : (n,) int64
        What tells aircraft apart, −1 where nothing does.
    range_max_m : float
        Its instrumented range, infinite when unknown.
    """
    speed = median_speed(plots, plots.range_m, site, paths)
    farthest = float(np.max(plots.range_m, initial=0.0))
    possible = SPEED_MIN_MPS <= speed <= SPEED_MAX_MPS
    if plots.size < TESTED_MIN or possible or (np.isnan(speed) and farthest > RANGES_SMALL_M):
        return None
    fitting = []
    for reading in RANGE_UNITS:
        ranges, _ = reading.polar(plots.range_m, plots.azimuth_deg)
        then = median_speed(plots, ranges, site, paths)
        fits = 50.0 <= then <= 330.0 or np.isnan(then)
        end = float(ranges.max())
        if fits and FARTHEST_MIN * min(range_max_m, RANGE_END_M) <= end <= 1.05 * min(
            range_max_m, RANGE_END_M
        ):
            fitting.append((reading, then, end))
    if not fitting:
        return None
    return _of_range(name, fitting, speed, farthest, known_end=bool(np.isfinite(range_max_m)))


def _of_range(
    name: str,
    fitting: list[tuple[Reading, float, float]],
    speed: float,
    farthest: float,
    *,
    known_end: bool,
) -> Diagnosis:
    # The farthest plots are near the instrumented range, if that is known.
    reading, then, end = max(
        fitting, key=lambda one: one[2] if known_end else -abs(one[1] - SPEED_USUAL_MPS)
    )
    others = [one[0].with_it.split(" as ")[1] for one in fitting if one[0] is not reading]
    perhaps = f" (or {', '.join(others)})" if others else ""
    now = "" if np.isnan(speed) else f" and the median speed of aircraft {speed:.0f} m/s"
    with_it = "" if np.isnan(then) else f" and {then:.0f} m/s"
    return Diagnosis(
        name,
        "range_unit",
        f"{name}: {reading.mistake}{perhaps}: the farthest is {farthest:.1f} m{now}; with "
        f"{reading.with_it} {end / 1e3:.0f} km{with_it}; {reading.remedy}",
    )


def median_speed(plots: Plots, range_m: Floats, site: Site, paths: Integers) -> float:
    """Return half of the speeds of aircraft are below, m/s; NaN where none is known."""
    speeds = []
    where = located(site, range_m, np.radians(plots.azimuth_deg), plots.heights())
    for path in np.unique(paths[paths >= 0])[:500]:
        rows = np.flatnonzero(paths == path)
        after = np.searchsorted(plots.time_s[rows], plots.time_s[rows] + _APART_MIN_S)
        inside = after < len(rows)
        first, last = rows[inside], rows[after[inside]]
        apart_s = plots.time_s[last] - plots.time_s[first]
        near = apart_s <= _APART_MAX_S
        if near.any():
            ways = np.linalg.norm(where[last[near]] - where[first[near]], axis=1)
            speeds.append(float(np.median(ways / apart_s[near])))
    return float(np.median(speeds)) if speeds else np.nan


def height_unit(name: str, plots: Plots, site: Site) -> Diagnosis | None:
    """Say so where heights are impossible, and feet or flight levels are not."""
    known = np.isfinite(plots.height_m)
    heights, ranges = plots.height_m[known], plots.range_m[known]
    if len(heights) < TESTED_MIN:
        return None
    if np.mean(heights > CEILING_M) > HIGH_MAX and np.mean(heights * FOOT_M > CEILING_M) < 0.01:
        return _height(
            name, "feet", f"{np.mean(heights > CEILING_M):.0%} of them are above {CEILING_M:.0f} m"
        )
    # Lowest height in sight over a smooth Earth in standard atmosphere.
    lowest = (
        ranges**2 / (2.0 * _RADIO_RADIUS_M)
        - np.sqrt(np.maximum(2.0 * max(site[2], 0.0) / _RADIO_RADIUS_M, 0.0)) * ranges
    )
    hidden = heights < lowest - 300.0
    then = heights * FLIGHT_LEVEL_M < lowest - 300.0
    if (
        np.mean(hidden) > MOST / 2.0
        and np.mean(then) < 0.1 * np.mean(hidden)
        and heights.max() < 700.0
    ):
        return _height(
            name, "flight levels", f"{np.mean(hidden):.0%} of its plots are below its horizon"
        )
    return None


def _height(name: str, unit: str, why: str) -> Diagnosis:
    return Diagnosis(
        name, "height_unit",
        f"{name}: its heights are probably in {unit}: {why}; convert them to metres",
    )  # fmt: skip


def _of_unit(name: str, unit: Reading, azimuth: Floats, found: Rotation) -> Diagnosis:
    return Diagnosis(
        name,
        unit.code,
        f"{name}: {unit.mistake}: they end at {azimuth.max():.2f}, and {unit.with_it} go round "
        f"with time, a scan in {abs(found.period_s):.2f} s; {unit.remedy}",
    )


def _rotates(found: Rotation, time_s: Floats) -> bool:
    scans = np.ptp(time_s) / abs(found.period_s) if len(time_s) else 0.0
    return bool(found.coherence >= ROTATES_MIN and scans >= SCANS_MIN)


def _closer(found: Rotation, than: Rotation, time_s: Floats) -> bool:
    return _rotates(found, time_s) and 1.0 - than.coherence > CLOSER * (1.0 - found.coherence)
