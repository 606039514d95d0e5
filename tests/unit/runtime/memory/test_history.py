"""The history ring beyond single readers: many tracks, and readers while it is written."""

import os
import threading
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.runtime import _kernels as kernels
from multiradar.runtime.memory.bias_board import BiasBoard
from multiradar.runtime.memory.health_board import HealthBoard
from multiradar.runtime.memory.history import UPDATE_DTYPE, TrackHistory
from multiradar.runtime.memory.past_rows import PastRows
from multiradar.settings.limits import RuntimeLimits
from multiradar.state import copied_state, encoded_state, restore_state
from multiradar.tracking.columns import row_type, rows_of, table_of
from multiradar.tracking.lifecycle.transitions import ENDED, TrackTransitions
from multiradar.tracking.outputs import TrackUpdates
from support.kernels import plain
from support.processes.waiting import join
from support.scenarios.live_scene import sensors


def test_identifiers_may_grow_without_end() -> None:
    history = TrackHistory(100)
    rows = np.zeros(3, UPDATE_DTYPE)
    rows["track_id"] = [5, 1_000_000, 5]
    rows["sequence"] = [1, 2, 3]
    history.append(rows)
    assert history.read(1_000_000, None, 5)["sequence"].tolist() == [2]
    assert history.read(5, None, 5)["sequence"].tolist() == [1, 3]
    assert history.read(999_999_999, None, 5)["sequence"].tolist() == []


def test_rows_that_are_never_appended_take_no_memory() -> None:
    """A restart once wrote to 40 MB before the first measurement."""
    small = np.dtype([("track_id", np.int64), ("time_s", np.float64)])
    before_b = _resident_b()
    history = TrackHistory(10_000_000, small)
    assert _resident_b() - before_b < 20e6
    assert len(history) == 0


