"""The engine's output for one reader in a thread of its own, who is never waited for."""

import math
import threading
from collections import deque
from dataclasses import dataclass
from typing import Protocol

from multiradar.tracking.outputs import EngineOutput

#: Updates that wait for a reader at most; all that wait are dropped when there are more.
ROWS_MAX = 262_144


@dataclass(frozen=True, slots=True)
class Fed:
    """What a reader gets next.

    Attributes
    ----------
    output : EngineOutput, optional
        Output of the engine; None for a notice.
    lost : bool
        Whether output before this was dropped.
    restarted : bool
        Whether the engine begins again: what it put out before comes once more.
    caught_up : bool
        Whether what follows is new: the journal was played.
    reached_s : float
        With `caught_up`, the greatest data time of what was put before it, s.
    """

    output: EngineOutput | None = None
    lost: bool = False
    restarted: bool = False
    caught_up: bool = False
    reached_s: float = -math.inf


class OutputReader(Protocol):
    """Who is handed all output of the engine, in its thread."""

    def put(self, output: EngineOutput) -> None:
        """Take output."""
        ...

    def restart(self) -> None:
        """Hear that the engine begins again."""
        ...


class OutputFeed:
    """A bounded queue of output; any thread puts, one reads.

    Parameters
    ----------
    rows_max : int
        Updates that may wait.
    """

    def __init__(self, rows_max: int = ROWS_MAX) -> None:
        self._rows_max = rows_max
        self._waiting: deque[Fed] = deque()
        self._rows = 0
        self._changed = threading.Condition()
        self._closed = False
        self._reached_s = -math.inf
        #: Updates that were dropped.
        self.dropped = 0

    @property
    def rows(self) -> int:
        """Updates that wait."""
        return self._rows

    def put(self, output: EngineOutput) -> None:
        """Add output; never waits. Of a closed feed nothing more is read, so nothing is kept."""
        with self._changed:
            if self._closed:
                return
            self._reached_s = float(output.updates.time_s.max(initial=self._reached_s))
            lost = self._rows + len(output.updates) > self._rows_max
            if lost:
                self._drop(output)
            else:
                self._waiting.append(Fed(output))
                self._rows += len(output.updates)
            self._changed.notify()

    def restart(self) -> None:
        """Say that the engine begins again."""
        with self._changed:
            # Nobody says twice that the journal was played: a reader that did not hear it would
            # wait for it for ever.
            kept = [fed for fed in self._waiting if fed.caught_up]
            self._waiting = deque([*kept, Fed(restarted=True)])
            self._rows = 0
            self._changed.notify()

    def catch_up(self) -> None:
        """Say that what follows is new."""
        with self._changed:
            self._waiting.append(Fed(caught_up=True, reached_s=self._reached_s))
            self._changed.notify()

    def take(self) -> Fed | None:
        """Wait for what is next; None when the feed is closed and empty."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or self._closed)
            if not self._waiting:
                return None
            fed = self._waiting.popleft()
            if fed.output is not None:
                self._rows -= len(fed.output.updates)
            return fed

    def close(self) -> None:
        """Take nothing more; what waits can still be read."""
        with self._changed:
            self._closed = True
            self._changed.notify()

    def _drop(self, output: EngineOutput) -> None:
        self.dropped += self._rows + len(output.updates)
        # Notices stay: each of them ends what came before it. One of a loss is enough.
        kept = [fed for fed in self._waiting if fed.output is None and not fed.lost]
        self._waiting = deque([*kept, Fed(lost=True)])
        self._rows = 0
