"""Listeners, their queue and their counts, with ports, service and clock from memory."""

import tracemalloc
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from typing import Any

import polars as pl
import pytest
from structlog.testing import capture_logs

from multiradar.clock import FixedClock
from multiradar.errors import (
    JournalError,
    JournalFullError,
    MultiradarError,
    PipelineError,
    QuarantineError,
    QueueFullError,
)
from multiradar.ingest import asterix_gateway, submission
from multiradar.ingest.asterix_gateway import AsterixGateway
from multiradar.ingest.asterix_inlet import AsterixInlet, InletBounds
from multiradar.ingest.asterix_queue import DatagramQueue, Received
from multiradar.ingest.asterix_source import MemorySource
from multiradar.observability.asterix_metrics import AsterixCollector
from multiradar.runtime.live.receipt import Receipt, RejectedRow
from multiradar_converters.asterix.framing.datagrams import Datagrams
from multiradar_converters.asterix.live.batch import LiveBatch
from multiradar_converters.asterix.live.reception import LiveDecoder, LiveOptions
from support.asterix.octets import block, north_mark, plot_048
from support.processes.waiting import wait_until

NOON_S = 19_675 * 86_400.0 + 43_200.0
NAMES = {(0x1482, "radar"): "20-130"}
#: What becomes of the octets of a listener.
PARTS = ("dropped", "framing", "decoded", "skipped", "quarantined")


@dataclass
class Taken:
    """A service that accepts everything, or raises the configured errors."""

    failures: list[Exception] = field(default_factory=list)
    later: list[MultiradarError] = field(default_factory=list)
    frames: list[tuple[str, pl.DataFrame]] = field(default_factory=list)
    rejected: list[tuple[str, RejectedRow]] = field(default_factory=list)
    rejecting: tuple[int, ...] = ()
    quarantined: tuple[str, ...] = ()

    def submit(
        self,
        frame: pl.DataFrame,
        *,
        source: str,
        idempotency_key: str | None = None,
        rejected: Sequence[RejectedRow] = (),
    ) -> Future[Receipt]:
        if source in self.quarantined:
            raise QuarantineError(source, 60.0)
        if self.failures:
            raise self.failures.pop(0)
        future: Future[Receipt] = Future()
        if self.later:
            future.set_exception(self.later.pop(0))
            return future
        self.frames.append((source, frame))
        self.rejected += [(source, row) for row in rejected]
        late = [RejectedRow(index, "TIME_LATE", "late") for index in self.rejecting]
        rejected = sorted([*late, *rejected], key=lambda row: row.index)
        future.set_result(Receipt(len(frame) - len(late), tuple(rejected), False, 1))
        return future

    @property
    def rows(self) -> int:
        return sum(len(frame) for _, frame in self.frames)


class Poisoned(LiveDecoder):
    """Fails on datagrams that hold a certain octet."""

    def decode(self, datagrams: Datagrams) -> LiveBatch:
        if (datagrams.data == 0xEE).any():
            msg = "poison"
            raise ValueError(msg)
        return super().decode(datagrams)


def plot(second: float) -> bytes:
    return block(48, plot_048(43_200.0 + second))


@dataclass
class Listening:
    """A gateway on memory."""

    sources: list[MemorySource]
    service: Taken
    gateway: AsterixGateway

    def number(self, name: str, listener: int = 0) -> int:
        return self.gateway.counts.number(listener, name)

    def until(self, name: str, number: int, listener: int = 0) -> None:
        """Wait until a counter has come so far."""
        wait_until(lambda: self.number(name, listener) >= number, f"{number} {name}")


@pytest.fixture
def listening() -> Iterator[Callable[..., Listening]]:
    """Start gateways; stop them at the end."""
    started: list[AsterixGateway] = []

    def start(
        labels: Sequence[str] = ("north",),
        decoder: LiveDecoder | None = None,
        *,
        datagrams_max: int = 1000,
        octets_max: int = 1 << 20,
        interval_s: float = 0.01,
        rows_max: int = 100,
        begin: bool = True,
    ) -> Listening:
        sources = [MemorySource(label) for label in labels]
        service = Taken()
        gateway = AsterixGateway(
            labels=labels,
            sources=[lambda source=source: source for source in sources],  # type: ignore[misc]
            sink=service,
            decoder=decoder or LiveDecoder(LiveOptions(NAMES)),
            queue=DatagramQueue(datagrams_max, octets_max),
            bounds=InletBounds(interval_s, rows_max),
            clock=FixedClock(NOON_S),
        )
        started.append(gateway)
        gateway.start()
        if begin:
            gateway.begin()
        return Listening(sources, service, gateway)

    yield start
    for gateway in started:
        gateway.stop()


