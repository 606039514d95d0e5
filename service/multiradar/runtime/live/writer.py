"""The journal writer: admits messages, writes several in one transaction, answers.

An answer is given when the transaction is on disk. A failed write stops the intake permanently,
because the content of the disk is unknown afterwards: the process ends, and the next one verifies
the journal. Only a full disk and a journal that another process has locked, which are reported
before any change, allow the next message to be tried.
"""

import itertools
import logging
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import polars as pl

from multiradar.errors import (
    IdempotencyConflictError,
    JournalBusyError,
    JournalFullError,
    MultiradarError,
    PipelineError,
)
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission.admission_by_time import Admission
from multiradar.runtime.admission.sensors_in_force import SensorsInForce
from multiradar.runtime.live.accounting import Accounting
from multiradar.runtime.live.backlog import Backlog, Journalled
from multiradar.runtime.live.intake import Intake, Submission
from multiradar.runtime.live.preparation import Prepared, prepare, same_message
from multiradar.runtime.live.receipt import SENDER_SEPARATOR, Receipt
from multiradar.runtime.live.threads import log_end
from multiradar.runtime.memory.history import TrackHistory
from multiradar.storage.entries import Entry, EntryKind, StoredEntry
from multiradar.storage.journal import Journal
from multiradar.tracking.input.measurements import MeasurementBatch

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class _Admitted:
    # A message of this transaction.
    submission: Submission
    prepared: Prepared


#: Called with the rows of a journalled message, and its entry.
OnJournalled = Callable[[pl.DataFrame, Entry], None]

# A message with a known key, and the earlier message with that key.
_Again = tuple[Submission, StoredEntry | Submission]


