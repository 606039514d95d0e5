"""Checks of a radar's plots without any other sensor: scans, speeds, ranges, heights."""

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.cross_sensor.hypotheses import AZIMUTH_UNITS, RANGE_UNITS, Reading
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import KEYS, Floats, Integers, Plots, Site, located
from multiradar.diagnosis.scans import Rotation, coherence_at, rotation, two_rotations

#: Coherence of azimuth and time of a rotating antenna; another unit is preferred when it reduces
#: the incoherence by this factor.
ROTATES_MIN, CLOSER = 0.998, 5.0
#: From this coherence on, no other unit can be better.
SURELY = 0.9997
#: Minimum number of scans to measure a period.
SCANS_MIN = 3.0
#: Periods within this of each other are the same.
PERIOD_WITHIN = 0.1
#: A configured period is wrong if it differs by more than this from the rotation, or from the time
#: between the plots of an aircraft.
_ROTATION_WITHIN, _BETWEEN_WITHIN = 0.04, 0.07
#: The median speed of aircraft lies in this range, m/s.
SPEED_MIN_MPS, SPEED_MAX_MPS = 25.0, 400.0
#: ... or, where the ranges end at the instrumented range, up to Mach 2; as well where most aircraft
#: are higher than airliners (FL430), m.
_ENDS_WITHIN, SUPERSONIC_MPS, _AIRLINERS_MAX_M = 0.05, 600.0, 13_500.0
#: The farthest plot of a radar is beyond this fraction of its instrumented range, and no plot is
#: beyond the line of sight of a ground radar, m.
FARTHEST_MIN, RANGE_END_M = 0.1, 600e3
#: Among units that fit, the median speed nearest to this is preferred, m/s.
SPEED_USUAL_MPS = 200.0
#: Time between the plots from which a speed is computed, s.
_APART_MIN_S, _APART_MAX_S = 20.0, 60.0
#: Aircraft that a median speed is computed of.
_PATHS_MAX = 500
#: Ranges that are all below this are not in metres.
RANGES_SMALL_M = 2000.0
#: Fraction of heights that may be above `CEILING_M`: garbled Mode C.
HIGH_MAX = 0.05
#: Tolerance of heights about a horizon or a site, m: pressure heights.
_BELOW_M = 300.0
#: Aircraft under air traffic control fly lower than this, m.
CEILING_M = 16_000.0
#: Minimum coherence of azimuths and times at the configured period in another unit, among plots
#: that do not advance with the antenna; its ratio to that of the azimuths as given at any period.
ADVANCES_MIN, ADVANCES_MORE = 0.35, 2.0
#: Quartiles of times between plots that are equal, as a fraction.
_EQUAL_WITHIN = 0.03
#: No antenna of a surveillance radar rotates more slowly, s.
_SLOWEST_S = 20.0
#: Pairs of columns that may be exchanged: the first ends at the first number, and the median of the
#: second exceeds the second: no azimuth is above 360°, no height above 50 km even in feet.
_EXCHANGED = (
    ("range_m", "azimuth_deg", 360.0, 360.0),
    ("height_m", "azimuth_deg", 360.0, 360.0),
    ("range_m", "height_m", CEILING_M, 50_000.0),
)


def check_exchanged_columns(name: str, plots: Plots) -> Diagnosis | None:
    """Diagnose two swapped columns of range, azimuth and height, by their largest values."""
    columns = {"range_m": plots.range_m, "azimuth_deg": plots.azimuth_deg}
    columns["height_m"] = plots.height_m[np.isfinite(plots.height_m)]
    for first, second, most, too_much in _EXCHANGED:
        small, large = columns[first], columns[second]
        if min(len(small), len(large)) < TESTED_MIN or not np.isfinite(large).any():
            continue
        if np.nanmax(small) <= most and np.nanmedian(large) > too_much:
            names = [one.partition("_")[0] for one in (first, second)]
            return Diagnosis(
                name,
                "columns_exchanged",
                f"{name}: its {names[0]} and {names[1]} columns are probably swapped: "
                f"{names[0]}s reach {np.nanmax(small):.1f}, {names[1]}s "
                f"{np.nanmax(large):.1f}; swap {first} and {second}",
            )
    return _exchanged_by_rotation(name, plots)


