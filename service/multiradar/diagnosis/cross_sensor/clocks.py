"""Clock errors of sensors: their diagnoses, and those of reported positions from each path."""

from collections.abc import Collection

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.effects import effects_at
from multiradar.diagnosis.cross_sensor.references import RECORDING, Pairs, are_named, common_key
from multiradar.diagnosis.cross_sensor.registration import PRIOR, Registration
from multiradar.diagnosis.cross_sensor.trimmed_fit import Equations
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import Floats, Plots
from multiradar.diagnosis.times import utc
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation
from multiradar.report.times import gps_time

#: Range of clock errors that are reported, s: smaller ones are those of transmission, and across
#: longer ones an aircraft turns.
LATE_MIN_S, LATE_MAX_S = 1.0, 600.0
#: Speed that the time along a path needs, m/s.
_SPEED_MIN_MPS = 60.0
#: Positions are this far from the path of their aircraft at most, m, and the time offsets of half
#: of them this close to their median, s and as a fraction of it.
_ACROSS_M, _ALIKE_S, _ALIKE = 3000.0, 1.5, 0.1
#: A coordinate is late alone if the other is by at most this fraction of its time; the path then is
#: late by half of it. The fraction of the distances that may remain.
_COMPONENT_MAX, _COMPONENT_LATE, _COMPONENT_REST = 0.25, 0.5, 0.5
#: Offset by the places on paths: fraction of the plots that are on them, and of those the fraction
#: with one offset within a scan, s.
_ON_PATH_MIN, _MOST, _WITHIN_S = 0.4, 0.6, 15.0
#: One time for each scan: so many plots at each time on average, and times this far apart, s.
_PLOTS_OF_SCAN, _SCAN_MIN_S = 3, 2.0
TIME_OF_SCAN = "time_of_scan"


def late_positions(comparison: Comparison, number: int, pairs: Pairs) -> float:
    """Return the time offset of the positions of a sensor against others, s; NaN where unknown.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number : int
        The sensor.
    pairs : Pairs
        Positions of its aircraft by others.

    Returns
    -------
    float
        Claimed time minus true time: positive where its clock is ahead. The offsets in range and
        azimuth of the radars that it is compared with do not count.
    """
    pairs = pairs.select(pairs.source != RECORDING)
    own_m = comparison.tested_positions(number)
    if not are_named(pairs):
        pairs = _nearest(pairs, own_m)
    if not pairs.size:
        return np.nan
    latitude, longitude, _ = ecef_to_geodetic(pairs.position_m)
    rotation = enu_rotation(latitude, longitude)
    own_m = own_m[pairs.plot]
    apart_m = np.einsum("kij,kj->ki", rotation, own_m - pairs.position_m)[:, :2]
    flown_mps = np.einsum("kij,kj->ki", rotation, pairs.velocity_mps)[:, :2]
    speed_mps = np.linalg.norm(flown_mps, axis=1)
    late_s = _late_s(apart_m, flown_mps)
    across_m = np.linalg.norm(apart_m + flown_mps * late_s[:, None], axis=1)
    # The path behind a turn is another: the farther from the time, the wider.
    near = (across_m <= _ACROSS_M + 0.2 * np.abs(late_s) * speed_mps) & (
        speed_mps >= _SPEED_MIN_MPS
    )
    used = near & (np.abs(late_s) <= LATE_MAX_S)
    late_s = late_s[used]
    if len(np.unique(pairs.plot)) < TESTED_MIN or len(late_s) < 0.5 * pairs.size:
        return np.nan
    middle_s = float(np.median(late_s))
    spread_s = float(np.median(np.abs(late_s - middle_s)))
    if spread_s > max(_ALIKE_S, _ALIKE * abs(middle_s)):
        return np.nan
    pairs, apart_m, flown_mps = pairs.select(used), apart_m[used], flown_mps[used]
    offsets_m = _offsets_m(comparison, pairs, apart_m + flown_mps * middle_s, flown_mps)
    return float(np.median(_late_s(apart_m - offsets_m, flown_mps)))


