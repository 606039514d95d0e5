"""Scenarios of a few aircraft and tracks on a plane, for the scorecard."""

from collections.abc import Mapping, Sequence

import numpy as np

from multiradar.evaluation.trajectories import Reference, Tracks
from multiradar.geodesy.system_plane import SystemPlane

PLANE = SystemPlane(0.8, 0.1)

#: Time, east, north, east and north velocity of an object.
Row = tuple[float, float, float, float, float]


def straight(
    times: Sequence[float], east_m: float, north_m: float, east_mps: float, north_mps: float
) -> list[Row]:
    """Return the rows of a straight flight with a given position at time 0."""
    return [(t, east_m + east_mps * t, north_m + north_mps * t, east_mps, north_mps) for t in times]


def reference_of(
    aircraft: Mapping[str, Sequence[Row]], *, velocities: bool = True, gap_s: float = 15.0
) -> Reference:
    """Return a reference of named aircraft, all at 9000 m."""
    names = sorted(aircraft)
    rows = [(number, *row) for number, name in enumerate(names) for row in aircraft[name]]
    table = np.array(rows, np.float64).reshape(-1, 6)
    return Reference(
        plane=PLANE,
        names=np.array(names, np.str_),
        aircraft=table[:, 0].astype(np.int64),
        time_s=table[:, 1],
        position_m=table[:, 2:4],
        velocity_mps=table[:, 4:6] if velocities else None,
        height_m=np.full(len(table), 9000.0),
        gap_s=gap_s,
    )


def tracks_of(
    tracks: Mapping[int, Sequence[Row]],
    *,
    sigma_m: float = 50.0,
    sigma_mps: float = 5.0,
    sensor_id: str = "radar",
) -> Tracks:
    """Return tracks of whole numbers, all at 9000 m, every update measured."""
    ids = sorted(tracks)
    rows = [(number, *row) for number, one in enumerate(ids) for row in tracks[one]]
    table = np.array(rows, np.float64).reshape(-1, 6)
    count = len(table)
    return Tracks(
        ids=np.array(ids, np.int64),
        track=table[:, 0].astype(np.int64),
        time_s=table[:, 1],
        position_m=table[:, 2:4],
        velocity_mps=table[:, 4:6],
        ground_mps=table[:, 4:6],
        height_m=np.full(count, 9000.0),
        climb_mps=np.zeros(count),
        position_sigma_m=np.full(count, sigma_m),
        velocity_sigma_mps=np.full(count, sigma_mps),
        measured=np.ones(count, np.bool_),
        sensor_id=np.full(count, sensor_id),
        initiated=len(ids),
        confirmed=len(ids),
    )
