"""Writes the history of a running service, in a thread of its own.

Nothing waits for it: it reads the rings that the service has anyway, and measurements from the
journal. What a ring has overwritten before it was written is counted as lost, with an alarm.
"""

import errno
import logging
import shutil
import threading
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from multiradar.clock import Clock
from multiradar.errors import ConfigurationError, MultiradarError, RemovedEntriesError
from multiradar.runtime.live.publication import Processed
from multiradar.runtime.live.readiness import Disk
from multiradar.runtime.live.threads import Event, Thread, Threads
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.set_backs import TrackStep, joined_steps
from multiradar.runtime.offline.offline_job import HEALTH_FILE
from multiradar.runtime.recorded.history_files import HistoryFolder, HistoryState
from multiradar.runtime.recorded.history_rows import is_due, new_rows, present_positions
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.full_disk import is_full
from multiradar.storage.journal import Journal, Space

_log = logging.getLogger(__name__)

#: Alarms: no rows are written; rows are missing.
HISTORY_STOPPED, HISTORY_INCOMPLETE = "history_stopped", "history_incomplete"
#: Time after which rows are written, however few, s.
PART_S = 600.0
#: Interval at which it looks for rows, and after a failure, s.
_POLL_S, _RETRY_S = 0.25, 30.0
#: The journal comes first: nothing is written with less than so many times its minimum left.
FREE_FACTOR = 4
_MIB = 1024 * 1024


class HistoryRules(NamedTuple):
    """Where the history is, and how much of it is kept; 0: no rule.

    Attributes
    ----------
    folder : Path
        The folder.
    days : float
        Age of the data above which hours are removed, days.
    octets : int
        Size above which the oldest hours are removed.
    limits : RuntimeLimits
        The free space that the journal needs, and the used shares of the disk that raise alarms.
    journal : Path, optional
        The journal, whose disk has its own alarms.
    """

    folder: Path
    days: float = 0.0
    octets: int = 0
    limits: RuntimeLimits = RuntimeLimits()
    journal: Path | None = None


def foreign(sequence: int, last: int) -> tuple[str, str]:
    """Return why a history cannot be continued, and what to do.

    Parameters
    ----------
    sequence : int
        The entry up to which the history was written, which the journal does not have.
    last : int
        The last entry of the journal.
    """
    if sequence > last:
        return (
            f"the history covers entries up to {sequence}, but the journal ends with entry "
            f"{last} (restored from a backup?)",
            "choose a new folder for the history, and keep this folder, which contains the lost "
            "data",
        )
    return (
        f"the history belongs to another journal: entry {sequence} differs",
        "choose another folder for the history",
    )


def before(sequence: int, base: int) -> tuple[str, str]:
    """Return why a history cannot be continued with a shortened journal, and what to do.

    Parameters
    ----------
    sequence : int
        The entry up to which the history was written, which was removed from the journal.
    base : int
        The last entry that was removed.
    """
    return (
        f"the history covers entries up to {sequence}, but the journal now starts with entry "
        f"{base + 1}",
        "choose a new folder for the history, and keep this folder",
    )


