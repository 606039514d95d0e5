"""Gaps, detection and initiation, counted as by hand."""

import numpy as np
import pytest

from multiradar.evaluation.instants import look
from multiradar.evaluation.measures.continuity import (
    Heard,
    Stretches,
    detection,
    intervals,
    stretches,
    tracked_since,
)
from multiradar.evaluation.measures.identity import identity_over_time
from multiradar.evaluation.settings import EvaluationSettings
from support.scenarios.skies import reference_of, straight, tracks_of


def heard(**times: list[float]) -> Heard:
    names = sorted(times)
    return Heard(
        np.concatenate([np.full(len(times[name]), n) for n, name in enumerate(names)]),
        np.concatenate([np.array(times[name], np.float64) for name in names]),
    )


def stretch(*rows: tuple[int, float, float]) -> Stretches:
    aircraft, begin, end = np.array(rows, np.float64).T
    return Stretches(aircraft.astype(np.int64), begin, end)


def test_intervals_reach_from_the_first_update_to_the_end_of_the_reference() -> None:
    found, whose = intervals(heard(a=[4.0, 8.0, 30.0]), stretch((0, 4.0, 50.0)))
    assert found.tolist() == [4.0, 22.0, 20.0]
    assert whose.tolist() == [0, 0, 0]


def test_no_interval_reaches_over_a_gap_of_the_reference_or_to_another_aircraft() -> None:
    updates = heard(a=[4.0, 8.0, 45.0], b=[1.0, 2.0])
    found, whose = intervals(updates, stretch((0, 4.0, 10.0), (0, 40.0, 50.0), (1, 1.0, 2.0)))
    assert found.tolist() == [4.0, 2.0, 5.0, 5.0, 1.0]
    assert whose.tolist() == [0, 0, 0, 0, 1]


def test_an_update_at_a_lone_position_of_the_reference_begins_no_interval() -> None:
    updates = heard(a=[4.0, 20.0, 45.0])
    found, _ = intervals(updates, stretch((0, 4.0, 10.0), (0, 40.0, 50.0)))
    assert found.tolist() == [6.0, 5.0, 5.0]


def test_stretches_begin_with_the_first_update_and_end_with_the_reference() -> None:
    rows = straight([0.0, 10.0, 20.0, 60.0, 70.0], 0.0, 0.0, 100.0, 0.0)
    reference = reference_of({"a": rows, "never": straight([0.0, 10.0], 0.0, 9e4, 1.0, 0.0)})
    found = stretches(reference, heard(a=[7.0, 65.0]))
    assert found.aircraft.tolist() == [0, 0]
    assert found.begin_s.tolist() == [7.0, 60.0]
    assert found.end_s.tolist() == [20.0, 70.0]


def test_detection_counts_intervals_with_an_update() -> None:
    # Intervals of 8 s from 0: [0, 8) and [16, 24) are hit, [8, 16) is not, [24, 30) is cut off.
    assert detection(heard(a=[0.0, 7.9, 17.0, 25.0]), stretch((0, 0.0, 30.0)), 8.0) == (2, 3)
    both = heard(a=[0.0], b=[1.0, 9.0])
    assert detection(both, stretch((0, 0.0, 16.0), (1, 1.0, 17.0)), 8.0) == (3, 4)
    assert detection(heard(a=[]), stretch((0, 0.0, 16.0)), 8.0) == (0, 2)


def test_a_track_is_there_from_its_first_update_on_also_before_the_reference() -> None:
    times = [float(t) for t in range(0, 101, 4)]
    reference = reference_of(
        {"a": straight(times[5:], 0.0, 0.0, 100.0, 0.0), "b": straight(times, 0.0, 9e4, 1.0, 0.0)}
    )
    tracks = tracks_of({1: straight(times[2:], 0.0, 0.0, 100.0, 0.0)})
    instants = look(tracks, reference, EvaluationSettings())
    found = identity_over_time(instants, 2, 1, 20.0)
    since = tracked_since(tracks, instants, found)
    assert since[0] == pytest.approx(8.0)
    assert np.isinf(since[1])