# Ranges in kilometres or nautical miles are possible azimuths, but do not advance with the antenna.
def _exchanged_by_rotation(name: str, plots: Plots) -> Diagnosis | None:
    plots = plots.select(np.isfinite(plots.range_m) & np.isfinite(plots.azimuth_deg))
    if plots.size < TESTED_MIN or plots.range_m.max() > 360.0:
        return None
    found = rotation(plots.time_s, np.radians(plots.range_m))
    if not _closer(found, rotation(plots.time_s, np.radians(plots.azimuth_deg)), plots.time_s):
        return None
    return Diagnosis(
        name,
        "columns_exchanged",
        f"{name}: its range and azimuth columns are probably swapped: its ranges advance steadily, "
        f"like azimuths, by one revolution in {abs(found.period_s):.2f} s; swap range_m and "
        "azimuth_deg, and convert the ranges to metres",
    )


def check_azimuth_unit(name: str, plots: Plots, configured_s: float = np.nan) -> Diagnosis | None:
    """Diagnose azimuths in another unit than degrees, or measured anticlockwise."""
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
    if (among := _among_clutter(time_s, azimuth, given, configured_s)) is not None:
        return _of_unit(name, among, azimuth, Rotation(configured_s, 1.0))
    if _rotates(given, time_s) and given.period_s < 0.0:
        clockwise = coherence_at(time_s, np.radians(azimuth), -given.period_s)
        # Few aircraft in one direction advance with an antenna in either sense.
        if clockwise >= SURELY or not 1.0 - clockwise > CLOSER * (1.0 - given.coherence):
            return None
        return Diagnosis(
            name,
            "azimuth_anticlockwise",
            f"{name}: its azimuths are probably measured anticlockwise: they decrease from plot "
            f"to plot, by one revolution in {-given.period_s:.2f} s; measure them clockwise from "
            "true north (if they are angles from east, as in mathematics: 90° minus each value)",
        )
    return None


# Clutter does not advance with the antenna in simulated recordings, and plots delayed by networks
# advance with it roughly: then the period is not searched for, but is that of the sensors file.
def _among_clutter(
    time_s: Floats, azimuth: Floats, given: Rotation, configured_s: float
) -> Reading | None:
    if not configured_s > 0.0 or given.coherence >= ADVANCES_MIN:
        return None
    found, most = None, max(ADVANCES_MIN, ADVANCES_MORE * given.coherence)
    for reading in AZIMUTH_UNITS:
        read = reading.polar(azimuth, azimuth)[1]
        if 0.5 * np.pi <= float(np.max(read, initial=0.0)) <= 2.01 * np.pi:
            coherence = coherence_at(time_s, read, configured_s)
            if coherence >= most:
                found, most = reading, coherence
    return found


def check_scan_period(name: str, plots: Plots, configured_s: float) -> Diagnosis | None:
    """Diagnose a scan period that differs from the configured one."""
    if not np.isfinite(configured_s):
        return None
    azimuth = np.radians(plots.azimuth_deg)
    found = rotation(plots.time_s, azimuth)
    if not _rotates(found, plots.time_s):
        between_s = _between_plots(plots)
        near = abs(between_s / configured_s - 1.0) <= _BETWEEN_WITHIN
        if np.isnan(between_s) or near or between_s > _SLOWEST_S:
            return None
        return _of_period(name, configured_s, between_s, "the plots of an aircraft repeat every")
    if found.period_s < 0.0:
        return None
    at = Rotation(configured_s, coherence_at(plots.time_s, azimuth, configured_s))
    if abs(found.period_s / configured_s - 1.0) <= _ROTATION_WITHIN or not _closer(
        found, at, plots.time_s
    ):
        return None
    return _of_period(
        name, configured_s, found.period_s, "the azimuths of the plots complete a revolution in"
    )


def gaps_s(plots: Plots) -> Floats:
    """Return the times between successive plots of each aircraft with a number or address, s."""
    names = plots.keys[:, :2].max(axis=1)
    order = np.lexsort((plots.time_s, names))
    same = (np.diff(names[order]) == 0) & (names[order][1:] >= 0)
    gaps: Floats = np.diff(plots.time_s[order])[same]
    return gaps


