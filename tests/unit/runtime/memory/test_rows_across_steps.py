"""Rows of a track or a sensor across a step back, from memory and from files that lag behind it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import polars as pl
import pytest
from numpy.typing import NDArray

from multiradar.runtime.live.publication import Publication
from multiradar.runtime.memory.bias_board import bias_rows_frame
from multiradar.runtime.memory.history import SPREAD_DTYPE, update_rows_frame
from multiradar.runtime.queries.registry import BIASES, UPDATES, History
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.columns import rows_of
from multiradar.tracking.outputs import NO_OUTPUT, BiasRecords
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.live_scene import sensors

TABLE = sensors()
SENSOR = TABLE.ids[0]
CAPACITY = 100
#: From one row to the next, s.
PERIOD_S = 4.0


class Files:
    """A history with the rows that have been written."""

    oldest_s = written_s = None

    def __init__(self) -> None:
        self.frames: list[pl.DataFrame] = []

    def at(self, at_s: float) -> None:
        """There are no pictures."""

    def rows(
        self, name: str, subject: int | str, since_s: float, before_s: float, limit: int, *,
        last: bool = False,
    ) -> pl.DataFrame:  # fmt: skip
        """Return rows as `HistoryReader` does."""
        key = "sensor_id" if name == "biases" else "track_id"
        time_s = pl.col("time_s")
        rows = pl.concat(self.frames).filter(pl.col(key) == subject)
        rows = rows.filter(time_s >= since_s, time_s < before_s).sort("time_s", maintain_order=True)
        return rows.tail(limit) if last else rows.head(limit)


class Past:
    """What memory has of the past of a service, and what its files have."""

    def __init__(self, *, keeps_files: bool = True) -> None:
        limits = RuntimeLimits(
            history_rows_max=CAPACITY, bias_history_rows_max=CAPACITY, events_max=10
        )
        self.publication = Publication(TABLE, TrackingSettings(), limits)
        self.files = Files()
        self.view: Any = self.publication.view
        if keeps_files:
            self.view.keep_history(self.files, lambda: ([], []))

    def step(self, time_s: float) -> None:
        """Set the data time back."""
        self.publication.known.absorb(NO_OUTPUT, time_s)
        self.publication.known.set_back()

    def updates(self, track_id: int, times_s: Sequence[float], *, written: bool) -> None:
        """Update a track."""
        rows: NDArray[np.void] = np.zeros(len(times_s), SPREAD_DTYPE)
        rows["track_id"], rows["time_s"] = track_id, times_s
        self.publication.known.past.updates.append(rows)
        if written:
            self.files.frames.append(update_rows_frame(rows, TABLE))

    def biases(self, times_s: Sequence[float], *, written: bool) -> None:
        """Estimate a bias."""
        none, ones = np.zeros(len(times_s), np.int64), np.ones(len(times_s))
        records = BiasRecords(
            (np.array(times_s) / PERIOD_S).astype(np.int64), np.array(times_s, np.float64),
            none.astype(np.int32), none.astype(np.int8), ones, ones,
        )  # fmt: skip
        self.publication.known._biases.append(records)
        if written:
            self.files.frames.append(bias_rows_frame(rows_of(records), TABLE))

    def times_s(
        self, history: History, subject: int | str, since_s: float, until_s: float | None = None
    ) -> list[float]:
        """Return the times of the rows since a time."""
        found: pl.DataFrame = self.view.rows(history, subject, since_s, 1000, until_s)
        return found["time_s"].to_list()


def spaced(begin_s: float, count: int) -> list[float]:
    """Return the times of rows."""
    return [begin_s + PERIOD_S * number for number in range(count)]


@pytest.fixture
def past() -> Past:
    """Nothing is retained, and nothing is written."""
    return Past()


def test_biases_since_a_step_are_those_of_memory_until_they_are_written(past: Past) -> None:
    """None of them was answered if the oldest row of memory was from before the step."""
    past.biases(spaced(41_000.0, 150), written=True)
    past.step(400.0)
    after = spaced(404.0, 50)
    past.biases(after, written=False)
    assert past.publication.known.past.complete_from_s("biases") == 400.0
    assert past.times_s(BIASES, SENSOR, 400.0)[:50] == after
    assert past.times_s(BIASES, SENSOR, 400.0, 600.0) == [one for one in after if one <= 600.0]
    assert past.times_s(BIASES, SENSOR, 500.0, 600.0) == spaced(500.0, 26)


def test_biases_without_a_step_are_answered_once(past: Past) -> None:
    every = spaced(1000.0, 250)
    past.biases(every[:200], written=True)
    past.biases(every[200:], written=False)
    for since_s in (0.0, every[149], every[150], every[151], every[240]):
        expected = [one for one in every if one >= since_s]
        assert past.times_s(BIASES, SENSOR, since_s) == expected
        assert past.times_s(BIASES, SENSOR, since_s, every[-1]) == expected


def test_a_track_that_a_step_terminated_has_the_rows_that_memory_has_lost(past: Past) -> None:
    """Only the rows of memory were answered."""
    before, after = spaced(600.0, 100), spaced(500.0, 40)
    past.updates(1, before, written=True)
    past.step(500.0)
    past.updates(2, after, written=False)
    assert past.times_s(UPDATES, 1, 600.0) == before
    assert past.times_s(UPDATES, 1, 600.0, 900.0) == spaced(600.0, 76)
    assert past.times_s(UPDATES, 1, 900.0) == spaced(900.0, 25)
    # Memory has all of the second one, and the files nothing.
    assert past.times_s(UPDATES, 2, 0.0) == after
    # Rows of the first one are no longer in memory at all.
    past.updates(2, spaced(660.0, 80), written=False)
    assert past.times_s(UPDATES, 1, 600.0) == before
    assert past.times_s(UPDATES, 1, 600.0, 900.0) == spaced(600.0, 76)
    # The first rows of the second one are lost and written.
    past.files.frames.append(past.publication.known.history(2, None, 1000))
    past.updates(2, spaced(980.0, 30), written=False)
    assert past.times_s(UPDATES, 2, 600.0) == spaced(600.0, 125)


def test_a_track_without_a_step_is_answered_once(past: Past) -> None:
    every = spaced(1000.0, 250)
    past.updates(1, every[:200], written=True)
    past.updates(1, every[200:], written=False)
    for since_s in (0.0, every[149], every[160], every[240]):
        expected = [one for one in every if one >= since_s]
        assert past.times_s(UPDATES, 1, since_s) == expected
        assert past.times_s(UPDATES, 1, since_s, every[-1]) == expected


def test_rows_until_a_time_are_those_of_memory_without_files() -> None:
    past = Past(keeps_files=False)
    past.updates(1, [1.0, 5.0, 7.0, 9.0, 13.0], written=False)
    assert past.view.rows(UPDATES, 1, None, 3, 9.0)["time_s"].to_list() == [5.0, 7.0, 9.0]