def inlet(service: Taken, queue: DatagramQueue) -> tuple[AsterixInlet, AsterixGateway]:
    """Return what decodes, without threads."""
    gateway = AsterixGateway(
        labels=["north", "south"],
        sources=[],
        sink=service,
        decoder=LiveDecoder(LiveOptions(NAMES)),
        queue=queue,
        bounds=InletBounds(0.01, 5),
    )
    return gateway._inlet, gateway


def test_what_listeners_hear_is_handed_in_and_counted_by_listener(
    listening: Callable[..., Listening],
) -> None:
    one = listening(("north", "south"))
    one.sources[0].send(plot(0.0), plot(1.0))
    one.sources[1].send(plot(2.0))
    one.until("rows_accepted", 2)
    one.until("rows_accepted", 1, listener=1)
    assert {source for source, _ in one.service.frames} == {"asterix/north", "asterix/south"}
    assert one.service.rows == 3
    assert one.number("octets") == one.number("octets_decoded") == 2 * len(plot(0.0))


def test_what_comes_while_the_service_recovers_waits_for_it(
    listening: Callable[..., Listening],
) -> None:
    one = listening(begin=False)
    one.sources[0].send(plot(0.0), plot(1.0))
    one.until("datagrams", 2)
    assert one.service.rows == 0
    one.gateway.begin()
    one.until("rows_accepted", 2)
    assert one.service.rows == 2


def test_what_two_listeners_hear_of_one_radar_counts_once(
    listening: Callable[..., Listening],
) -> None:
    one = listening(("north", "south"))
    for source in one.sources:
        source.send(plot(0.0))
    one.until("octets_decoded", 1)
    one.until("octets_decoded", 1, listener=1)
    counted = [one.number("records_measurement", k) for k in (0, 1)]
    assert sorted(counted) == [0, 1]
    assert one.service.rows == 1


def test_a_batch_keeps_the_order_of_reception_over_all_listeners() -> None:
    """In order of listeners, late data of one listener would make those of the other late."""
    service, queue = Taken(), DatagramQueue(1000, 1 << 20)
    work, _gateway = inlet(service, queue)
    for k in range(10):
        queue.put(Received(k % 2, k + 1, NOON_S + k, plot(float(k))))
    work.drain()
    times = [frame["time_s"].to_list() for _, frame in service.frames]
    assert times == [[NOON_S + k] for k in range(10)]
    # What arrives at about the same time is put together.
    service.frames.clear()
    for k in range(10):
        queue.put(Received(k % 2, 11 + k, NOON_S + 10.0 + 0.01 * k, plot(10.0 + 0.01 * k)))
    work.drain()
    assert [(source, len(frame)) for source, frame in service.frames] == [
        ("asterix/north", 5),
        ("asterix/south", 5),
    ]


