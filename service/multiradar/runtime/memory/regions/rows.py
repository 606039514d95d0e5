"""Rows of tracks of this region and of its neighbours."""

import numpy as np
from numpy.typing import NDArray

from multiradar.runtime.stream.region_marks import MARK_DTYPE, REFERENCE_OCTETS
from multiradar.tracking.outputs import STATE_TENTATIVE, TrackUpdates

_STATE = [
    ("track_id", np.int64),
    ("time_s", np.float64),
    ("latitude_rad", np.float64),
    ("longitude_rad", np.float64),
    ("east_mps", np.float64),
    ("north_mps", np.float64),
    # Variances of the position, east, east and north, north, m²; of the velocity, m²/s².
    ("position_m2", np.float64, (3,)),
    ("velocity_m2ps2", np.float64),
    ("height_m", np.float64),
    ("mode_s_address", np.int64),
    ("mode_3a", np.int32),
    ("tentative", np.bool_),
    ("responsible", np.bool_),
    ("since_s", np.float64),
    ("aircraft", f"S{REFERENCE_OCTETS}"),
]
#: A track of this region: its state, whether the region is responsible for it, and since when; the
#: name of the aircraft in all regions, empty for that of the track itself; the responsible track of
#: a neighbour; its first time.
OWN_DTYPE = np.dtype([*_STATE, ("duplicate_of", f"S{REFERENCE_OCTETS}"), ("first_s", np.float64)])
#: A track of a neighbour, with the matching own one; 0 for none.
OTHER_DTYPE = np.dtype([*_STATE, ("own_id", np.int64)])


def own_rows(updates: TrackUpdates, chosen: NDArray[np.intp]) -> NDArray[np.void]:
    """Return track updates as rows of `OWN_DTYPE`, responsible for nothing."""
    rows = np.zeros(len(chosen), OWN_DTYPE)
    for name in ("track_id", "time_s", "latitude_rad", "longitude_rad", "height_m",
                 "mode_s_address", "mode_3a"):  # fmt: skip
        rows[name] = getattr(updates, name)[chosen]
    speed, heading = updates.speed_mps[chosen], updates.heading_rad[chosen]
    rows["east_mps"], rows["north_mps"] = speed * np.sin(heading), speed * np.cos(heading)
    axis_m2 = updates.position_sigma_m[chosen] ** 2 / 2.0
    rows["position_m2"][:, 0] = rows["position_m2"][:, 2] = axis_m2
    rows["velocity_m2ps2"] = updates.velocity_sigma_mps[chosen] ** 2 / 2.0
    rows["first_s"] = rows["time_s"]
    rows["tentative"] = updates.state[chosen] == STATE_TENTATIVE
    return rows


def marks_of(rows: NDArray[np.void]) -> NDArray[np.void]:
    """Return what subscribers get of rows of `OWN_DTYPE`."""
    marks = np.zeros(len(rows), MARK_DTYPE)
    marks["responsible"], marks["duplicate_of"] = rows["responsible"], rows["duplicate_of"]
    marks["continues"] = rows["aircraft"]
    return marks
