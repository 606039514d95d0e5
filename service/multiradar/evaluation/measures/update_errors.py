"""Errors of track updates: position, velocity, heading, height."""

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
    positions_at,
)

#: Below this speed the course of an aircraft is undefined, m/s.
COURSE_SPEED_MIN_MPS = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class UpdateErrors:
    """Errors (track minus reference) of the updates with a known aircraft.

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
    offset_m : (n, 2) float64
        Position error to the east and to the north, true metres.
    along_m, across_m : (n,) float64
        Components of the position error along the course of the reference and to the right of it;
        NaN where the aircraft is too slow for a course.
    speed_mps, heading_deg, height_m, climb_mps : (n,) float64
        Errors; heading in (−180, 180], NaN where the aircraft is too slow; height and rate of
        climb NaN where either is unknown.
    """

    update: Indices
    aircraft: Indices
    time_s: Floats
    position_m: Floats
    velocity_mps: Floats
    offset_m: Floats
    along_m: Floats
    across_m: Floats
    speed_mps: Floats
    heading_deg: Floats
    height_m: Floats
    climb_mps: Floats


def aircraft_of_updates(
    tracks: Tracks, reference: Reference, instants: Instants, identity: Identity
) -> Indices:
    """Return the aircraft of each update.

    Parameters
    ----------
    tracks : Tracks
        Of n updates.
    reference : Reference
        Positions of the aircraft at the times of updates.
    instants : Instants
        The instants at which tracks were assigned.
    identity : Identity
        The runs over which a track followed an aircraft.

    Returns
    -------
    (n,) int64
        Index of the aircraft of the run that contains the update or is one instant away; between
        two runs that of the nearer aircraft. −1 for none.
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
    instant = (tracks.time_s - instants.time_s[0]) / instants.step_s
    instant = np.clip(instant, -2.0, length - 2.0)
    before = np.searchsorted(owner * length + first, tracks.track * length + instant, "right") - 1
    found, apart = np.full(len(instant), -1), np.full(len(instant), np.inf)
    for candidate in (before, before + 1):
        row = np.clip(candidate, 0, len(owner) - 1)
        near = (instant >= first[row] - 1.0) & (instant <= last[row] + 1.0)
        hit = np.flatnonzero(near & (owner[row] == tracks.track) & (candidate == row))
        aircraft_index = partner[row[hit]]
        there = positions_at(reference, aircraft_index, tracks.time_s[hit]).position_m
        # Without a reference position, the run alone decides.
        distance = np.nan_to_num(np.hypot(*(tracks.position_m[hit] - there).T), nan=1e12)
        nearer = distance < apart[hit]
        found[hit[nearer]], apart[hit[nearer]] = aircraft_index[nearer], distance[nearer]
    return found


def errors_of_updates(
    tracks: Tracks, reference: Reference, aircraft: Indices, settings: EvaluationSettings
) -> UpdateErrors:
    """Return the errors of all updates with a reference position.

    Parameters
    ----------
    tracks : Tracks
        Of n updates.
    reference : Reference
        Interpolated to the time of each update.
    aircraft : (n,) int64
        Aircraft of each update; −1 for none.
    settings : EvaluationSettings
        Settings; only the settling time is used.

    Returns
    -------
    UpdateErrors
        Of measured updates only: by track, then time.
    """
    initiated_s = tracks.time_s[np.searchsorted(tracks.track, tracks.track)]
    settled = tracks.time_s - initiated_s >= settings.settling_s
    wanted = tracks.measured & (aircraft >= 0) & settled
    update = np.flatnonzero(wanted)
    positions = positions_at(reference, aircraft[update], tracks.time_s[update])
    known = np.isfinite(positions.position_m[:, 0])
    update, height = update[known], positions.height_m[known]
    position, velocity = positions.position_m[known], positions.velocity_mps[known]
    matrix = reference.plane.local_matrix(position[:, 0], position[:, 1], np.nan_to_num(height))
    off = np.einsum("nij,nj->ni", matrix, tracks.position_m[update] - position)
    true = np.einsum("nij,nj->ni", matrix, velocity)
    reported = tracks.ground_mps[update]
    speed = np.hypot(*true.T)
    with np.errstate(invalid="ignore", divide="ignore"):
        course = np.where((speed >= COURSE_SPEED_MIN_MPS)[:, None], true / speed[:, None], np.nan)
    heading_error = np.arctan2(
        reported[:, 0] * course[:, 1] - reported[:, 1] * course[:, 0],
        reported[:, 0] * course[:, 0] + reported[:, 1] * course[:, 1],
    )
    return UpdateErrors(
        update=update,
        aircraft=aircraft[update],
        time_s=tracks.time_s[update],
        position_m=np.hypot(*off.T),
        velocity_mps=np.hypot(*(reported - true).T),
        offset_m=off,
        along_m=off[:, 0] * course[:, 0] + off[:, 1] * course[:, 1],
        across_m=off[:, 0] * course[:, 1] - off[:, 1] * course[:, 0],
        speed_mps=np.hypot(*reported.T) - speed,
        heading_deg=np.degrees(heading_error),
        height_m=tracks.height_m[update] - height,
        climb_mps=tracks.climb_mps[update]
        - climb_at(reference, aircraft[update], tracks.time_s[update]),
    )
