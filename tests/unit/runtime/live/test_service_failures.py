"""The live pipeline when the disk or the engine fails: nothing is lost, all senders get errors."""

import threading
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import polars as pl
import pytest

from multiradar.errors import (
    JournalBusyError,
    JournalError,
    JournalFullError,
    PipelineError,
)
from multiradar.observability.pipeline_metrics import PipelineCollector
from multiradar.runtime.live import live_diagnosis, processor
from multiradar.runtime.live.alarms.supervision import Supervision
from multiradar.runtime.live.service import Service, ServiceState
from multiradar.runtime.stream.events import Subscription
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from support.fakes.fake_engine import EngineCrashError, FakeEngine
from support.processes.live_services import (
    TABLE,
    FailingJournal,
    Starter,
    services,
    settled,
    submit,
)
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import cut, recording


@pytest.fixture
def start() -> Iterator[Starter]:
    """Start services that are stopped at the end."""
    with services() as starter:
        yield starter


@pytest.mark.parametrize(("owner", "name"), [(Supervision, "note"), (live_diagnosis, "_sensor_of")])
def test_an_error_in_what_is_derived_from_a_message_stops_nothing(
    start: Starter,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    owner: Any,
    name: str,
) -> None:
    """It stopped the journal writer: the message was on disk, and its sender got an error."""

    def fail(*_: Any) -> None:
        raise RecursionError("too deep")

    service = start()
    frame = recording(100)
    bad = frame[10:20].with_columns(sensor_id=pl.lit("99-99"))
    with monkeypatch.context() as patch:
        patch.setattr(owner, name, fail)
        receipt = submit(service, pl.concat([frame[:10], bad]))
    assert (receipt.accepted, len(receipt.rejected)) == (10, 10)
    assert submit(service, frame[20:30]).accepted == 10
    status = settled(service)
    assert (status["state"], status["internal_errors"]) == ("running", 1)
    metrics = {one.name: one for one in PipelineCollector(lambda: status).collect()}
    assert metrics["multiradar_internal_errors"].samples[0].value == 1.0
    assert "alarms or diagnosis of a message from test failed" in caplog.text
    assert "RecursionError: too deep" in caplog.text


def test_a_failed_journal_stops_the_intake_and_reading_continues(start: Starter) -> None:
    journal = FailingJournal(JournalError("disk I/O error"))
    service = start(journal)
    frame = recording(100)
    submit(service, frame[:40])
    journal.failing = True
    with pytest.raises(JournalError, match="disk I/O error"):
        submit(service, frame[40:50])
    journal.failing = False
    with pytest.raises(JournalError, match="disk I/O error"):
        service.submit(frame[50:60], source="test")
    assert service.state is ServiceState.FAILED
    status = settled(service)
    reason = "the journal failed; see the log of the service"
    assert (status["state"], status["failure"]) == ("failed", reason)
    assert status["read"] == status["accepted"] == 40
    assert len(service.view.tracks()) == frame[:40]["track_number"].n_unique()


@pytest.mark.fault(24)
@pytest.mark.parametrize("error", [JournalFullError("no room"), JournalBusyError("locked")])
def test_a_full_disk_or_a_locked_journal_rejects_messages_until_it_can_be_written(
    start: Starter, error: JournalFullError | JournalBusyError
) -> None:
    journal = FailingJournal(error)
    service = start(journal)
    frame = recording(100)
    submit(service, frame[:40])
    journal.failing = True
    later = frame[40:50].with_columns(pl.col("time_s") + 100.0)
    for _ in range(2):
        with pytest.raises(type(error)):
            submit(service, later)
    journal.failing = False
    # Rejected messages did not advance the data clock.
    assert submit(service, frame[50:]).accepted == 50
    assert service.state is ServiceState.RUNNING
    assert settled(service)["read"] == 90
    arrivals = service.view.status()["arrivals"]
    assert sum(one["received"] for one in arrivals.values()) == 90


@pytest.mark.fault(27)
def test_an_entry_that_fails_in_the_engine_is_skipped_and_all_others_count(start: Starter) -> None:
    journal = MemoryJournal()
    frame = recording(100)
    poison = float(frame["time_s"][45])

    def crash(batch: MeasurementBatch) -> None:
        if np.any(batch.time_s == poison):
            raise EngineCrashError("poison")

    service = start(journal, lambda: FakeEngine(crash))
    subscription = service.view.subscribe(0, 10_000)
    for piece in cut(frame, [20, 20, 10, 20]):
        submit(service, piece)
    status = settled(service)
    assert status["skipped"] == [3]
    assert status["output_sequence"] == 90
    numbers = [event.sequence for event in iter_events(subscription.poll)]
    assert numbers == list(range(1, len(numbers) + 1))
    service.stop()

    again = start(journal, lambda: FakeEngine(crash))
    assert settled(again)["output_sha256"] == status["output_sha256"]
    clean = start()
    for piece in [frame[:40], frame[50:]]:
        submit(clean, piece)
    assert settled(clean)["output_sha256"] == status["output_sha256"]