class Writer:
    """Empties the intake into the journal; `run` is the body of one thread.

    Parameters
    ----------
    intake : Intake
        Queue of messages.
    journal : Journal
        The journal.
    backlog : Backlog
        Queue of the engine, for messages on disk.
    sensors : SensorsInForce
        The sensors after the last entry of the journal.
    admission : Admission
        Accepts or rejects by time.
    accounting : Accounting
        Row counts.
    batches_max : int
        Messages in one transaction.
    require_usable : callable
        Raises an error if the engine cannot use sensors. Their change is then rejected: another
        change may have come between it and its plan, and a journalled change is never skipped.
    on_sensors : callable
        Called with the sensors before they change.
    on_journalled : callable
        Called with the rows of each journalled message, and its entry; its errors are logged and
        counted.
    on_full : callable
        Called when the disk is full.
    on_failure : callable
        Called when it has stopped for good.
    """

    def __init__(
        self,
        *,
        intake: Intake,
        journal: Journal,
        backlog: Backlog,
        sensors: SensorsInForce,
        admission: Admission,
        accounting: Accounting,
        batches_max: int,
        require_usable: Callable[[SensorTable], object] = lambda _table: None,
        on_sensors: Callable[[SensorTable], None] = lambda _table: None,
        on_journalled: OnJournalled = lambda _rows, _entry: None,
        on_full: Callable[[], None] = lambda: None,
        on_failure: Callable[[], None] = lambda: None,
    ) -> None:
        self._require_usable = require_usable
        self._on_sensors = on_sensors
        self._on_journalled = on_journalled
        self._on_full = on_full
        self._on_failure = on_failure
        self._intake = intake
        self._journal = journal
        self._backlog = backlog
        #: The sensors after the last message.
        self.sensors = sensors
        self._admission = admission
        self._accounting = accounting
        self._batches_max = batches_max
        #: Last journal entry completed by this writer, or before the restart.
        self.head = 0
        #: Time of reception of the oldest message being written, UTC, s; None if there is none.
        self.oldest_s: float | None = None
        #: Why no more messages are accepted, or None.
        self.failure: MultiradarError | None = None

    def run(self) -> None:
        """Write until the intake is closed and drained."""
        while group := self._intake.pop(self._batches_max):
            running = [one for one in group if one.future.set_running_or_notify_cancel()]
            if self.failure is not None:
                _fail(running, self.failure)
                continue
            self.oldest_s = group[0].received_s
            try:
                self.write(running)
            except Exception as error:
                self._stop(error, running)
            self.oldest_s = None
            # A message may have taken 100 MB, and the next one may come hours later.
            del group, running

    def write(self, group: Sequence[Submission]) -> None:
        """Write messages in one transaction, answer them, and queue them for the engine."""
        before, sensors = self._admission.state(), self.sensors
        fresh, again = self._sort(group)
        admitted = self._prepare(fresh)
        entries = [one.prepared.entry for one in admitted]
        try:
            sequences = self._journal.append(entries) if entries else []
        except (JournalFullError, JournalBusyError) as error:
            self._undo_arrivals(admitted)
            if self.sensors is not sensors:
                self._use(sensors)
            self._admission.restore(before)
            if isinstance(error, JournalFullError):
                self._on_full()
            else:
                _log.warning("%s", error)
            _fail(group, error)
            return
        # Before the answer, so that what the sender then asks for shows its message.
        for one in admitted:
            self._record(one)
        self._answer(admitted, sequences, again)
        self._backlog.put(
            [
                Journalled(
                    sequence,
                    entry.kind,
                    one.prepared.batch,
                    entry.source,
                    entry.rejects,
                    one.prepared.clock_s,
                    one.submission.received_s,
                    one.submission.change,
                )
                for sequence, one, entry in zip(sequences, admitted, entries, strict=True)
            ]
        )

    # A bug there costs neither the answer nor what comes after: the message is on disk.
    def _record(self, one: _Admitted) -> None:
        try:
            self._on_journalled(one.submission.frame, one.prepared.entry)
        except Exception as error:
            self._accounting.internal_errors += 1
            source = one.submission.source
            _log.error("alarms or diagnosis of a message from %s failed", source, exc_info=error)

    # The senders repeat what the disk had no room for.
    def _undo_arrivals(self, admitted: Sequence[_Admitted]) -> None:
        arrivals = self._admission.arrivals
        for one in admitted:
            if arrivals is not None and one.prepared.counted is not None:
                arrivals.undo(*one.prepared.counted)

    # New messages, and messages with a known key together with the earlier one: a journal entry, or
    # a message of this group.
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

    def _prepare(self, fresh: Sequence[Submission]) -> list[_Admitted]:
        admitted = []
        prepared: list[Prepared | Exception] = []
        # A change of a sensor applies to the messages after it.
        for kind, part in itertools.groupby(fresh, lambda one: one.kind):
            if kind is EntryKind.SENSOR:
                prepared += [self._change(one) for one in part]
            else:
                prepared += prepare(list(part), self.sensors.table, self._admission)
        for submission, one in zip(fresh, prepared, strict=True):
            if isinstance(one, Prepared):
                admitted.append(_Admitted(submission, one))
                continue
            if not isinstance(one, MultiradarError):
                _log.error("unprocessable message from %s", submission.source, exc_info=one)
            submission.future.set_exception(one)
        return admitted

    def _change(self, submission: Submission) -> Prepared | Exception:
        try:
            sensors, _ = self.sensors.changed(submission.change)
            self._require_usable(sensors.table)
        except MultiradarError as error:
            return error
        self._use(sensors)
        return prepare([submission], sensors.table, self._admission)[0]

    def _use(self, sensors: SensorsInForce) -> None:
        self._on_sensors(sensors.table)
        self._admission.use(sensors.table)
        self.sensors = sensors

    def _answer(
        self,
        admitted: Sequence[_Admitted],
        sequences: Sequence[int],
        again: Sequence[_Again],
    ) -> None:
        accounting = self._accounting
        receipts = []
        for one, sequence in zip(admitted, sequences, strict=True):
            entry = one.prepared.entry
            accounting.read += one.submission.rows
            accounting.accepted += entry.accepted
            accounting.rejected += len(entry.rejects)
            receipts.append(Receipt(entry.accepted, entry.rejects, False, sequence))
            self.head = sequence
        accounting.check()
        for one, receipt in zip(admitted, receipts, strict=True):
            one.submission.future.set_result(receipt)
        known = {
            id(one.submission): (one.prepared.entry, sequence)
            for one, sequence in zip(admitted, sequences, strict=True)
        }
        for submission, earlier in again:
            if isinstance(earlier, StoredEntry):
                self._answer_again(submission, earlier.entry, earlier.sequence)
            elif id(earlier) in known:
                self._answer_again(submission, *known[id(earlier)])
            else:
                # The first message with this key was invalid.
                submission.future.set_exception(earlier.future.exception())

    def _answer_again(self, submission: Submission, entry: Entry, sequence: int) -> None:
        key = submission.idempotency_key
        if key is not None and not same_message(submission, entry):
            given = key.rpartition(SENDER_SEPARATOR)[2]
            submission.future.set_exception(IdempotencyConflictError(given, sequence))
            return
        self._accounting.read += submission.rows
        self._accounting.duplicate += submission.rows
        self._accounting.check()
        submission.future.set_result(Receipt(entry.accepted, entry.rejects, True, sequence))

    def _stop(self, error: Exception, group: Sequence[Submission]) -> None:
        if isinstance(error, MultiradarError):
            failure: MultiradarError = error
        else:
            failure = PipelineError("the journal writer has stopped; see the log")
        log_end(_log, "journal writer failed, ingest stopped", error)
        self.failure = failure
        self._intake.close(failure)
        _fail(group, failure)
        self._on_failure()


def _fail(group: Sequence[Submission], error: MultiradarError) -> None:
    for submission in group:
        if not submission.future.done():
            submission.future.set_exception(error)


def warm_up(admission: Admission) -> None:
    """Compile the kernels that the first message needs."""
    admission.admit(MeasurementBatch.empty())
    TrackHistory(1).read(1, None, 1)