def _resident_b() -> int:
    pages = int(Path("/proc/self/statm").read_text("utf-8").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def test_a_batch_larger_than_the_ring_leaves_its_end() -> None:
    history = TrackHistory(4)
    rows = np.zeros(11, UPDATE_DTYPE)
    rows["track_id"] = 1
    rows["sequence"] = np.arange(11)
    history.append(rows)
    assert history.read(1, None, 100)["sequence"].tolist() == [7, 8, 9, 10]


class _ReadWhileWritten(TrackHistory):
    found = 0

    def _grow(self, track_id: int) -> None:
        self.found = len(self.after(0, 10)[0])
        super()._grow(track_id)


def test_rows_are_read_only_once_they_are_written() -> None:
    history = _ReadWhileWritten(100)
    rows = np.zeros(3, UPDATE_DTYPE)
    rows["track_id"] = [1, 2, 3]
    history.append(rows)
    assert (history.found, len(history.after(0, 10)[0])) == (0, 3)


@pytest.mark.parametrize("follow", [kernels.follow, plain(kernels.follow)])
def test_a_link_that_leads_forward_ends_the_walk(follow: object) -> None:
    """A row that is overwritten while it is read may link anywhere."""
    assert callable(follow)
    found = np.zeros(10, np.int64)
    links = np.array([-1, 0, 5, 2], np.int64)
    assert follow(links, np.zeros(4), 3, 0, -np.inf, found, False) == 2
    assert found[:2].tolist() == [3, 2]


def test_rows_and_updates_are_the_same_columns() -> None:
    rows = np.zeros(3, UPDATE_DTYPE)
    rows["track_id"] = [7, 8, 9]
    rows["height_m"] = [np.nan, 1.5, -3.0]
    again = rows_of(table_of(TrackUpdates, rows))
    assert again.tobytes() == rows.tobytes()


@pytest.mark.slow
def test_readers_get_complete_rows_of_their_track_during_writes() -> None:
    history, done = TrackHistory(64), threading.Event()
    wrong: list[str] = []

    def read() -> None:
        while not done.is_set():
            found = history.read(3, None, 40)
            sequence = found["sequence"]
            if not (np.all(found["track_id"] == 3) and np.all(np.diff(sequence) > 0)):
                wrong.append(f"tracks {found['track_id']}, numbers {sequence}")
            if not np.array_equal(found["height_m"], sequence.astype(np.float64)):
                wrong.append(f"heights {found['height_m']} of {sequence}")

    readers = [threading.Thread(target=read) for _ in range(2)]
    for reader in readers:
        reader.start()
    random = np.random.default_rng(1)
    sequence = 0
    for _ in range(3000):
        rows = np.zeros(23, UPDATE_DTYPE)
        rows["track_id"] = random.integers(1, 5, 23)
        rows["sequence"] = np.arange(sequence, sequence + 23)
        rows["height_m"] = rows["sequence"]
        sequence += 23
        history.append(rows)
    done.set()
    for reader in readers:
        join(reader)
    assert wrong == []


def _numbered(first: int, count: int) -> NDArray[np.void]:
    rows = np.zeros(count, UPDATE_DTYPE)
    rows["track_id"] = 1 + np.arange(first, first + count) % 3
    rows["time_s"] = np.arange(first, first + count)
    return rows


def test_rows_of_all_tracks_are_read_on_from_a_number() -> None:
    history = TrackHistory(100)
    history.append(_numbered(0, 5))
    rows, number, skipped = history.after(None, 10)
    assert (rows["time_s"].tolist(), number, skipped) == ([0.0, 1.0, 2.0, 3.0, 4.0], 5, 0)
    history.append(_numbered(5, 2))
    rows, number, skipped = history.after(number, 10)
    assert (rows["time_s"].tolist(), number, skipped) == ([5.0, 6.0], 7, 0)
    rows, number, skipped = history.after(number, 10)
    assert (len(rows), number, skipped) == (0, 7, 0)


def test_rows_beyond_the_limit_or_overwritten_are_counted_as_skipped() -> None:
    history = TrackHistory(8)
    history.append(_numbered(0, 6))
    history.append(_numbered(6, 14))
    rows, number, skipped = history.after(2, 3)
    assert (rows["time_s"].tolist(), number, skipped) == ([17.0, 18.0, 19.0], 20, 15)
    rows, _, skipped = history.after(2, 100)
    assert (rows["time_s"].tolist(), skipped) == ([float(one) for one in range(12, 20)], 10)


def test_a_number_from_before_a_restart_starts_with_the_newest() -> None:
    history = TrackHistory(8)
    history.append(_numbered(0, 4))
    rows, number, skipped = history.after(1000, 2)
    assert (rows["time_s"].tolist(), number, skipped) == ([2.0, 3.0], 4, 0)


@pytest.mark.parametrize("appended", [0, 5, 64, 100, 301])
def test_a_span_of_time_has_the_retained_rows_in_order_of_time(appended: int) -> None:
    """Rows may be appended out of order by as much as `DISORDER_S`."""
    generator = np.random.default_rng(appended)
    rows = np.zeros(appended, UPDATE_DTYPE)
    rows["time_s"] = np.arange(appended) * 10.0 + generator.uniform(-14.0, 14.0, appended)
    rows["track_id"] = generator.integers(1, 9, appended)
    history = TrackHistory(64)
    for start in range(0, appended, 7):
        history.append(rows[start : start + 7])
    kept = np.sort(rows[-64:], order="time_s") if appended else rows
    assert history.oldest_s == (rows["time_s"][-64:][0] if appended else None)
    for after_s, until_s in [(-np.inf, np.inf), (300.0, 420.0), (2500.0, 2777.7), (5e3, 6e3)]:
        wanted = kept[(kept["time_s"] > after_s) & (kept["time_s"] <= until_s)]
        assert history.between(after_s, until_s).tobytes() == wanted.tobytes()


@pytest.mark.parametrize("steps", [[], [(40, 100.0)], [(30, 250.0), (60, 120.0)], [(0, 0.0)]])
@pytest.mark.parametrize("capacity", [30, 64, 200])
def test_after_a_step_back_rows_with_later_times_before_it_are_superseded(
    steps: list[tuple[int, float]], capacity: int
) -> None:
    """A search by time once found rows of terminated tracks, and none of the present ones."""
    generator = np.random.default_rng(capacity)
    rows = np.zeros(100, UPDATE_DTYPE)
    rows["sequence"] = np.arange(100)
    rows["track_id"] = 1 + np.arange(100) % 3
    starts_s = dict(steps)
    time_s, history = 0.0, TrackHistory(capacity)
    valid_s = np.full(100, np.inf)
    for number in range(100):
        if number in starts_s:
            time_s = starts_s[number]
            history.set_back(time_s)
            valid_s[:number] = np.minimum(valid_s[:number], time_s)
        rows["time_s"][number] = time_s + generator.uniform(0.0, 9.0)
        time_s += 10.0
        history.append(rows[number : number + 1])
    kept = np.arange(100) >= 100 - capacity
    valid = rows["time_s"] <= valid_s
    ordered_s = np.minimum(rows["time_s"], valid_s)
    for after_s, until_s in [(-np.inf, np.inf), (90.0, 160.0), (200.0, 333.0), (119.0, 121.0)]:
        inside = kept & (ordered_s > after_s) & (ordered_s <= until_s)
        for superseded, expected in ((False, rows[inside & valid]), (True, rows[inside])):
            found = history.between(after_s, until_s, superseded=superseded)
            assert sorted(found["sequence"].tolist()) == sorted(expected["sequence"].tolist())
        past = rows[kept & valid & (rows["time_s"] <= until_s)]
        newest = np.sort(past, order="time_s")[-7:]
        assert history.last_until(until_s, 7)["sequence"].tolist() == newest["sequence"].tolist()
    first = int(np.flatnonzero(kept)[0])
    assert history.oldest_s == ordered_s[first]
    assert history.complete_from_s == (ordered_s[first] if capacity < 100 else -np.inf)
    since = max([0, *starts_s])
    assert history.first_since_set_back == since
    newest = history.after(None, 1000)[0]
    assert newest["sequence"].tolist() == list(range(max(since, first), 100))
    # Tracks are read whole.
    track = rows[kept & (rows["track_id"] == 2)]
    assert history.read(2, None, 1000)["sequence"].tolist() == track["sequence"].tolist()


def test_steps_without_rows_between_them_are_one_step() -> None:
    """Each of them was kept, and searched by every reader, until a row was overwritten."""
    history, rows = TrackHistory(50), np.zeros(10, UPDATE_DTYPE)
    rows["track_id"], rows["time_s"] = 1, 100.0 + np.arange(10)
    history.append(rows)
    for time_s in (108.0, 104.5, 106.0):
        history.set_back(time_s)
    assert len(history._set_backs) == 1
    assert history.between(0.0, 200.0)["time_s"].tolist() == [100.0, 101.0, 102.0, 103.0, 104.0]
    history.append(rows[4:])
    history.set_back(105.0)
    assert len(history._set_backs) == 2


def test_tracks_terminated_by_a_step_back_have_ended_at_its_time_also_after_a_restart() -> None:
    sensors_, limits = sensors(), RuntimeLimits()

    def past() -> PastRows:
        return PastRows(limits, BiasBoard(sensors_, 100), HealthBoard())

    one, other = past(), past()
    steps = np.zeros(2, row_type(TrackTransitions))
    steps["track_id"], steps["time_s"] = [1, 2], [100.0, 400.0]
    steps["transition"] = ENDED
    one.transitions.append(steps)
    one.set_back(200.0)
    restore_state(other, encoded_state(copied_state(one)))
    other.transitions.refill(0, one.transitions.rows(0, 2))
    for known in (one, other):
        assert known.ended_between(150.0, 199.0).tolist() == []
        assert known.ended_between(150.0, 210.0).tolist() == [2]
        assert known.ended_between(200.0, 500.0).tolist() == []
        assert known.ended_between(0.0, 500.0).tolist() == [1, 2]
