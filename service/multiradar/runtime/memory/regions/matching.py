"""Tracks of a neighbour that are the same aircraft as own ones."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy.geodesic import EARTH_RADIUS_M

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

#: Pairs that may match are compared, so many at once.
PAIRS_AT_ONCE = 50_000
#: Own tracks of about the same age and uncertainty have a common window: classes of both, s and m.
_AGE_S, _UNCERTAIN_M = 4.0, 250.0
#: The uncertainty of the velocity counts with this time in the classes, s.
_AHEAD_S = 10.0
#: Rounding of a window, rad.
_ROUNDING_RAD = 1e-9

#: Numbers of tracks: of a neighbour, and of this region.
_Pairs = tuple[NDArray[np.intp], NDArray[np.intp]]


class _Matches(NamedTuple):
    # Pairs that match, with the order in which they are used.
    row: NDArray[np.intp]
    column: NDArray[np.intp]
    distance: NDArray[np.float64]
    rank: NDArray[np.int64]


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
    parts = [
        _matches(own, others, held, rows, columns)
        for rows, columns in _together(candidates(own, others, held))
    ]
    found = _Matches(*(np.concatenate(column) for column in zip(*parts, strict=True)))
    # In order of rank, then of distance, then of number. A pair may be in several parts.
    order = np.lexsort((found.column, found.row, found.distance, found.rank))
    taken: set[int] = set()
    pairs = zip(found.row[order].tolist(), found.column[order].tolist(), strict=True)
    for row, column in pairs:
        if not others["own_id"][row] and column not in taken:
            others["own_id"][row] = own["track_id"][column]
            taken.add(column)


def _matches(
    own: NDArray[np.void], others: NDArray[np.void], held: NDArray[np.int64],
    rows: NDArray[np.intp], columns: NDArray[np.intp],
) -> _Matches:  # fmt: skip
    distance, apart_m = _distances(own[columns], others[rows])
    ours, theirs = own["mode_s_address"][columns], others["mode_s_address"][rows]
    known = (ours >= 0) & (theirs >= 0)
    same = known & (ours == theirs) & (apart_m <= ADDRESS_APART_MAX_M)
    before = held[rows] == own["track_id"][columns]
    differ = known & (ours != theirs)
    our_code, code = own["mode_3a"][columns], others["mode_3a"][rows]
    other_code = (code >= 0) & (our_code >= 0) & (code != our_code)
    near = (distance <= GATE) & ~differ & ~other_code
    near |= before & (distance <= GATE_HELD) & ~differ
    rank = np.where(before & (near | same), 0, np.where(same, 1, 2))
    kept = near | same
    return _Matches(rows[kept], columns[kept], distance[kept], rank[kept])


def candidates(
    own: NDArray[np.void], others: NDArray[np.void], held: NDArray[np.int64]
) -> Iterator[_Pairs]:
    """Yield pairs, of which those that match are a part, some more than once.

    Parameters
    ----------
    own : (n,) ndarray of `OWN_DTYPE`
        Own tracks, by ascending identifier.
    others : (m,) ndarray of `OTHER_DTYPE`
        Tracks of one neighbour.
    held : (m,) int64
        Identifiers of the own tracks with which they match already; 0 for none.

    Yields
    ------
    rows, columns : (k,) intp
        Places in `others` and in `own`.
    """
    yield from _equal(own["track_id"], np.arange(len(own)), held)
    by_address = np.argsort(own["mode_s_address"], kind="stable")
    yield from _equal(own["mode_s_address"][by_address], by_address, others["mode_s_address"])
    level = np.cos(others["latitude_rad"])
    for group in _groups(own):
        latitude_rad = own["latitude_rad"][group]
        north_rad = _window_rad(own[group], others, "north_mps", 2)
        first = np.searchsorted(latitude_rad, others["latitude_rad"] - north_rad, side="left")
        end = np.searchsorted(latitude_rad, others["latitude_rad"] + north_rad, side="right")
        east_rad = _window_rad(own[group], others, "east_mps", 0)
        for rows, columns in _expanded(group, first, end):
            turn = _turn(own["longitude_rad"][columns], others["longitude_rad"][rows])
            near = level[rows] * np.abs(turn) <= east_rad[rows]
            yield rows[near], columns[near]


# Some pairs at once, instead of few or many.
def _together(parts: Iterator[_Pairs]) -> Iterator[_Pairs]:
    waiting, count = list[_Pairs](), 0
    for part in parts:
        waiting.append(part)
        count += len(part[0])
        if count >= PAIRS_AT_ONCE:
            yield _joined(waiting)
            waiting, count = [], 0
    if waiting:
        yield _joined(waiting)


def _joined(parts: list[_Pairs]) -> _Pairs:
    return np.concatenate([one[0] for one in parts]), np.concatenate([one[1] for one in parts])


# Own tracks with a value of other ones, if it is known.
def _equal(
    values: NDArray[np.int64], numbers: NDArray[np.intp], wanted: NDArray[np.int64]
) -> Iterator[_Pairs]:
    first = np.searchsorted(values, wanted, side="left")
    end = np.where(wanted >= 0, np.searchsorted(values, wanted, side="right"), first)
    yield from _expanded(numbers, first, end)


# Pairs of each other track with the own ones from `first` to before `end`, some at once.
def _expanded(
    numbers: NDArray[np.intp], first: NDArray[np.intp], end: NDArray[np.intp]
) -> Iterator[_Pairs]:
    counts = end - first
    ends = np.cumsum(counts)
    cuts = np.flatnonzero(np.diff(ends // PAIRS_AT_ONCE)) + 1
    for rows in np.split(np.arange(len(first)), cuts):
        many = counts[rows]
        within = np.arange(many.sum()) - np.repeat(np.cumsum(many) - many, many)
        yield np.repeat(rows, many), numbers[np.repeat(first[rows], many) + within]


# Own tracks by classes of age and uncertainty, each by ascending latitude. A track that is not
# finite is near to no other.
def _groups(own: NDArray[np.void]) -> list[NDArray[np.intp]]:
    size2 = own["position_m2"].max(axis=1) + own["velocity_m2ps2"] * _AHEAD_S**2
    names = ("time_s", "latitude_rad", "longitude_rad", "east_mps", "north_mps")
    usable = np.flatnonzero(np.isfinite(sum((own[name] for name in names), size2)))
    if not len(usable):
        return []
    age_s = own["time_s"][usable].max() - own["time_s"][usable]
    classes = np.stack([age_s / _AGE_S, np.sqrt(size2[usable]) / _UNCERTAIN_M])
    key = np.floor(np.log2(1.0 + classes))
    order = np.lexsort((own["latitude_rad"][usable], key[1], key[0]))
    cuts = np.flatnonzero(np.diff(key[:, order]).any(axis=0)) + 1
    return np.split(usable[order], cuts)


# How far a pair within the gate is apart at most, as an angle, (m,): by the part of `_distances`
# towards north or east. `place` is that of the variance.
def _window_rad(
    group: NDArray[np.void], others: NDArray[np.void], velocity: str, place: int
) -> NDArray[np.float64]:
    time_s = others["time_s"]
    with np.errstate(over="ignore", invalid="ignore"):
        apart_s = np.maximum(
            np.abs(time_s - group["time_s"].min()), np.abs(time_s - group["time_s"].max())
        )
        speed_mps = np.maximum(np.abs(others[velocity]), np.abs(group[velocity]).max())
        velocity_m2ps2 = others["velocity_m2ps2"] + group["velocity_m2ps2"].max()
        variance_m2 = others["position_m2"][:, place] + group["position_m2"][:, place].max()
        variance_m2 = variance_m2 + _grown_m2(apart_s, velocity_m2ps2)
        apart_m = np.sqrt(GATE * variance_m2) + apart_s * speed_mps
    apart_rad = np.asarray(apart_m / EARTH_RADIUS_M + _ROUNDING_RAD)
    return np.where(np.isnan(apart_rad), np.inf, apart_rad)


def _grown_m2(
    apart_s: NDArray[np.float64], velocity_m2ps2: NDArray[np.float64]
) -> NDArray[np.float64]:
    grown_m2 = POSITION_FLOOR_M**2 + (0.5 * ACCELERATION_MPS2 * apart_s**2) ** 2
    return np.asarray(grown_m2 + velocity_m2ps2 * apart_s**2)


def _turn(
    longitude_rad: NDArray[np.float64], other_rad: NDArray[np.float64]
) -> NDArray[np.float64]:
    return np.asarray((longitude_rad - other_rad + np.pi) % (2.0 * np.pi) - np.pi)


# Squared statistical distance, and distance in m, of each pair, (k,): at the later of both times.
def _distances(
    own: NDArray[np.void], other: NDArray[np.void]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    ahead_s = own["time_s"] - other["time_s"]
    apart_s = np.abs(ahead_s)
    level = np.cos(other["latitude_rad"])
    turn = _turn(own["longitude_rad"], other["longitude_rad"])
    moving = {
        name: np.where(ahead_s > 0.0, other[name], own[name]) for name in ("east_mps", "north_mps")
    }
    east_m = EARTH_RADIUS_M * level * turn - ahead_s * moving["east_mps"]
    north_m = EARTH_RADIUS_M * (own["latitude_rad"] - other["latitude_rad"])
    north_m = north_m - ahead_s * moving["north_mps"]
    velocity_m2ps2 = own["velocity_m2ps2"] + other["velocity_m2ps2"]
    grown_m2 = _grown_m2(apart_s, velocity_m2ps2)
    both = own["position_m2"] + other["position_m2"]
    ee, en, nn = both[..., 0] + grown_m2, both[..., 1], both[..., 2] + grown_m2
    position = (nn * east_m**2 - 2.0 * en * east_m * north_m + ee * north_m**2) / (ee * nn - en**2)
    grown = VELOCITY_FLOOR_MPS**2 + (ACCELERATION_MPS2 * apart_s) ** 2
    speed2 = (own["east_mps"] - other["east_mps"]) ** 2
    speed2 = speed2 + (own["north_mps"] - other["north_mps"]) ** 2
    distance = position + speed2 / (velocity_m2ps2 + grown)
    apart = np.abs(own["height_m"] - other["height_m"]) > HEIGHT_APART_MAX_M
    return np.where(apart, np.inf, distance), np.hypot(east_m, north_m)
