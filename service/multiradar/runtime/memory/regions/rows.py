"""Rows of tracks of this region and of its neighbours, and how far apart two of them are."""

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy.geodesic import EARTH_RADIUS_M
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

#: Uncertainty that the states do not contain: biases estimated from different radars, m and m/s.
POSITION_FLOOR_M, VELOCITY_FLOOR_MPS = 150.0, 15.0
#: Acceleration between the times of two states, m/s².
ACCELERATION_MPS2 = 3.0
#: Heights of one aircraft differ less: pressure altitude and geometric height.
HEIGHT_APART_MAX_M = 600.0
#: Gate of position and velocity, four degrees of freedom: exceeded by one pair in 1000.
GATE = 18.47
#: Gate of a pair that matches already, and distance to which an address decides, m.
GATE_HELD, ADDRESS_APART_MAX_M = 100.0, 10_000.0


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


def match(own: NDArray[np.void], others: NDArray[np.void]) -> None:
    """Match the tracks of a neighbour with own ones, one with one; sets `own_id`.

    Pairs that match already come first, then equal Mode S addresses, then the pairs that are
    nearest by position and velocity, within the gate.

    Parameters
    ----------
    own : (n,) ndarray of `OWN_DTYPE`
        Own tracks, by ascending identifier.
    others : (m,) ndarray of `OTHER_DTYPE`
        Tracks of one neighbour; changed.
    """
    held, others["own_id"] = others["own_id"].copy(), 0
    if not len(own) or not len(others):
        return
    distance, apart_m = _distances(own, others)
    address = others["mode_s_address"][:, np.newaxis]
    known = (address >= 0) & (own["mode_s_address"] >= 0)
    same = known & (address == own["mode_s_address"]) & (apart_m <= ADDRESS_APART_MAX_M)
    before = held[:, np.newaxis] == own["track_id"]
    differ = known & (address != own["mode_s_address"])
    code = others["mode_3a"][:, np.newaxis]
    other_code = (code >= 0) & (own["mode_3a"] >= 0) & (code != own["mode_3a"])
    near = (distance <= GATE) & ~differ & ~other_code
    near |= before & (distance <= GATE_HELD) & ~differ
    # In order of rank, then of distance, then of number.
    rank = np.where(before & (near | same), 0, np.where(same, 1, 2))
    rows, columns = np.nonzero(near | same)
    order = np.lexsort((columns, rows, distance[rows, columns], rank[rows, columns]))
    taken: set[int] = set()
    for row, column in zip(rows[order].tolist(), columns[order].tolist(), strict=True):
        if not others["own_id"][row] and column not in taken:
            others["own_id"][row] = own["track_id"][column]
            taken.add(column)


def _distances(
    own: NDArray[np.void], others: NDArray[np.void]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    # Squared statistical distance, and distance in m, (m, n): at the later of both times.
    other = others[:, np.newaxis]
    ahead_s = own["time_s"] - other["time_s"]
    apart_s = np.abs(ahead_s)
    level = np.cos(other["latitude_rad"])
    turn = (own["longitude_rad"] - other["longitude_rad"] + np.pi) % (2.0 * np.pi) - np.pi
    moving = {
        name: np.where(ahead_s > 0.0, other[name], own[name]) for name in ("east_mps", "north_mps")
    }
    east_m = EARTH_RADIUS_M * level * turn - ahead_s * moving["east_mps"]
    north_m = EARTH_RADIUS_M * (own["latitude_rad"] - other["latitude_rad"])
    north_m = north_m - ahead_s * moving["north_mps"]
    grown_m2 = POSITION_FLOOR_M**2 + (0.5 * ACCELERATION_MPS2 * apart_s**2) ** 2
    velocity_m2ps2 = own["velocity_m2ps2"] + other["velocity_m2ps2"]
    grown_m2 = grown_m2 + velocity_m2ps2 * apart_s**2
    both = own["position_m2"] + other["position_m2"]
    ee, en, nn = both[..., 0] + grown_m2, both[..., 1], both[..., 2] + grown_m2
    position = (nn * east_m**2 - 2.0 * en * east_m * north_m + ee * north_m**2) / (ee * nn - en**2)
    grown = VELOCITY_FLOOR_MPS**2 + (ACCELERATION_MPS2 * apart_s) ** 2
    speed2 = (own["east_mps"] - other["east_mps"]) ** 2
    speed2 = speed2 + (own["north_mps"] - other["north_mps"]) ** 2
    distance = position + speed2 / (velocity_m2ps2 + grown)
    apart = np.abs(own["height_m"] - other["height_m"]) > HEIGHT_APART_MAX_M
    return np.where(apart, np.inf, distance), np.hypot(east_m, north_m)
