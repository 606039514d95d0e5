"""The live pipeline: all is accounted for, answers come from disk, one message harms no other."""

import io
import threading
from collections.abc import Iterator
from concurrent.futures import Future
from dataclasses import replace

import polars as pl
import pytest

from multiradar.errors import (
    IdempotencyConflictError,
    InputError,
    JournalError,
    QueueFullError,
)
from multiradar.runtime.live import preparation
from multiradar.runtime.live.payload import decode_rows
from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar.runtime.live.service import Service, ServiceState
from multiradar.storage.journal import Journal
from multiradar.storage.memory_journal import MemoryJournal
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.measurements.columns import complete
from support.fakes.engine_outputs import Bias, output_of
from support.fakes.fake_engine import FakeEngine
from support.processes.live_services import TABLE, GatedJournal, Starter, services, settled, submit
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios.live_scene import START_S, cut, recording


@pytest.fixture
def start() -> Iterator[Starter]:
    """Start services that are stopped at the end."""
    with services() as starter:
        yield starter


def test_measurements_become_updates(start: Starter) -> None:
    service = start()
    receipt = submit(service, recording(100))
    assert receipt == Receipt(100, (), False, 1)
    assert service.settled().result(WAIT_TIMEOUT_S) == 100
    assert settled(service)["processed_sequence"] == 1
    assert len(service.view.tracks()) == 12


def test_a_service_that_has_started_or_stopped_is_at_no_step_of_its_start(start: Starter) -> None:
    service = start()
    assert service.start_step == ""
    service.stop()
    assert service.start_step == ""


@pytest.mark.fault(12)
def test_every_row_is_accepted_or_rejected_with_its_index_and_content(start: Starter) -> None:
    service = start()
    frame = recording(10).with_columns(
        sensor_id=pl.when(pl.int_range(10) == 3).then(pl.lit("unlisted")).otherwise("sensor_id"),
        time_s=pl.col("time_s") + pl.when(pl.int_range(10) == 7).then(1e6).otherwise(0.0),
        height_m=pl.when(pl.int_range(10) == 5).then(float("nan")).otherwise("height_m"),
    )
    # The edge kept rows 0 and 4 of the message for itself.
    index = pl.Series("index", [1, 2, 3, 5, 6, 7, 8, 9, 10, 11], pl.UInt32)
    edge = [
        RejectedRow(4, "WRONG_TYPE", "no", "raw 4"),
        RejectedRow(0, "MISSING_FIELD", "no", "raw 0"),
    ]
    receipt = service.submit(frame.with_columns(index), source="test", rejected=edge).result(
        WAIT_TIMEOUT_S
    )
    assert receipt.accepted == 7
    assert [(row.index, row.code) for row in receipt.rejected] == [
        (0, "MISSING_FIELD"),
        (4, "WRONG_TYPE"),
        (5, "UNKNOWN_SENSOR"),
        (7, "NON_FINITE"),
        (9, "TIME_FUTURE"),
    ]
    status = settled(service)
    assert (status["read"], status["accepted"], status["rejected"]) == (12, 7, 5)
    kept = service.quarantined(0, 100)
    assert [one.row for one in kept] == list(receipt.rejected)
    assert [one.row.raw for one in kept][:2] == ["raw 0", "raw 4"]
    assert '"sensor_id": "unlisted"' in kept[2].row.raw
    assert '"height_m": NaN' in kept[3].row.raw
    assert "was 1701000000" in kept[4].row.reason
    assert service.quarantined(3, 1)[0].number == 4


@pytest.mark.fault(7)
def test_late_rows_are_rejected_and_the_rest_accepted(start: Starter) -> None:
    service = start()
    frame = recording(400)
    submit(service, frame[300:])
    receipt = submit(service, frame[:310])
    assert receipt.accepted + len(receipt.rejected) == 310
    assert {row.code for row in receipt.rejected} == {"TIME_LATE"}
    assert 100 < len(receipt.rejected) < 300


def test_the_data_time_zero_does_not_go_back(start: Starter) -> None:
    service, frame = start(), recording(2)
    for time_s in (0.0, -3.0):
        submit(service, frame[:1].with_columns(time_s=time_s))
    service.flush(source="test").result(WAIT_TIMEOUT_S)
    assert settled(service)["data_time_s"] == 0.0


