"""How far each update of a track is from its aircraft: position, velocity, heading, height."""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.instants import Instants
from multiradar.evaluation.measures.identity import Identity
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.trajectories import (
    Floats,
    Indices,
    Reference,
    Tracks,
    climb_at,
    places_at,
)

#: An aircraft that is slower has no course to speak of, m/s.
COURSE_SPEED_MIN_MPS = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class UpdateErrors:
    """Errors (track minus reference) of the updates that have an aircraft.

    Attributes
    ----------
    update : (n,) int64
        Row of `Tracks`.
    aircraft : (n,) int64
        Index into the names of the reference.
    time_s : (n,) float64
        Time of the update.
    position_m, velocity_mps : (n,) float64
        Lengths of the error vectors, true metres.
    along_m, across_m : (n,) float64
        Components of the position error along the course of the reference and to the right of it;
        NaN where the aircraft hardly moves.
    speed_mps, heading_deg, height_m, climb_mps : (n,) float64
        Errors; heading in (−180, 180], NaN where the aircraft hardly moves; height and rate of
        climb NaN where either is unknown.
    """

    update: Indices
    aircraft: Indices
    time_s: Floats
    position_m: Floats
    velocity_mps: Floats
    along_m: Floats
    across_m: Floats
    speed_mps: Floats
    heading_deg: Floats
    height_m: Floats
    climb_mps: Floats


def aircraft_of_updates(
    tracks: Tracks, reference: Reference, instants: Instants, identity: Identity
) -> Indices:
    """Return whose each update is.

    Parameters
    ----------
    tracks : Tracks
        Of n updates.
    reference : Reference
        Where the aircraft are at the time of an update.
    instants : Instants
        The instants at which tracks were assigned.
    identity : Identity
        The stretches over which a track followed an aircraft.

    Returns
    -------
    (n,) int64
        Index of the aircraft of the stretch that the update falls into, or that is one instant
        away; between two stretches that of the nearer aircraft. −1 for none.
    """
    rows = [
        (track, run.first, run.last, run.partner)
        for track, runs in enumerate(identity.aircraft_of_track)
        for run in runs
    ]
    if not rows:
        return np.full(len(tracks.time_s), -1)
    owner, first, last, partner = np.array(rows, np.int64).T
    length = float(len(instants.time_s)) + 2.0
    place = (tracks.time_s - instants.time_s[0]) / instants.step_s
    place = np.clip(place, -2.0, length - 2.0)
    before = np.searchsorted(owner * length + first, tracks.track * length + place, "right") - 1
    found, apart = np.full(len(place), -1), np.full(len(place), np.inf)
    for candidate in (before, before + 1):
        row = np.clip(candidate, 0, len(owner) - 1)
        near = (place >= first[row] - 1.0) & (place <= last[row] + 1.0)
        hit = np.flatnonzero(near & (owner[row] == tracks.track) & (candidate == row))
        whose = partner[row[hit]]
        there = places_at(reference, whose, tracks.time_s[hit]).position_m
        # Where the reference says nothing, the stretch alone decides.
        distance = np.nan_to_num(np.hypot(*(tracks.position_m[hit] - there).T), nan=1e12)
        nearer = distance < apart[hit]
        found[hit[nearer]], apart[hit[nearer]] = whose[nearer], distance[nearer]
    return found


def errors_of_updates(
    tracks: Tracks, reference: Reference, aircraft: Indices, settings: EvaluationSettings
) -> UpdateErrors:
    """Return the errors of all updates that can be judged.

    Parameters
    ----------
    tracks : Tracks
        Of n updates.
    reference : Reference
        What is known, at the very time of an update.
    aircraft : (n,) int64
        Whose each update is; −1 for none.
    settings : EvaluationSettings
        Of which the settling time is used.

    Returns
    -------
    UpdateErrors
        Of measured updates alone: by track, then time.
    """
    begun = tracks.time_s[np.searchsorted(tracks.track, tracks.track)]
    wanted = tracks.measured & (aircraft >= 0) & (tracks.time_s - begun >= settings.settling_s)
    update = np.flatnonzero(wanted)
    places = places_at(reference, aircraft[update], tracks.time_s[update])
    known = np.isfinite(places.position_m[:, 0])
    update, height = update[known], places.height_m[known]
    position, velocity = places.position_m[known], places.velocity_mps[known]
    matrix = reference.plane.local_matrix(position[:, 0], position[:, 1], np.nan_to_num(height))
    off = np.einsum("nij,nj->ni", matrix, tracks.position_m[update] - position)
    true = np.einsum("nij,nj->ni", matrix, velocity)
    told = tracks.ground_mps[update]
    speed = np.hypot(*true.T)
    with np.errstate(invalid="ignore", divide="ignore"):
        course = np.where((speed >= COURSE_SPEED_MIN_MPS)[:, None], true / speed[:, None], np.nan)
    turn = np.arctan2(
        told[:, 0] * course[:, 1] - told[:, 1] * course[:, 0],
        told[:, 0] * course[:, 0] + told[:, 1] * course[:, 1],
    )
    return UpdateErrors(
        update=update,
        aircraft=aircraft[update],
        time_s=tracks.time_s[update],
        position_m=np.hypot(*off.T),
        velocity_mps=np.hypot(*(told - true).T),
        along_m=off[:, 0] * course[:, 0] + off[:, 1] * course[:, 1],
        across_m=off[:, 0] * course[:, 1] - off[:, 1] * course[:, 0],
        speed_mps=np.hypot(*told.T) - speed,
        heading_deg=np.degrees(turn),
        height_m=tracks.height_m[update] - height,
        climb_mps=tracks.climb_mps[update]
        - climb_at(reference, aircraft[update], tracks.time_s[update]),
    )
