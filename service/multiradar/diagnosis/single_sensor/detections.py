"""How often a radar detects the aircraft that it follows: a recording may lack rows."""

import numpy as np

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.cross_sensor.plausibility import aircraft_of, rotates, scan_period
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import Floats, Integers, Plots, Site, located

#: Rows are missing if half of the plots of an aircraft follow the previous one after so many scans
#: or more: a probability of detection below 0.3. Shortest gap, in scans: a copy is no scan. Gaps in
#: which an aircraft is followed, in scans, and largest speed between its plots, m/s.
_SPARSE_SCANS_MIN, _COPY_SCANS, _FOLLOWED_SCANS, _SPARSE_SPEED_MPS = 2.5, 0.3, 60.0, 400.0
#: ... or if a secondary radar, which detects more than 0.8 of the replies, detects fewer than this
#: in the scans of its aircraft, in gaps of at most so many scans, and fewer than the second ones
#: follow a plot of the scan before: aircraft at the edge of coverage are lost for long at a time.
_DETECTED_MIN, _GAP_SCANS, _NEXT_MIN = 0.6, 10.5, 0.55
#: Aircraft that show it, at least and as a fraction, plots of each, and the detections of each.
_AIRCRAFT_MIN, _AIRCRAFT_SHARE, _GAPS_MIN, _DETECTED_EACH = 3, 0.7, 8, 0.7
#: Every second or third scan: at most the first fraction of the plots follow one of the scan
#: before, and at least the second follow after one number of scans.
_NEXT_MAX, _REGULAR_MIN = 0.1, 0.8
SPARSE_CODE = "plots_missing"


def check_detections(
    name: str, plots: Plots, site: Site, configured_s: float
) -> Diagnosis | None:  # fmt: skip
    """Diagnose plots of which many are missing: aircraft are seen once in several scans.

    Parameters
    ----------
    name : str
        The radar.
    plots : Plots
        Its plots.
    site : Site
        Its site, rad and m.
    configured_s : float
        The configured scan period, s; NaN where unknown.
    """
    period_s = scan_period(plots, configured_s)
    aircraft = aircraft_of(plots)
    order = np.lexsort((plots.time_s, aircraft))
    order = order[aircraft[order] >= 0]
    of = aircraft[order]
    scans = np.diff(plots.time_s[order]) / period_s
    seen = (of[1:] == of[:-1]) & (scans > _COPY_SCANS)
    if np.count_nonzero(seen) < TESTED_MIN:
        return None
    coded = bool(np.mean(plots.keys[:, 1:].max(axis=1) >= 0) >= 0.5)
    few = np.median(scans[seen]) >= _SPARSE_SCANS_MIN
    if not few and not _are_missed(of[1:][seen], scans[seen], coded=coded):
        return None
    # Numbers and codes of other aircraft would be far apart.
    azimuth = np.radians(plots.azimuth_deg)
    where = located(site, plots.range_m, azimuth, plots.heights())[order]
    near = seen & (scans <= _FOLLOWED_SCANS)
    speed = np.linalg.norm(np.diff(where, axis=0), axis=1)[near] / (scans[near] * period_s)
    if len(speed) < TESTED_MIN or not np.median(speed) <= _SPARSE_SPEED_MPS:
        return None
    every = float(np.mean(scans[near if few else seen & (scans <= _GAP_SCANS)]))
    known = rotates(plots)
    by = "the azimuths of its plots" if known else "rotation_period_s in the sensors file"
    perhaps = "" if known else ", or rotation_period_s is wrong"
    return Diagnosis(
        name,
        SPARSE_CODE,
        f"{name}: its aircraft are detected only once in about {every:.0f} scans (of "
        f"{period_s:.3g} s by {by}): rows are probably missing from the recording (thinned or "
        f"filtered){perhaps}; record every plot",
    )


def _are_missed(aircraft: Integers, scans: Floats, *, coded: bool) -> bool:
    follows = scans <= _GAP_SCANS
    steps, of = np.round(scans[follows]), aircraft[follows]
    if len(steps) < TESTED_MIN:
        return False
    shares = np.bincount(steps.astype(np.int64), minlength=3) / len(steps)
    if shares[:2].sum() <= _NEXT_MAX and shares.max() >= _REGULAR_MIN:
        return True
    if not coded or shares[:2].sum() >= _NEXT_MIN or len(steps) >= _DETECTED_MIN * steps.sum():
        return False
    _, number, counts = np.unique(of, return_inverse=True, return_counts=True)
    each = counts / np.bincount(number, steps)
    each = each[counts >= _GAPS_MIN]
    rare = np.count_nonzero(each < _DETECTED_EACH)
    return bool(rare >= max(_AIRCRAFT_MIN, _AIRCRAFT_SHARE * len(each)))
