"""Encounters of live tracks: which are expected to come near each other, for whoever asks."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.live_tracks import ages_and_states
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.forecasts import points_inside
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
from multiradar.tracking.outputs import STATE_NAMES, STATE_TENTATIVE, TrackStates
from multiradar.tracking.settings import TrackingSettings

#: Forecasts are made at times so far apart, s; between them tracks follow cubics.
PIECE_S = 10.0
# Nowhere below sea level is a true metre longer than this on the plane.
_METRE_MAX = 1.001

Floats = NDArray[np.float64]


class Sky(NamedTuple):
    """The live tracks of one moment.

    Attributes
    ----------
    time_s : float
        The moment: data time.
    rows : (n,) ndarray of `UPDATE_DTYPE`
        The last update of each track, by ascending track.
    states : TrackStates
        The tracks as the filter has them.
    """

    time_s: float
    rows: NDArray[np.void]
    states: TrackStates


class _Chosen(NamedTuple):
    # The tracks that take part, those that do not counted.
    places: NDArray[np.intp]
    track_id: NDArray[np.int64]
    state: NDArray[np.int8]
    age_s: Floats
    tentative: int


class _Found(NamedTuple):
    # Encounters, a row each, before they are told.
    tracks: NDArray[np.int64]
    approaches: Approaches
    between: Floats
    within: Floats
    both: Floats

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_]) -> "_Found":
        return _Found(
            self.tracks[rows], self.approaches.select(rows), self.between[rows], self.within[rows],
            self.both[rows],
        )  # fmt: skip


def encounters(
    sky: Sky,
    query: EncounterQuery,
    plane: SystemPlane,
    settings: TrackingSettings,
    calibration: ForecastCalibration,
) -> dict[str, Any]:
    """Return the encounters that are expected among live tracks.

    Parameters
    ----------
    sky : Sky
        The tracks.
    query : EncounterQuery
        What is asked for.
    plane : SystemPlane
        The plane of the states.
    settings : TrackingSettings
        When tracks coast.
    calibration : ForecastCalibration
        What the run has taught of forecasts.

    Returns
    -------
    dict
        The fields of `multiradar_schemas.products.encounter.Encounters`.
    """
    # Tracks may have moved on since the data time was asked for.
    time_s = float(np.max(sky.states.time_s, initial=sky.time_s))
    chosen = _chosen(sky, time_s, settings)
    ahead_s = time_s - sky.states.time_s[chosen.places]
    times_s = np.append(np.arange(0.0, query.horizon_s, PIECE_S), query.horizon_s)
    paths = _paths(calibration, sky.states.at(chosen.places), ahead_s, times_s)
    paths = paths._replace(points=points_inside(plane, paths.means))
    pairs = near_pairs(paths, query.distance_m * _METRE_MAX)
    found, told = _selected(_found(paths, pairs, query, plane), query)
    return {
        **no_encounters(query),
        "time_s": time_s,
        "tracks": int(np.count_nonzero(paths.points >= 2)),
        "tracks_tentative": chosen.tentative,
        "tracks_off_plane": int(np.count_nonzero(paths.points < 2)),
        "pairs_left_out": pairs.left_out,
        "total": found,
        "count": len(told.tracks),
        "encounters": _told(told, chosen, time_s, plane, paths),
    }


def answer_encounters(known: Knowledge, **values: Any) -> dict[str, Any]:
    """Return the encounters that are expected among the live tracks.

    Parameters
    ----------
    known : Knowledge
        What the service knows.
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
    sky = Sky(now_s, rows, states)
    return encounters(sky, query, plane, known.tracking, known.calibration)


def no_encounters(query: EncounterQuery) -> dict[str, Any]:
    """Return the answer as long as there is no track."""
    counts = ("tracks", "tracks_tentative", "tracks_off_plane", "pairs_left_out", "total", "count")
    return {
        "time_s": None,
        "horizon_s": float(query.horizon_s),
        "distance_threshold_m": float(query.distance_m),
        "height_threshold_m": None if query.height_m is None else float(query.height_m),
        **dict.fromkeys(counts, 0),
        "encounters": [],
    }


def _chosen(sky: Sky, time_s: float, settings: TrackingSettings) -> _Chosen:
    # Tracks that both the filter and the readers know; a tentative one may be no aircraft.
    track_id, places, at = np.intersect1d(
        sky.states.track_id, sky.rows["track_id"], assume_unique=True, return_indices=True
    )
    age_s, state = ages_and_states(sky.rows[at], time_s, settings.coast_after_s)
    sure = state != STATE_TENTATIVE
    return _Chosen(
        places[sure], track_id[sure], state[sure], age_s[sure], int(np.count_nonzero(~sure))
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
    # Where they meet is found on the plane, how near they come there in true metres.
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
        # Written so that unknown heights stay.
        kept &= ~(least_heights(approaches, between, query.distance_m) > query.height_m)
    unknown = np.full(np.count_nonzero(kept), np.nan)
    return _Found(tracks[kept], approaches.select(kept), between[kept], unknown, unknown)


# How many there are, and those that are told.
def _selected(found: _Found, query: EncounterQuery) -> tuple[int, _Found]:
    # Chances cost most: where they decide nothing only those of who is told are asked for.
    decisive = query.order == BY_PROBABILITY or query.probability_min > 0.0
    if decisive:
        found = _with_chances(found, query)
        found = found.take(_probability(found) >= query.probability_min)
    ordered = found.take(_order(found, query)[: query.limit])
    return len(found.tracks), ordered if decisive else _with_chances(ordered, query)


def _with_chances(found: _Found, query: EncounterQuery) -> _Found:
    within, both = conflict_probabilities(
        found.approaches, found.between, query.distance_m, query.height_m
    )
    return found._replace(within=within, both=both)


def _probability(found: _Found) -> Floats:
    return np.where(np.isnan(found.both), found.within, found.both)


def _order(found: _Found, query: EncounterQuery) -> NDArray[np.intp]:
    second, first = found.tracks[:, 1], found.tracks[:, 0]
    keys: tuple[NDArray[Any], ...] = (second, first, found.approaches.time_s)
    if query.order == BY_PROBABILITY:
        keys = (*keys, -_probability(found))
    return np.lexsort(keys)


def _told(
    found: _Found, chosen: _Chosen, time_s: float, plane: SystemPlane, paths: Paths
) -> list[dict[str, Any]]:
    approaches = found.approaches
    low_m, high_m = bounds(approaches)
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
    for side, (name, places) in enumerate(sides):
        tracks = found.tracks[:, side]
        latitude_rad, longitude_rad = plane.to_geodetic(places[:, 0], places[:, 1])
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