def scan_period(plots: Plots, configured_s: float) -> float:
    """Return the scan period by the azimuths of the plots where they contradict the configured one.

    Parameters
    ----------
    plots : Plots
        Plots of a radar.
    configured_s : float
        Its configured scan period, s; NaN where unknown.

    Returns
    -------
    float
        s; the configured period where that fits, too: few aircraft fit several periods.
    """
    azimuth = np.radians(plots.azimuth_deg)
    found = rotation(plots.time_s, azimuth)
    at = Rotation(configured_s, 0.0)
    if np.isfinite(configured_s):
        at = Rotation(configured_s, coherence_at(plots.time_s, azimuth, configured_s))
    return abs(found.period_s) if _closer(found, at, plots.time_s) else configured_s


def rotates(plots: Plots) -> bool:
    """Return whether the azimuths of the plots of a radar show a rotation."""
    return _rotates(rotation(plots.time_s, np.radians(plots.azimuth_deg)), plots.time_s)


def measured_period(plots: Plots) -> float:
    """Return the scan period of a radar by its plots, s; NaN where unknown."""
    found = rotation(plots.time_s, np.radians(plots.azimuth_deg))
    return found.period_s if _rotates(found, plots.time_s) else _between_plots(plots)


def check_two_radars(name: str, plots: Plots) -> Diagnosis | None:
    """Diagnose plots of two radars under one identifier, by their scan periods."""
    found = two_rotations(plots.time_s, np.radians(plots.azimuth_deg))
    if found is None:
        return None
    first, second, share = found
    return Diagnosis(
        name,
        "two_radars",
        f"{name}: its plots are probably from two radars: {share:.0%} complete a revolution in "
        f"{abs(first.period_s):.2f} s, the others in {abs(second.period_s):.2f} s; give each radar "
        "its own identifier",
    )


# Time between successive plots of an aircraft that most scans detect; NaN where unknown.
def _between_plots(plots: Plots) -> float:
    gaps = gaps_s(plots)
    gaps = gaps[gaps > 0.1]
    if len(gaps) < TESTED_MIN:
        return np.nan
    low, middle = np.quantile(gaps, (0.25, 0.5))
    # The lower quartile and the median of the gaps are equal: that is one scan.
    return float(middle) if middle - low <= _EQUAL_WITHIN * middle else np.nan


def _of_period(name: str, configured_s: float, found_s: float, what: str) -> Diagnosis:
    rpm = 60.0 / found_s
    hint = f", {rpm:.1f} revolutions per minute" if abs(configured_s / rpm - 1.0) < 0.1 else ""
    return Diagnosis(
        name,
        "rotation_period",
        f"{name}: rotation_period_s is probably wrong: it is {configured_s:g} in the sensors "
        f"file, but {what} {found_s:.2f} s{hint}; correct it in the sensors file",
    )


def check_range_unit(
    name: str, plots: Plots, site: Site, paths: Integers, range_max_m: float
) -> Diagnosis | None:
    """Diagnose ranges in another unit: speeds are impossible as given and possible with it.

    Parameters
    ----------
    name : str
        The radar.
    plots : Plots
        Its plots.
    site : Site
        Its site, rad and m.
    paths : (n,) int64
        Identifies the aircraft of each plot; −1 where unknown.
    range_max_m : float
        Its instrumented range, infinite when unknown.
    """
    speed = median_speed(plots, plots.range_m, site, paths)
    farthest = float(np.max(plots.range_m, initial=0.0))
    possible = SPEED_MIN_MPS <= speed <= SPEED_MAX_MPS
    # Plots up to the instrumented range, and none beyond, are in its unit.
    ends = abs(farthest / range_max_m - 1.0) <= _ENDS_WITHIN or _are_high(plots)
    ends = ends and speed <= SUPERSONIC_MPS
    small = np.isnan(speed) and farthest > RANGES_SMALL_M
    if plots.size < TESTED_MIN or possible or ends or small:
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


