"""ASTERIX input from the network: ports, queue, decoder."""

import threading
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import structlog

from multiradar.clock import Clock, SystemClock
from multiradar.ingest.asterix_counts import AsterixCounts
from multiradar.ingest.asterix_inlet import AsterixInlet, InletBounds
from multiradar.ingest.asterix_queue import DatagramQueue, Received
from multiradar.ingest.asterix_source import DatagramSource
from multiradar.runtime.live.threads import SystemThreads, Thread, Threads
from multiradar.runtime.ports import MeasurementSink
from multiradar_converters.asterix.live.reception import LiveDecoder, warm_up

_log = structlog.get_logger("multiradar.asterix")

#: Pause before a failed port is tried again, s.
FAULT_PAUSE_S = 1.0
#: Pause before data of a sender that can wait are put into a full queue again, s.
QUEUE_PAUSE_S = 0.05


class AsterixGateway:
    """Receives ASTERIX datagrams and submits their measurements.

    Parameters
    ----------
    labels : sequence of str
        Names of the listeners.
    sources : sequence of callable
        Each opens the port of a listener.
    sink : MeasurementSink
        The running service.
    decoder : LiveDecoder
        Shared by all listeners, because two of them may receive the same data.
    queue : DatagramQueue
        Queue between the ports and the decoder.
    bounds : InletBounds
        Limits of decoding.
    clock : Clock, optional
        Time of reception.
    threads : Threads, optional
        Runs what listens and decodes; threads of the system by default.

    Attributes
    ----------
    counts : AsterixCounts
        Received data and their disposition.
    """

    def __init__(
        self,
        *,
        labels: Sequence[str],
        sources: Sequence[Callable[[], DatagramSource]],
        sink: MeasurementSink,
        decoder: LiveDecoder,
        queue: DatagramQueue,
        bounds: InletBounds | None = None,
        clock: Clock | None = None,
        threads: Threads | None = None,
    ) -> None:
        self._open_sources = tuple(sources)
        self._sources: list[DatagramSource] = []
        self._queue = queue
        self._clock = clock or SystemClock()
        self._threads = threads or SystemThreads()
        self._stopping = threading.Event()
        self._listening: list[Thread] = []
        self._decoding: Thread | None = None
        # Datagrams by listener, and those whose internal error is logged.
        self._received = [0] * len(labels)
        self._failed: set[int] = set()
        self.counts = AsterixCounts(labels)
        self.counts.waiting = lambda: (len(queue), queue.octets)
        self.counts.lost_by_system = self._lost
        self.counts.endpoint = self._endpoint
        self.counts.status = self._status
        self._inlet = AsterixInlet(
            queue,
            decoder,
            sink,
            self.counts,
            bounds or InletBounds(),
            can_wait=self._can_wait,
            threads=self._threads,
        )

    @property
    def endpoints(self) -> tuple[str, ...]:
        """Addresses it listens on; empty before the start."""
        return tuple(source.endpoint for source in self._sources)

    def start(self) -> None:
        """Open the ports and listen; datagrams are queued until `begin`, as far as they fit.

        Raises
        ------
        ConfigurationError
            If a port cannot be opened.
        """
        self.open()
        self._listening = [
            self._threads.start(partial(self._listen, k), f"asterix-{label}")
            for k, label in enumerate(self.counts.labels)
        ]

    def open(self) -> None:
        """Open the ports without listening: the caller calls `receive`.

        Raises
        ------
        ConfigurationError
            If a port cannot be opened.
        """
        for open_source in self._open_sources:
            self._sources.append(open_source())

    def begin(self) -> None:
        """Submit queued and further datagrams: the service accepts measurements."""
        warm_up()
        self._decoding = self._threads.start(self._inlet.run, "asterix-decoder")

    def stop(self) -> None:
        """Stop listening, submit what was received, close the ports; may be called twice."""
        self._stopping.set()
        for thread in self._listening:
            thread.join()
        self._inlet.stop()
        if self._decoding is not None:
            self._decoding.join()
        self._listening, self._decoding = [], None
        for source in self._sources:
            source.close()

    def receive(self, listener: int) -> None:
        """Wait a moment for the next datagram of a listener, by index; queue or drop it."""
        source = self._sources[listener]
        try:
            octets = source.receive()
        except Exception as error:
            # Counted and tried again: the network may come back.
            if not (listener in self._failed or isinstance(error, OSError)):
                self._failed.add(listener)
                label = self.counts.labels[listener]
                _log.error("asterix_listener_failed", listener=label, exc_info=error)
            self.counts.add(listener, receive_faults=1)
            self._stopping.wait(FAULT_PAUSE_S)
            return
        if octets is None:
            return
        self._received[listener] += 1
        number, size = self._received[listener], len(octets)
        received = Received(listener, number, self._clock.now_s(), octets, source.sender)
        if not (self._put(received) or self._put_later(received)):
            self.counts.add(
                listener, datagrams=1, octets=size, datagrams_dropped=1, octets_dropped=size
            )

    # ---------------------------------------------------------------- inside

    def _listen(self, listener: int) -> None:
        while not self._stopping.is_set():
            self.receive(listener)

    def _put(self, received: Received) -> bool:
        with self.counts.at_once():
            if not self._queue.put(received):
                return False
            self.counts.add(received.listener, datagrams=1, octets=len(received.octets))
            return True

    # A sender that can wait is not read from until there is room, or nothing that takes it.
    def _put_later(self, received: Received) -> bool:
        if not self._can_wait(received.listener):
            return False
        while len(self._queue) and not self._stopping.wait(QUEUE_PAUSE_S):
            if self._put(received):
                return True
        return self._put(received)

    def _can_wait(self, listener: int) -> bool:
        return listener < len(self._sources) and self._sources[listener].can_wait

    def _lost(self, listener: int) -> int:
        return self._sources[listener].lost if listener < len(self._sources) else 0

    def _status(self, listener: int) -> Mapping[str, object]:
        return self._sources[listener].status if listener < len(self._sources) else {}

    def _endpoint(self, listener: int) -> str:
        return self._sources[listener].endpoint if listener < len(self._sources) else ""
