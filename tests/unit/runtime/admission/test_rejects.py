"""Rejected rows have a count, a reason and an origin, including duplicates."""

import json
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from multiradar.runtime.admission.origins import Origins
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.memory.reject_board import RejectBoard
from multiradar.storage.entries import RejectedRow
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.input.duplicates import Duplicates
from multiradar.tracking.input.order import ReorderBuffer
from multiradar.tracking.settings import TrackingSettings
from support.inputs.batches import batch_of
from support.processes.live_services import TABLE, Starter, services, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import recording


@pytest.fixture
def start() -> Iterator[Starter]:
    """Start services that are stopped at the end."""
    with services() as starter:
        yield starter


def engine() -> Engine:
    return Engine(TABLE, TrackingSettings())


def spoilt(rows: int) -> pl.DataFrame:
    row = pl.int_range(rows)
    return recording(rows).with_columns(
        sensor_id=pl.when(row % 50 == 7).then(pl.lit("unlisted")).otherwise("sensor_id"),
        height_m=pl.when(row == 11).then(float("nan")).otherwise("height_m"),
    )


@pytest.mark.fault(12)
def test_rejects_are_counted_by_code_and_the_last_of_each_are_retained(start: Starter) -> None:
    service = start(engine=engine)
    submit(service, spoilt(200))
    submit(service, recording(200)[170:175])
    service.flush(source="test").result(WAIT_TIMEOUT_S)
    status = settled(service)
    assert status["rejected_by_code"] == {"DUPLICATE": 5, "NON_FINITE": 1, "UNKNOWN_SENSOR": 4}
    assert (status["read"], status["accepted"], status["rejected"]) == (205, 200, 5)
    unknown = service.quarantined(0, 100, "UNKNOWN_SENSOR")
    assert [(row.number, row.row.index) for row in unknown] == [(1, 7), (2, 57), (3, 107), (4, 157)]
    assert [row.number for row in service.quarantined(2, 1, "UNKNOWN_SENSOR")] == [3]
    assert service.quarantined(0, 100, "TRUNCATED") == []
    twice = service.quarantined(0, 100, "DUPLICATE")
    assert sorted((row.sequence, row.row.index) for row in twice) == [(2, at) for at in range(5)]
    sent = recording(200)[170:175]
    for row in twice:
        assert json.loads(row.row.raw)["time_s"] == sent["time_s"][row.row.index]
        assert "same measurement as at" in row.row.reason


def test_rejects_are_the_same_after_a_restart(start: Starter) -> None:
    journal = MemoryJournal()
    first = start(journal, engine=engine)
    submit(first, spoilt(200))
    submit(first, recording(200)[170:175])
    first.flush(source="test").result(WAIT_TIMEOUT_S)
    before = settled(first)["rejected_by_code"], first.quarantined(0, 100, "DUPLICATE")
    first.stop()
    again = start(journal, engine=engine)
    assert (settled(again)["rejected_by_code"], again.quarantined(0, 100, "DUPLICATE")) == before


def test_many_rejects_are_all_counted_and_the_last_retained() -> None:
    board = RejectBoard(TABLE, 3)
    board.record(1, "a", [RejectedRow(row, "TOO_LARGE", "why", "") for row in range(10)])
    twice = Duplicates.equal(np.arange(5), batch_of([float(row) for row in range(5)]))
    board.record_duplicates(twice, [(2, row) for row in range(5)])
    assert board.counts == {"DUPLICATE": 5, "TOO_LARGE": 10}
    assert [(one.number, one.row.index) for one in board.last("TOO_LARGE")] == [
        (8, 7),
        (9, 8),
        (10, 9),
    ]
    assert [(one.number, one.row.index) for one in board.last("DUPLICATE")] == [
        (3, 2),
        (4, 3),
        (5, 4),
    ]
    board.clear()
    assert (board.counts, board.last("TOO_LARGE")) == ({}, [])


def test_origins_of_buffered_measurements_are_found_and_others_discarded() -> None:
    places = Origins()
    places.add(7, 3)
    places.add(8, 0)
    places.add(9, 2, np.array([4, 6]))
    assert places.find([0, 2, 3, 4]) == [(7, 0), (7, 2), (9, 4), (9, 6)]
    places.discard(4)
    assert places.find([4]) == [(9, 6)]
    assert len(places._parts) == 1


def test_the_buffer_reports_duplicates_by_arrival_number() -> None:
    buffer = ReorderBuffer(2.0)
    buffer.push(batch_of([3.0, 1.0, 2.0]))
    assert buffer.waiting_from == 0
    buffer.push(batch_of([1.0, 4.0, 3.0]))
    # All before 2 s have left: the first row of all is still waiting.
    assert buffer.dropped.arrival.tolist() == [3]
    assert buffer.waiting_from == 0
    rest = buffer.flush()
    assert rest is not None
    assert rest.time_s.tolist() == [2.0, 3.0, 4.0]
    assert buffer.arrivals.tolist() == [2, 0, 4]
    assert buffer.dropped.arrival.tolist() == [5]
    assert buffer.waiting_from == 6


def test_a_near_duplicate_reports_its_distance() -> None:
    found = replace(
        Duplicates.equal(np.array([1]), batch_of([5.25])),
        twin_time_s=np.array([5.0]),
        range_apart_m=np.array([7.25]),
        azimuth_apart_rad=np.radians([0.01]),
    )
    assert found.reasons() == [
        "duplicate of the plot of the same sensor at 5.0 s: 0.250 s, 7.2 m and 0.0100° apart"
    ]


def test_of_rows_in_few_messages_and_in_many_the_same_number_is_retained() -> None:
    rows = [RejectedRow(at, "OUT_OF_RANGE", f"was {at}", "\udcff\u00e9") for at in range(25)]
    whole, single = RejectBoard(TABLE, 10), RejectBoard(TABLE, 10)
    for board, size in ((whole, 25), (single, 1)):
        for first in range(0, 25, size):
            board.record(3, "http", rows[first : first + size])
    last = whole.last("OUT_OF_RANGE")
    assert [(one.number, one.sequence, one.source) for one in last] == [
        (number, 3, "http") for number in range(16, 26)
    ]
    assert [one.row for one in last] == rows[15:]
    assert single.last("OUT_OF_RANGE") == last
    whole.record(4, "http", rows[:3])
    assert [one.number for one in whole.last("OUT_OF_RANGE")] == list(range(19, 29))
    assert whole.last("TRUNCATED") == []
