"""Swaps, number changes and segments, against counts by hand."""

import numpy as np
import polars as pl
import pytest

from multiradar.evaluation.instants import Instants, assign_tracks
from multiradar.evaluation.measures.identity import identity_over_time
from multiradar.evaluation.measures.plots_on_tracks import plots_on_the_right_track
from multiradar.evaluation.measures.siap import siap
from multiradar.evaluation.measures.update_times import UPDATE_TIME
from multiradar.evaluation.settings import EvaluationSettings
from multiradar.evaluation.trajectories import Reference, Tracks
from support.scenarios.skies import Row, reference_of, straight, tracks_of

SETTINGS = EvaluationSettings(step_s=1.0, gate_m=1000.0)
#: Two aircraft side by side, 3 km apart, for 100 s.
TIMES = range(101)
WEST = straight(TIMES, -1500.0, 0.0, 0.0, 200.0)
EAST = straight(TIMES, 1500.0, 0.0, 0.0, 200.0)
BOTH = reference_of({"west": WEST, "east": EAST})


def simulated(tracks: Tracks, reference: Reference = BOTH) -> tuple[Instants, int, int]:
    instants = assign_tracks(tracks, reference, SETTINGS)
    found = identity_over_time(instants, len(reference.names), len(tracks.ids), SETTINGS.dwell_s)
    return instants, found.swaps, found.number_changes


def test_steady_tracks_have_no_swaps() -> None:
    instants, swaps, changes = simulated(tracks_of({1: WEST, 2: EAST}))
    assert (swaps, changes) == (0, 0)
    assert len(instants.time_s) == 101
    assert np.all(instants.track_of >= 0)


def test_two_tracks_that_exchange_aircraft_are_two_swaps() -> None:
    crossing = tracks_of({1: WEST[:50] + EAST[50:], 2: EAST[:50] + WEST[50:]})
    assert simulated(crossing)[1:] == (2, 2)


def test_a_track_briefly_nearest_to_another_aircraft_has_not_swapped() -> None:
    flicker = tracks_of(
        {1: WEST[:50] + EAST[50:55] + WEST[55:], 2: EAST[:50] + WEST[50:55] + EAST[55:]}
    )
    instants, swaps, changes = simulated(flicker)
    assert (swaps, changes) == (0, 0)
    assert list(identity_over_time(instants, 2, 2, 20.0).longest_s) == [101.0, 101.0]


def test_a_new_track_after_a_lost_one_is_a_change_of_number_and_no_swap() -> None:
    again = tracks_of({1: WEST[:40], 2: EAST, 3: WEST[60:]})
    instants, swaps, changes = simulated(again)
    assert (swaps, changes) == (0, 1)
    found = identity_over_time(instants, 2, 3, SETTINGS.dwell_s)
    # Last update at 39 s, extrapolated for 12 s: instants 0 to 51.
    assert list(found.longest_s) == [101.0, 52.0]
    picture = siap(instants, found)
    assert picture.number_changes_per_h == pytest.approx(3600.0 / (101 + 52 + 41))
    assert picture.longest_segment == pytest.approx((101 + 52) / 202)
    assert picture.completeness == pytest.approx((101 + 52 + 41) / 202)


def test_a_gap_of_the_reference_breaks_no_segment() -> None:
    broken = reference_of({"west": WEST[:30] + WEST[60:], "east": EAST})
    instants, swaps, changes = simulated(tracks_of({1: WEST, 2: EAST}), broken)
    assert (swaps, changes) == (0, 0)
    assert list(identity_over_time(instants, 2, 2, 20.0).longest_s) == [101.0, 71.0]
    assert np.sum(instants.evaluated) == 101 + 71
    assert siap(instants, identity_over_time(instants, 2, 2, 20.0)).completeness == 1.0


def test_track_names_do_not_affect_the_result() -> None:
    rows: dict[int, list[Row]] = {
        1: WEST[:50] + EAST[50:],
        2: EAST[:50] + WEST[50:],
        3: straight(range(20, 80), -1400.0, 0.0, 0.0, 200.0),
    }
    renamed = {9: rows[1], 4: rows[2], 1: rows[3]}
    first, second = simulated(tracks_of(rows)), simulated(tracks_of(renamed))
    assert first[1:] == second[1:]
    for name in ("completeness", "ambiguity", "spuriousness", "positional_accuracy_m"):
        one, other = (
            getattr(siap(found[0], identity_over_time(found[0], 2, 3, 20.0)), name)
            for found in (first, second)
        )
        assert one == pytest.approx(other)


def test_plots_are_counted_by_the_aircraft_of_their_track() -> None:
    found = tracks_of({1: EAST[:3], 2: WEST[:3], 3: WEST[:1]})
    aircraft = np.array([0, 0, 0, 1, 0, 1, -1])
    plots = pl.DataFrame(
        {
            UPDATE_TIME: [0.0, 1.0, 2.0, 2.0],
            "sensor_id": ["radar"] * 4,
            # The plots at 2 s are ambiguous.
            "name": ["east", "east", "west", "east"],
        }
    )
    # Both tracks have a plot of east at 0 and 1 s; at 0 s the second follows west.
    assert plots_on_the_right_track(found, BOTH, aircraft, plots) == (3, 4)
    unknown = plots.with_columns(name=pl.Series([None, "other", "west", "west"]))
    assert plots_on_the_right_track(found, BOTH, aircraft, unknown) == (0, 0)
