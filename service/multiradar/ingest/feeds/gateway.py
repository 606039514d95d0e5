"""All feeds of the service: one thread each."""

import threading
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from multiradar.clock import Clock, SystemClock
from multiradar.ingest.feeds.connections import FeedConnection
from multiradar.ingest.feeds.counts import FeedCounts
from multiradar.ingest.feeds.reader import FeedReader, ReaderBounds
from multiradar.runtime.ports import MeasurementSink
from multiradar_converters.feeds.live import LiveFeed, warm_up

#: Maximum wait for a feed that is just connecting, s.
STOP_TIMEOUT_S = 20.0

Wait = Callable[[float], object]


@dataclass(frozen=True)
class FeedPlan:
    """A feed to be read.

    Attributes
    ----------
    label : str
        Its name.
    open : callable
        Returns the connection; called with the function that waits for a time or the stop. Raises
        ConfigurationError.
    feed : LiveFeed
        Its decoder.
    """

    label: str
    open: Callable[[Wait], FeedConnection]
    feed: LiveFeed


class FeedGateway:
    """Reads feeds and submits their measurements.

    Parameters
    ----------
    plans : sequence of FeedPlan
        The feeds.
    sink : MeasurementSink
        The running service.
    bounds : ReaderBounds, optional
        Limits.
    clock : Clock, optional
        Time of reception.

    Attributes
    ----------
    counts : FeedCounts
        States, received data and their disposition.
    """

    def __init__(
        self,
        plans: Sequence[FeedPlan],
        sink: MeasurementSink,
        bounds: ReaderBounds | None = None,
        clock: Clock | None = None,
    ) -> None:
        self._plans = tuple(plans)
        self._sink = sink
        self._bounds = bounds or ReaderBounds()
        self._clock = clock or SystemClock()
        self._stopping = threading.Event()
        self._connections: list[FeedConnection] = []
        self._threads: list[threading.Thread] = []
        self.counts = FeedCounts(plan.label for plan in self._plans)

    @property
    def endpoints(self) -> tuple[str, ...]:
        """Addresses of the feeds; empty before the start."""
        return tuple(connection.endpoint for connection in self._connections)

    def start(self) -> None:
        """Open the ports; connections wait until `begin`.

        Raises
        ------
        ConfigurationError
            If a port cannot be opened.
        """
        for plan in self._plans:
            self._connections.append(plan.open(self._stopping.wait))

    def begin(self) -> None:
        """Connect and read: the service accepts measurements."""
        warm_up()
        for plan, connection in zip(self._plans, self._connections, strict=True):
            reader = FeedReader(
                label=plan.label,
                connection=connection,
                feed=plan.feed,
                sink=self._sink,
                counts=self.counts,
                bounds=self._bounds,
                clock=self._clock,
                stopping=self._stopping,
            )
            thread = threading.Thread(target=reader.run, name=f"feed-{plan.label}", daemon=True)
            self._threads.append(thread)
            thread.start()

    def stop(self) -> None:
        """Stop reading, submit what was decoded, close everything; may be called twice."""
        self._stopping.set()
        for thread in self._threads:
            thread.join(STOP_TIMEOUT_S)
        self._threads = []
        for connection in self._connections:
            connection.release()
