"""One feed from memory: decoded, submitted, connected again."""

import threading
from collections.abc import Sequence
from concurrent.futures import Future
from typing import Any

import polars as pl
import pytest

from multiradar.clock import SystemClock
from multiradar.errors import JournalBusyError, JournalFullError, PipelineError, QueueFullError
from multiradar.ingest import submission
from multiradar.ingest.feeds.connections import MemoryConnection
from multiradar.ingest.feeds.counts import FeedCounts
from multiradar.ingest.feeds.reader import FeedReader, ReaderBounds
from multiradar.ingest.submission import SUBMIT_RETRIES_MAX
from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar_converters.feeds.live import LiveFeed
from support.processes.waiting import join, wait_until
from support.scenarios.feeds import aircraft, base_station, readsb_line, snapshot

SENSORS = {"adsb": "roof", "mlat": "network"}
BOUNDS = ReaderBounds(
    reconnect_min_s=0.001, reconnect_max_s=0.004, batch_interval_s=0.001, quarantine_rows_max=2
)


class Sink:
    """Collects what is submitted; raises what is queued."""

    def __init__(self) -> None:
        self.frames: list[pl.DataFrame] = []
        self.rejected: list[RejectedRow] = []
        self.faults: list[Exception] = []
        self.later: list[Exception] = []

    def submit(
        self, frame: pl.DataFrame, *, source: str, idempotency_key: str | None = None,
        rejected: Sequence[RejectedRow] = (),
    ) -> Future[Receipt]:  # fmt: skip
        assert source == "feeds/one"
        assert idempotency_key is None
        if self.faults:
            raise self.faults.pop(0)
        done: Future[Receipt] = Future()
        if self.later:
            done.set_exception(self.later.pop(0))
            return done
        self.frames.append(frame)
        self.rejected += rejected
        done.set_result(Receipt(len(frame), tuple(rejected), duplicate=False, journal_sequence=1))
        return done


class Running:
    """A reader on a thread of its own."""

    def __init__(self, connection: MemoryConnection, bounds: ReaderBounds = BOUNDS) -> None:
        self.connection, self.sink, self.counts = connection, Sink(), FeedCounts(["one"])
        self._stopping = threading.Event()
        reader = FeedReader(
            label="one",
            connection=connection,
            feed=LiveFeed("one", SENSORS, at_reception=False),
            sink=self.sink,
            counts=self.counts,
            bounds=bounds,
            clock=SystemClock(),
            stopping=self._stopping,
        )
        self._thread = threading.Thread(target=reader.run)
        self._thread.start()

    def document(self) -> dict[str, Any]:
        found: dict[str, Any] = self.counts.document()["sources"]["one"]
        return found

    def wait_for(self, **numbers: int) -> dict[str, Any]:
        wait_until(
            lambda: all(self.document()[name] >= number for name, number in numbers.items()),
            f"{numbers}",
        )
        return self.document()

    def stop(self) -> dict[str, Any]:
        self._stopping.set()
        join(self._thread)
        found = self.document()
        assert found["state"] == "stopped"
        parts = ("accepted", "rejected", "duplicate")
        assert found["reports_read"] == sum(found[f"reports_{part}"] for part in parts)
        rows = ("accepted", "rejected", "lost")
        assert found["reports_accepted"] == sum(found[f"rows_{part}"] for part in rows)
        assert sum(found["rejected_by_code"].values()) == found["reports_rejected"]
        return found


@pytest.mark.slow
def test_positions_are_submitted_with_the_sensors_of_the_feed() -> None:
    connection = MemoryConnection()
    connection.send(
        base_station(0.0, "1", f11="DLH8JW"),
        readsb_line(1.0) + readsb_line(1.0) + b"bad\n" + readsb_line(2.0, type="mlat"),
    )
    running = Running(connection)
    running.wait_for(reports_read=4, rows_accepted=2)
    found = running.stop()
    frame = pl.concat(running.sink.frames)
    assert frame["sensor_id"].to_list() == ["roof", "network"]
    assert frame["kind"].to_list() == ["adsb", "mlat"]
    assert frame["position_sigma_m"].to_list() == [pytest.approx(34.1, abs=0.05), None]
    assert frame["ground_speed_m_s"].to_list() == [pytest.approx(231.5), None]
    assert found["messages_without_position"] == found["reports_duplicate"] == 1
    (reject,) = running.sink.rejected
    assert (reject.code, reject.raw) == ("MALFORMED_LINE", "bad")
    assert reject.reason.startswith("one, line 4: expected JSON, BaseStation or mlat-server CSV")


@pytest.mark.slow
def test_snapshots_are_whole_documents() -> None:
    connection = MemoryConnection(whole=True)
    connection.send(*(snapshot(s, [aircraft(s), {"hex": "4ca8d1"}]) for s in (1.0, 2.0)), b"<html>")
    running = Running(connection)
    running.wait_for(reports_read=3, rows_accepted=2)
    found = running.stop()
    assert found["messages_without_position"] == 2
    assert running.sink.rejected[0].reason.startswith("one, octet 0: expected a list of aircraft")


