"""The history ring gives what a list of all rows would give, as far as it reaches back."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from multiradar.runtime.memory.history import UPDATE_DTYPE, TrackHistory
from multiradar.runtime.memory.live_tracks import LiveTracks

_TRACKS = st.lists(st.lists(st.integers(1, 6), max_size=12), max_size=12)


def _rows(tracks: list[int], first: int) -> NDArray[np.void]:
    rows = np.zeros(len(tracks), UPDATE_DTYPE)
    rows["track_id"] = tracks
    rows["sequence"] = np.arange(first, first + len(tracks))
    # Several rows at the same time.
    rows["time_s"] = rows["sequence"] // 2
    return rows


@given(_TRACKS, st.integers(1, 30), st.integers(1, 8), st.one_of(st.none(), st.integers(-1, 60)))
def test_reading_is_filtering_the_rows_that_are_kept(
    batches: list[list[int]], capacity: int, limit: int, since_s: float | None
) -> None:
    history, every = TrackHistory(capacity), np.zeros(0, UPDATE_DTYPE)
    for tracks in batches:
        rows = _rows(tracks, len(every) + 1)
        if len(rows):
            history.append(rows)
        every = np.concatenate([every, rows])
        kept = every[-capacity:]
        for track in range(8):
            expected = kept[kept["track_id"] == track]
            if since_s is None:
                expected = expected[-limit:]
            else:
                expected = expected[expected["time_s"] >= since_s][:limit]
            found = history.read(track, since_s, limit)
            assert found["sequence"].tolist() == expected["sequence"].tolist()
    assert len(history) == min(capacity, len(every))


@given(st.lists(st.tuples(st.lists(st.integers(1, 200), max_size=90), st.integers(1, 200))))
def test_live_tracks_are_the_last_rows_of_tracks_that_did_not_end(
    steps: list[tuple[list[int], int]],
) -> None:
    live, expected, ended = LiveTracks(), dict[int, int](), set[int]()
    sequence = 0
    for tracks, end in steps:
        # A track that ended does not come back: identifiers are never used again.
        rows = _rows([track for track in tracks if track not in ended], sequence + 1)
        live.update(rows)
        expected.update(zip(rows["track_id"].tolist(), rows["sequence"].tolist(), strict=True))
        sequence += len(rows)
        live.remove(np.array([end, 10_000]))
        ended.add(end)
        expected.pop(end, None)
        found = live.all()
        assert (
            dict(zip(found["track_id"].tolist(), found["sequence"].tolist(), strict=True))
            == expected
        )
        assert found["track_id"].tolist() == sorted(expected)
        assert len(live) == len(expected)
        one = live.get(end)
        assert one is None
    for track, number in expected.items():
        row = live.get(track)
        assert row is not None
        assert row["sequence"].tolist() == [number]
    assert live.get(0) is None
    assert live.get(10**9) is None
