"""How often a radar detects the aircraft that it follows: a recording may lack rows."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.plausibility import aircraft_of, rotates, scan_period
from multiradar.diagnosis.cross_sensor.radar_groups import ONE_SITE_M
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import Floats, Integers, Plots, Site, located

#: Rows are missing if half of the plots of an aircraft follow the previous one after so many scans
#: or more: a probability of detection below 0.3. Shortest gap, in scans: a copy is no scan. Gaps in
#: which an aircraft is followed, in scans, and largest speed between its plots, m/s.
_SPARSE_SCANS_MIN, _COPY_SCANS, _FOLLOWED_SCANS, _SPARSE_SPEED_MPS = 2.5, 0.3, 60.0, 400.0
#: Secondary radars detect more than 0.8 of the replies. Rows may be missing if all of them detect
#: fewer than this in the scans of their aircraft, in gaps of at most so many scans, and fewer than
#: the second ones follow a plot of the scan before: aircraft at the edge of coverage are lost for
#: long at a time. One radar alone may be weak; a filter reduces all by one factor.
_DETECTED_MIN, _GAP_SCANS, _NEXT_MIN = 0.6, 10.5, 0.55
#: Aircraft that show it, at least and as a fraction, plots of each, and the detections of each.
_AIRCRAFT_MIN, _AIRCRAFT_SHARE, _GAPS_MIN, _DETECTED_EACH = 3, 0.7, 8, 0.7
#: Detection of those of all radars over that of the one with the fewest, at most.
_FACTORS_APART = 1.25
#: Every second row: the fraction of successive detection opportunities of a radar with the same
#: outcome, at most; it is 0.5 or more if detections are independent.
_SAME_OUTCOME_MAX = 0.25
#: Every second or third scan: at most the first fraction of the plots follow one of the scan
#: before, and at least the second follow after one number of scans.
_NEXT_MAX, _REGULAR_MIN = 0.1, 0.8
SPARSE_CODE = "plots_missing"


class _Followed(NamedTuple):
    """Successive plots of an aircraft: the aircraft, the scans between them, and the later time."""

    aircraft: Integers
    scans: Floats
    time_s: Floats


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
    order, scans, seen = _successive(plots, period_s)
    if np.count_nonzero(seen) < TESTED_MIN:
        return None
    few = np.median(scans[seen]) >= _SPARSE_SCANS_MIN
    followed = _followed(plots, order, scans, seen)
    if not few and not (_are_regular(followed) or _alternate(followed, period_s)):
        return None
    # Numbers and codes of other aircraft would be far apart.
    azimuth = np.radians(plots.azimuth_deg)
    where = located(site, plots.range_m, azimuth, plots.heights())[order]
    near = seen & (scans <= _FOLLOWED_SCANS)
    speed = np.linalg.norm(np.diff(where, axis=0), axis=1)[near] / (scans[near] * period_s)
    if len(speed) < TESTED_MIN or not np.median(speed) <= _SPARSE_SPEED_MPS:
        return None
    every = float(np.mean(scans[near] if few else followed.scans))
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


def check_all_detections(
    comparison: Comparison, names: Sequence[str], found: Sequence[Diagnosis]
) -> list[Diagnosis]:
    """Diagnose rows that are missing at random: each secondary radar lacks as many.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    names : sequence of str
        Names of the sensors.
    found : sequence of Diagnosis
        Of the other checks, which have other causes unless all are of missing rows.

    Returns
    -------
    list of Diagnosis
        These, and a warning for each other radar, since all may detect as few; none for radars at
        one site, which may share a transmitter.
    """
    if any(one.code != SPARSE_CODE for one in found):
        return [*found]
    radars = [
        one
        for one in comparison.numbers
        if comparison.is_radar(one) and _are_coded(comparison.plots(one))
    ]
    if all(comparison.apart_m(radars[0], one) < ONE_SITE_M for one in radars[1:]):
        return [*found]
    shares = []
    for one in radars:
        plots = comparison.plots(one)
        period_s = scan_period(plots, comparison.period_s(one))
        share = _detected(_followed(plots, *_successive(plots, period_s)))
        if share is None:
            return [*found]
        shares.append(share)
    if max(shares) > _FACTORS_APART * min(shares):
        return [*found]
    of = {one.sensor_id: one for one in found}
    others = [one for one in found if one.sensor_id not in {names[radar] for radar in radars}]
    return others + [
        of.get(names[one]) or _of_all(names[one], share)
        for one, share in zip(radars, shares, strict=True)
    ]


def _of_all(name: str, share: float) -> Diagnosis:
    return Diagnosis(
        name,
        SPARSE_CODE,
        f"{name}: its aircraft are detected only once in about {1.0 / share:.0f} scans, like those "
        f"of all radars ({share:.0%} of the scans): rows are probably missing from the recording "
        "(thinned or filtered); record every plot, unless the probability of detection is as low",
        "warning",
    )


# Plots by aircraft and time; for each of these but the first, the scans after the one before, and
# whether both are of one aircraft.
def _successive(plots: Plots, period_s: float) -> tuple[Integers, Floats, NDArray[np.bool_]]:
    aircraft = aircraft_of(plots)
    order = np.lexsort((plots.time_s, aircraft))
    order = order[aircraft[order] >= 0]
    of = aircraft[order]
    scans = np.diff(plots.time_s[order]) / period_s
    return order, scans, (of[1:] == of[:-1]) & (scans > _COPY_SCANS)


def _followed(
    plots: Plots, order: Integers, scans: Floats, seen: NDArray[np.bool_]
) -> _Followed:  # fmt: skip
    chosen = np.flatnonzero(seen & (scans <= _GAP_SCANS))
    later = order[chosen + 1]
    return _Followed(aircraft_of(plots)[later], np.round(scans[chosen]), plots.time_s[later])


def _are_coded(plots: Plots) -> bool:
    return bool(np.mean(plots.keys[:, 1:].max(axis=1) >= 0) >= 0.5)


def _shares(steps: Floats) -> Floats:
    return np.bincount(steps.astype(np.int64), minlength=3) / max(len(steps), 1)


def _are_regular(followed: _Followed) -> bool:
    shares = _shares(followed.scans)
    return bool(
        len(followed.scans) >= TESTED_MIN
        and shares[:2].sum() <= _NEXT_MAX
        and shares.max() >= _REGULAR_MIN
    )


# Whether a detection follows each missed one in the order of the antenna, as in every second row.
def _alternate(followed: _Followed, period_s: float) -> bool:
    steps = np.maximum(followed.scans, 1.0).astype(np.int64)
    if len(steps) < TESTED_MIN or steps.sum() < 1.5 * len(steps):
        return False
    before = np.concatenate([np.arange(one) for one in steps.tolist()])
    time_s = np.repeat(followed.time_s, steps) - before * period_s
    detected = (before == 0)[np.argsort(time_s, kind="stable")]
    return bool(np.mean(detected[1:] == detected[:-1]) <= _SAME_OUTCOME_MAX)


# The fraction of the scans in which aircraft are detected; None unless it is small for most.
def _detected(followed: _Followed) -> float | None:
    steps = followed.scans
    if len(steps) < TESTED_MIN or _shares(steps)[:2].sum() >= _NEXT_MIN:
        return None
    share = len(steps) / float(steps.sum())
    if share >= _DETECTED_MIN:
        return None
    _, number, counts = np.unique(followed.aircraft, return_inverse=True, return_counts=True)
    each = counts / np.bincount(number, steps)
    each = each[counts >= _GAPS_MIN]
    rare = np.count_nonzero(each < _DETECTED_EACH)
    return share if rare >= max(_AIRCRAFT_MIN, _AIRCRAFT_SHARE * len(each)) else None