def test_a_repeated_message_is_accepted_once(start: Starter) -> None:
    journal = MemoryJournal()
    service = start(journal)
    frame = recording(50).with_columns(
        range_m=pl.when(pl.int_range(50) == 9).then(-1.0).otherwise("range_m"),
        kind=pl.when(pl.int_range(50) == 9).then(pl.lit("radar")).otherwise("kind"),
    )
    first = submit(service, frame, "key")
    again = submit(service, frame, "key")
    assert (first.duplicate, again.duplicate) == (False, True)
    assert (again.accepted, again.rejected, again.journal_sequence) == (
        first.accepted, first.rejected, first.journal_sequence,
    )  # fmt: skip
    status = settled(service)
    assert (status["read"], status["accepted"], status["duplicate"]) == (100, first.accepted, 50)
    assert len(list(journal.read(0))) == 1
    service.stop()
    assert submit(start(journal), frame, "key") == again


def test_a_message_repeated_in_the_same_transaction_is_accepted_once(start: Starter) -> None:
    gate = GatedJournal()
    service = start(gate)
    frame = recording(30)
    blocked = service.submit(frame[:10], source="test")
    gate.entered.wait(WAIT_TIMEOUT_S)
    futures = [
        service.submit(frame[10:], source="test", idempotency_key="key") for _ in range(3)
    ] + [service.submit(frame[10:15], source="test", idempotency_key="key")]
    gate.open.set()
    blocked.result(WAIT_TIMEOUT_S)
    receipts = [future.result(WAIT_TIMEOUT_S) for future in futures[:3]]
    assert [receipt.duplicate for receipt in receipts] == [False, True, True]
    assert {receipt.journal_sequence for receipt in receipts} == {2}
    with pytest.raises(IdempotencyConflictError):
        futures[3].result(WAIT_TIMEOUT_S)
    assert settled(service)["accepted"] == 30


def test_a_journal_without_callsigns_is_replayed_and_its_messages_recognised(
    start: Starter, monkeypatch: pytest.MonkeyPatch
) -> None:
    def before(frame: pl.DataFrame) -> bytes:
        stream = io.BytesIO()
        complete(frame).drop("callsign").write_ipc_stream(stream)
        return stream.getvalue()

    journal = MemoryJournal()
    service = start(journal)
    frame = recording(40).with_columns(callsign=pl.lit("KLM1"))
    with monkeypatch.context() as earlier:
        earlier.setattr(preparation, "encode_rows", before)
        submit(service, frame[:20], "key")
    submit(service, frame[20:], "other")
    service.stop()
    service = start(journal)
    assert submit(service, frame[:20], "key").duplicate
    with pytest.raises(IdempotencyConflictError):
        submit(service, frame[20:].with_columns(callsign=pl.lit("KLM2")), "other")
    assert settled(service)["accepted"] == 40


def test_a_key_is_that_of_a_message_whose_rows_were_rejected(start: Starter) -> None:
    service = start()
    unknown = recording(8).with_columns(sensor_id=pl.lit("99-9"))
    raw = [RejectedRow(index, "WRONG_TYPE", "a reason", f"[{index}]") for index in (8, 9)]

    def sent(frame: pl.DataFrame, rejected: list[RejectedRow]) -> Receipt:
        future = service.submit(frame, source="test", idempotency_key="k", rejected=rejected)
        return future.result(WAIT_TIMEOUT_S)

    assert len(sent(unknown, raw).rejected) == 10
    assert sent(unknown, raw).duplicate
    others = [
        (unknown.with_columns(height_m=pl.lit(1.0)), raw),
        (unknown, [raw[0], replace(raw[1], raw="[0]")]),
        (unknown, [raw[0], replace(raw[1], index=10)]),
    ]
    for frame, rejected in others:
        with pytest.raises(IdempotencyConflictError):
            sent(frame, rejected)
    assert settled(service)["read"] == 20


