"""The live pipeline: submit measurements, read tracks.

::

    submit ─ intake ─ writer: admit, journal, answer ─ backlog ─ engine ─ publication
            bounded          on disk before the answer bounded            rings, bounded
"""

import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from dataclasses import asdict
from importlib.metadata import version
from typing import Any

import polars as pl

from multiradar.clock import Clock, SystemClock
from multiradar.errors import LiveStreamError, MultiradarError, PipelineError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission.admission_by_time import FORWARD_JUMP_MAX_S, Admission
from multiradar.runtime.admission.sensors_in_force import SensorPlan, SensorsInForce
from multiradar.runtime.engine.prerequisites import plan_usable, usability
from multiradar.runtime.engine.tracking_engine import TrackingEngine
from multiradar.runtime.live.accounting import Accounting
from multiradar.runtime.live.alarms.supervision import Supervision
from multiradar.runtime.live.backlog import Backlog
from multiradar.runtime.live.intake import Intake, Submission
from multiradar.runtime.live.processor import NO_FIGURES, Processor
from multiradar.runtime.live.publication import Publication
from multiradar.runtime.live.readiness import (
    PRIMARY,
    Check,
    Disk,
    Reason,
    ServiceState,
    lags_s,
    not_running,
    require_running,
    stall,
    state_reason,
)
from multiradar.runtime.live.receipt import Executed, Receipt, RejectedRow, once_processed
from multiradar.runtime.live.snapshots import SnapshotRules, open_snapshots
from multiradar.runtime.live.threads import SystemThreads, Thread, Threads
from multiradar.runtime.live.writer import Writer, warm_up
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.entries import Entry, EntryKind, Quarantined
from multiradar.storage.journal import Journal, Space
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.sensors.sensor import SensorsFile

__all__ = ["Receipt", "RejectedRow", "Service", "ServiceState"]

_VERSION = version("multiradar")
# Before the start, and when it has ended, a failure is an exception.
_UNABLE = (ServiceState.STOPPED, ServiceState.RECOVERING)


