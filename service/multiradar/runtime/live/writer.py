"""The one writer of the journal: decides, writes several messages in one transaction, answers.

An answer is given when the transaction is on disk. A journal that cannot be written stops the
intake for good, because after a failed write nothing says what is on disk; only a full disk, which
the journal reports before anything is changed, lets the next message try again.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import polars as pl

from multiradar.errors import (
    IdempotencyConflictError,
    JournalFullError,
    MultiradarError,
    PipelineError,
)
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission.admission import Admission
from multiradar.runtime.live.accounting import Accounting
from multiradar.runtime.live.backlog import Backlog, Journalled
from multiradar.runtime.live.intake import Intake, Submission
from multiradar.runtime.live.preparation import Prepared, prepare, same_message
from multiradar.runtime.live.receipt import Receipt
from multiradar.storage.entries import Entry, RejectedRow, StoredEntry
from multiradar.storage.journal import Journal

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Taken:
    # A message that goes into the journal with this transaction.
    submission: Submission
    prepared: Prepared


#: Given the rows of a message that is in the journal, and those of it that were rejected.
OnTaken = Callable[[pl.DataFrame, Sequence[RejectedRow]], None]

# A message of a known key, and what was taken under it.
_Again = tuple[Submission, StoredEntry | Submission]


class Writer:
    """Empties the intake into the journal; `run` is the body of one thread.

    Parameters
    ----------
    intake : Intake
        Where messages wait.
    journal : Journal
        Where they go.
    backlog : Backlog
        Where the engine finds them, once they are on disk.
    sensors : SensorTable
        The sensors.
    admission : Admission
        Decides by time.
    accounting : Accounting
        Counts rows.
    batches_max : int
        Messages in one transaction.
    on_taken : callable
        Given the rows of each message that is in the journal, and those of it that were rejected.
    """

    def __init__(
        self,
        *,
        intake: Intake,
        journal: Journal,
        backlog: Backlog,
        sensors: SensorTable,
        admission: Admission,
        accounting: Accounting,
        batches_max: int,
        on_taken: Callable[[pl.DataFrame, Sequence[RejectedRow]], None] = lambda _rows, _rejects: (
            None
        ),
    ) -> None:
        self._on_taken = on_taken
        self._intake = intake
        self._journal = journal
        self._backlog = backlog
        self._sensors = sensors
        self._admission = admission
        self._accounting = accounting
        self._batches_max = batches_max
        #: Last entry of the journal that this writer, or the one before the restart, completed.
        self.head = 0
        #: Why nothing more is taken, or None.
        self.failure: MultiradarError | None = None

    def run(self) -> None:
        """Write until the intake is closed and drained."""
        while group := self._intake.take(self._batches_max):
            running = [one for one in group if one.future.set_running_or_notify_cancel()]
            if self.failure is not None:
                _fail(running, self.failure)
                continue
            try:
                self.write(running)
            except Exception as error:
                self._stop(error, running)

    def write(self, group: Sequence[Submission]) -> None:
        """Write messages in one transaction, answer them, and hand them to the engine."""
        before = self._admission.state()
        fresh, again = self._sort(group)
        taken = self._prepare(fresh)
        entries = [one.prepared.entry for one in taken]
        try:
            sequences = self._journal.append(entries) if entries else []
        except JournalFullError as error:
            self._admission.restore(before)
            _fail(group, error)
            return
        self._answer(taken, sequences, again)
        self._backlog.put(
            [
                Journalled(sequence, entry.kind, one.prepared.batch, entry.source, entry.rejects)
                for sequence, one, entry in zip(sequences, taken, entries, strict=True)
            ]
        )
        for one in taken:
            self._on_taken(one.submission.frame, one.prepared.entry.rejects)

    # Messages to take, and messages of a key that is known, with what was taken under it: an entry
    # of the journal, or an earlier message of this group.
    def _sort(self, group: Sequence[Submission]) -> tuple[list[Submission], list[_Again]]:
        fresh: list[Submission] = []
        again: list[_Again] = []
        keys: dict[str, Submission] = {}
        for submission in group:
            key = submission.idempotency_key
            earlier = None
            if key is not None:
                earlier = keys.get(key) or self._journal.find(key)
            if earlier is not None:
                again.append((submission, earlier))
                continue
            fresh.append(submission)
            if key is not None:
                keys[key] = submission
        return fresh, again

    def _prepare(self, fresh: Sequence[Submission]) -> list[_Taken]:
        taken = []
        prepared = prepare(fresh, self._sensors, self._admission)
        for submission, one in zip(fresh, prepared, strict=True):
            if isinstance(one, Prepared):
                taken.append(_Taken(submission, one))
                continue
            if not isinstance(one, MultiradarError):
                _log.error("a message of %s is poison", submission.source, exc_info=one)
            submission.future.set_exception(one)
        return taken

    def _answer(
        self,
        taken: Sequence[_Taken],
        sequences: Sequence[int],
        again: Sequence[_Again],
    ) -> None:
        accounting = self._accounting
        receipts = []
        for one, sequence in zip(taken, sequences, strict=True):
            entry = one.prepared.entry
            accounting.read += one.submission.rows
            accounting.accepted += entry.accepted
            accounting.rejected += len(entry.rejects)
            receipts.append(Receipt(entry.accepted, entry.rejects, False, sequence))
            self.head = sequence
        accounting.check()
        for one, receipt in zip(taken, receipts, strict=True):
            one.submission.future.set_result(receipt)
        known = {
            id(one.submission): (one.prepared.entry, sequence)
            for one, sequence in zip(taken, sequences, strict=True)
        }
        for submission, earlier in again:
            if isinstance(earlier, StoredEntry):
                self._answer_again(submission, earlier.entry, earlier.sequence)
            elif id(earlier) in known:
                self._answer_again(submission, *known[id(earlier)])
            else:
                # What came first under this key could not be understood.
                submission.future.set_exception(earlier.future.exception())

    def _answer_again(self, submission: Submission, entry: Entry, sequence: int) -> None:
        key = submission.idempotency_key
        if key is not None and not same_message(submission, entry):
            submission.future.set_exception(IdempotencyConflictError(key, sequence))
            return
        self._accounting.read += submission.rows
        self._accounting.duplicate += submission.rows
        self._accounting.check()
        submission.future.set_result(Receipt(entry.accepted, entry.rejects, True, sequence))

    def _stop(self, error: Exception, group: Sequence[Submission]) -> None:
        if isinstance(error, MultiradarError):
            failure: MultiradarError = error
        else:
            failure = PipelineError(f"the writer of the journal has stopped: {error!r}")
        _log.error("nothing more is taken", exc_info=error)
        self.failure = failure
        self._intake.close(failure)
        _fail(group, failure)


def _fail(group: Sequence[Submission], error: MultiradarError) -> None:
    for submission in group:
        if not submission.future.done():
            submission.future.set_exception(error)
