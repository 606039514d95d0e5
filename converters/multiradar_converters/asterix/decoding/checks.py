"""Selection of reports that are measurements of aircraft, and reasons for rejection."""

from collections import Counter

import numpy as np

from multiradar_converters.asterix.decoding.targets import FLAGS, NOT_AIRCRAFT, flag_bits
from multiradar_converters.asterix.decoding.timing import KINDS, Timed
from multiradar_converters.asterix.layout.columns import Flags
from multiradar_schemas.measurements.reject import RejectCode

_RANGE_MAX_M = 1e6
_RADAR = KINDS.index("radar")

#: Reports, and the code and reason of their rejection.
Rejection = tuple[Flags, RejectCode, str]


def untimed(timed: Timed) -> list[Rejection]:
    """Return the reasons why reports have no time.

    Parameters
    ----------
    timed : Timed
        Reports; those with time NaN are classified.

    Returns
    -------
    list of (bool[n], RejectCode, str)
        Each of them is in exactly one.
    """
    open_rows = np.isnan(timed.targets.time_s)
    beyond = open_rows & ~np.isnan(timed.reported_s)
    truncated = open_rows & ~beyond & ~np.isnan(timed.targets.truncated_s)
    left = open_rows & ~beyond & ~truncated
    radar = timed.kind == _RADAR
    return [
        (beyond, RejectCode.OUT_OF_RANGE, "a time of day of 24 h or more"),
        (
            truncated,
            RejectCode.MISSING_FIELD,
            "only the time modulo 512 s (item 141), and nothing to resolve it: no service "
            "message of the radar, no recorder's clock, no time of another sensor",
        ),
        (
            left & radar,
            RejectCode.MISSING_FIELD,
            "no time; and neither the antenna passage (north mark or sector, scan period) nor the "
            "time of reception is known",
        ),
        (
            left & ~radar,
            RejectCode.MISSING_FIELD,
            "no time, and the time of reception is unknown",
        ),
    ]


def aircraft(timed: Timed, *, all_targets: bool) -> tuple[Flags, Counter[str], Counter[str]]:
    """Select the reports that are measurements of aircraft.

    Parameters
    ----------
    timed : Timed
        The reports.
    all_targets : bool
        Whether to include test targets and the like.

    Returns
    -------
    measured : bool[n]
        Whether each is selected.
    left_out : Counter
        Counts of the others, by kind.
    flags : Counter
        Counts of selected reports, by flag.
    """
    targets = timed.targets
    radar = timed.kind == _RADAR
    first = np.where(radar, targets.range_m, targets.latitude_deg)
    second = np.where(radar, targets.azimuth_deg, targets.longitude_deg)
    measured = np.asarray(~np.isnan(first + second), dtype=np.bool_)
    left_out, flags = Counter[str](), Counter[str]()
    left_out["no_position"] = int((~measured).sum())
    for name in () if all_targets else NOT_AIRCRAFT:
        marked = measured & (targets.flags & flag_bits(name) != 0)
        left_out[name] = int(marked.sum())
        measured &= ~marked
    for name in FLAGS:
        flags[name] = int((measured & (targets.flags & flag_bits(name) != 0)).sum())
    return measured, left_out, flags


def misplaced(timed: Timed, measured: Flags) -> Rejection:
    """Return the measurements with an impossible position."""
    targets = timed.targets
    near = (targets.range_m > 0.0) & (targets.range_m <= _RANGE_MAX_M)
    on_earth = (np.abs(targets.latitude_deg) <= 90.0) & (np.abs(targets.longitude_deg) <= 180.0)
    possible = np.where(timed.kind == _RADAR, near, on_earth)
    return measured & ~possible, RejectCode.OUT_OF_RANGE, "an impossible position"
