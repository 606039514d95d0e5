"""A queue of engine output for one reader in a separate thread; the engine never waits for it."""

import math
import threading
from collections import deque
from dataclasses import dataclass
from typing import Protocol

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.outputs import EngineOutput

#: Maximum queued updates; when exceeded, the queue is discarded.
ROWS_MAX = 262_144


@dataclass(frozen=True, slots=True)
class FeedItem:
    """An item of the queue.

    Attributes
    ----------
    output : EngineOutput, optional
        Output of the engine; None for a notice.
    lost : bool
        Whether earlier output was discarded.
    restarted : bool
        Whether the engine restarts: its earlier output is repeated.
    set_back : bool
        Whether output of earlier times follows: the data clock was set back.
    caught_up : bool
        Whether the following output is new: the journal has been replayed.
    reached_s : float
        With `caught_up`, the greatest data time of earlier output, s.
    reached : int
        With `caught_up`, the number of the last earlier update.
    sensors : SensorTable, optional
        The following output is of these sensors.
    """

    output: EngineOutput | None = None
    lost: bool = False
    restarted: bool = False
    set_back: bool = False
    caught_up: bool = False
    reached_s: float = -math.inf
    reached: int = 0
    sensors: SensorTable | None = None


class OutputReader(Protocol):
    """Receives all output of the engine, in the engine's thread."""

    def put(self, output: EngineOutput) -> None:
        """Process output."""
        ...

    def restart(self) -> None:
        """Start over: the engine restarts."""
        ...

    def set_back(self) -> None:
        """Expect earlier times: the data clock was set back, and all tracks were terminated."""
        ...

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        ...


class OutputFeed:
    """A bounded queue of output with one reader; any thread may put.

    Parameters
    ----------
    rows_max : int
        Maximum queued updates.
    """

    def __init__(self, rows_max: int = ROWS_MAX) -> None:
        self._rows_max = rows_max
        self._waiting: deque[FeedItem] = deque()
        self._rows = 0
        self._changed = threading.Condition()
        self._closed = False
        self._reached_s, self._reached = -math.inf, 0
        #: Discarded updates.
        self.dropped = 0

    @property
    def rows(self) -> int:
        """Queued updates."""
        return self._rows

    def put(self, output: EngineOutput) -> None:
        """Add output; never blocks. Ignored after `close`."""
        with self._changed:
            if self._closed:
                return
            self._reached_s = float(output.updates.time_s.max(initial=self._reached_s))
            self._reached = int(output.updates.sequence.max(initial=self._reached))
            lost = self._rows + len(output.updates) > self._rows_max
            if lost:
                self._drop(output)
            else:
                self._waiting.append(FeedItem(output))
                self._rows += len(output.updates)
            self._changed.notify()

    def restart(self) -> None:
        """Queue a notice that the engine restarts."""
        with self._changed:
            # `caught_up` is sent once: a reader that missed it would wait for ever.
            kept = [fed for fed in self._waiting if fed.caught_up or fed.sensors is not None]
            self._waiting = deque([*kept, FeedItem(restarted=True)])
            self._rows = 0
            self._changed.notify()

    def set_back(self) -> None:
        """Queue a notice that output of earlier times follows."""
        with self._changed:
            self._waiting.append(FeedItem(set_back=True))
            self._reached_s = -math.inf
            self._changed.notify()

    def use(self, sensors: SensorTable) -> None:
        """Queue a notice of other sensors."""
        with self._changed:
            self._waiting.append(FeedItem(sensors=sensors))
            self._changed.notify()

    def catch_up(self) -> None:
        """Queue a notice that the following output is new."""
        with self._changed:
            fed = FeedItem(caught_up=True, reached_s=self._reached_s, reached=self._reached)
            self._waiting.append(fed)
            self._changed.notify()

    def pop(self) -> FeedItem | None:
        """Wait for the next item; None when the feed is closed and empty."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closed)
            if not self._waiting:
                return None
            fed = self._waiting.popleft()
            if fed.output is not None:
                self._rows -= len(fed.output.updates)
            return fed

    def close(self) -> None:
        """Accept no more output; queued items can still be popped."""
        with self._changed:
            self._closed = True
            self._changed.notify()

    def _drop(self, output: EngineOutput) -> None:
        self.dropped += self._rows + len(output.updates)
        # Notices are kept: each separates output. One notice of a loss is sufficient.
        kept = [fed for fed in self._waiting if fed.output is None and not fed.lost]
        self._waiting = deque([*kept, FeedItem(lost=True)])
        self._rows = 0