@pytest.mark.slow
def test_a_lost_connection_is_opened_again_and_lines_continue_to_be_counted() -> None:
    connection = MemoryConnection()
    connection.faults.extend(
        [ConnectionRefusedError(111, "Connection refused"), OSError("no route")]
    )
    connection.send(
        readsb_line(1.0) + readsb_line(2.0)[:30], b"", readsb_line(3.0), OSError("reset"), b"x\n"
    )
    running = Running(connection)
    running.wait_for(reports_read=4, rows_accepted=2)
    document = running.document()
    assert (document["connections"], document["connection_faults"]) == (3, 4)
    assert document["last_error"] == "reset"
    running.stop()
    assert [row.reason.split(":")[0] for row in running.sink.rejected] == [
        "one, line 2",
        "one, line 4",
    ]
    assert running.sink.rejected[0].code == "TRUNCATED"
    assert connection.closed >= 4


@pytest.mark.slow
def test_an_error_that_is_none_of_the_system_is_a_fault_of_the_connection() -> None:
    """The thread ended, and the state stayed `starting`."""
    connection = MemoryConnection()
    connection.faults.append(UnicodeError("label too long"))
    connection.send(readsb_line(1.0), ValueError("no digits"), readsb_line(2.0))
    running = Running(connection)
    found = running.wait_for(rows_accepted=2)
    assert (found["connections"], found["connection_faults"]) == (2, 2)
    assert found["last_error"] == "ValueError: no digits"
    running.stop()


def test_the_pause_doubles_up_to_its_maximum_until_data_arrive() -> None:
    pauses = []

    class Stopping(threading.Event):
        def wait(self, timeout: float | None = None) -> bool:
            pauses.append(timeout)
            if len(pauses) == 8:
                self.set()
            return self.is_set()

    connection = MemoryConnection()
    connection.faults.extend([OSError("no")] * 4)
    connection.send(readsb_line(1.0), b"")
    for _ in range(5):
        connection.send(b"")
    counts = FeedCounts(["one"])
    FeedReader(
        label="one", connection=connection,
        feed=LiveFeed("one", SENSORS, at_reception=False), sink=Sink(), counts=counts,
        bounds=ReaderBounds(1.0, 5.0, 0.001), clock=SystemClock(), stopping=Stopping(),
    ).run()  # fmt: skip
    assert pauses == [1.0, 2.0, 4.0, 5.0, 1.0, 2.0, 4.0, 5.0]


@pytest.mark.slow
def test_rejects_beyond_the_limit_share_a_row() -> None:
    connection = MemoryConnection()
    connection.send(b"bad\n" * 5 + b'{"a"\n')
    running = Running(connection)
    running.wait_for(reports_rejected=6)
    running.stop()
    assert len(running.sink.rejected) == 3
    assert running.sink.rejected[-1].reason == (
        "one, line 3 to 6: 4 more rejects, not retained (MALFORMED_JSON 1, MALFORMED_LINE 3)"
    )


@pytest.mark.slow
def test_a_full_journal_is_waited_for_and_a_failed_one_loses_rows() -> None:
    connection = MemoryConnection()
    running = Running(connection)
    running.sink.faults.append(QueueFullError("intake", 1, 0.001))
    connection.send(readsb_line(1.0))
    running.wait_for(rows_accepted=1)
    running.sink.faults.append(PipelineError("stopped"))
    connection.send(readsb_line(2.0))
    running.wait_for(rows_lost=1)
    running.stop()


@pytest.mark.slow
def test_a_full_disk_and_a_queue_that_stays_full_are_waited_for(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Batches were lost at once, and after a minute."""
    monkeypatch.setattr(submission, "DISK_PAUSE_S", 0.001)
    connection = MemoryConnection()
    running = Running(connection)
    running.sink.faults += [QueueFullError("intake", 1, 0.0001)] * (SUBMIT_RETRIES_MAX + 10)
    running.sink.later += [JournalFullError("no space left"), JournalBusyError("locked")] * 2
    connection.send(readsb_line(1.0))
    assert running.wait_for(rows_accepted=1)["rows_lost"] == 0
    assert (running.sink.faults, running.sink.later) == ([], [])
    running.sink.later += [JournalFullError("no space left")] * 100_000
    connection.send(readsb_line(2.0))
    wait_until(lambda: len(running.sink.later) < 99_990, "some attempts")
    assert running.stop()["rows_lost"] == 1


@pytest.mark.slow
def test_an_internal_error_loses_its_batch_and_not_the_feed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    connection = MemoryConnection()
    running = Running(connection)
    with monkeypatch.context() as patch:
        patch.setattr(LiveFeed, "push", lambda *_: 1 / 0)
        connection.send(readsb_line(1.0))
        running.wait_for(batches_failed=1)
    connection.send(readsb_line(2.0))
    running.wait_for(rows_accepted=1)
    running.stop()


def test_a_wrong_clock_of_the_receiver_is_reported() -> None:
    connection = MemoryConnection()
    connection.send(*(readsb_line(float(s)) for s in range(20)))
    running = Running(connection)
    running.wait_for(reports_accepted=20)
    # Counted after the reports.
    clocks = running.document()["clocks"]
    wait_until(lambda: running.document()["clocks"]["roof"]["messages"] == 20, f"{clocks}")
    assert running.document()["clocks"]["roof"]["alarm"] == "clock"
    running.stop()