def late_on_paths(comparison: Comparison, number: int, others: Collection[int]) -> float:
    """Return the time offset of a sensor by the places on the paths of its aircraft, s, or 0.

    However large it is: the paths by others show when each aircraft was at the place of a plot.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number : int
        The sensor.
    others : collection of int
        The sensors to compare with.
    """
    plots = comparison.tested(number)
    asked = [one for one in others if one != number and one in comparison.numbers]
    key = common_key(plots, [comparison.plots(one) for one in asked])
    if key is None:
        return 0.0
    where, names = comparison.tested_positions(number), plots.keys[:, key]
    late_s, named = [], 0
    for one in asked:
        paths = comparison.paths_by(one, key)
        for name in np.unique(names[names >= 0]).tolist():
            on_path = np.flatnonzero(paths.name == name)
            rows = np.flatnonzero(names == name)
            named += len(rows) if len(on_path) > 1 else 0
            if len(on_path) < 2:
                continue
            apart_m = np.linalg.norm(where[rows, None] - paths.position_m[on_path][None], axis=2)
            nearest = apart_m.argmin(axis=1)
            # A place at the end of a path may be beyond it.
            inside = (nearest > 0) & (nearest < len(on_path) - 1)
            good = inside & (apart_m.min(axis=1) <= _ACROSS_M)
            late_s.append((plots.time_s[rows] - paths.time_s[on_path[nearest]])[good])
    found = np.sort(np.concatenate(late_s)) if late_s else np.empty(0)
    if len(found) < max(TESTED_MIN, _ON_PATH_MIN * named):
        return 0.0
    # The offset is that of most places; an aircraft may pass one twice.
    until = np.searchsorted(found, found + _WITHIN_S)
    first = int((until - np.arange(len(found))).argmax())
    alike = found[first : until[first]]
    return float(np.median(alike)) if len(alike) >= _MOST * len(found) else 0.0


# The one position by each other sensor that is near each plot: that of its aircraft, unnamed.
def _nearest(pairs: Pairs, own_m: Floats) -> Pairs:
    apart_m = np.linalg.norm(own_m[pairs.plot] - pairs.position_m, axis=1)
    pairs = pairs.select(apart_m <= _ACROSS_M)
    _, index, counts = np.unique(
        np.column_stack([pairs.plot, pairs.source]), axis=0, return_inverse=True, return_counts=True
    )
    return pairs.select(counts[index.ravel()] == 1)


# Claimed minus true time of each position, from the distance along its track.
def _late_s(apart_m: Floats, flown_mps: Floats) -> Floats:
    with np.errstate(invalid="ignore", divide="ignore"):
        late_s = -np.sum(apart_m * flown_mps, axis=1) / np.sum(flown_mps**2, axis=1)
    return np.asarray(late_s)


# Effect of the offsets of the radars on each difference: 0.2° are seconds along a track.
def _offsets_m(comparison: Comparison, pairs: Pairs, apart_m: Floats, flown_mps: Floats) -> Floats:
    columns = np.concatenate([_of_radars(comparison, pairs), -flown_mps[:, :, None]], axis=2)
    fit = Equations(apart_m, columns).fit(range(columns.shape[2]))
    return np.asarray(columns[:, :, :-1] @ fit.solution[:-1])


# Columns of the offsets in range and azimuth of each radar.
def _of_radars(comparison: Comparison, pairs: Pairs) -> Floats:
    height_m = ecef_to_geodetic(pairs.position_m)[2]
    radars = [one for one in np.unique(pairs.source).tolist() if comparison.is_radar(one)]
    columns = np.zeros((pairs.size, 2, 2 * len(radars)))
    for column, radar in enumerate(radars):
        rows = np.flatnonzero(pairs.source == radar)
        seen = effects_at(comparison.site(radar), pairs.position_m[rows], height_m[rows])
        columns[rows, :, 2 * column : 2 * column + 2] = -seen.offsets * PRIOR
    return columns


def check_late_positions(
    comparison: Comparison, number: int, name: str, pairs: Pairs
) -> Diagnosis | None:
    """Diagnose a clock of reported positions; arguments as of `late_positions`."""
    # By the names of aircraft: with tracks the nearest one would hide a clock error.
    late_s = late_positions(comparison, number, pairs)
    # Offsets of radars, which the time along the path does not contain, displace coordinates, too.
    is_late = not abs(late_s) < _COMPONENT_LATE * LATE_MIN_S
    of_one = _late_component(comparison, number, pairs) if is_late else None
    if of_one is not None:
        column, by_s = of_one
        return Diagnosis(
            name,
            "other_rows",
            f"{name}: its {column} probably belongs to other rows: it is that of the aircraft "
            f"{abs(by_s):.1f} s {'earlier' if by_s > 0.0 else 'later'}, unlike the other "
            "coordinate; check how the columns were joined",
        )
    if not abs(late_s) >= LATE_MIN_S:
        return None
    return _of_clock(name, late_s, "set bias.time_offset_s in the sensors file")


