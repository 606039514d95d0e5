"""Owner of the engine: replays the journal, processes new entries, publishes the output.

An entry on which the engine fails twice is marked in the journal and skipped from then on, so that
one message cannot prevent the service from starting. After a failure the engine is rebuilt and the
journal replayed: the output is the same as before.
"""

import json
import logging
import math
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from typing import Any, ClassVar

from multiradar.clock import Clock
from multiradar.errors import MultiradarError, PipelineError
from multiradar.estimation.measurement.sensor_changes import SensorChange
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.admission.origins import Origins
from multiradar.runtime.admission.sensors_in_force import CHANGES_MAX, SensorsInForce
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.tracking_engine import TrackingEngine
from multiradar.runtime.live.backlog import (
    Backlog,
    EntryFutures,
    Journalled,
    grouped,
    releasing_clock_s,
)
from multiradar.runtime.live.preparation import journalled, pieces
from multiradar.runtime.live.publication import Publication
from multiradar.runtime.live.snapshots import Snapshots
from multiradar.runtime.live.threads import log_end
from multiradar.state import Fields
from multiradar.storage.entries import EntryKind
from multiradar.storage.journal import Journal
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import NO_OUTPUT, EngineOutput, TrackStates

_log = logging.getLogger(__name__)

#: Maximum entries skipped in one recovery; with more the engine stops.
POISON_ENTRIES_MAX = 10
#: Entries of another service that are processed at once.
FOLLOWED_MAX = 256
# Skipped entries listed in the status.
_SKIPPED_SHOWN_MAX = 100
# The status waits so long for a call of the engine, s.
_FIGURES_WAIT_S = 0.2
#: Figures without an engine.
NO_FIGURES: dict[str, Any] = {
    "processed_sequence": 0, "sensor_changes": [], "engine": {}, "unobservable_biases": [],
    "output_sha256": None, "skipped_entries": 0, "skipped": [],
}  # fmt: skip


class _EngineFailureError(Exception):
    # The engine raised an error with these entries.
    def __init__(self, entries: Sequence[Journalled], cause: Exception) -> None:
        self.entries, self.cause = entries, cause
        super().__init__(str(cause))