@pytest.mark.fault(27)
def test_readers_that_connect_while_the_engine_is_rebuilt_miss_and_repeat_nothing(
    start: Starter,
) -> None:
    """Their number was taken for that of another journal: a gap, then all events once more."""
    frame = recording(100)
    transient = float(frame["time_s"][45])
    failed: list[bool] = []
    readers: list[Subscription] = []

    def crash(batch: MeasurementBatch) -> None:
        if np.any(batch.time_s == transient) and not failed:
            failed.append(True)
            raise EngineCrashError("transient")
        if failed and not readers:
            readers.extend(service.view.subscribe(after, 10_000) for after in (head, None, 10_000))

    service = start(MemoryJournal(), lambda: FakeEngine(crash))
    for piece in (frame[:20], frame[20:40]):
        submit(service, piece)
    head = int(settled(service)["event_sequence"])  # type: ignore[call-overload]
    submit(service, frame[40:])
    last = settled(service)["event_sequence"]
    known, later, foreign = (iter_events(reader.poll) for reader in readers)
    assert [one.sequence for one in known] == [*range(head + 1, last + 1)]  # type: ignore[operator]
    assert later == known
    assert [one.kind for one in foreign] == ["gap"]
    assert service.view.subscribe(10_000, 10_000).poll(1)[0].kind == "gap"


