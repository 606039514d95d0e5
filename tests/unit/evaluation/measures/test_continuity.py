"""Gaps, detection and initiation, against counts by hand."""

import numpy as np
import pytest

from multiradar.evaluation.instants import assign_tracks
from multiradar.evaluation.measures.continuity import (
    AircraftUpdates,
    TrackedPeriods,
    detection,
    intervals,
    tracked_periods,
    tracked_since,
)
from multiradar.evaluation.measures.identity import identity_over_time
from multiradar.evaluation.settings import EvaluationSettings
from support.scenarios.skies import reference_of, straight, tracks_of


def aircraft_updates(**times: list[float]) -> AircraftUpdates:
    names = sorted(times)
    return AircraftUpdates(
        np.concatenate([np.full(len(times[name]), n) for n, name in enumerate(names)]),
        np.concatenate([np.array(times[name], np.float64) for name in names]),
    )


def periods(*rows: tuple[int, float, float]) -> TrackedPeriods:
    aircraft, begin, end = np.array(rows, np.float64).T
    return TrackedPeriods(aircraft.astype(np.int64), begin, end)


def test_intervals_extend_from_the_first_update_to_the_end_of_the_reference() -> None:
    found, aircraft_index = intervals(aircraft_updates(a=[4.0, 8.0, 30.0]), periods((0, 4.0, 50.0)))
    assert found.tolist() == [4.0, 22.0, 20.0]
    assert aircraft_index.tolist() == [0, 0, 0]


def test_no_interval_spans_a_gap_of_the_reference_or_two_aircraft() -> None:
    updates = aircraft_updates(a=[4.0, 8.0, 45.0], b=[1.0, 2.0])
    found, aircraft_index = intervals(
        updates, periods((0, 4.0, 10.0), (0, 40.0, 50.0), (1, 1.0, 2.0))
    )
    assert found.tolist() == [4.0, 2.0, 5.0, 5.0, 1.0]
    assert aircraft_index.tolist() == [0, 0, 0, 0, 1]


def test_an_update_at_an_isolated_reference_position_starts_no_interval() -> None:
    updates = aircraft_updates(a=[4.0, 20.0, 45.0])
    found, _ = intervals(updates, periods((0, 4.0, 10.0), (0, 40.0, 50.0)))
    assert found.tolist() == [6.0, 5.0, 5.0]


def test_periods_start_with_the_first_update_and_end_with_the_reference() -> None:
    rows = straight([0.0, 10.0, 20.0, 60.0, 70.0], 0.0, 0.0, 100.0, 0.0)
    reference = reference_of({"a": rows, "never": straight([0.0, 10.0], 0.0, 9e4, 1.0, 0.0)})
    found = tracked_periods(reference, aircraft_updates(a=[7.0, 65.0]))
    assert found.aircraft.tolist() == [0, 0]
    assert found.begin_s.tolist() == [7.0, 60.0]
    assert found.end_s.tolist() == [20.0, 70.0]


def test_detection_counts_intervals_with_an_update() -> None:
    # Intervals of 8 s from 0: [0, 8) and [16, 24) are hit, [8, 16) is not, [24, 30) is cut off.
    assert detection(aircraft_updates(a=[0.0, 7.9, 17.0, 25.0]), periods((0, 0.0, 30.0)), 8.0) == (
        2,
        3,
    )
    both = aircraft_updates(a=[0.0], b=[1.0, 9.0])
    assert detection(both, periods((0, 0.0, 16.0), (1, 1.0, 17.0)), 8.0) == (3, 4)
    assert detection(aircraft_updates(a=[]), periods((0, 0.0, 16.0)), 8.0) == (0, 2)


def test_a_track_counts_from_its_first_update_even_before_the_reference() -> None:
    times = [float(t) for t in range(0, 101, 4)]
    reference = reference_of(
        {"a": straight(times[5:], 0.0, 0.0, 100.0, 0.0), "b": straight(times, 0.0, 9e4, 1.0, 0.0)}
    )
    tracks = tracks_of({1: straight(times[2:], 0.0, 0.0, 100.0, 0.0)})
    instants = assign_tracks(tracks, reference, EvaluationSettings())
    found = identity_over_time(instants, 2, 1, 20.0)
    since = tracked_since(tracks, instants, found)
    assert since[0] == pytest.approx(8.0)
    assert np.isinf(since[1])