def test_a_key_used_for_another_message_is_rejected(start: Starter) -> None:
    service = start()
    frame = recording(50)
    submit(service, frame[:20], "key")
    for other in (frame[20:40], frame[:19], frame[:20].with_columns(height_m=pl.lit(1.0))):
        with pytest.raises(IdempotencyConflictError, match="'key'"):
            submit(service, other, "key")
    with pytest.raises(IdempotencyConflictError):
        service.flush(source="test", idempotency_key="key").result(WAIT_TIMEOUT_S)
    assert settled(service)["read"] == 20


def test_a_message_of_the_wrong_form_harms_no_other(
    start: Starter, caplog: pytest.LogCaptureFixture
) -> None:
    gate = GatedJournal()
    service = start(gate)
    frame = recording(60)
    service.submit(frame[:10], source="test")
    gate.entered.wait(WAIT_TIMEOUT_S)
    good = [service.submit(frame[10:30], source="test")]
    bad = [
        service.submit(frame[30:40].drop("kind"), source="test"),
        service.submit(frame[30:40].with_columns(pl.col("time_s").cast(pl.String)), source="test"),
    ]
    good.append(service.submit(frame[30:], source="test"))
    gate.open.set()
    assert [future.result(WAIT_TIMEOUT_S).accepted for future in good] == [20, 30]
    for future in bad:
        with pytest.raises(InputError):
            future.result(WAIT_TIMEOUT_S)
    assert settled(service)["read"] == 60
    # An invalid message is no error of the service.
    assert not caplog.records


def test_optional_columns_may_be_absent(start: Starter) -> None:
    frame = recording(50).filter(pl.col("kind") == "radar")
    slim = frame.select("time_s", "sensor_id", "kind", "range_m", "azimuth_deg", "track_number")
    assert submit(start(), slim).accepted == len(slim)


def test_an_empty_message_is_accepted(start: Starter) -> None:
    service = start()
    assert submit(service, recording(10)[:0], "empty") == Receipt(0, (), False, 1)
    assert submit(service, recording(10)[:0], "empty").duplicate


def test_a_full_intake_says_when_to_retry_and_accepts_the_rest_later(start: Starter) -> None:
    gate = GatedJournal()
    service = start(gate, intake_batches_max=3, retry_after_s=7.0)
    frame = recording(60)
    futures = [service.submit(frame[:10], source="test")]
    gate.entered.wait(WAIT_TIMEOUT_S)
    futures += [service.submit(piece, source="test") for piece in cut(frame[10:40], [10, 10])]
    with pytest.raises(QueueFullError) as full:
        service.submit(frame[40:], source="test")
    assert full.value.retry_after_s == 7.0
    gate.open.set()
    assert [future.result(WAIT_TIMEOUT_S).accepted for future in futures] == [10, 10, 10, 10]
    assert submit(service, frame[40:]).accepted == 20
    assert settled(service)["read"] == 60


def test_the_intake_is_bounded_in_rows_and_one_large_message_is_still_accepted(
    start: Starter,
) -> None:
    gate = GatedJournal()
    service = start(gate, intake_rows_max=20)
    frame = recording(60)
    first = service.submit(frame[:5], source="test")
    gate.entered.wait(WAIT_TIMEOUT_S)
    large = service.submit(frame[5:55], source="test")
    with pytest.raises(QueueFullError):
        service.submit(frame[55:56], source="test")
    gate.open.set()
    assert (first.result(WAIT_TIMEOUT_S).accepted, large.result(WAIT_TIMEOUT_S).accepted) == (5, 50)


def test_a_message_cancelled_in_the_queue_is_not_accepted(start: Starter) -> None:
    gate = GatedJournal()
    service = start(gate)
    frame = recording(30)
    service.submit(frame[:10], source="test")
    gate.entered.wait(WAIT_TIMEOUT_S)
    cancelled = service.submit(frame[10:20], source="test")
    kept = service.submit(frame[20:], source="test")
    assert cancelled.cancel()
    gate.open.set()
    kept.result(WAIT_TIMEOUT_S)
    assert settled(service)["read"] == 20


