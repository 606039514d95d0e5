"""Selection of reports that are measurements of aircraft, and reasons for rejection."""

from collections import Counter

import numpy as np
import polars as pl

from multiradar_converters.asterix.decoding.bounds import (
    DAY_S,
    HEIGHT_MAX_M,
    HEIGHT_MIN_M,
    LATITUDE_MAX_DEG,
    LONGITUDE_MAX_DEG,
    SPEED_MAX_MPS,
)
from multiradar_converters.asterix.decoding.local_plane import local_only
from multiradar_converters.asterix.decoding.targets import FLAGS, NOT_AIRCRAFT, flag_bits
from multiradar_converters.asterix.decoding.timing import KINDS, Timed
from multiradar_converters.asterix.layout.columns import Flags, Numbers
from multiradar_schemas.reject import RejectCode

_RANGE_MAX_M = 1e6
_RADAR = KINDS.index("radar")

#: Reason, and what to do.
NO_REFERENCE_POINT = (
    "local coordinates only (item 042), whose reference point is unknown: specify it with "
    "--reference SAC-SIC=LATITUDE,LONGITUDE, or as latitude_deg and longitude_deg of the sensor in "
    "the sensors file"
)
IMPOSSIBLE_TIME = "a time of day of 24 h or more"
IMPOSSIBLE_POSITION = "an impossible position"
IMPOSSIBLE_HEIGHT = f"an impossible height: below {HEIGHT_MIN_M:g} m or above {HEIGHT_MAX_M:g} m"
IMPOSSIBLE_SPEED = f"an impossible speed: above {SPEED_MAX_MPS:g} m/s"

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
        (beyond, RejectCode.OUT_OF_RANGE, IMPOSSIBLE_TIME),
        (
            truncated,
            RejectCode.MISSING_FIELD,
            "time of day known only modulo 512 s (item 141), and the ambiguity cannot be "
            "resolved: no service message from the radar, no recorder time stamp, no time from "
            "another sensor",
        ),
        (
            left & radar,
            RejectCode.MISSING_FIELD,
            "no time, and none can be derived: neither the antenna position (north marker or "
            "sector, scan period) nor the time of reception is known",
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
    measured = has_position(timed) | local_only(targets)
    left_out, flags = Counter[str](), Counter[str]()
    left_out["no_position"] = int((~measured).sum())
    for name in () if all_targets else NOT_AIRCRAFT:
        marked = measured & (targets.flags & flag_bits(name) != 0)
        left_out[name] = int(marked.sum())
        measured &= ~marked
    for name in FLAGS:
        flags[name] = int((measured & (targets.flags & flag_bits(name) != 0)).sum())
    return measured, left_out, flags


def has_position(timed: Timed) -> Flags:
    """Return which reports have the position of their kind, bool[n]; not local coordinates."""
    targets, radar = timed.targets, timed.kind == _RADAR
    first = np.where(radar, targets.range_m, targets.latitude_deg)
    second = np.where(radar, targets.azimuth_deg, targets.longitude_deg)
    return np.asarray(~np.isnan(first + second), dtype=np.bool_)


def unreferenced(timed: Timed, measured: Flags) -> Rejection:
    """Return the measurements with local coordinates whose reference point is unknown."""
    return measured & local_only(timed.targets), RejectCode.MISSING_FIELD, NO_REFERENCE_POINT


def misplaced(timed: Timed, measured: Flags) -> Rejection:
    """Return the measurements with an impossible position.

    An impossible height is omitted from a measurement (see `table`): its position is as good.
    """
    targets = timed.targets
    near = (targets.range_m > 0.0) & (targets.range_m <= _RANGE_MAX_M)
    on_earth = _on_earth(targets.latitude_deg, targets.longitude_deg)
    possible = np.where(timed.kind == _RADAR, near, on_earth) | local_only(targets)
    return measured & ~possible, RejectCode.OUT_OF_RANGE, IMPOSSIBLE_POSITION


def impossible_tracks(tracks: pl.DataFrame) -> list[Rejection]:
    """Return the system tracks with impossible values; each is in one rejection at most.

    Parameters
    ----------
    tracks : DataFrame
        As from `read_system_tracks`.

    Returns
    -------
    list of (bool[n], RejectCode, str)
        The tracks of each reason. A value that is absent is possible.
    """
    values = {
        name: tracks[name].fill_null(np.nan).to_numpy()
        for name in ("time_s", "latitude_deg", "longitude_deg", "height_m", "speed_mps")
    }
    latitude, longitude = values["latitude_deg"], values["longitude_deg"]
    height_m = values["height_m"]
    absent = np.isnan(latitude) | np.isnan(longitude)
    found: list[Rejection] = []
    possible = np.ones(tracks.height, dtype=np.bool_)
    for wrong, reason in (
        (values["time_s"] >= DAY_S, IMPOSSIBLE_TIME),
        (~absent & ~_on_earth(latitude, longitude), IMPOSSIBLE_POSITION),
        ((height_m < HEIGHT_MIN_M) | (height_m > HEIGHT_MAX_M), IMPOSSIBLE_HEIGHT),
        (values["speed_mps"] > SPEED_MAX_MPS, IMPOSSIBLE_SPEED),
    ):
        found.append((possible & wrong, RejectCode.OUT_OF_RANGE, reason))
        possible &= ~wrong
    return found


def _on_earth(latitude_deg: Numbers, longitude_deg: Numbers) -> Flags:
    on_earth: Flags = (np.abs(latitude_deg) <= LATITUDE_MAX_DEG) & (
        np.abs(longitude_deg) <= LONGITUDE_MAX_DEG
    )
    return on_earth
