"""Track numbers: one for each live track, the same after a restart, and not again too early."""

import numpy as np

from multiradar.runtime.asterix.numbers import NO_NUMBER, NUMBERS, REST_S, TrackNumbers


def given(numbers: TrackNumbers, tracks: list[int], time_s: float) -> list[int]:
    found: list[int] = numbers.give(np.array(tracks, np.int64), time_s).tolist()
    return found


def test_the_number_follows_from_the_identifier_alone() -> None:
    assert given(TrackNumbers(), [1, 2, 70_000], 0.0) == [1, 2, 70_000 - NUMBERS]
    # Another start, when other tracks are gone.
    assert given(TrackNumbers(), [70_000], 1e6) == [70_000 - NUMBERS]


def test_a_number_that_is_held_or_rests_is_not_given() -> None:
    numbers = TrackNumbers()
    assert given(numbers, [5], 0.0) == [5]
    assert given(numbers, [5 + NUMBERS], 1.0) == [6]
    numbers.free(np.array([5, NO_NUMBER]), 100.0)
    # By then receivers have dropped the track before.
    assert REST_S == 120.0
    assert given(numbers, [5 + 2 * NUMBERS], np.nextafter(100.0 + REST_S, 0.0)) == [7]
    assert given(numbers, [5 + 3 * NUMBERS], 100.0 + REST_S) == [5]


def test_more_tracks_than_numbers_are_counted() -> None:
    numbers = TrackNumbers()
    assert set(given(numbers, list(range(1, NUMBERS + 1)), 0.0)) == set(range(NUMBERS))
    assert given(numbers, [NUMBERS + 1, NUMBERS + 2], 0.0) == [NO_NUMBER, NO_NUMBER]
    assert numbers.unassigned == 2
    numbers.free(np.array([77]), 10.0)
    assert given(numbers, [NUMBERS + 2], 10.0) == [NO_NUMBER]
    assert given(numbers, [NUMBERS + 2, NUMBERS + 3], 10.0 + REST_S) == [77, NO_NUMBER]