def _are_high(plots: Plots) -> bool:
    heights = plots.height_m[np.isfinite(plots.height_m)]
    return len(heights) > 0 and float(np.median(heights)) > _AIRLINERS_MAX_M


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
    now = "" if np.isnan(speed) else f" and the median aircraft speed is {speed:.0f} m/s"
    with_it = "" if np.isnan(then) else f" and {then:.0f} m/s"
    return Diagnosis(
        name,
        "range_unit",
        f"{name}: {reading.mistake}{perhaps}: the maximum range is {farthest:.1f} m{now}; with "
        f"{reading.with_it}, {end / 1e3:.0f} km{with_it}; {reading.remedy}",
    )


def median_speed(plots: Plots, range_m: Floats, site: Site, paths: Integers) -> float:
    """Return the median speed of aircraft, m/s; NaN where none is known."""
    rows = np.flatnonzero(paths >= 0)
    rows = rows[np.argsort(paths[rows], kind="stable")]
    path = np.cumsum(np.diff(paths[rows], prepend=paths[rows][:1]) != 0)
    rows, path = rows[path < _PATHS_MAX], path[path < _PATHS_MAX]
    time_s = plots.time_s[rows]
    # Complex numbers are ordered by their real part, the path, and then by time.
    after = np.searchsorted(path + 1j * time_s, path + 1j * (time_s + _APART_MIN_S))
    first = np.flatnonzero(after < len(rows))
    last = after[first]
    apart_s = time_s[last] - time_s[first]
    near = (path[last] == path[first]) & (apart_s <= _APART_MAX_S)
    first, last, apart_s = first[near], last[near], apart_s[near]
    if len(first) == 0:
        return np.nan
    where = located(site, range_m, np.radians(plots.azimuth_deg), plots.heights())[rows]
    speed = np.linalg.norm(where[last] - where[first], axis=1) / apart_s
    return float(np.median(_medians(path[first], speed))) if np.isfinite(speed).all() else np.nan


# The median value of each group, in the order of the groups.
def _medians(group: Integers, values: Floats) -> Floats:
    order = np.lexsort((values, group))
    group, values = group[order], values[order]
    first = np.flatnonzero(np.diff(group, prepend=group[0] - 1))
    count = np.diff(first, append=len(group))
    return np.asarray(0.5 * (values[first + (count - 1) // 2] + values[first + count // 2]))


def aircraft_of(plots: Plots) -> Integers:
    """Return the aircraft of each plot by the first of `KEYS` that most have, −1 where unknown."""
    return next(
        (plots.keys[:, key] for key in range(len(KEYS)) if np.mean(plots.keys[:, key] >= 0) >= 0.5),
        np.full(plots.size, -1, np.int64),
    )


def check_nearer_than_height(name: str, plots: Plots, site: Site) -> Diagnosis | None:
    """Diagnose ranges shorter than the height of the aircraft above or below the radar."""
    # A negative range is rejected, with its reason.
    known = np.isfinite(plots.height_m) & (plots.range_m >= 0.0)
    apart_m = plots.height_m[known] - site[2]
    if len(apart_m) < TESTED_MIN:
        return None
    wrong = np.abs(apart_m) > 1.1 * plots.range_m[known] + _BELOW_M
    if np.mean(wrong) <= HIGH_MAX:
        return None
    sense = "above" if np.median(apart_m[wrong]) > 0.0 else "below"
    return Diagnosis(
        name,
        "height",
        f"{name}: height_m of its site or its reported heights are probably wrong: "
        f"{np.mean(wrong):.0%} of its ranges are shorter than the height of the aircraft {sense} "
        f"its site at {site[2]:g} m; check height_m in the sensors file and the units",
    )


def _of_unit(name: str, unit: Reading, azimuth: Floats, found: Rotation) -> Diagnosis:
    return Diagnosis(
        name,
        unit.code,
        f"{name}: {unit.mistake}: their maximum is {azimuth.max():.2f}, and {unit.with_it} "
        f"advance steadily, by one revolution in {abs(found.period_s):.2f} s; {unit.remedy}",
    )


def _rotates(found: Rotation, time_s: Floats) -> bool:
    scans = np.ptp(time_s) / abs(found.period_s) if len(time_s) else 0.0
    return bool(found.coherence >= ROTATES_MIN and scans >= SCANS_MIN)


def _closer(found: Rotation, than: Rotation, time_s: Floats) -> bool:
    return _rotates(found, time_s) and 1.0 - than.coherence > CLOSER * (1.0 - found.coherence)
