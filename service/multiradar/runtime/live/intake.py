"""The bounded queue between the senders and the writer of the journal.

Each source has a share of it, and one that floods the service does not delay the others.
"""

from collections import deque
from collections.abc import Sequence
from concurrent.futures import Future
from dataclasses import dataclass, field
from math import inf
from typing import Any, Self

import polars as pl

from multiradar.clock import Clock, SystemClock
from multiradar.errors import MultiradarError, PipelineError, QueueFullError
from multiradar.runtime.admission.sources import Sources
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
        What it is.
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
    clock_s : float
        New time of the data clock, s.
    change : bytes
        Change of a sensor; see `multiradar.runtime.admission.sensors_in_force`. Of a handover,
        the message.
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
    clock_s: float = inf
    change: bytes = b""
    future: Future[Receipt] = field(default_factory=Future)

    @classmethod
    def mark(
        cls, kind: EntryKind, source: str, received_s: float, key: str | None = None, *,
        clock_s: float = inf, change: bytes = b"",
    ) -> Self:  # fmt: skip
        """Return a message without measurements."""
        return cls(
            kind, pl.DataFrame(), source, key, (),
            received_s=received_s, clock_s=clock_s, change=change,
        )  # fmt: skip

    @property
    def rows(self) -> int:
        """Rows of the message, including rejected ones."""
        return len(self.frame) + len(self.rejected)


class _Queue:
    # Messages of one source, each with its number in the order of arrival.
    def __init__(self) -> None:
        self.waiting: deque[tuple[int, Submission]] = deque()
        self.rows = 0


class Intake:
    """A queue with bounds on messages and on rows, of all sources and of each.

    Parameters
    ----------
    limits : RuntimeLimits
        The bounds.
    threads : Threads, optional
        Makes what the threads wait for; threads of the system by default.
    clock : Clock, optional
        Times the quarantine of sources.
    """

    def __init__(
        self, limits: RuntimeLimits, threads: Threads | None = None, clock: Clock | None = None
    ) -> None:
        self._limits = limits
        self._queues: dict[str, _Queue] = {}
        self._number = 0
        self._batches = 0
        self._rows = 0
        #: Time of reception of the oldest queued message, UTC, s; None if it has none.
        self.oldest_s: float | None = None
        self._closed_with: MultiradarError | None = None
        self._changed = (threads or SystemThreads()).condition()
        #: What each source sends.
        self.sources = Sources(limits, clock or SystemClock())

    def put(self, submission: Submission) -> None:
        """Add a message.

        Raises
        ------
        QueueFullError
            If a bound is reached, or the source is in quarantine. A message larger than the bound
            is accepted when the queue is empty.
        MultiradarError
            If the queue is closed: the error it was closed with.
        """
        with self._changed:
            if self._closed_with is not None:
                raise self._closed_with
            queue = self._queues.get(submission.source) or _Queue()
            self._require_room(queue, submission)
            if submission.kind is EntryKind.BATCH:
                self.sources.require(submission.source, submission.rows, queue.rows)
            self._queues[submission.source] = queue
            self._number += 1
            queue.waiting.append((self._number, submission))
            self._count(queue, 1, submission.rows)
            self._changed.notify()

    def pop(self, batches_max: int) -> list[Submission]:
        """Wait for messages and return some in their order; empty when closed and drained.

        Messages of a source with more rows than a transaction has come after those of the others,
        except the first. If most of its rows are rejected, each counts as several: it takes longer.
        The end of a stream comes after all messages before it, of all sources.
        """
        with self._changed:
            while not self._batches and self._closed_with is None:
                self._changed.wait()
            popped: list[Submission] = []
            rows = 0.0
            while self._batches and len(popped) < batches_max:
                if popped and rows >= self._limits.commit_rows_max:
                    break
                # The first is the oldest of all, so that each source proceeds.
                popped.append(self._next(in_order=not popped))
                rows += self.sources.cost_rows(popped[-1].source, popped[-1].rows)
            return popped

    def close(self, error: MultiradarError | None = None) -> None:
        """Accept no more messages; queued ones can still be popped."""
        with self._changed:
            if self._closed_with is None:
                self._closed_with = error or PipelineError("the service is stopping")
            self._changed.notify_all()

    def document(self) -> dict[str, Any]:
        """Return what is queued, and what each source sends, for the status."""
        return {
            "intake_batches": self._batches,
            "intake_rows": self._rows,
            "sources": self.sources.document(),
        }

    # ---------------------------------------------------------------- inside

    def _require_room(self, queue: _Queue, submission: Submission) -> None:
        limits, rows = self._limits, submission.rows
        own = len(queue.waiting), queue.rows, limits.source_batches_max, limits.source_rows_max
        every = self._batches, self._rows, limits.intake_batches_max, limits.intake_rows_max
        for name, (batches, held, batches_max, rows_max) in (
            (submission.source, own),
            ("intake", every),
        ):
            if batches >= batches_max or (batches and held + rows > rows_max):
                self.sources.defer(submission.source, rows)
                raise QueueFullError(name, batches, limits.retry_after_s)

    def _next(self, *, in_order: bool) -> Submission:
        every = self._queues.items()
        oldest = min(queue.waiting[0][0] for _, queue in every)
        # A source with more than a transaction waits for the others. The order of the others is not
        # changed: it would make those late that send in smaller pieces.
        source, queue = min(
            (
                one
                for one in every
                if one[1].waiting[0][0] == oldest or one[1].waiting[0][1].kind is EntryKind.BATCH
            ),
            key=lambda one: (
                not in_order
                and self.sources.cost_rows(one[0], one[1].rows) > self._limits.commit_rows_max,
                one[1].waiting[0][0],
            ),
        )
        _, submission = queue.waiting.popleft()
        if not queue.waiting:
            del self._queues[source]
        self._count(queue, -1, -submission.rows)
        return submission

    def _count(self, queue: _Queue, batches: int, rows: int) -> None:
        self._batches += batches
        self._rows += rows
        queue.rows += rows
        firsts = [one.waiting[0] for one in self._queues.values()]
        self.oldest_s = min(firsts, key=lambda one: one[0])[1].received_s if firsts else None
