"""Sources that flood the service, or send mostly rejected rows: they delay no others."""

from collections.abc import Iterator
from concurrent.futures import Future
from typing import Any

import polars as pl
import pytest

from multiradar.api.problems import _translated
from multiradar.clock import FixedClock
from multiradar.errors import QuarantineError, QueueFullError
from multiradar.observability.pipeline_metrics import PipelineCollector
from multiradar.runtime.admission.sources import (
    OTHERS,
    REJECTED_COST,
    SOURCES_MAX,
    UNREADABLE_ROW_OCTETS,
    Sources,
)
from multiradar.runtime.live.receipt import Receipt
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.entries import Entry, EntryKind, RejectedRow
from support.processes.live_services import GatedJournal, Starter, services, settled
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import recording

LIMITS = RuntimeLimits(quarantine_rejects_min=1000, quarantine_rows_per_s=10)
ROWS = recording(400)
CIRCUMSTANCES = ("TIME_LATE", "RATE_EXCEEDED", "DUPLICATE", "TIME_FUTURE", "SENSOR_DISABLED")


@pytest.fixture
def start() -> Iterator[Starter]:
    with services() as starter:
        yield starter


@pytest.fixture
def sources(clock: FixedClock) -> Sources:
    return Sources(LIMITS, clock)


@pytest.fixture
def clock() -> FixedClock:
    return FixedClock(100.0)


def _entry(accepted: int, rejected: int, code: str = "OUT_OF_RANGE", source: str = "x") -> Entry:
    row = RejectedRow(0, code, "")
    return Entry(EntryKind.BATCH, source, None, b"", accepted, (row,) * rejected, "")


def _held(service: Any, gate: GatedJournal) -> "Future[Receipt]":
    """Submit a message that the journal holds, so that those after it wait."""
    first: Future[Receipt] = service.submit(ROWS[:1], source="first")
    assert gate.entered.wait(WAIT_TIMEOUT_S)
    return first


def test_a_source_that_floods_the_service_does_not_delay_the_others(start: Starter) -> None:
    gate = GatedJournal()
    service = start(gate, commit_batches_max=4, commit_rows_max=20)
    _held(service, gate)
    flood = [service.submit(ROWS[n : n + 1], source="flood") for n in range(1, 100)]
    other = service.submit(ROWS[200:201], source="other")
    gate.open.set()
    place = other.result(WAIT_TIMEOUT_S).journal_sequence
    numbers = [one.result(WAIT_TIMEOUT_S).journal_sequence for one in flood]
    # After the one that was held, and the oldest.
    assert place == 3
    assert numbers == sorted(numbers)


def test_rejected_rows_of_a_source_do_not_delay_the_others(start: Starter) -> None:
    """They take longer than accepted ones: a transaction has fewer of them."""
    gate = GatedJournal()
    service = start(gate, commit_rows_max=2000)
    transactions, append = [], gate.append
    gate.append = lambda entries: transactions.append(len(entries)) or append(entries)  # type: ignore[method-assign,func-returns-value]
    bad = pl.concat([ROWS] * 3).with_columns(sensor_id=pl.lit("unlisted"))
    gate.open.set()
    service.submit(bad, source="bad").result(WAIT_TIMEOUT_S)
    gate.open.clear()
    gate.entered.clear()
    _held(service, gate)
    flood = [service.submit(bad[:100], source="bad") for _ in range(8)]
    other = service.submit(ROWS[200:201], source="other")
    gate.open.set()
    # Of 800 rows, the first transaction takes the first message and then the other source.
    assert other.result(WAIT_TIMEOUT_S).journal_sequence == 4
    numbers = [one.result(WAIT_TIMEOUT_S).journal_sequence for one in flood]
    assert numbers == [3, 5, 6, 7, 8, 9, 10, 11]
    assert transactions == [1, 1, 3, 2, 2, 2]


def test_sources_that_do_not_flood_keep_their_order(start: Starter) -> None:
    gate = GatedJournal()
    service = start(gate)
    _held(service, gate)
    # One sends often, another seldom: in turns the messages of the first would be late.
    sources = ["seldom" if n % 10 == 0 else "often" for n in range(1, 150)]
    pending = [service.submit(ROWS[n : n + 1], source=one) for n, one in enumerate(sources, 1)]
    gate.open.set()
    numbers = [one.result(WAIT_TIMEOUT_S).journal_sequence for one in pending]
    assert numbers == sorted(numbers)