def test_the_quarantine_of_a_listener_neither_delays_nor_loses_data_of_others(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Regression: all listeners were one source, and the decoder waited for it."""
    service, queue = Taken(quarantined=("asterix/north",)), DatagramQueue(1000, 1 << 20)
    work, gateway = inlet(service, queue)
    for k in range(4):
        queue.put(Received(k % 2, k + 1, NOON_S + k, plot(float(k))))
    queue.put(Received(1, 5, NOON_S + 4.0, b"\x31\x00\x04\x80"))
    monkeypatch.setattr(work._stopping, "wait", lambda _s: pytest.fail("it waits"))
    work.drain()
    lost = [gateway.counts.number(k, "rows_lost") for k in (0, 1)]
    accepted = [gateway.counts.number(k, "rows_accepted") for k in (0, 1)]
    assert (lost, accepted) == ([2, 0], [0, 2])
    assert [source for source, _ in service.rejected] == ["asterix/south"]


def test_a_fault_of_the_service_loses_the_data_of_one_listener() -> None:
    service, queue = Taken(failures=[RuntimeError("a mistake")]), DatagramQueue(1000, 1 << 20)
    work, gateway = inlet(service, queue)
    for k in range(2):
        queue.put(Received(k, k + 1, NOON_S, plot(float(k))))
    work.drain()
    assert [gateway.counts.number(k, "rows_lost") for k in (0, 1)] == [1, 0]
    assert [gateway.counts.number(k, "rows_accepted") for k in (0, 1)] == [0, 1]


def test_datagrams_without_plots_are_decoded_and_nothing_is_submitted() -> None:
    service, queue = Taken(), DatagramQueue(1000, 1 << 20)
    work, gateway = inlet(service, queue)
    queue.put(Received(0, 1, NOON_S, north_mark(NOON_S)))
    work.drain()
    assert gateway.counts.number(0, "octets_decoded") == len(north_mark(NOON_S))
    assert service.frames == []


def test_what_the_service_rejects_is_counted_by_listener() -> None:
    service, queue = Taken(rejecting=(0, 2)), DatagramQueue(1000, 1 << 20)
    work, gateway = inlet(service, queue)
    for k in range(6):
        queue.put(Received(k // 3, k + 1, NOON_S, plot(float(k))))
    queue.put(Received(0, 7, NOON_S, b"\x31\x00\x04\x80"))
    work.drain()
    for listener in (0, 1):
        assert gateway.counts.number(listener, "rows_accepted") == 1
        assert gateway.counts.number(listener, "rows_rejected") == 2


def test_a_rejection_keeps_listener_number_octet_and_content(
    listening: Callable[..., Listening],
) -> None:
    one = listening()
    bad = plot(0.0) + b"\x30\x00\x05\xff\xff"
    one.sources[0].send(plot(0.5), bad, b"")
    one.until("datagrams", 3)
    one.until("octets_quarantined", 5)
    one.until("rows_accepted", 2)
    reported = {row.reason.split(": ")[0]: row for _, row in one.service.rejected}
    assert set(reported) == {
        f"north, datagram 2, octet {len(plot(0.0))}",
        "north, datagram 3, octet 0",
    }
    assert reported[f"north, datagram 2, octet {len(plot(0.0))}"].raw == "300005ffff"
    assert one.gateway.counts.document()["listeners"]["north"]["refused_by_code"] == {
        "MALFORMED_BLOCK": 1,
        "TRUNCATED": 1,
    }


def test_a_fault_of_the_port_is_counted_and_does_not_stop_the_listener(
    listening: Callable[..., Listening], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(asterix_gateway, "FAULT_PAUSE_S", 0.0)
    one = listening()
    one.sources[0].faults.extend([OSError("the network is down"), UnicodeError("no host name")])
    one.until("receive_faults", 2)
    one.sources[0].send(plot(0.0))
    one.until("rows_accepted", 1)


@pytest.mark.slow
def test_a_datagram_that_fails_to_decode_is_quarantined_alone(
    listening: Callable[..., Listening],
) -> None:
    one = listening(decoder=Poisoned(LiveOptions(NAMES)), interval_s=0.3)
    one.sources[0].send(plot(0.0), b"\xee\x00", plot(1.0))
    one.until("rows_accepted", 2)
    one.until("octets_quarantined", 2)
    assert one.number("octets_decoded") == 2 * len(plot(0.0))
    (row,) = [row for _, row in one.service.rejected]
    assert (row.code, row.raw) == ("MALFORMED_BLOCK", "ee00")
    assert one.gateway.counts.document()["batches_failed"] >= 1


@pytest.mark.slow
def test_a_storm_of_small_datagrams_cannot_fill_the_memory() -> None:
    """Datagrams that do not fit into the queue are dropped and counted."""
    queue = DatagramQueue(datagrams_max=10_000, octets_max=1 << 30)
    octets = bytes(8)
    tracemalloc.start()
    taken = sum(queue.put(Received(0, k, NOON_S, octets + bytes(1))) for k in range(100_000))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert taken == len(queue) == 10_000
    assert peak < 10_000 * 400


def test_the_queue_is_bounded_by_octets_too() -> None:
    queue = DatagramQueue(datagrams_max=1000, octets_max=100_000)
    taken = [queue.put(Received(0, k, NOON_S, bytes(40_000))) for k in range(4)]
    assert taken == [True, True, False, False]
    assert queue.octets == 80_000
    assert len(queue.pop(1)) == 1
    assert queue.octets == 40_000
    assert queue.put(Received(0, 4, NOON_S, b""))


def test_every_octet_is_in_a_count_while_a_batch_is_decoded(
    listening: Callable[..., Listening],
) -> None:
    seen: list[dict[str, Any]] = []

    class Watched(LiveDecoder):
        def decode(self, datagrams: Datagrams) -> LiveBatch:
            seen.append(one.gateway.counts.document())
            return super().decode(datagrams)

    one = listening(decoder=Watched(LiveOptions(NAMES)), begin=False)
    one.sources[0].send(plot(0.0), plot(1.0), bytes([0xEE, 0]))
    one.until("datagrams", 3)
    one.gateway.begin()
    one.until("rows_accepted", 2)
    for document in (*seen, one.gateway.counts.document()):
        own = document["listeners"]["north"]
        parts = [document["waiting_octets"], document.get("decoding_octets", 0)]
        parts += [own[f"octets_{name}"] for name in PARTS]
        assert sum(parts) == own["octets"] == 2 * len(plot(0.0)) + 2
    assert seen


def test_drops_are_counted_and_every_octet_is_in_a_count(
    listening: Callable[..., Listening],
) -> None:
    one = listening(datagrams_max=3, interval_s=60.0)
    one.sources[0].send(*[plot(0.01 * k) for k in range(10)])
    one.until("datagrams", 10)
    size = len(plot(0.0))
    assert one.number("datagrams_dropped") == 7
    assert one.number("octets_dropped") == 7 * size
    assert one.gateway.counts.document()["waiting_octets"] == 3 * size
    one.gateway.stop()
    assert one.number("octets") == one.number("octets_dropped") + one.number("octets_decoded")


def test_many_rejections_of_a_batch_share_a_row() -> None:
    service, queue = Taken(), DatagramQueue(1000, 1 << 20)
    work, gateway = inlet(service, queue)
    for k in range(50):
        queue.put(Received(0, k + 1, NOON_S, b"\x30\x00\x04\x01" if k % 2 else b"\x31\x00\x04\x80"))
    work.drain()
    rows = [row for _, row in service.rejected]
    assert len(rows) == 6
    assert rows[-1].reason == (
        "north, datagram 6 to north, datagram 50: 45 more rejects, 180 octets in total, not "
        "retained (MALFORMED_BLOCK 23, UNKNOWN_KIND 22)"
    )
    codes = gateway.counts.document()["listeners"]["north"]["refused_by_code"]
    assert codes == {"MALFORMED_BLOCK": 25, "UNKNOWN_KIND": 25}
    assert sorted(row.index for row in rows) == list(range(6))


def test_a_full_journal_is_waited_for() -> None:
    service, queue = Taken(), DatagramQueue(1000, 1 << 20)
    service.failures = [QueueFullError("intake", 1, 0.001)] * 3
    work, gateway = inlet(service, queue)
    queue.put(Received(0, 1, NOON_S, plot(0.0)))
    work.drain()
    assert gateway.counts.number(0, "rows_accepted") == 1


@pytest.mark.parametrize("stream", [False, True])
def test_a_full_disk_is_waited_for_if_the_sender_can_wait(
    listening: Callable[..., Listening], monkeypatch: pytest.MonkeyPatch, stream: bool
) -> None:
    monkeypatch.setattr(submission, "DISK_PAUSE_S", 0.001)
    one = listening()
    one.sources[0].can_wait = stream
    one.service.later += [JournalFullError("no space left")] * 3
    one.sources[0].send(plot(0.0))
    one.until("rows_accepted" if stream else "rows_lost", 1)
    assert (one.number("rows_lost"), one.number("rows_accepted")) == (1 - stream, stream)


def test_a_full_queue_drops_nothing_of_a_stream(listening: Callable[..., Listening]) -> None:
    one = listening(begin=False, datagrams_max=1)
    one.sources[0].can_wait = True
    one.sources[0].send(*(plot(float(k)) for k in range(3)))
    one.until("datagrams", 1)
    one.gateway.begin()
    one.until("rows_accepted", 3)
    assert (one.number("datagrams"), one.number("datagrams_dropped")) == (3, 0)


def test_what_never_fits_into_the_queue_is_dropped_of_a_stream_too(
    listening: Callable[..., Listening],
) -> None:
    one = listening(octets_max=10)
    one.sources[0].can_wait = True
    one.sources[0].send(plot(0.0))
    one.until("datagrams_dropped", 1)


@pytest.mark.parametrize("later", [False, True])
def test_measurements_that_the_service_does_not_take_are_counted(later: bool) -> None:
    failure = JournalError("the disk is gone") if later else PipelineError("it is stopping")
    service, queue = Taken(), DatagramQueue(1000, 1 << 20)
    (service.later if later else service.failures).append(failure)
    work, gateway = inlet(service, queue)
    queue.put(Received(0, 1, NOON_S, plot(0.0)))
    work.drain()
    queue.put(Received(0, 2, NOON_S, plot(1.0)))
    work.drain()
    assert gateway.counts.number(0, "rows_lost") == 1
    assert gateway.counts.number(0, "rows_accepted") == 1


def test_a_fault_of_the_service_does_not_stop_the_decoder(
    listening: Callable[..., Listening],
) -> None:
    one = listening()
    one.service.failures.append(RuntimeError("a mistake"))
    one.sources[0].send(plot(0.0))
    one.until("rows_lost", 1)
    one.sources[0].send(plot(1.0))
    one.until("rows_accepted", 1)
    assert one.gateway.counts.document()["batches_failed"] == 1


def test_metrics_show_what_the_counts_say() -> None:
    service, queue = Taken(), DatagramQueue(1000, 1 << 20)
    work, gateway = inlet(service, queue)
    gateway.counts.add(0, datagrams=1, octets=len(plot(0.0)))
    queue.put(Received(0, 1, NOON_S, plot(0.0)))
    work.drain()
    samples = {
        (sample.name, *sample.labels.values()): sample.value
        for metric in AsterixCollector(gateway.counts.document).collect()
        for sample in metric.samples
    }
    assert samples["multiradar_asterix_octets_total", "north", "decoded"] == len(plot(0.0))
    assert samples["multiradar_asterix_records_total", "north", "measurement"] == 1
    assert samples["multiradar_asterix_rows_total", "north", "accepted"] == 1
    assert samples["multiradar_asterix_category_records_total", "048"] == 1
    assert samples["multiradar_asterix_waiting_datagrams",] == 0


def test_a_sensor_whose_times_are_off_is_in_the_status_and_the_metrics() -> None:
    service, queue = Taken(), DatagramQueue(1000, 1 << 20)
    work, gateway = inlet(service, queue)
    for k in range(20):
        queue.put(Received(0, k + 1, NOON_S + k + 3.0, plot(float(k))))
    with capture_logs() as logs:
        work.drain()
        queue.put(Received(0, 21, NOON_S + 23.0, plot(20.0)))
        work.drain()
    (name, clock), *others = gateway.counts.document()["clocks"].items()
    assert (others, clock["alarm"], clock["clock_offset_s"]) == ([], "clock", -3.0)
    samples = {
        (sample.name, *sample.labels.values()): sample.value
        for metric in AsterixCollector(gateway.counts.document).collect()
        for sample in metric.samples
    }
    assert samples["multiradar_asterix_clock_offset_seconds", name] == -3.0
    assert samples["multiradar_asterix_latency_seconds", name] == 3.0
    assert samples["multiradar_asterix_sensor_alarm", name, "clock"] == 1
    assert samples["multiradar_asterix_sensor_alarm", name, "latency"] == 0
    raised = [one for one in logs if one["event"] == "asterix_sensor_alarm"]
    assert [(one["sensor"], one["alarm"]) for one in raised] == [(name, "clock")]
