"""Who is whose at an instant; duplicates, false tracks, and those that cannot be judged."""

import numpy as np
import pytest

from multiradar.errors import InputError
from multiradar.evaluation.instants import look
from multiradar.evaluation.measures.identity import identity_over_time
from multiradar.evaluation.measures.siap import Siap, siap
from multiradar.evaluation.measures.verdicts import Verdicts, verdicts
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.trajectories import Tracks
from support.scenarios.skies import Row, reference_of, straight, tracks_of

TIMES = range(0, 101, 4)
FLIGHT = straight(TIMES, 0.0, 0.0, 100.0, 0.0)
ONE = reference_of({"a": FLIGHT})
SETTINGS = EvaluationSettings(gate_m=1000.0)


def moved(rows: list[Row], east_m: float, north_m: float) -> list[Row]:
    return [(t, east + east_m, north + north_m, *rest) for t, east, north, *rest in rows]  # type: ignore[misc]


def judged(tracks: Tracks, settings: EvaluationSettings = SETTINGS) -> tuple[Siap, Verdicts]:
    instants = look(tracks, ONE, settings)
    found = identity_over_time(instants, 1, len(tracks.ids), settings.dwell_s)
    return siap(instants, found), verdicts(tracks, instants)


def test_a_second_track_within_the_gate_is_a_duplicate_the_nearer_one_is_the_track() -> None:
    told, found = judged(tracks_of({1: moved(FLIGHT, 0.0, 300.0), 2: moved(FLIGHT, 0.0, 30.0)}))
    assert list(found.true) == [False, True]
    assert list(found.duplicate) == [True, False]
    assert not found.false_.any()
    assert told.ambiguity == pytest.approx(2.0)
    assert told.spuriousness == 0.0
    assert told.positional_accuracy_m == pytest.approx(30.0, abs=1e-6)


def test_a_track_far_from_everything_is_false_and_lives_from_first_to_last_update() -> None:
    told, found = judged(tracks_of({1: FLIGHT, 2: moved(FLIGHT[5:9], 0.0, 5000.0)}))
    assert list(found.false_) == [False, True]
    assert found.life_s[1] == 12.0
    # Four updates, carried on for 12 s: instants 20, 24, ..., 44.
    assert told.spuriousness == pytest.approx(7 / (26 + 7))


def test_a_reference_that_may_lack_aircraft_calls_nobody_false() -> None:
    tracks = tracks_of({1: FLIGHT, 2: moved(FLIGHT[5:9], 0.0, 5000.0)})
    told, found = judged(tracks, EvaluationSettings(gate_m=1000.0, partial=True))
    assert not found.false_.any()
    assert list(found.true) == [True, False]
    assert not found.duplicate.any()
    assert told.spuriousness == 0.0


def test_a_track_that_leaves_its_aircraft_is_spurious_from_then_on() -> None:
    away = FLIGHT[:13] + moved(FLIGHT[13:], 0.0, 3000.0)
    told, found = judged(tracks_of({1: away}))
    assert found.true[0]
    assert told.spuriousness == pytest.approx(13 / 26)
    assert told.completeness == pytest.approx(13 / 26)


def test_a_track_is_what_it_was_most_of_the_time() -> None:
    passing = FLIGHT[:4] + moved(FLIGHT[4:], 0.0, 3000.0)
    assert judged(tracks_of({1: passing}))[1].false_.tolist() == [True]
    # Nearer than the other at first, and then a duplicate of it for long.
    nearer = [*FLIGHT[:4], *moved(FLIGHT[4:], 0.0, 500.0)]
    other = moved(FLIGHT, 0.0, 100.0)
    found = judged(tracks_of({1: nearer, 2: other}))[1]
    assert found.true.tolist() == [False, True]
    assert found.duplicate.tolist() == [True, False]


def test_a_track_before_and_after_its_aircraft_is_known_is_not_judged() -> None:
    longer = straight(range(-40, 141, 4), 0.0, 0.0, 100.0, 0.0)
    other = straight(range(-40, 141, 4), 0.0, 9000.0, 100.0, 0.0)
    reference = reference_of({"a": FLIGHT[5:20], "b": other})
    tracks = tracks_of({1: longer, 2: other})
    instants = look(tracks, reference, SETTINGS)
    assert np.sum(instants.judged & (instants.track == 0)) == 15
    assert not instants.spurious.any()


def test_a_track_between_updates_is_where_its_velocity_takes_it() -> None:
    fine = EvaluationSettings(step_s=1.0, gate_m=1000.0)
    instants = look(tracks_of({1: FLIGHT}), ONE, fine)
    told = siap(instants, identity_over_time(instants, 1, 1, 20.0))
    assert told.positional_accuracy_m == pytest.approx(0.0, abs=1e-6)
    assert told.velocity_accuracy_mps == pytest.approx(0.0, abs=1e-9)


def test_tracks_and_reference_of_different_days_are_refused() -> None:
    late = straight(range(1000, 1101, 4), 0.0, 0.0, 100.0, 0.0)
    with pytest.raises(InputError, match="no time in common: tracks 00:16:40 to"):
        look(tracks_of({1: late}), ONE, SETTINGS)


def test_an_absurd_number_of_instants_is_refused() -> None:
    with pytest.raises(InputError, match="expected at most 1000000 instants"):
        look(tracks_of({1: FLIGHT}), ONE, EvaluationSettings(step_s=1e-6))