@pytest.mark.parametrize("count", [2, 3])
def test_a_journal_has_no_more_entries_that_fail_than_the_bound(
    start: Starter, monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    monkeypatch.setattr(processor, "POISON_ENTRIES_MAX", 2)
    journal, pieces = MemoryJournal(), cut(recording(50), [10, 10, 10, 10])
    service = start(journal)
    for piece in pieces:
        submit(service, piece)
    service.stop()
    poison = [float(piece["time_s"][0]) for piece in pieces[1 : 1 + count]]

    def crash(batch: MeasurementBatch) -> None:
        if np.isin(batch.time_s, poison).any():
            raise EngineCrashError("poison")

    if count == 2:
        assert settled(start(journal, lambda: FakeEngine(crash)))["skipped"] == [2, 3]
        return
    with pytest.raises(PipelineError, match="failed on more than 2 journal entries"):
        start(journal, lambda: FakeEngine(crash))


def test_an_entry_without_measurements_is_not_skipped_with_the_next_one(start: Starter) -> None:
    frame = recording(60)
    poison = float(frame["time_s"][40])

    def crash(batch: MeasurementBatch) -> None:
        if np.any(batch.time_s == poison):
            raise EngineCrashError("poison")

    service = start(engine=lambda: FakeEngine(crash))
    submit(service, frame[:40])
    submit(service, frame[40:45].with_columns(sensor_id=pl.lit("unknown")))
    submit(service, frame[40:41])
    submit(service, frame[41:])
    assert settled(service)["skipped"] == [3]


def test_an_engine_that_fails_once_loses_nothing(start: Starter) -> None:
    failures = iter([True])

    def crash(_batch: MeasurementBatch) -> None:
        if next(failures, False):
            raise EngineCrashError("a passing weakness")

    service = start(engine=lambda: FakeEngine(crash))
    submit(service, recording(100))
    status = settled(service)
    assert (status["skipped"], status["output_sequence"]) == ([], 100)


def test_a_cancelled_wait_does_not_stop_the_engine(start: Starter) -> None:
    service, gate = start(), threading.Event()
    frame = recording(20)
    publication, publish = service.publication, service.publication.publish

    def publish_late(output: EngineOutput, data_time_s: float | None, ends: bool = False) -> None:
        gate.wait(WAIT_TIMEOUT_S)
        publish(output, data_time_s, ends)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(publication, "publish", publish_late)
        submit(service, frame[:10])
        waiting = service.settled()
        assert waiting.cancel()
        gate.set()
        assert service.settled().result(WAIT_TIMEOUT_S) == 10
    submit(service, frame[10:])
    assert service.settled().result(WAIT_TIMEOUT_S) == 20
    assert service.state is ServiceState.RUNNING


def test_a_cancelled_wait_does_not_block_the_stop(start: Starter) -> None:
    service, gate = start(), threading.Event()

    def crash(*_output: object) -> None:
        gate.wait(WAIT_TIMEOUT_S)
        raise OSError("no room for the output")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(service.publication, "publish", crash)
        submit(service, recording(10))
        left, stays = service.settled(), service.settled()
        assert left.cancel()
        gate.set()
        with pytest.raises(PipelineError, match="the engine has stopped"):
            stays.result(WAIT_TIMEOUT_S)
    assert service.state is ServiceState.FAILED


@pytest.mark.fault(26)
def test_an_engine_that_always_fails_stops_the_service_with_an_error(start: Starter) -> None:
    def crash(_batch: MeasurementBatch) -> None:
        raise MemoryError

    service = start(engine=lambda: FakeEngine(crash))
    submit(service, recording(10))
    with pytest.raises(PipelineError, match="out of memory"):
        service.settled().result(WAIT_TIMEOUT_S)
    assert service.state is ServiceState.FAILED
    with pytest.raises(PipelineError, match="out of memory"):
        service.submit(recording(10), source="test")


def test_requests_after_a_failure_of_the_engine_fail(start: Starter) -> None:
    """Once, waiting for processing after a failure of the engine never returned."""

    def crash(_batch: MeasurementBatch) -> None:
        raise MemoryError

    service = start(engine=lambda: FakeEngine(crash))
    submit(service, recording(10))
    with pytest.raises(PipelineError, match="out of memory"):
        service.settled().result(WAIT_TIMEOUT_S)
    with pytest.raises(PipelineError, match="out of memory"):
        service.settled().result(WAIT_TIMEOUT_S)
    service.stop()
    with pytest.raises(PipelineError, match="out of memory"):
        service.settled().result(WAIT_TIMEOUT_S)


def test_the_end_of_a_stream_fails_with_the_engine(start: Starter) -> None:
    gate = threading.Event()

    def crash(_batch: MeasurementBatch) -> None:
        gate.wait(WAIT_TIMEOUT_S)
        raise MemoryError

    service = start(engine=lambda: FakeEngine(crash))
    submit(service, recording(10))
    ended = service.flush(source="test")
    gate.set()
    with pytest.raises(PipelineError, match="out of memory"):
        ended.result(WAIT_TIMEOUT_S)


def test_what_was_processed_is_settled_after_a_stop(start: Starter) -> None:
    service = start()
    submit(service, recording(10))
    service.stop()
    assert service.settled().result(WAIT_TIMEOUT_S) == 10


def test_a_stopped_service_accepts_nothing() -> None:
    service = Service(
        open_journal=MemoryJournal,
        open_engine=FakeEngine,
        sensors=TABLE,
        tracking=TrackingSettings(),
    )
    for call in (
        lambda: service.submit(recording(1), source="test"),
        lambda: service.flush(source="test"),
        service.settled,
        lambda: service.quarantined(0, 1),
    ):
        with pytest.raises(PipelineError):
            call()
    service.start()
    with pytest.raises(PipelineError, match="already been started"):
        service.start()
    service.stop()
    service.stop()
    with pytest.raises(PipelineError):
        service.submit(recording(1), source="test")
    assert service.view.status()["state"] == "stopped"


@pytest.mark.fault(21)
def test_readers_that_connect_before_the_start_miss_and_repeat_nothing(start: Starter) -> None:
    """Requests are served before the journal is open: they got a gap, then all events once more."""
    journal = MemoryJournal()
    first = start(journal)
    submit(first, recording(40))
    head = int(settled(first)["event_sequence"])  # type: ignore[call-overload]
    first.stop()
    second = Service(
        open_journal=lambda: journal,
        open_engine=FakeEngine,
        sensors=TABLE,
        tracking=TrackingSettings(),
    )
    known, foreign = (second.view.subscribe(after, 10_000) for after in (head, head + 7))
    second.start()
    assert second.view.status()["event_sequence"] == head > 0
    assert known.poll(10) == []
    assert [one.kind for one in foreign.poll(10)] == ["gap"]
    second.stop()


def test_a_start_without_a_snapshot_opens_one_engine() -> None:
    opened: list[FakeEngine] = []

    def open_engine() -> FakeEngine:
        opened.append(FakeEngine())
        return opened[-1]

    service = Service(
        open_journal=MemoryJournal,
        open_engine=open_engine,
        sensors=TABLE,
        tracking=TrackingSettings(),
    )
    service.start()
    service.stop()
    assert len(opened) == 1


def iter_events(poll: Callable[[int], Sequence[object]]) -> list[Any]:
    """Poll until there are no events."""
    found: list[Any] = []
    while part := poll(100):
        found += part
    return found