def test_a_long_message_does_not_share_its_transaction_with_many(start: Starter) -> None:
    gate = GatedJournal()
    service = start(gate, commit_rows_max=100)
    transactions, append = [], gate.append
    gate.append = lambda entries: transactions.append(len(entries)) or append(entries)  # type: ignore[method-assign,func-returns-value]
    _held(service, gate)
    pending = [service.submit(ROWS[n : n + 60], source="x") for n in (1, 61, 121, 181)]
    gate.open.set()
    assert {one.result(WAIT_TIMEOUT_S).accepted for one in pending} == {60}
    assert transactions == [1, 2, 2]


def test_a_source_has_a_share_of_the_queue_and_its_excess_is_counted(start: Starter) -> None:
    gate = GatedJournal()
    service = start(gate, source_batches_max=2, source_rows_max=50, retry_after_s=3.0)
    _held(service, gate)
    pending = [service.submit(ROWS[n : n + 1], source="flood") for n in (1, 2)]
    for source, rows in (("flood", ROWS[3:8]), ("long", ROWS[10:70])):
        if source == "long":
            pending.append(service.submit(ROWS[9:10], source="long"))
        with pytest.raises(QueueFullError, match=source) as full:
            service.submit(rows, source=source)
        assert full.value.retry_after_s == 3.0
    pending.append(service.submit(ROWS[100:140], source="other"))
    gate.open.set()
    for one in pending:
        one.result(WAIT_TIMEOUT_S)
    status: Any = settled(service)
    flood = {"accepted": 2, "rejected": 0, "deferred_messages": 1, "deferred_rows": 5}
    assert status["sources"]["flood"] == {**flood, "quarantined": False}
    assert status["sources"]["long"]["deferred_rows"] == 60
    assert status["read"] == status["accepted"] == 1 + 2 + 1 + 40


def test_the_end_of_a_stream_comes_after_what_was_sent_before_it_by_others(start: Starter) -> None:
    gate = GatedJournal()
    service = start(gate)
    _held(service, gate)
    before = [service.submit(ROWS[n : n + 1], source=f"s{n % 3}") for n in range(1, 30)]
    end = service.flush(source="s0")
    gate.open.set()
    last = end.result(WAIT_TIMEOUT_S).journal_sequence
    numbers = {one.result(WAIT_TIMEOUT_S).journal_sequence for one in before}
    assert max(numbers) < last
    assert not any(one.result().rejected for one in before)


def test_a_source_that_sends_mostly_rejected_rows_is_put_into_quarantine_and_returns(
    sources: Sources, clock: FixedClock
) -> None:
    sources.note(_entry(100, 999))
    sources.require("x", 1)
    sources.note(_entry(0, 1))
    sources.require("x", 5)
    with pytest.raises(QuarantineError, match="x is in quarantine") as rejected:
        sources.require("x", 7)
    assert rejected.value.retry_after_s == pytest.approx(0.5)
    sources.require("other", 7)
    found = sources.document()
    assert found["x"] == {
        "accepted": 100, "rejected": 1000, "deferred_messages": 1, "deferred_rows": 7,
        "quarantined": True,
    }  # fmt: skip
    assert not found["other"]["quarantined"]
    (sentence,) = sources.warnings()
    assert sentence.startswith("x: in quarantine")
    clock.advance(0.5)
    sources.require("x", 100_000)
    with pytest.raises(QuarantineError) as later:
        sources.require("x", 1)
    assert later.value.retry_after_s == 60.0
    sources.note(_entry(1000, 0))
    sources.require("x", 1)
    assert list(sources.warnings()) == []


def test_rows_that_wait_are_expected_to_be_like_those_before(sources: Sources) -> None:
    """The quarantine of a flood began when it had ended: its rows still waited."""
    sources.note(_entry(10, 199))
    sources.require("x", 5, 100_000)
    sources.note(_entry(0, 1))
    sources.require("x", 5, 800)
    assert not sources.document()["x"]["quarantined"]
    sources.require("x", 5, 900)
    with pytest.raises(QuarantineError):
        sources.require("x", 5, 900)
    sources.note(_entry(100, 200, source="mixed"))
    sources.require("mixed", 5, 100_000)
    sources.require("mixed", 5, 100_000)


def test_a_rejected_row_costs_as_much_as_several(sources: Sources) -> None:
    assert sources.cost_rows("x", 10) == 10
    sources.note(_entry(0, 500, "TIME_LATE"))
    assert sources.cost_rows("x", 10) == pytest.approx(10 + 0.5 * 10 * (REJECTED_COST - 1))
    sources.note(_entry(0, 1000))
    assert sources.cost_rows("x", 10) == 10 * REJECTED_COST
    sources.note(_entry(1000, 0))
    assert sources.cost_rows("x", 10) == 10