class HistoryWriter:
    """Writes a history; any thread reads its counts.

    Parameters
    ----------
    rules : HistoryRules
        Where it is, and what is kept.
    known : Knowledge
        The output of the engine.
    beside : callable
        Returns the further files of a new hour.
    clock : Clock
        For times of writing.
    threads : Threads
        Starts the thread.
    """

    def __init__(
        self, rules: HistoryRules, known: Knowledge, beside: Callable[[], Mapping[str, bytes]],
        clock: Clock, threads: Threads,
    ) -> None:  # fmt: skip
        self._rules, self._known, self._beside = rules, known, beside
        self._clock, self._threads = clock, threads
        self._disk = Disk(self._space, rules.limits, clock, "history")
        self._stopping: Event = threads.event()
        self._thread: Thread | None = None
        self._folder: HistoryFolder | None = None
        self._positions: dict[str, Any] = {}
        self._written_s = -PART_S
        self._lock = threading.Lock()
        self._rows: Counter[str] = Counter()
        self._lost: Counter[str] = Counter()
        #: Why nothing is written, in words; empty if it is.
        self.stopped = ""

    def start(self, journal: Journal, processor: Processed) -> None:
        """Continue the history with what the service processes from now on."""
        self._journal, self._processor = journal, processor
        self._first = present_positions(self._known, journal)
        try:
            self._open()
        except (MultiradarError, OSError) as error:
            # The service is worth more than its history; the thread tries again.
            self._stop_for(error)
        self._written_s = self._clock.monotonic_s()
        self._thread = self._threads.start(self._run, "history")

    def stop(self) -> None:
        """Write what there is, and end; the journal is still open."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        if self._folder is not None:
            self._folder.close()
            self._folder = None

    def document(self) -> dict[str, Any]:
        """Return what was written and lost since the start, for the status."""
        folder = self._folder
        with self._lock:
            return {
                "rows": dict(self._rows), "lost": dict(self._lost), "stopped": self.stopped,
                "octets": 0 if folder is None else folder.octets,
                "oldest_s": self.oldest_s(),
            }  # fmt: skip

    def oldest_s(self) -> float | None:
        """Return the earliest time in the history, s; None without any."""
        return None if self._folder is None else self._folder.oldest_s

    def written_s(self) -> float | None:
        """Return the time up to which the history is written, s; None without any."""
        folder = self._folder
        if folder is None or folder.written_s is None:
            return None
        # Nothing since a step that the files do not know.
        new = set(self.steps()) - set(folder.state.steps)
        return min([folder.written_s, *(time_s for _, time_s in new)])

    def steps(self) -> list[TrackStep]:
        """Return when the data time was set back; see `joined_steps`."""
        folder, known = self._folder, self._known.past.steps
        return known if folder is None else joined_steps(folder.state.steps, known)

    def alarms(self) -> tuple[list[str], list[str]]:
        """Return its alarms, and warnings in words."""
        alarms, warnings = self._disk.alarms()
        with self._lock:
            lost = ", ".join(f"{count:,} of {name}" for name, count in self._lost.items())
        if self.stopped:
            alarms.append(HISTORY_STOPPED)
            warnings.append(f"the history is not being written: {self.stopped}")
        if lost:
            alarms.append(HISTORY_INCOMPLETE)
            warnings.append(
                "rows that arrived faster than they could be written are missing from the history: "
                f"{lost}"
            )
        return alarms, warnings

    # ---------------------------------------------------------------- inside

    # None without a history, or on the disk of the journal.
    def _space(self) -> Space | None:
        folder, journal = self._rules.folder, self._rules.journal
        try:
            device = None if journal is None else journal.parent.stat().st_dev
            if folder.stat().st_dev == device:
                return None
            disk = shutil.disk_usage(folder)
        except OSError:
            return None
        return Space(disk.free, disk.total, 0)

    def _open(self) -> HistoryFolder:
        folder = HistoryFolder(self._rules.folder, self._beside)
        state = folder.state
        try:
            if not state.positions:
                self._positions = dict(self._first)
                self._commit(folder, {}, self._known.past.steps)
            elif 0 < state.sequence < (base := self._journal.removed_until()):
                reason, advice = before(state.sequence, base)
                raise RemovedEntriesError(f"{folder.path}: {reason}; {advice}")
            elif self._digest(state.sequence) != state.digest:
                last = self._journal.counts().entries
                reason, advice = foreign(state.sequence, last)
                raise ConfigurationError(f"{folder.path}: {reason}; {advice}")
            else:
                self._positions = dict(state.positions)
                if not isinstance(self._positions.get(HEALTH_FILE), int):
                    # Of a version that named epochs, which recur after a step back.
                    self._positions[HEALTH_FILE] = self._first[HEALTH_FILE]
        except BaseException:
            folder.close()
            raise
        self._folder = folder
        return folder

    def _run(self) -> None:
        wait_s = _RETRY_S if self.stopped else 0.0
        ends = False
        # Once more at the end, for the last rows.
        while not ends:
            ends = self._stopping.wait(wait_s)
            since_s = self._clock.monotonic_s() - self._written_s
            wait_s = _POLL_S
            if not ends and since_s < PART_S and not self.stopped and not self._is_due():
                continue
            try:
                while self._write():
                    pass
            except Exception as error:
                wait_s = _RETRY_S
                self._stop_for(error)

    def _is_due(self) -> bool:
        return is_due(self._known, self._positions)

    # Returns whether there are more rows already.
    def _write(self) -> bool:
        folder = self._folder or self._open()
        least = FREE_FACTOR * self._rules.limits.disk_free_bytes_min
        if folder.free_octets() < least:
            self._remove(folder)
            # As a write would do that fails halfway.
            raise OSError(errno.ENOSPC, f"less than {least / _MIB:.0f} MiB left", str(folder.path))
        # First: rows from before a step may then be written without it, but not without its rows.
        steps = self.steps()
        found = new_rows(self._known, self._journal, self._processor.processed, self._positions)
        positions = {table: one.position for table, one in found.items()}
        tables = {table: one.rows for table, one in found.items() if len(one.rows)}
        before, self._positions = self._positions, positions
        try:
            if tables or positions != before:
                self._commit(folder, tables, steps)
        except BaseException:
            self._positions = before
            raise
        with self._lock:
            self._rows.update({table: len(one) for table, one in tables.items()})
            self._lost.update({table: one.lost for table, one in found.items() if one.lost})
        if any(one.lost for one in found.values()):
            _log.warning("%s", self.alarms()[1][-1])
        self._written_s = self._clock.monotonic_s()
        if self.stopped:
            _log.info("history writing has resumed")
            self.stopped = ""
        self._remove(folder)
        return any(one.more for one in found.values())

    def _commit(
        self, folder: HistoryFolder, tables: Mapping[str, Any], steps: Sequence[TrackStep]
    ) -> None:
        # The rows are of entries that are on disk, so that the last of them now covers all.
        head = self._journal.counts().entries
        state = HistoryState(0, head, self._digest(head), self._positions, steps)
        folder.write(tables, state)

    def _remove(self, folder: HistoryFolder) -> None:
        rules = self._rules
        removed = folder.remove_oldest(rules.days, rules.octets, self._clock.now_s())
        if removed:
            _log.info("removed from the history: %s", ", ".join(removed))

    # Of an entry; empty if the journal has no such entry.
    def _digest(self, sequence: int) -> str:
        if not sequence:
            return ""
        if sequence > self._journal.counts().entries:
            return "none"
        return self._journal.digest(sequence).hex()

    def _stop_for(self, error: Exception) -> None:
        reason = _reason(error)
        if reason != self.stopped:
            expected = isinstance(error, OSError | MultiradarError) or is_full(error)
            trace = None if expected else error
            _log.warning("the history is not being written: %s", error, exc_info=trace)
        self.stopped = reason


# In words for clients, who must not learn a path of this host.
def _reason(error: Exception) -> str:
    if is_full(error):
        return "the history disk is full; free some space, or lower history.octets"
    if isinstance(error.__cause__, BlockingIOError):
        return "another service is still writing it; this service tries again every 30 s"
    if isinstance(error, RemovedEntriesError):
        return (
            "entries of the journal that follow the history are only in its archive; choose a new "
            "folder"
        )
    if isinstance(error, ConfigurationError):
        return (
            "the history belongs to another journal, or to a later state of this journal, which "
            "was restored from a backup; choose a new folder"
        )
    return "the history folder cannot be written; see the log"
