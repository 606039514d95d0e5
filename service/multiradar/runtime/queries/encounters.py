"""Encounters of live tracks: pairs predicted to come close to each other."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.memory.live_tracks import ages_and_states
from multiradar.runtime.queries.deadline import check_deadline
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.forecasts import points_inside
from multiradar.runtime.queries.moment import Moment
from multiradar.runtime.queries.parameters import BY_PROBABILITY
from multiradar.tracking.encounters.approaches import (
    Approaches,
    bounds,
    closest_approaches,
    conflict_probabilities,
    height_at,
    heights_between,
    least_heights,
)
from multiradar.tracking.encounters.calibrated_paths import calibrated_paths
from multiradar.tracking.encounters.climbs import (
    CLIMB_COUNT,
    CLIMB_HEIGHT,
    CLIMB_RATE,
    moved_climbs,
)
from multiradar.tracking.encounters.pairs import Pairs, Paths, near_pairs
from multiradar.tracking.forecast.forecast_calibration import ForecastCalibration
from multiradar.tracking.outputs import ON_GROUND, STATE_NAMES, STATE_TENTATIVE, TrackStates
from multiradar.tracking.settings import TrackingSettings

#: Interval of forecast times, s; paths between them are cubic.
PIECE_S = 10.0
# Pairs whose probabilities are computed between two checks of the deadline: some 10 ms.
_PAIRS_AT_ONCE = 200
# Upper bound of the scale of the plane at and above sea level.
_METRE_MAX = 1.001

Floats = NDArray[np.float64]


class TrackSnapshot(NamedTuple):
    """The live tracks at one time.

    Attributes
    ----------
    time_s : float
        Data time.
    rows : (n,) ndarray of `UPDATE_DTYPE`
        The last update of each track, by ascending track.
    states : TrackStates
        The filter states of the tracks.
    """

    time_s: float
    rows: NDArray[np.void]
    states: TrackStates


class _Chosen(NamedTuple):
    # The tracks included, and the number of tentative ones.
    rows: NDArray[np.intp]
    track_id: NDArray[np.int64]
    state: NDArray[np.int8]
    age_s: Floats
    tentative: int


class _Found(NamedTuple):
    # Encounters, one row each.
    tracks: NDArray[np.int64]
    approaches: Approaches
    between: Floats
    within: Floats
    both: Floats

    def select(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> "_Found":
        return _Found(
            self.tracks[rows], self.approaches.select(rows), self.between[rows], self.within[rows],
            self.both[rows],
        )  # fmt: skip


def encounters(
    snapshot: TrackSnapshot,
    query: EncounterQuery,
    plane: SystemPlane,
    settings: TrackingSettings,
    calibration: ForecastCalibration,
) -> dict[str, Any]:
    """Return the encounters predicted among live tracks.

    Parameters
    ----------
    snapshot : TrackSnapshot
        The tracks.
    query : EncounterQuery
        Selection of encounters.
    plane : SystemPlane
        The plane of the states.
    settings : TrackingSettings
        When tracks coast.
    calibration : ForecastCalibration
        Calibration of forecasts.

    Returns
    -------
    dict
        The fields of `multiradar_schemas.products.encounter.Encounters`.
    """
    # Track states may be newer than the data time of the snapshot.
    time_s = float(np.max(snapshot.states.time_s, initial=snapshot.time_s))
    chosen = _chosen(snapshot, time_s, settings)
    ahead_s = time_s - snapshot.states.time_s[chosen.rows]
    times_s = np.append(np.arange(0.0, query.horizon_s, PIECE_S), query.horizon_s)
    paths = _paths(calibration, snapshot.states.at(chosen.rows), ahead_s, times_s)
    paths = paths._replace(points=points_inside(plane, paths.means))
    pairs = near_pairs(paths, query.distance_m * _METRE_MAX)
    found, reported = _selected(_found(paths, pairs, query, plane), query)
    return {
        **no_encounters(query),
        "time_s": time_s,
        "tracks": int(np.count_nonzero(paths.points >= 2)),
        "tracks_tentative": chosen.tentative,
        "tracks_off_plane": int(np.count_nonzero(paths.points < 2)),
        "pairs_left_out": pairs.left_out,
        "total": found,
        "count": len(reported.tracks),
        "encounters": _documents(reported, chosen, time_s, plane, paths),
    }


def answer_encounters(known: Moment, **values: Any) -> dict[str, Any]:
    """Return the encounters predicted among the live tracks.

    Parameters
    ----------
    known : Moment
        The data.
    **values
        The fields of `EncounterQuery`.

    Returns
    -------
    dict
        The fields of `Encounters` of the schemas.
    """
    query, now = EncounterQuery(**values), known.states()
    rows, now_s = known.live_rows()
    if now is None or now_s is None:
        return no_encounters(query)
    states, plane = now
    snapshot = TrackSnapshot(now_s, rows, states)
    return encounters(snapshot, query, plane, known.tracking, known.calibration)


def no_encounters(query: EncounterQuery) -> dict[str, Any]:
    """Return the answer without tracks."""
    counts = ("tracks", "tracks_tentative", "tracks_off_plane", "pairs_left_out", "total", "count")
    return {
        "time_s": None,
        "horizon_s": float(query.horizon_s),
        "distance_threshold_m": float(query.distance_m),
        "height_threshold_m": None if query.height_m is None else float(query.height_m),
        **dict.fromkeys(counts, 0),
        "encounters": [],
    }


def _chosen(snapshot: TrackSnapshot, time_s: float, settings: TrackingSettings) -> _Chosen:
    # Tracks present in both states and updates; a tentative track may be false. Aircraft on the
    # ground are not separated by radar.
    track_id, rows, at = np.intersect1d(
        snapshot.states.track_id, snapshot.rows["track_id"], assume_unique=True, return_indices=True
    )
    age_s, state = ages_and_states(snapshot.rows[at], time_s, settings.coast_after_s)
    tentative = state == STATE_TENTATIVE
    sure = ~tentative & (snapshot.rows["on_ground"][at] != ON_GROUND)
    return _Chosen(
        rows[sure], track_id[sure], state[sure], age_s[sure], int(np.count_nonzero(tentative))
    )


def _paths(
    calibration: ForecastCalibration, states: TrackStates, ahead_s: Floats, times_s: Floats
) -> Paths:
    courses = calibrated_paths(calibration, states, ahead_s, times_s)
    shared = np.zeros((len(states), 4, 0))
    if states.shared is not None:
        shared = states.shared.copy()
        shared[:, :2] += ahead_s[:, None, None] * shared[:, 2:]
    return Paths(
        times_s,
        courses.means,
        courses.now,
        courses.velocity_spreads,
        np.full(len(states), len(times_s)),
        _heights(states, ahead_s),
        shared,
    )


def _heights(states: TrackStates, ahead_s: Floats) -> Floats:
    if states.climbs is None:
        return np.full((len(states), CLIMB_COUNT), np.nan)
    return moved_climbs(states.climbs, ahead_s)


def _found(paths: Paths, pairs: Pairs, query: EncounterQuery, plane: SystemPlane) -> _Found:
    tracks = pairs.tracks
    # The position of closest approach is found on the plane, the distance there in true metres.
    flat = closest_approaches(
        paths, tracks, np.tile(np.eye(2), (len(tracks), 1, 1)), query.distance_m
    )
    middle = 0.5 * (flat.first + flat.second)
    height_m = np.nan_to_num(np.fmax(*paths.heights[tracks, CLIMB_HEIGHT].T))
    matrices = plane.local_matrix(middle[:, 0], middle[:, 1], height_m)
    approaches = closest_approaches(paths, tracks, matrices, query.distance_m)
    between = heights_between(paths, tracks)
    kept = approaches.distance_m <= query.distance_m
    if query.height_m is not None:
        # Written so that unknown heights (NaN) are kept.
        kept &= ~(least_heights(approaches, between, query.distance_m) > query.height_m)
    unknown = np.full(np.count_nonzero(kept), np.nan)
    return _Found(tracks[kept], approaches.select(kept), between[kept], unknown, unknown)


# The number of encounters, and those reported.
def _selected(found: _Found, query: EncounterQuery) -> tuple[int, _Found]:
    # Probabilities are expensive: unless they select or sort, only reported pairs need them.
    decisive = query.order == BY_PROBABILITY or query.probability_min > 0.0
    if decisive:
        found = _with_probabilities(found, query)
        found = found.select(_probability(found) >= query.probability_min)
    ordered = found.select(_order(found, query)[: query.limit])
    return len(found.tracks), ordered if decisive else _with_probabilities(ordered, query)


def _with_probabilities(found: _Found, query: EncounterQuery) -> _Found:
    within, both = np.empty(len(found.tracks)), np.empty(len(found.tracks))
    for part in _parts(len(found.tracks)):
        within[part], both[part] = conflict_probabilities(
            found.approaches.select(part), found.between[part], query.distance_m, query.height_m
        )
    return found._replace(within=within, both=both)


def _parts(count: int) -> Iterator[NDArray[np.intp]]:
    # Without pairs one empty part: warming up compiles what it calls.
    for first in range(0, max(count, 1), _PAIRS_AT_ONCE):
        check_deadline()
        yield np.arange(first, min(first + _PAIRS_AT_ONCE, count))


def _bounds(approaches: Approaches) -> tuple[Floats, Floats]:
    low_m, high_m = np.empty(len(approaches.time_s)), np.empty(len(approaches.time_s))
    for part in _parts(len(low_m)):
        low_m[part], high_m[part] = bounds(approaches.select(part))
    return low_m, high_m


def _probability(found: _Found) -> Floats:
    return np.where(np.isnan(found.both), found.within, found.both)


def _order(found: _Found, query: EncounterQuery) -> NDArray[np.intp]:
    second, first = found.tracks[:, 1], found.tracks[:, 0]
    keys: tuple[NDArray[Any], ...] = (second, first, found.approaches.time_s)
    if query.order == BY_PROBABILITY:
        # In a dense sky thousands are as probable: those of known height, and the nearest, first.
        unknown, percent = np.isnan(found.both), np.ceil(100.0 * _probability(found))
        keys = (second, first, found.approaches.distance_m, found.approaches.time_s)
        keys = (*keys, unknown, -percent)
    return np.lexsort(keys)


def _documents(
    found: _Found, chosen: _Chosen, time_s: float, plane: SystemPlane, paths: Paths
) -> list[dict[str, Any]]:
    approaches = found.approaches
    low_m, high_m = _bounds(approaches)
    vertical_m, vertical_sigma_m = height_at(found.between, approaches.time_s)
    columns = {
        "closest_time_s": time_s + approaches.time_s,
        "time_to_closest_s": approaches.time_s,
        "time_sigma_s": approaches.time_sigma_s,
        "distance_m": approaches.distance_m,
        "distance_sigma_m": approaches.sigma_m,
        "distance_low_m": low_m,
        "distance_high_m": high_m,
        "distance_now_m": approaches.distance_now_m,
        "together": approaches.together,
        "probability": found.within,
        "vertical_separation_m": np.abs(vertical_m),
        "vertical_sigma_m": vertical_sigma_m,
        "probability_both": found.both,
    }
    sides = (("first", approaches.first), ("second", approaches.second))
    for side, (name, positions) in enumerate(sides):
        tracks = found.tracks[:, side]
        latitude_rad, longitude_rad = plane.to_geodetic(positions[:, 0], positions[:, 1])
        heights = paths.heights[tracks]
        columns |= {
            f"{name}_track_id": chosen.track_id[tracks],
            f"{name}_state": np.array(STATE_NAMES)[chosen.state[tracks]],
            f"{name}_age_s": chosen.age_s[tracks],
            f"{name}_latitude_deg": np.degrees(latitude_rad),
            f"{name}_longitude_deg": np.degrees(longitude_rad),
            f"{name}_height_m": heights[:, CLIMB_HEIGHT]
            + heights[:, CLIMB_RATE] * approaches.time_s,
        }
    lists = {name: column.tolist() for name, column in columns.items()}
    return [
        {"time_s": time_s, **{name: _known(value) for name, value in zip(lists, row, strict=True)}}
        for row in zip(*lists.values(), strict=True)
    ]


def _known(value: Any) -> Any:
    return None if isinstance(value, float) and np.isnan(value) else value