def test_a_message_of_a_source_in_quarantine_is_rejected_before_its_rows_are_known(
    sources: Sources, clock: FixedClock
) -> None:
    sources.require("x", 0)
    sources.note(_entry(0, 1000))
    sources.require("x", 0)
    sources.require("x", 5)
    with pytest.raises(QuarantineError, match="x is in quarantine") as rejected:
        sources.require("x", 0)
    assert rejected.value.retry_after_s == pytest.approx(0.5)
    found = sources.document()["x"]
    assert (found["deferred_messages"], found["deferred_rows"]) == (1, 0)
    sources.require("other", 0)
    clock.advance(0.5)
    sources.require("x", 0)
    # Only what has rows delays the next.
    sources.require("x", 0)


def test_a_quarantine_ends_by_itself(sources: Sources, clock: FixedClock) -> None:
    sources.note(_entry(0, 1000))
    assert sources.document()["x"]["quarantined"]
    clock.advance(600.0)
    assert not sources.document()["x"]["quarantined"]


@pytest.mark.parametrize("code", CIRCUMSTANCES)
def test_rows_rejected_by_circumstances_are_no_reason(sources: Sources, code: str) -> None:
    sources.note(_entry(0, 5000, code))
    assert not sources.document()["x"]["quarantined"]


@pytest.mark.parametrize("code", CIRCUMSTANCES)
def test_rows_rejected_by_circumstances_do_not_outweigh_invalid_ones(
    sources: Sources, code: str
) -> None:
    sources.note(_entry(0, 5000, code))
    sources.note(_entry(50, 1000))
    assert sources.document()["x"]["quarantined"]


def test_messages_that_cannot_be_read_lead_to_a_quarantine_by_their_size(
    sources: Sources, clock: FixedClock
) -> None:
    size = 400 * UNREADABLE_ROW_OCTETS
    for _ in range(2):
        sources.note_unreadable("x", size)
        sources.require("x", 0)
    sources.note_unreadable("x", size)
    with pytest.raises(QuarantineError) as rejected:
        sources.require("x", 0)
    # The third is more than the source may send.
    assert rejected.value.retry_after_s == pytest.approx(40.0)
    clock.advance(40.0)
    sources.require("x", 0)
    assert sources.document()["x"]["quarantined"]
    clock.advance(600.0)
    assert not sources.document()["x"]["quarantined"]


def test_many_sources_are_counted_together(sources: Sources) -> None:
    for number in range(SOURCES_MAX + 5):
        sources.note(_entry(1, 0, source=f"s{number}"))
    found = sources.document()
    assert len(found) == SOURCES_MAX + 1
    assert found[OTHERS]["accepted"] == 5


def test_all_rows_of_a_source_in_quarantine_are_accounted_for(start: Starter) -> None:
    service = start(quarantine_rejects_min=100, quarantine_rows_per_s=1)
    bad = ROWS[:200].with_columns(range_m=pl.lit(-1.0), kind=pl.lit("radar"))
    receipt = service.submit(bad, source="bad").result(WAIT_TIMEOUT_S)
    assert len(receipt.rejected) == 200
    service.submit(bad[:90], source="bad").result(WAIT_TIMEOUT_S)
    with pytest.raises(QuarantineError) as rejected:
        service.submit(bad, source="bad")
    answer = _translated(rejected.value)
    assert (answer.status, answer.code) == (429, "SOURCE_QUARANTINED")
    assert int(answer.headers["retry-after"]) >= 1
    assert service.submit(ROWS[:9], source="good").result(WAIT_TIMEOUT_S).accepted == 9
    status: Any = settled(service)
    assert (status["read"], status["accepted"], status["rejected"]) == (299, 9, 290)
    assert status["sources"]["bad"]["deferred_rows"] == 200
    assert status["alarms"] == ["source_quarantined"]
    assert any("bad: in quarantine" in one for one in status["warnings"])
    metrics = {
        (sample.name, *sample.labels.values()): sample.value
        for metric in PipelineCollector(lambda: status).collect()
        for sample in metric.samples
    }
    assert metrics["multiradar_source_quarantined", "bad"] == 1.0
    assert metrics["multiradar_source_rows_total", "bad", "deferred"] == 200.0
    assert metrics["multiradar_source_rows_total", "good", "accepted"] == 9.0