def test_the_end_of_a_stream_releases_and_is_journalled(start: Starter) -> None:
    journal = MemoryJournal()
    service = start(journal)
    frame = recording(100)
    submit(service, frame[50:])
    assert service.flush(source="test").result(WAIT_TIMEOUT_S) == Receipt(0, (), False, 2)
    assert settled(service)["epoch"] is not None
    assert len(submit(service, frame[:50]).rejected) == 50
    service.stop()
    again = start(journal)
    assert settled(again)["output_sha256"] == _status_sha(service)
    # What the admission knew is known again.
    late = submit(again, frame[:50])
    assert {row.code for row in late.rejected} == {"TIME_LATE"}
    assert len(late.rejected) == 50


def test_the_end_of_a_stream_is_answered_when_its_tracks_can_be_read(
    start: Starter, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once it was answered when it was on disk, and a track that it made was a 404 for a moment."""
    service, gate = start(), threading.Event()
    publish = service.publication.publish

    def publish_late(output: EngineOutput, data_time_s: float | None, ends: bool = False) -> None:
        gate.wait(WAIT_TIMEOUT_S)
        publish(output, data_time_s, ends)

    monkeypatch.setattr(service.publication, "publish", publish_late)
    frame = recording(40)
    submit(service, frame[:20])
    ended = service.flush(source="test", idempotency_key="end")
    # The journal is written in order: the end of the stream is on disk, too.
    submit(service, frame[20:])
    assert not ended.done()
    assert not ended.cancel()
    gate.set()
    assert ended.result(WAIT_TIMEOUT_S).journal_sequence == 2
    made = service.view.tracks()["track_number"]
    assert frame[:20]["track_number"].is_in(made.implode()).all()
    again = service.flush(source="test", idempotency_key="end").result(WAIT_TIMEOUT_S)
    assert (again.duplicate, again.journal_sequence) == (True, 2)


def test_messages_of_one_transaction_keep_their_own_rows(start: Starter) -> None:
    frame = recording(120).with_columns(
        sensor_id=pl.when(pl.int_range(120) % 7 == 3).then(pl.lit("no")).otherwise("sensor_id"),
        time_s=pl.col("time_s") + pl.when(pl.int_range(120) % 11 == 5).then(1e6).otherwise(0.0),
    )
    pieces = cut(frame, [30, 1, 0, 29, 40])
    gate, apart = GatedJournal(), start()
    together = start(gate)
    futures = [together.submit(recording(1), source="test")]
    gate.entered.wait(WAIT_TIMEOUT_S)
    futures += [together.submit(piece, source="test") for piece in pieces]
    gate.open.set()
    submit(apart, recording(1))
    alone = [submit(apart, piece) for piece in pieces]
    assert [future.result(WAIT_TIMEOUT_S) for future in futures[1:]] == alone
    assert sum(len(receipt.rejected) for receipt in alone) > 20
    assert settled(together)["output_sha256"] == settled(apart)["output_sha256"]
    for stored, receipt in zip(gate.read(1), alone, strict=True):
        assert len(decode_rows(stored.entry.payload)) == receipt.accepted


def test_what_is_settled_can_be_read(start: Starter, monkeypatch: pytest.MonkeyPatch) -> None:
    """Once, a reader between the engine's call and the publication got no data."""
    service = start()
    publish = service.publication.publish
    entered, gate = threading.Event(), threading.Event()

    def publish_late(output: EngineOutput, data_time_s: float | None, ends: bool = False) -> None:
        entered.set()
        assert gate.wait(WAIT_TIMEOUT_S)
        publish(output, data_time_s, ends)

    monkeypatch.setattr(service.publication, "publish", publish_late)
    for number, piece in enumerate(cut(recording(30), [10, 10])):
        entered.clear()
        gate.clear()
        submit(service, piece)
        assert entered.wait(WAIT_TIMEOUT_S)
        all_can_be_read = service.settled()
        assert not all_can_be_read.done()
        gate.set()
        assert all_can_be_read.result(WAIT_TIMEOUT_S) == 10 * (number + 1)
        assert service.view.status()["output_sequence"] == 10 * (number + 1)


def test_updates_do_not_wait_for_the_end_of_an_epoch(
    start: Starter, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Once in 10 s, they waited for the states of all tracks."""
    service, published = start(), []

    def complete(_engine: FakeEngine) -> EngineOutput:
        published.append([one.kind for one in service.view.subscribe(0, 100).poll(100)])
        return output_of([Bias(START_S, 0.5)])

    monkeypatch.setattr(FakeEngine, "complete", complete)
    submit(service, recording(10))
    service.settled().result(WAIT_TIMEOUT_S)
    assert published == [["track"] * 10]
    assert service.view.subscribe(10, 100).poll(100)[0].kind == "bias"


def test_a_subscriber_before_the_replay_gets_what_comes_after_it(start: Starter) -> None:
    """HTTP answers while kernels are loaded, and each client reconnects after a restart."""
    journal = MemoryJournal()
    first = start(journal)
    submit(first, recording(20))
    first.stop()
    service = Service(
        open_journal=lambda: journal,
        open_engine=FakeEngine,
        sensors=TABLE,
        tracking=TrackingSettings(),
    )
    resumed, new = (service.view.subscribe(after, 100) for after in (15, None))
    assert (resumed.poll(100), new.poll(100)) == ([], [])
    service.start()
    assert [event.sequence for event in resumed.poll(100)] == [16, 17, 18, 19, 20]
    assert new.poll(100) == []
    submit(service, recording(21)[20:])
    service.settled().result(WAIT_TIMEOUT_S)
    assert [event.sequence for event in new.poll(100)] == [21]
    service.stop()


def test_stopping_finishes_what_was_handed_in(start: Starter) -> None:
    journal = MemoryJournal()
    service = start(journal)
    futures = [service.submit(piece, source="test") for piece in cut(recording(500), [5] * 99)]
    service.stop()
    assert sum(future.result(0).accepted for future in futures) == 500
    assert journal.counts().accepted == 500
    assert service.view.status()["output_sequence"] == 500


def test_a_journal_that_does_not_open_leaves_the_service_stopped() -> None:
    def fail() -> Journal:
        raise JournalError("journal.db: in use")

    service = Service(
        open_journal=fail, open_engine=FakeEngine, sensors=TABLE, tracking=TrackingSettings()
    )
    with pytest.raises(JournalError, match="in use"):
        service.start()
    assert service.state is ServiceState.STOPPED


def test_the_backlog_of_the_engine_is_bounded_and_loses_nothing(start: Starter) -> None:
    released = threading.Event()

    def hold(_batch: MeasurementBatch) -> None:
        assert released.wait(WAIT_TIMEOUT_S)

    service = start(
        engine=lambda: FakeEngine(hold), backlog_rows_max=50, push_rows_max=10, intake_batches_max=8
    )
    pieces = cut(recording(400), [10] * 39)
    taken: list[Future[Receipt]] = []

    # One is held by the engine and five wait for it; the writer hands on no more.
    for piece in pieces[:6]:
        taken.append(service.submit(piece, source="test"))
        taken[-1].result(WAIT_TIMEOUT_S)
    with pytest.raises(QueueFullError):
        taken.extend(service.submit(piece, source="test") for piece in pieces[6:])
    assert len(taken) >= 6 + 8
    assert service._backlog.rows <= 50
    released.set()
    assert all(future.result(WAIT_TIMEOUT_S).accepted == 10 for future in taken)
    assert settled(service)["output_sequence"] == 10 * len(taken)


def _status_sha(service: Service) -> object:
    return service.view.status()["output_sha256"]


@pytest.mark.slow
def test_a_status_during_a_long_call_has_digest_and_entry_of_one_moment(start: Starter) -> None:
    service = start()
    parts = cut(recording(60), [30])
    submit(service, parts[0])
    first = settled(service)
    submit(service, parts[1])
    service.settled().result(WAIT_TIMEOUT_S)
    processor = service._processor
    assert processor is not None
    # As during a long call of the engine.
    with processor._lock:
        during = service.view.status()
    names = ("processed_sequence", "output_sha256")
    assert [during[name] for name in names] == [first[name] for name in names]
    after = service.view.status()
    assert after["processed_sequence"] == 2
    assert after["output_sha256"] != first["output_sha256"]
