"""Errors of updates: along and across, heading around north, height, gaps and settling."""

import dataclasses

import numpy as np
import pytest

from multiradar.evaluation.instants import assign_tracks
from multiradar.evaluation.measures.identity import identity_over_time
from multiradar.evaluation.measures.update_errors import (
    UpdateErrors,
    aircraft_of_updates,
    errors_of_updates,
)
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.trajectories import Reference, Tracks
from support.scenarios.skies import reference_of, straight, tracks_of

TIMES = [float(t) for t in range(0, 61, 4)]
NORTH = straight(TIMES, 0.0, 0.0, 0.0, 200.0)
#: Scale of the plane at 9000 m: metres on the plane per true metre.
SCALE = 1.0 + 9000.0 / 6.38e6


def errors(
    tracks: Tracks, reference: Reference, settings: EvaluationSettings | None = None
) -> UpdateErrors:
    settings = settings or EvaluationSettings()
    instants = assign_tracks(tracks, reference, settings)
    found = identity_over_time(instants, len(reference.names), len(tracks.ids), settings.dwell_s)
    aircraft_index = aircraft_of_updates(tracks, reference, instants, found)
    return errors_of_updates(tracks, reference, aircraft_index, settings)


def test_along_is_ahead_and_across_is_to_the_right() -> None:
    off = [(t, 30.0, north + 70.0, 0.0, 200.0) for t, _, north, _, _ in NORTH]
    found = errors(tracks_of({1: off}), reference_of({"a": NORTH}))
    assert found.along_m == pytest.approx(np.full(16, 70.0 * SCALE), rel=1e-4)
    assert found.across_m == pytest.approx(np.full(16, 30.0 * SCALE), rel=1e-4)
    assert found.position_m == pytest.approx(np.full(16, np.hypot(70.0, 30.0) * SCALE), rel=1e-4)


def test_heading_errors_wrap_at_north() -> None:
    angle = np.radians(2.0)
    east, north = 200.0 * np.sin(angle), 200.0 * np.cos(angle)
    flown = straight(TIMES, 0.0, 0.0, -east, north)
    picture = [(*row[:3], east, north) for row in flown]
    found = errors(tracks_of({1: picture}), reference_of({"a": flown}))
    assert found.heading_deg == pytest.approx(np.full(16, 4.0), abs=0.01)
    assert np.abs(found.speed_mps).max() < 0.5
    assert found.velocity_mps == pytest.approx(np.full(16, 2.0 * east), rel=0.02)


def test_a_stationary_aircraft_has_no_course() -> None:
    still = straight(TIMES, 0.0, 0.0, 0.0, 0.0)
    found = errors(tracks_of({1: still}), reference_of({"a": still}))
    assert np.isnan(found.heading_deg).all()
    assert np.isnan(found.along_m).all()
    assert np.isfinite(found.position_m).all()


def test_rates_of_climb_are_compared_with_the_slope_of_the_heights_around() -> None:
    tracks, reference = tracks_of({1: NORTH}), reference_of({"a": NORTH})
    time_s = reference.time_s
    # Level until 20 s, then down by 5 m/s.
    reference = dataclasses.replace(
        reference, height_m=9000.0 - 5.0 * np.maximum(time_s - 20.0, 0.0)
    )
    picture = np.full(16, -4.0)
    picture[12] = np.nan
    found = errors(dataclasses.replace(tracks, climb_mps=picture), reference)
    # The slope is over 10 s: 5 s from either end it is unknown.
    assert np.isnan(found.climb_mps[[0, 1, 12, 14, 15]]).all()
    assert found.climb_mps[[2, 3]] == pytest.approx([-4.0, -4.0])
    assert found.climb_mps[[7, 8, 9, 10, 11, 13]] == pytest.approx([1.0] * 6)


def test_heights_are_compared_where_both_are_known() -> None:
    tracks = tracks_of({1: NORTH})
    heights = tracks.height_m + 30.0
    heights[3] = np.nan
    found = errors(dataclasses.replace(tracks, height_m=heights), reference_of({"a": NORTH}))
    assert np.flatnonzero(np.isnan(found.height_m)).tolist() == [3]
    assert np.nanmax(np.abs(found.height_m - 30.0)) < 1e-6


def test_no_error_is_reported_in_a_gap_of_the_reference() -> None:
    broken = reference_of({"a": NORTH[:4] + NORTH[9:]}, gap_s=15.0)
    found = errors(tracks_of({1: NORTH}), broken)
    assert found.time_s.tolist() == TIMES[:4] + TIMES[9:]
    # Over a shorter gap it is joined.
    joined = reference_of({"a": NORTH[:4] + NORTH[9:]}, gap_s=30.0)
    assert len(errors(tracks_of({1: NORTH}), joined).time_s) == len(NORTH)


def test_coasting_updates_and_the_settling_time_are_excluded() -> None:
    tracks = tracks_of({1: NORTH})
    measured = tracks.measured.copy()
    measured[5] = False
    coasting = dataclasses.replace(tracks, measured=measured)
    found = errors(coasting, reference_of({"a": NORTH}), EvaluationSettings(settling_s=8.0))
    assert found.time_s.tolist() == [t for t in TIMES if t >= 8.0 and t != TIMES[5]]


def test_updates_between_instants_belong_to_the_aircraft_of_the_run() -> None:
    times = [1.0, 5.0, 6.5, 9.0, 30.0]
    found = errors(
        tracks_of({1: straight(times, 0.0, 0.0, 0.0, 200.0)}), reference_of({"a": NORTH})
    )
    assert found.time_s.tolist() == times
    assert np.abs(found.position_m).max() < 1e-3


def test_an_update_between_a_swap_and_the_next_instant_belongs_to_the_nearer_aircraft() -> None:
    # Regression: an error of 29 km when only the last run was considered.
    other = straight(TIMES, 9000.0, 0.0, 0.0, 200.0)
    late = [(t, 9000.0, 200.0 * t, 0.0, 200.0) for t in (30.5, 31.5, *TIMES[8:])]
    found = errors(
        tracks_of({1: [*NORTH[:8], *late], 2: [*other[:8], *NORTH[8:]]}),
        reference_of({"a": NORTH, "b": other}),
    )
    assert len(found.time_s) == 34
    assert found.position_m.max() < 1e-3
