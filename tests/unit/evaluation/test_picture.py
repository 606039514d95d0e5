"""Assignment at an instant; duplicate, false and unclassified tracks."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.errors import InputError
from multiradar.evaluation.instants import assign_tracks
from multiradar.evaluation.measures.identity import identity_over_time
from multiradar.evaluation.measures.siap import Siap, siap
from multiradar.evaluation.measures.track_classes import TrackClasses, classify_tracks
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.trajectories import Tracks
from support.scenarios.skies import Row, reference_of, straight, tracks_of

TIMES = range(0, 101, 4)
FLIGHT = straight(TIMES, 0.0, 0.0, 100.0, 0.0)
ONE = reference_of({"a": FLIGHT})
SETTINGS = EvaluationSettings(gate_m=1000.0)


def moved(rows: list[Row], east_m: float, north_m: float) -> list[Row]:
    return [(t, east + east_m, north + north_m, *rest) for t, east, north, *rest in rows]  # type: ignore[misc]


def evaluated(tracks: Tracks, settings: EvaluationSettings = SETTINGS) -> tuple[Siap, TrackClasses]:
    instants = assign_tracks(tracks, ONE, settings)
    found = identity_over_time(instants, 1, len(tracks.ids), settings.dwell_s)
    return siap(instants, found), classify_tracks(tracks, instants)


def test_a_second_track_within_the_gate_is_a_duplicate_the_nearer_one_is_the_track() -> None:
    picture, found = evaluated(
        tracks_of({1: moved(FLIGHT, 0.0, 300.0), 2: moved(FLIGHT, 0.0, 30.0)})
    )
    assert list(found.true) == [False, True]
    assert list(found.duplicate) == [True, False]
    assert not found.false_.any()
    assert picture.ambiguity == pytest.approx(2.0)
    assert picture.spuriousness == 0.0
    assert picture.positional_accuracy_m == pytest.approx(30.0, abs=1e-6)


def test_a_track_far_from_everything_is_false_and_lives_from_first_to_last_update() -> None:
    picture, found = evaluated(tracks_of({1: FLIGHT, 2: moved(FLIGHT[5:9], 0.0, 5000.0)}))
    assert list(found.false_) == [False, True]
    assert found.life_s[1] == 12.0
    # Four updates, extrapolated for 12 s: instants 20, 24, ..., 44.
    assert picture.spuriousness == pytest.approx(7 / (26 + 7))


def test_a_partial_reference_gives_no_false_tracks() -> None:
    tracks = tracks_of({1: FLIGHT, 2: moved(FLIGHT[5:9], 0.0, 5000.0)})
    picture, found = evaluated(tracks, EvaluationSettings(gate_m=1000.0, partial=True))
    assert not found.false_.any()
    assert list(found.true) == [True, False]
    assert not found.duplicate.any()
    assert picture.spuriousness == 0.0


def test_a_track_that_leaves_its_aircraft_is_spurious_from_then_on() -> None:
    away = FLIGHT[:13] + moved(FLIGHT[13:], 0.0, 3000.0)
    picture, found = evaluated(tracks_of({1: away}))
    assert found.true[0]
    assert picture.spuriousness == pytest.approx(13 / 26)
    assert picture.completeness == pytest.approx(13 / 26)


def test_a_track_is_what_it_was_most_of_the_time() -> None:
    passing = FLIGHT[:4] + moved(FLIGHT[4:], 0.0, 3000.0)
    assert evaluated(tracks_of({1: passing}))[1].false_.tolist() == [True]
    # Nearer than the other at first, then its duplicate for most of the time.
    nearer = [*FLIGHT[:4], *moved(FLIGHT[4:], 0.0, 500.0)]
    other = moved(FLIGHT, 0.0, 100.0)
    found = evaluated(tracks_of({1: nearer, 2: other}))[1]
    assert found.true.tolist() == [False, True]
    assert found.duplicate.tolist() == [True, False]


def test_a_track_outside_the_time_of_its_aircraft_is_not_evaluated() -> None:
    longer = straight(range(-40, 141, 4), 0.0, 0.0, 100.0, 0.0)
    other = straight(range(-40, 141, 4), 0.0, 9000.0, 100.0, 0.0)
    reference = reference_of({"a": FLIGHT[5:20], "b": other})
    tracks = tracks_of({1: longer, 2: other})
    instants = assign_tracks(tracks, reference, SETTINGS)
    assert np.sum(instants.evaluated & (instants.track == 0)) == 15
    assert not instants.spurious.any()


def test_a_track_is_extrapolated_between_updates() -> None:
    fine = EvaluationSettings(step_s=1.0, gate_m=1000.0)
    instants = assign_tracks(tracks_of({1: FLIGHT}), ONE, fine)
    picture = siap(instants, identity_over_time(instants, 1, 1, 20.0))
    assert picture.positional_accuracy_m == pytest.approx(0.0, abs=1e-6)
    assert picture.velocity_accuracy_mps == pytest.approx(0.0, abs=1e-9)


def test_tracks_and_reference_of_different_days_are_rejected() -> None:
    late = straight(range(1000, 1101, 4), 0.0, 0.0, 100.0, 0.0)
    with pytest.raises(InputError, match="do not overlap in time: tracks 00:16:40 to"):
        assign_tracks(tracks_of({1: late}), ONE, SETTINGS)


def test_an_excessive_number_of_instants_is_rejected() -> None:
    with pytest.raises(InputError, match="expected at most 1000000 instants"):
        assign_tracks(tracks_of({1: FLIGHT}), ONE, EvaluationSettings(step_s=1e-6))


def test_a_reference_without_joined_positions_is_an_error_with_the_gap() -> None:
    """Regression: an internal error where no position of the reference is at an instant."""
    times = [0.5 + 19.0 * number for number in range(20)]
    reference = reference_of({"a": straight(times, 0.0, 0.0, 200.0, 0.0)})
    tracks = tracks_of({1: straight(times, 0.0, 0.0, 200.0, 0.0)})
    with pytest.raises(InputError, match=r"19\.0 s apart .* --reference-gap \(15 s\)"):
        assign_tracks(tracks, replace(reference, gap_s=15.0), SETTINGS)