class Service:
    """The live pipeline; every method may be called from any thread.

    Parameters
    ----------
    open_journal : callable
        Opens the journal; called by `start`.
    open_engine : callable
        Builds an engine without state; called by `start`, and again after its failure.
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker.
    limits : RuntimeLimits
        Bounds of queues and rings.
    forward_jump_max_s : float
        Measurements farther ahead of the data time are rejected.
    clock : Clock, optional
        Clock to detect measurements from the future; the system clock by default.
    threads : Threads, optional
        Starts threads; those of the system by default.
    on_failure : callable, optional
        Called, from a thread of the service, when it has failed for good: to accept measurements
        again, the process must end and start again.
    snapshots : SnapshotRules, optional
        Where snapshots are, and when they are taken; without, each start replays the journal.
    described : SensorsFile, optional
        The sensors as described, so that they can change; without, they cannot.

    Attributes
    ----------
    publication : Publication
        Distributes the output of the engine.
    view : LiveView
        The read side.
    sensor_listeners : list of callable
        Called with the sensors at the start, and before they change; interfaces add theirs.
    unready_checks : list of callable
        What `unready` asks; interfaces add theirs before the start.
    role : callable
        Returns `role`, `lag_entries` and `lag_s` for the status; a standby sets its own.
    """

    def __init__(
        self,
        *,
        open_journal: Callable[[], Journal],
        open_engine: Callable[[], TrackingEngine],
        sensors: SensorTable,
        tracking: TrackingSettings,
        limits: RuntimeLimits | None = None,
        forward_jump_max_s: float = FORWARD_JUMP_MAX_S,
        clock: Clock | None = None,
        threads: Threads | None = None,
        on_failure: Callable[[], None] = lambda: None,
        snapshots: SnapshotRules | None = None,
        described: SensorsFile | None = None,
    ) -> None:
        self._on_failure, self._snapshot_rules = on_failure, snapshots
        self._clock = clock or SystemClock()
        self._threads = threads or SystemThreads()
        self._open_journal, self._open_engine = open_journal, open_engine
        self._sensors = SensorsInForce.of(sensors, described)
        self._limits = limits or RuntimeLimits()
        self._usable, self._horizon_s = usability(sensors, tracking), tracking.reorder_horizon_s
        self._forward_jump_max_s = forward_jump_max_s
        self._accounting = Accounting()
        self._intake = Intake(self._limits, threads, self._clock)
        self._backlog = Backlog(self._limits.backlog_rows_max, threads)
        self._state = ServiceState.STOPPED
        self.start_step = ""  # for `/readyz`; empty once the service runs
        self._changing = threading.Lock()
        self._journal: Journal | None = None
        self._was_started, self._followed = False, 0  # last entry of another service
        self.role: Callable[[], dict[str, Any]] = lambda: PRIMARY
        self._writer: Writer | None = None
        self._processor: Processor | None = None
        self._running: list[Thread] = []
        self.publication = Publication(sensors, tracking, self._limits, self._clock, threads)
        self.publication.follow()  # readers come before the journal is open, with its numbers
        self.view = self.publication.view
        self._watch = Supervision(
            sensors, tracking.reorder_horizon_s, self._clock,
            disk=Disk(self._space, self._limits, self._clock),
            sources=self._intake.sources, saturated=self.view.saturated,
        )  # fmt: skip
        self.reception = self._watch.host_clock  # dates what is received
        self.sensor_listeners: list[Callable[[SensorTable], None]] = [self._watch.use]
        self.view.clock_leads = self._watch.sensors.clock_leads
        self.view.storms = self._watch.sensors.storms
        self.publication.watch_silence(self._watch.silence)
        self.unready_checks: list[Check] = [
            self._state_reason,
            *self._watch.checks(self._lags_s, self._limits.lag_max_s),
        ]

    @property
    def state(self) -> ServiceState:
        """State of the service."""
        if self._state not in _UNABLE and self.failure is not None:
            return ServiceState.FAILED
        return self._state

    @property
    def failure(self) -> MultiradarError | None:
        """Why no more measurements are accepted, or None."""
        # The engine first: the writer stops when the engine has.
        failures = [part.failure for part in (self._processor, self._writer) if part is not None]
        return next((failure for failure in failures if failure is not None), None)

    def unready(self) -> tuple[Reason, ...]:
        """Return why the service does not do what it is for, the most severe reason first."""
        return tuple(filter(None, (check() for check in self.unready_checks)))

    @property
    def stalled(self) -> str:
        """Why only a restart can help, in words; empty if the engine moves, or has no work."""
        moved_s = None if self._processor is None else self._processor.moved_s
        return stall(self.failure, moved_s, self._clock.monotonic_s(), self._limits.stall_max_s)

    def open(self) -> Journal:
        """Open the journal, ahead of `start`, and return it.

        Raises
        ------
        JournalError, ConfigurationError
            It cannot be opened, or was written with other sensors or settings.
        """
        with self._changing:
            self._journal = self._journal or self._open_journal()
            return self._journal

    def start(self, *, following: bool = False) -> None:
        """Open the journal, replay it, then accept measurements.

        Parameters
        ----------
        following : bool
            Whether another service writes the journal: they are accepted from `lead` on.

        Raises
        ------
        JournalError, ConfigurationError
            See `open`; or the verification fails.
        PipelineError
            If the service was started before, or the engine fails on the journal.
        """
        with self._changing:
            if self._was_started:
                raise PipelineError("the service has already been started; create a new one")
            self._was_started = True
            self._state = ServiceState.RECOVERING
            self.start_step = "replaying the journal"
            try:
                self._replay(following)
                if not following:
                    self._accept()
            except BaseException:
                self._state = ServiceState.STOPPED
                self._let_go()
                raise
            finally:
                self.start_step = ""
            self._state = ServiceState.STANDBY if following else ServiceState.RUNNING

    def follow(self, until: int) -> int:
        """Process entries of another service, up to one; return the last; raises as `start`."""
        with self._changing:
            processor, journal = self._processor, self._journal
            if processor is None or journal is None or self._state is not ServiceState.STANDBY:
                raise PipelineError(f"the service is not a standby: {self._state}")
            self._followed = max(until, self._followed)
            if until > processor.processed:
                # First: what is processed has been counted.
                self._accounting.resume(journal.counts())
                processor.follow(until)
            return processor.processed

    def lead(self) -> None:
        """Accept measurements: no other service writes the journal; raises as `start`."""
        with self._changing:
            self._accept()
            self._state = ServiceState.RUNNING

    def fail(self, error: Exception) -> None:
        """Stop for good: the journal can no longer be followed."""
        if self._processor is not None:
            self._processor.fail(error)

    def drain(self) -> None:
        """Stop accepting, process what is queued, close the journal; reads go on."""
        with self._changing:
            if self._state is ServiceState.RUNNING:
                self._state = ServiceState.DRAINING
            self._intake.close()
            if self._running:
                writer, processor = self._running
                writer.join()
                self._backlog.close()
                processor.join()
                self._running = []
            self.publication.stop()
            self._let_go()
            self.publication.end()

    def stop(self) -> None:
        """Drain, then close the engine; may be called twice."""
        self.drain()
        with self._changing:
            if self._processor is not None:
                self._processor.close()
            self._state = ServiceState.STOPPED

    def require_source(self, source: str) -> None:
        """Reject a source in quarantine; see `OperatedSink.require_source`."""
        self._intake.sources.require(source, 0)

    def note_unreadable(self, source: str, octets: int) -> None:
        """Count an unreadable message; see `OperatedSink.note_unreadable`."""
        self._intake.sources.note_unreadable(source, octets)

    def submit(
        self,
        frame: pl.DataFrame,
        *,
        source: str,
        idempotency_key: str | None = None,
        rejected: Sequence[RejectedRow] = (),
    ) -> Future[Receipt]:
        """Submit measurements; see `MeasurementSink.submit`."""
        submission = Submission(
            EntryKind.BATCH, frame, source, idempotency_key, tuple(rejected),
            latest_s=self.reception.now_s() + self._limits.clock_ahead_max_s,
            received_s=self.reception.received_s,
        )  # fmt: skip
        return self._put(submission)

    def flush(
        self, *, source: str, idempotency_key: str | None = None, force: bool = False
    ) -> Future[Receipt]:
        """Submit the end of a stream: the reorder buffer is emptied; see `OperatedSink.flush`."""
        require_running(self._state, self.failure, self.start_step)
        known = idempotency_key is not None and self.has_message(idempotency_key)
        if not (force or known) and (live := self.reception.live()):
            raise LiveStreamError(live)
        return self._put_mark(EntryKind.FLUSH, source, idempotency_key)

    def set_clock(
        self, time_s: float, *, source: str, idempotency_key: str | None = None
    ) -> Future[Receipt]:
        """Set the data clock, as an operator says; see `OperatedSink.set_clock`."""
        agreed = self.reception.agreeing(time_s)
        return self._put_mark(EntryKind.CLOCK, source, idempotency_key, agreed, clock_s=time_s)

    def plan_sensor(
        self, sensor_id: str, values: Mapping[str, Any], *, reset_biases: bool = False
    ) -> SensorPlan:
        """Return what a change of a sensor would do; see `OperatedSink.plan_sensor`."""
        if self._writer is None:
            raise not_running(self._state, self.start_step)
        present = self._writer.sensors
        return plan_usable(present, self._usable, sensor_id, values, reset=reset_biases)

    def change_sensor(
        self, change: bytes, *, source: str, idempotency_key: str | None = None
    ) -> Future[Receipt]:
        """Change a sensor; see `OperatedSink.change_sensor`."""
        return self._put_mark(EntryKind.SENSOR, source, idempotency_key, change=change)

    def hand_over(self, message: bytes, *, source: str) -> Future[Receipt]:
        """Submit the message of a neighbouring region; see `HandoverSink.hand_over`."""
        received_s = self.reception.received_s
        return self._put(Submission.mark(EntryKind.HANDOVER, source, received_s, change=message))

    def has_message(self, idempotency_key: str) -> bool:
        """Return whether a message is in the journal; see `OperatedSink.has_message`."""
        require_running(self._state, self.failure, self.start_step)
        return self._journal is not None and self._journal.find(idempotency_key) is not None

    def describe_sensor(self, sensor_id: str) -> dict[str, Any] | None:
        """Return the description of a sensor; see `OperatedSink.describe_sensor`."""
        present = self._sensors if self._writer is None else self._writer.sensors
        return present.description(sensor_id)

    def settled(self) -> Future[int]:
        """Return a future that resolves when all journal entries so far are processed.

        Returns
        -------
        Future of int
            Number of the last track update then. Fails when the service or the engine stops before.
        """
        if self._processor is None or self._writer is None:
            raise not_running(self._state, self.start_step)
        return self._processor.settled(self._writer.head)

    def quarantined(self, after: int, limit: int, code: str | None = None) -> list[Quarantined]:
        """Return rejected rows after a number of the quarantine, at most `limit`.

        Fewer mean that there are no more for now. With a code, the retained rows of that code with
        their own numbers; duplicates of accepted measurements are among them.
        """
        if self._journal is None:
            raise not_running(self._state, self.start_step)
        if code is None:
            return self._journal.quarantined(after, limit)
        return [row for row in self.publication.rejects.last(code) if row.number > after][:limit]

    # ---------------------------------------------------------------- inside

    def _put_mark(
        self, kind: EntryKind, source: str, key: str | None, then: Executed | None = None,
        **given: Any,
    ) -> Future[Receipt]:  # fmt: skip
        written = self._put(Submission.mark(kind, source, self.reception.received_s, key, **given))
        assert self._processor is not None, "a running service has a processor"
        return once_processed(written, self._processor.settled, then)

    def _put(self, submission: Submission) -> Future[Receipt]:
        require_running(self._state, self.failure, self.start_step)
        self._intake.put(submission)
        return submission.future

    def _replay(self, following: bool) -> None:
        self._journal = self._journal or self._open_journal()
        self._followed = self._accounting.resume(self._journal.counts()).entries
        self._watch.snapshots = open_snapshots(
            self._snapshot_rules, self._limits, self.publication.repeating, self._clock,
            self._threads,
        )  # fmt: skip
        self._processor = Processor(
            journal=self._journal, backlog=self._backlog, open_engine=self._open_engine,
            sensors=self._sensors, publication=self.publication,
            rows_max=self._limits.push_rows_max, clock=self._clock, on_failure=self._on_failure,
            snapshots=self._watch.snapshots, following=following,
        )  # fmt: skip
        self.publication.attach(self._processor.states, self._counters)
        self._processor.replay()

    def _accept(self) -> None:
        assert self._processor is not None, "the journal has been replayed"
        assert self._journal is not None, "the journal is open"
        self._processor.lead()
        self.publication.lead()
        counts = self._accounting.resume(self._journal.counts())
        present = self._processor.sensors
        admission = Admission.for_sensors(
            present.table, self._horizon_s, self._forward_jump_max_s, state=counts.admission
        )
        self._use(present.table)
        self._watch.attach(admission)
        warm_up(admission)
        self._writer = Writer(
            intake=self._intake, journal=self._journal, backlog=self._backlog, sensors=present,
            on_sensors=self._use, admission=admission, accounting=self._accounting,
            batches_max=self._limits.commit_batches_max, require_usable=self._usable,
            on_journalled=self._note_journalled, on_full=self._watch.disk.note_full,
            on_failure=self._on_failure,
        )  # fmt: skip
        self.publication.start(self._journal, self._processor, self._backlog)
        self._writer.head = counts.entries
        self._running = [
            self._threads.start(self._writer.run, "journal-writer"),
            self._threads.start(self._processor.run, "engine"),
        ]

    def _use(self, sensors: SensorTable) -> None:
        for listener in self.sensor_listeners:
            listener(sensors)

    def _note_journalled(self, frame: pl.DataFrame, entry: Entry) -> None:
        self._watch.note(entry)
        self.publication.diagnosis.record(frame, entry.rejects)

    def _state_reason(self) -> Reason | None:
        return state_reason(self.failure, self._state, self.start_step)

    def _space(self) -> Space | None:
        return None if self._journal is None else self._journal.space()

    def _lags_s(self) -> dict[str, float]:
        engine = (self._backlog, self._processor)
        stages = {"intake": (self._intake,), "journal": (self._writer,), "processor": engine}
        return lags_s(self.reception.received_s, stages)

    def _let_go(self) -> None:
        if self._processor is not None:
            self._processor.finish()
        if self._journal is not None:
            self._journal.close()

    def _counters(self) -> dict[str, Any]:
        writer, processor = self._writer, self._processor
        failure, space = self.failure, self._space()
        return {
            "state": str(self.state),
            "failure": None if failure is None else failure.for_clients,
            "version": _VERSION,
            **asdict(self._accounting),
            **self.role(),
            "journal_sequence": self._followed if writer is None else writer.head,
            **self._intake.document(),
            "backlog_rows": self._backlog.rows,
            "reorder_horizon_s": self._horizon_s,
            "lags_s": {name: round(lag_s, 2) for name, lag_s in self._lags_s().items()},
            "journal_disk": None if space is None else space._asdict(),
            "unready": [one._asdict() for one in self.unready()],
            **self._watch.document(),
            **(NO_FIGURES if processor is None else processor.figures()),
        }
