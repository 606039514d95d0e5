"""The bounded queue between the senders and the writer of the journal."""

from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from math import inf

import polars as pl

from multiradar.errors import MultiradarError, PipelineError, QueueFullError
from multiradar.runtime.live.receipt import Receipt
from multiradar.runtime.live.threads import SystemThreads, Threads
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.entries import EntryKind, RejectedRow


@dataclass(frozen=True, slots=True)
class Submission:
    """A message queued for the journal.

    Attributes
    ----------
    kind : EntryKind
        Measurements, or the end of a stream.
    frame : DataFrame
        The rows, columns of `MEASUREMENT_SCHEMA` and perhaps `index`.
    source : str
        Its sender.
    idempotency_key : str or None
        The sender's name for the message.
    rejected : sequence of RejectedRow
        Rows rejected at the interface.
    latest_s : float
        Measurements later than this are in the future, s.
    received_s : float or None
        Time of its reception, UTC, s, of a clock that is never set back.
    future : Future of Receipt
        Resolved when the message is in the journal.
    """

    kind: EntryKind
    frame: pl.DataFrame
    source: str
    idempotency_key: str | None
    rejected: Sequence[RejectedRow]
    latest_s: float = inf
    received_s: float | None = None
    future: Future[Receipt] = field(default_factory=Future)

    @property
    def rows(self) -> int:
        """Rows of the message, including rejected ones."""
        return len(self.frame) + len(self.rejected)


class Intake:
    """A queue with a bound on messages and on rows.

    Parameters
    ----------
    limits : RuntimeLimits
        The bounds.
    threads : Threads, optional
        Makes what the threads wait for; threads of the system by default.
    """

    def __init__(self, limits: RuntimeLimits, threads: Threads | None = None) -> None:
        self._limits = limits
        self._waiting: deque[Submission] = deque()
        self._rows = 0
        #: Time of reception of the oldest queued message, UTC, s; None if it has none.
        self.oldest_s: float | None = None
        self._closed_with: MultiradarError | None = None
        self._changed = (threads or SystemThreads()).condition()

    @property
    def batches(self) -> int:
        """Queued messages."""
        return len(self._waiting)

    @property
    def rows(self) -> int:
        """Queued rows."""
        return self._rows

    def put(self, submission: Submission) -> None:
        """Add a message.

        Raises
        ------
        QueueFullError
            If a bound is reached. A message larger than the bound is accepted when the queue is
            empty.
        MultiradarError
            If the queue is closed: the error it was closed with.
        """
        limits = self._limits
        with self._changed:
            if self._closed_with is not None:
                raise self._closed_with
            full = len(self._waiting) >= limits.intake_batches_max or (
                self._waiting and self._rows + submission.rows > limits.intake_rows_max
            )
            if full:
                raise QueueFullError("intake", len(self._waiting), limits.retry_after_s)
            self._waiting.append(submission)
            self._rows += submission.rows
            self.oldest_s = self._waiting[0].received_s
            self._changed.notify()

    def pop(self, batches_max: int) -> list[Submission]:
        """Wait for messages and return the oldest ones; empty when closed and drained."""
        with self._changed:
            while not self._waiting and self._closed_with is None:
                self._changed.wait()
            popped = [self._waiting.popleft() for _ in range(min(batches_max, len(self._waiting)))]
            self._rows -= sum(submission.rows for submission in popped)
            self.oldest_s = self._waiting[0].received_s if self._waiting else None
            return popped

    def close(self, error: MultiradarError | None = None) -> None:
        """Accept no more messages; queued ones can still be popped."""
        with self._changed:
            if self._closed_with is None:
                self._closed_with = error or PipelineError("the service is stopping")
            self._changed.notify_all()
