"""Clock errors of sensors: their diagnoses, and those of reported positions from each path."""

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.effects import effects_at
from multiradar.diagnosis.cross_sensor.references import RECORDING, Pairs, are_named
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
#: One time for each scan: so many plots at each time on average, and times this far apart, s.
_PLOTS_OF_SCAN, _SCAN_MIN_S = 3, 2.0


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
    if not pairs.size or not are_named(pairs):
        return np.nan
    latitude, longitude, _ = ecef_to_geodetic(pairs.position_m)
    rotation = enu_rotation(latitude, longitude)
    own_m = comparison.tested_positions(number)[pairs.plot]
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


# Claimed minus true time of each position, from the distance along its track.
def _late_s(apart_m: Floats, flown_mps: Floats) -> Floats:
    with np.errstate(invalid="ignore", divide="ignore"):
        late_s = -np.sum(apart_m * flown_mps, axis=1) / np.sum(flown_mps**2, axis=1)
    return np.asarray(late_s)


# Effect of the offsets of the radars on each difference: 0.2° are seconds along a track.
def _offsets_m(comparison: Comparison, pairs: Pairs, apart_m: Floats, flown_mps: Floats) -> Floats:
    height_m = ecef_to_geodetic(pairs.position_m)[2]
    radars = [one for one in np.unique(pairs.source).tolist() if comparison.is_radar(one)]
    columns = np.zeros((pairs.size, 2, 2 * len(radars) + 1))
    columns[:, :, -1] = -flown_mps
    for column, radar in enumerate(radars):
        rows = np.flatnonzero(pairs.source == radar)
        seen = effects_at(comparison.site(radar), pairs.position_m[rows], height_m[rows])
        columns[rows, :, 2 * column : 2 * column + 2] = -seen.offsets * PRIOR
    fit = Equations(apart_m, columns).fit(range(columns.shape[2]))
    return np.asarray(columns[:, :, :-1] @ fit.solution[:-1])


def check_late_positions(
    comparison: Comparison, number: int, name: str, pairs: Pairs
) -> Diagnosis | None:
    """Diagnose a clock of reported positions; arguments as of `late_positions`."""
    # By the names of aircraft: with tracks the nearest one would hide a clock error.
    late_s = late_positions(comparison, number, pairs)
    if not abs(late_s) >= LATE_MIN_S:
        return None
    return _of_clock(name, late_s, "set bias.time_offset_s in the sensors file")


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
        "time_of_scan",
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