# The coordinate that alone is late, and by how much, s; None where both are, or neither.
def _late_component(comparison: Comparison, number: int, pairs: Pairs) -> tuple[str, float] | None:
    pairs = pairs.select(pairs.source != RECORDING)
    if not pairs.size or not are_named(pairs):
        return None
    latitude, longitude, _ = ecef_to_geodetic(pairs.position_m)
    rotation = enu_rotation(latitude, longitude)
    own_m = comparison.tested_positions(number)[pairs.plot]
    apart_m = np.einsum("kij,kj->ki", rotation, own_m - pairs.position_m)[:, :2]
    flown_mps = np.einsum("kij,kj->ki", rotation, pairs.velocity_mps)[:, :2]
    fast = np.linalg.norm(flown_mps, axis=1) >= _SPEED_MIN_MPS
    fast &= np.linalg.norm(apart_m, axis=1) <= _ACROSS_M
    if np.count_nonzero(fast) < max(TESTED_MIN, 0.5 * pairs.size):
        return None
    pairs, apart_m, flown_mps = pairs.select(fast), apart_m[fast], flown_mps[fast]
    columns = np.zeros((pairs.size, 2, 2))
    columns[:, 0, 0], columns[:, 1, 1] = -flown_mps[:, 0], -flown_mps[:, 1]
    columns = np.concatenate([_of_radars(comparison, pairs), columns], axis=2)
    solution = Equations(apart_m, columns).fit(range(columns.shape[2])).solution
    east_s, north_s = solution[-2:].tolist()
    rest_m = np.linalg.norm(apart_m - columns @ solution, axis=1)
    if np.median(rest_m) > _COMPONENT_REST * np.median(np.linalg.norm(apart_m, axis=1)):
        return None
    for column, this_s, other_s in (
        ("longitude_deg", east_s, north_s), ("latitude_deg", north_s, east_s),
    ):  # fmt: skip
        if abs(this_s) >= LATE_MIN_S and abs(other_s) <= _COMPONENT_MAX * abs(this_s):
            return column, this_s
    return None


def _of_clock(name: str, late_s: float, setting: str) -> Diagnosis:
    sense, where = ("ahead", "behind") if late_s > 0.0 else ("behind", "ahead of")
    return Diagnosis(
        name,
        "clock",
        f"{name}: its clock is probably {abs(late_s):.1f} s {sense}{gps_time(late_s)}: along "
        f"track, its plots lie {where} the positions measured by other sensors; correct its "
        f"times, or {setting}",
    )


def _of_change(name: str, wrong: Registration) -> Diagnosis:
    how = f"jumped by {wrong.change_s:+.1f} s at about {utc(wrong.jump_at_s)}"
    remedy = "correct its times on one side of the jump"
    if np.isnan(wrong.jump_at_s):
        how = f"drifts by {1e3 * wrong.drift:+.2g} ms per second ({wrong.change_s:+.1f} s in total)"
        remedy = "correct its times"
    return Diagnosis(
        name,
        "clock",
        f"{name}: its clock probably {how}: the distance along track between its plots and the "
        f"positions measured by other sensors changes during the recording; {remedy}",
    )


def _of_times_of_scans(name: str, late_s: float) -> Diagnosis:
    sense = "later" if late_s > 0.0 else "earlier"
    return Diagnosis(
        name,
        TIME_OF_SCAN,
        f"{name}: all plots of a scan have the same time, on average {abs(late_s):.1f} s {sense} "
        "than the times at which they were measured; write the time of each plot",
    )


def check_clock(
    name: str, wrong: Registration, configured_s: float, plots: Plots
) -> list[Diagnosis]:
    """Diagnose a clock by the registration of its radar.

    Parameters
    ----------
    name : str
        The radar.
    wrong : Registration
        Its errors.
    configured_s : float
        Its time offset in the sensors file, s.
    plots : Plots
        Its plots.
    """
    late_s = wrong.time_offset_s
    if wrong.change_s:
        return [_of_change(name, wrong)]
    if late_s and _have_time_of_scan(plots):
        return [_of_times_of_scans(name, late_s)]
    if late_s:
        setting = "set bias.time_offset_s in the sensors file"
        if configured_s:
            setting = f"bias.time_offset_s ({configured_s:g} s in the sensors file)"
        return [_of_clock(name, late_s, setting)]
    return []


def _have_time_of_scan(plots: Plots) -> bool:
    times = np.unique(plots.time_s)
    together = len(times) * _PLOTS_OF_SCAN <= plots.size
    return together and len(times) > 1 and float(np.median(np.diff(times))) >= _SCAN_MIN_S
