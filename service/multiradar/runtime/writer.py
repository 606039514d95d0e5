"""The one writer of the journal: decides, writes several messages in one transaction, answers.

An answer is given when the transaction is on disk. A journal that cannot be written stops the
intake for good, because after a failed write nothing says what is on disk; only a full disk, which
the journal reports before anything is changed, lets the next message try again.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace

from multiradar.errors import (
    IdempotencyConflictError,
    JournalError,
    JournalFullError,
    MultiradarError,
    PipelineError,
)
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.accounting import Accounting
from multiradar.runtime.admission import Admission
from multiradar.runtime.backlog import Backlog, Journalled
from multiradar.runtime.intake import Intake, Submission
from multiradar.runtime.preparation import Prepared, prepare, same_message
from multiradar.runtime.receipt import Receipt
from multiradar.storage.entries import StoredEntry
from multiradar.storage.journal import Journal

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Taken:
    # A message that goes into the journal with this transaction.
    submission: Submission
    prepared: Prepared


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
    ) -> None:
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
        taken: list[_Taken] = []
        again: list[tuple[Submission, StoredEntry | int]] = []
        for submission in group:
            self._sort(submission, taken, again)
        entries = [one.prepared.entry for one in taken]
        try:
            sequences = self._journal.append(entries) if entries else []
        except JournalFullError as error:
            self._admission.restore(before)
            _fail([one.submission for one in taken] + [one for one, _ in again], error)
            return
        self._answer(taken, sequences, again)
        self._backlog.put(
            [
                Journalled(sequence, one.prepared.entry.kind, one.prepared.batch)
                for sequence, one in zip(sequences, taken, strict=True)
            ]
        )

    def _sort(
        self,
        submission: Submission,
        taken: list[_Taken],
        again: list[tuple[Submission, StoredEntry | int]],
    ) -> None:
        # One message that cannot be understood must not harm those that share its transaction.
        try:
            earlier = self._earlier(submission, taken)
            if earlier is not None:
                again.append((submission, earlier))
            else:
                taken.append(
                    _Taken(submission, prepare(submission, self._sensors, self._admission))
                )
        except JournalError:
            raise
        except Exception as error:
            if not isinstance(error, MultiradarError):
                _log.exception("a message of %s could not be prepared", submission.source)
            submission.future.set_exception(error)

    # The message that was taken under the same key: in the journal, or in this transaction.
    def _earlier(self, submission: Submission, taken: list[_Taken]) -> StoredEntry | int | None:
        key = submission.idempotency_key
        if key is None:
            return None
        for place, one in enumerate(taken):
            entry = one.prepared.entry
            if entry.idempotency_key == key:
                if not same_message(submission, StoredEntry(0, entry, b"")):
                    raise IdempotencyConflictError(key, self.head + 1 + place)
                return place
        stored = self._journal.find(key)
        if stored is not None and not same_message(submission, stored):
            raise IdempotencyConflictError(key, stored.sequence)
        return stored

    def _answer(
        self,
        taken: Sequence[_Taken],
        sequences: Sequence[int],
        again: Sequence[tuple[Submission, StoredEntry | int]],
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
        for submission, _ in again:
            accounting.read += submission.rows
            accounting.duplicate += submission.rows
        accounting.check()
        for one, receipt in zip(taken, receipts, strict=True):
            one.submission.future.set_result(receipt)
        for submission, earlier in again:
            if isinstance(earlier, int):
                receipt = replace(receipts[earlier], duplicate=True)
            else:
                entry = earlier.entry
                receipt = Receipt(entry.accepted, entry.rejects, True, earlier.sequence)
            submission.future.set_result(receipt)

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
