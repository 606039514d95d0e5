"""Selection of tracks for the calibration of forecasts: pseudo-random and reproducible."""

import numpy as np

from multiradar.tracking.forecast.state_samples import (
    SAMPLE_EVERY_S,
    SAMPLE_TRACKS_MAX,
    drawn,
    is_due,
)


def test_a_selection_from_a_selection_is_the_same() -> None:
    tracks = np.arange(1, 1000)
    for epoch in (0, 7, 10**9):
        few = tracks[drawn(tracks, epoch)]
        assert len(few) == SAMPLE_TRACKS_MAX
        assert (np.diff(few) > 0).all()
        np.testing.assert_array_equal(few[drawn(few, epoch)], few)
        shuffled = tracks[::-1]
        np.testing.assert_array_equal(shuffled[drawn(shuffled, epoch)], few)


def test_every_track_is_selected() -> None:
    tracks = np.arange(1, 41)
    seen = np.zeros(41)
    for epoch in range(200):
        seen[tracks[drawn(tracks, epoch)]] += 1
    # 1600 draws of 40 tracks, 40 each: five sigmas are 30.
    assert seen[1:].min() > 10
    assert seen[1:].max() < 70


def test_no_tracks_give_an_empty_draw() -> None:
    assert len(drawn(np.empty(0, np.int64), 3)) == 0


def test_samples_are_due_at_the_configured_interval() -> None:
    for epoch_s in (0.5, 4.0, 3.0, 8.0, 60.0):
        due = [epoch for epoch in range(2000) if is_due(epoch, epoch_s)]
        apart_s = np.diff(due) * epoch_s
        assert apart_s.min() >= SAMPLE_EVERY_S - epoch_s
        assert apart_s.max() <= SAMPLE_EVERY_S + epoch_s
        assert np.mean(apart_s) >= SAMPLE_EVERY_S - 0.01


def test_tracks_of_times_before_zero_are_drawn_in_turn() -> None:
    tracks = np.arange(40, dtype=np.int64)
    found = [tracks[drawn(tracks, epoch)] for epoch in (-997, -996, -1)]
    assert all(len(few) == SAMPLE_TRACKS_MAX for few in found)
    assert not np.array_equal(found[0], found[1])