class Processor:
    """Owns the engine; `run` is the body of one thread.

    Parameters
    ----------
    journal : Journal
        Replayed at the start.
    backlog : Backlog
        New entries.
    open_engine : callable
        Builds an engine without state.
    sensors : SensorsInForce
        The sensors before the first entry of the journal.
    publication : Publication
        Receives the output.
    rows_max : int
        Measurements in one call of the engine.
    clock : Clock
        For the time since it last moved.
    on_failure : callable
        Called when the engine has stopped for good.
    snapshots : Snapshots, optional
        Snapshots of the state; without them each start replays the whole journal.
    following : bool
        Whether another service writes journal and snapshots, until `lead`.
    """

    processed: int
    STATE: ClassVar[Fields] = {
        "_digest": OutputDigest,
        "_origins": Origins,
        "_updates": int,
        "_data_time_s": float | None,
        "_changed_sensors": list[str],
        "_changes": deque[str],
    }

    def __init__(
        self,
        *,
        journal: Journal,
        backlog: Backlog,
        open_engine: Callable[[], TrackingEngine],
        sensors: SensorsInForce,
        publication: Publication,
        rows_max: int,
        clock: Clock,
        on_failure: Callable[[], None],
        snapshots: Snapshots | None = None,
        following: bool = False,
    ) -> None:
        self._snapshots = snapshots
        #: Whether another service writes journal and snapshots.
        self.following = following
        self._clock = clock
        self._on_failure = on_failure
        self._journal = journal
        self._backlog = backlog
        self._open_engine = open_engine
        self._first_sensors = sensors
        self._publication = publication
        self._rows_max = rows_max
        self._lock = threading.Lock()
        self._futures = EntryFutures()
        self._states: TrackStates | None = None
        self._data_time_s: float | None = None
        self._figures: dict[str, Any] = NO_FIGURES
        # Whether the state is that after an entry: one that failed was processed in part.
        self._is_whole = True
        self._reset()
        #: Skipped entries, with the reason of each.
        self.skipped: dict[int, str] = {}
        #: Time of reception of the oldest entry being processed, UTC, s; None if there is none.
        self.oldest_s: float | None = None
        #: When a call of the engine last ended or began, s; None while it has nothing to do.
        self.moved_s: float | None = None
        #: Why the engine has stopped, or None.
        self.failure: MultiradarError | None = None

    def figures(self) -> dict[str, Any]:
        """Return what the engine counts, for the status.

        During a long call of the engine they are those of the last request.

        Returns
        -------
        dict
            `processed_sequence`: entry that all of them include; `sensor_changes`: the last ones;
            `engine`: measurements by outcome; `unobservable_biases`: what is not observable so far,
            in words (`what`, `prior_ratio`, `reason`); `output_sha256`: hash of all output so far;
            `skipped_entries`, `skipped`: number of skipped entries, and the first ones.
        """
        if self._lock.acquire(timeout=_FIGURES_WAIT_S):
            try:
                self._figures = self._read_figures()
            finally:
                self._lock.release()
        return self._figures

    def _read_figures(self) -> dict[str, Any]:
        return {  # of the same moment: the digest is never that of an earlier entry
            "processed_sequence": self.processed,
            "sensor_changes": [json.loads(one) for one in self._changes],
            "engine": dict(sorted(self._engine.counts.items())),
            "unobservable_biases": [
                {"what": one.name, "prior_ratio": round(one.prior_ratio, 4), "reason": one.reason}
                for one in self._engine.unobservable_biases()
            ],
            "output_sha256": self._digest.hexdigest(),
            "skipped_entries": len(self.skipped),
            "skipped": sorted(self.skipped)[:_SKIPPED_SHOWN_MAX],
        }

    def states(self) -> tuple[TrackStates, SystemPlane]:
        """Return the live tracks and their plane; waits for a running call of the engine.

        The tracks are read from the engine once after each change and cached.
        """
        with self._lock:
            if self._states is None:
                self._states = self._engine.tracks()
            return self._states, self._engine.plane

    def replay(self) -> None:
        """Replay the journal, from a snapshot on if there is one.

        Raises
        ------
        JournalError
            If its verification fails.
        PipelineError
            If the engine fails on too many entries.
        """
        self._rebuild(None, one_by_one=False)
        self.moved_s = None
        if self.following:
            self._publication.followed(is_first=True)
        if self._snapshots is not None:
            self._snapshots.verify_before(self._journal, self.fail, keep=self.following)

    def follow(self, until: int) -> None:
        """Process entries that another service has written, up to one, `FOLLOWED_MAX` at most."""
        self._follow(min(until, self.processed + FOLLOWED_MAX))
        self._publication.followed()

    def lead(self) -> None:
        """Process what is left of the journal, which this service writes from now on."""
        if not self.following:
            return
        self.following = False
        if self._snapshots is not None:
            self._snapshots.lead()
        if self._journal.skipped().keys() != self.skipped.keys():
            _log.warning("the previous run skipped different entries; replaying the journal")
            self._rebuild(None, one_by_one=False)
        self._follow(self._journal.counts().entries)

    def run(self) -> None:
        """Process entries until the backlog is closed and drained."""
        while group := self._backlog.pop(self._rows_max):
            self.oldest_s = group[0].received_s
            try:
                self._process_or_rebuild(group)
            except Exception as error:
                self.fail(error)
                return
            self.oldest_s = self.moved_s = None
            # Memory of a large message is released before waiting for the next one.
            del group

    def settled(self, sequence: int) -> Future[int]:
        """Return a future of the last update, resolved when an entry has been processed.

        It fails when processing has stopped before the entry.
        """
        future = self._futures.add(sequence)
        self._settle()
        return future

    def finish(self) -> None:
        """Take a last snapshot, and read the journal no more."""
        if (snapshots := self._snapshots) is not None:
            is_sound = self.failure is None and self._is_whole
            if is_sound and snapshots.is_new and not self.following:
                self._capture(snapshots)
            snapshots.close()

    def close(self) -> None:
        """Close the engine; unresolved futures fail."""
        with self._lock:
            self._engine.close()
        self._futures.fail(self.failure or PipelineError("the service has stopped"))

    def fail(self, error: Exception) -> None:
        """Stop for good, with an error."""
        unknown = PipelineError("the engine has stopped; see the log")
        self.failure = error if isinstance(error, MultiradarError) else unknown
        log_end(_log, "engine stopped", error)
        self._backlog.abandon()
        self._futures.fail(self.failure)
        self._on_failure()

    # ---------------------------------------------------------------- inside

    def _follow(self, until: int) -> None:
        try:
            for group in self._stored(until, self._rows_max):
                self._publication.hear(group)
                self._process(group)
        except _EngineFailureError as failure:
            _log.warning("engine failed, replaying the journal", exc_info=failure.cause)
            self._rebuild(until, one_by_one=True)
        # The last entries may be among the skipped ones.
        self.processed = max(self.processed, until)
        self.moved_s = None

    def _reset(self) -> None:
        self._engine, self._is_used = self._open_engine(), False
        self._digest = OutputDigest()
        self._origins = Origins()
        self._states = self._data_time_s = None
        self._updates = 0
        #: The sensors after the last entry that was processed, and their descriptions if changed.
        self.sensors = self._first_sensors
        self._changed_sensors: list[str] = []
        self._changes: deque[str] = deque(maxlen=CHANGES_MAX)
        #: Last entry that was processed.
        self.processed = 0

    def _process_or_rebuild(self, group: Sequence[Journalled]) -> None:
        try:
            self._process(group)
        except _EngineFailureError as failure:
            _log.warning("engine failed, replaying the journal", exc_info=failure.cause)
            self._rebuild(group[-1].sequence, one_by_one=True)
            self._publication.lead()
        self._settle()

    def _rebuild(self, until: int | None, *, one_by_one: bool) -> None:
        self._is_whole, rows_max = False, 1 if one_by_one else self._rows_max
        # Another service may write meanwhile: what comes later is followed.
        until = until or self._journal.counts().entries
        for _ in range(POISON_ENTRIES_MAX + 2):
            self.skipped = self._journal.skipped()
            self._start_over()
            self._restore()
            try:
                for group in self._stored(until, rows_max):
                    self._process(group)
            except _EngineFailureError as failure:
                if isinstance(failure.cause, MemoryError):
                    raise PipelineError("the engine is out of memory") from failure.cause
                if failure.entries[0].kind is EntryKind.SENSOR:
                    # Without it later entries would have another meaning.
                    raise PipelineError(
                        f"the sensor change in journal entry {failure.entries[0].sequence} "
                        f"cannot be processed: {failure.cause}"
                    ) from failure.cause
                if rows_max == 1:
                    # The second failure that involves this entry.
                    sequence = failure.entries[0].sequence
                    _log.error("skipping unprocessable entry %d", sequence, exc_info=failure.cause)
                    self._journal.skip(sequence, repr(failure.cause))
                rows_max = 1
            else:
                # A snapshot may be of a later entry of another service.
                self.processed, self._is_whole = max(self.processed, until), True
                return
        raise PipelineError(
            f"the engine failed on more than {POISON_ENTRIES_MAX} journal entries; see the log"
        )

    # The journal in groups for the engine, without skipped entries.
    def _stored(self, until: int, rows_max: int) -> Iterator[list[Journalled]]:
        stored = self._journal.read(self.processed)
        for piece in pieces(stored, until, self.skipped, rows_max):
            waiting = deque(journalled(piece, self.sensors.table))
            while waiting:
                # One by one: those without measurements, too.
                yield grouped(waiting, rows_max) if rows_max > 1 else [waiting.popleft()]

    def _process(self, group: Sequence[Journalled]) -> None:
        self.moved_s, self._is_whole = self._clock.monotonic_s(), False
        set_back = self._is_set_back(group)
        output = self._called(group, lambda: self._push(group))
        change = self._changes[-1] if group[0].kind is EntryKind.SENSOR else None
        if change is not None:
            self._publication.use(self.sensors.table)
        self._publication.publish(output, self._data_time_s, group[0].kind is EntryKind.FLUSH)
        if change is not None:
            self._publication.publish_change(json.loads(change))
        if set_back:
            self._publication.set_back()
        self._quarantine(group, output)
        # The updates do not wait for the end of an epoch, which takes as long as 10 000 of them.
        if (completed := self._called(group, self._engine.complete)) is not NO_OUTPUT:
            self._publication.publish(completed, self._data_time_s)
        # The output is visible to readers only from now on.
        self.processed, self._is_whole = group[-1].sequence, True
        snapshots, rows = self._snapshots, sum(len(entry.batch) for entry in group)
        if snapshots is not None and snapshots.note(rows) and not self.following:
            self._capture(snapshots)

    def _called(
        self, group: Sequence[Journalled], call: Callable[[], EngineOutput]
    ) -> EngineOutput:
        with self._lock:
            try:
                output = call()
            except Exception as error:
                raise _EngineFailureError(group, error) from error
            self._digest.add(output)
            self._states = None
            if len(output.updates):
                self._updates = int(output.updates.sequence[-1])
        return output

    def _capture(self, snapshots: Snapshots) -> None:
        with self._lock:
            snapshots.capture(
                self._journal, self.processed, self.skipped, self._holders, self._publication.logs
            )

    # Continue from a snapshot, if there is one.
    def _restore(self) -> None:
        if self._snapshots is not None:
            self._is_used = True
            self.processed = self._snapshots.restore(
                self._journal, self.skipped, self._holders, self._publication, self._start_over
            )
        if not self.processed:
            self._journal.verify_pages()  # beside the service only what a snapshot covers

    def _start_over(self) -> None:
        if self._is_used:
            with self._lock:
                self._engine.close()
                self._reset()
        self._publication.restart(self.sensors.table)

    def restored(self) -> None:
        """Use the sensors of the snapshot, before the parts that depend on them are restored."""
        if not self._changed_sensors:
            return
        first = self.sensors
        self.sensors = first.with_texts(self._changed_sensors)
        change = SensorChange.between(first.table, self.sensors.table)
        self._engine.change_sensors(self.sensors.table, change)
        self._publication.use(self.sensors.table)

    @property
    def _holders(self) -> dict[str, Any]:
        # The processor first: it has the sensors.
        own = {"processor": self, "engine": self._engine, "publication": self._publication}
        return own | self._publication.parts

    def _push(self, group: Sequence[Journalled]) -> EngineOutput:
        self._is_used = True
        if self._is_set_back(group):
            self._data_time_s = group[0].clock_s
            return self._engine.restart()
        clock_s = group[-1].clock_s
        if math.isfinite(clock_s):
            self._data_time_s = clock_s
        if group[0].kind is EntryKind.FLUSH:
            return self._engine.flush()
        if group[0].kind is EntryKind.SENSOR:
            return self._change_sensors(group[0])
        if group[0].kind is EntryKind.HANDOVER:
            return self._publication.hand_over(group[0].change)
        for entry in group:
            self._origins.add(entry.sequence, len(entry.batch))
        batch = MeasurementBatch.concatenate([entry.batch for entry in group])
        return self._engine.push(batch, releasing_clock_s(group))

    def _change_sensors(self, entry: Journalled) -> EngineOutput:
        before = self.sensors
        sensors, what = before.changed(entry.change)
        output = self._engine.change_sensors(sensors.table, what)
        self.sensors, self._changed_sensors = sensors, sensors.texts()
        record = before.record(sensors, what, entry.change) | {
            "journal_sequence": entry.sequence, "source": entry.source,
            "data_time_s": self._data_time_s,
        }  # fmt: skip
        self._changes.append(json.dumps(record))
        return output

    # Whether an operator has set the data clock to an earlier time.
    def _is_set_back(self, group: Sequence[Journalled]) -> bool:
        known_s = -math.inf if self._data_time_s is None else self._data_time_s
        return group[0].kind is EntryKind.CLOCK and group[0].clock_s < known_s

    # Record the rejected rows of these entries, and the duplicates found by the engine.
    def _quarantine(self, group: Sequence[Journalled], output: EngineOutput) -> None:
        board = self._publication.rejects
        for entry in group:
            board.record(entry.sequence, entry.source, entry.rejects)
        if len(output.duplicates):
            board.record_duplicates(
                output.duplicates, self._origins.find(output.duplicates.arrival.tolist())
            )
        self._origins.discard(self._engine.waiting_from)

    def _settle(self) -> None:
        self._futures.settle(self.processed, self._updates)
