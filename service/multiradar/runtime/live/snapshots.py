"""Snapshots of a running service: when they are taken, written and used.

The engine's thread copies the state between two calls of the engine; another thread encodes and
writes the copy. Rows of histories are not copied: that thread reads those since the last snapshot
where they are. A snapshot that cannot be written or used costs time at the next start, nothing
else: the journal has everything.
"""

import hashlib
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple, Protocol

from numpy.typing import NDArray

from multiradar.clock import Clock
from multiradar.errors import JournalError, SnapshotError, StateError
from multiradar.runtime.live.journal_check import JournalCheck
from multiradar.runtime.live.threads import Thread, Threads
from multiradar.runtime.row_ring import Cut, RowLog, rows_of_cuts
from multiradar.settings.limits import RuntimeLimits
from multiradar.state import CopiedState, copied_state, encoded_state, layout_of, restore_state
from multiradar.storage.journal import Journal, Space
from multiradar.storage.snapshots import (
    KEPT,
    Position,
    RowFile,
    Snapshot,
    SnapshotFolder,
)

_log = logging.getLogger(__name__)

#: Greatest share of the time that taking and writing snapshots may cost.
SHARE_MAX = 0.02
#: Files of one table, after which all its rows are written again as one.
FILES_MAX = 64
#: Limits on which the state of a service depends.
_LIMITS = (
    "events_max", "history_rows_max", "bias_history_rows_max", "transition_rows_max",
    "plot_rows_max", "state_bytes_max", "rejects_kept_max", "status_period_s",
)  # fmt: skip


class Tables(Protocol):
    """Rows that the service retains, and what it makes of them."""

    @property
    def logs(self) -> Mapping[str, RowLog]:
        """The tables of rows, by name."""
        ...

    def refill(self, rows: Mapping[str, NDArray[Any]]) -> None:
        """Use the rows of all tables, which were refilled with them."""
        ...


@dataclass(frozen=True, slots=True)
class SnapshotRules:
    """Where snapshots are, when they are taken, and for which service they are valid.

    Attributes
    ----------
    folder : SnapshotFolder
        Where they are.
    interval_s : float
        Time after which one is taken if there were measurements, s.
    rows : int
        Measurements after which one is taken.
    fingerprint : str
        Fingerprint of the configuration of the service; see `configuration_fingerprint`.
    """

    folder: SnapshotFolder
    interval_s: float
    rows: int
    fingerprint: str


class Taken(NamedTuple):
    """A copy of the state after an entry of the journal, to be written.

    Attributes
    ----------
    sequence : int
        The entry.
    skipped : tuple of int
        Entries up to it that the engine cannot process.
    copies : mapping of str to CopiedState
        States, by name.
    cuts : mapping of str to Cut
        Rows, by name of the table.
    """

    sequence: int
    skipped: tuple[int, ...]
    copies: Mapping[str, CopiedState]
    cuts: Mapping[str, Cut]


class Snapshots:
    """Takes snapshots of a service, and restores the newest intact one.

    Parameters
    ----------
    rules : SnapshotRules
        Where they are, and when they are taken.
    limits : RuntimeLimits
        Limits of the service.
    clock : Clock
        Times them.
    threads : Threads
        Starts the threads that write.
    """

    def __init__(
        self, rules: SnapshotRules, limits: RuntimeLimits, clock: Clock, threads: Threads
    ) -> None:
        self._folder, self._rules = rules.folder, rules
        self._free_bytes_min = limits.disk_free_bytes_min
        self._key = _given_key(rules.fingerprint, limits)
        self._clock, self._threads = clock, threads
        self._thread: Thread | None = None
        self._writing = False
        self._rows = 0
        self._check_beside: JournalCheck | None = None
        self._earliest_s = self._taken_s = clock.monotonic_s()
        # The entry from which the service was started.
        self._restored = Position(0, b"")
        # Files of the last snapshot of this process, or of the one it started from.
        self._files: Mapping[str, Sequence[RowFile]] = {}
        #: Why the last one could not be written, in words; empty if it was.
        self.failure = ""

    def note(self, rows: int) -> bool:
        """Note processed measurements; return whether a snapshot is due."""
        self._rows += rows
        now_s = self._clock.monotonic_s()
        if self._writing or now_s < self._earliest_s:
            return False
        since_s = now_s - self._taken_s
        return self._rows >= self._rules.rows or (since_s >= self._rules.interval_s and self.is_new)

    @property
    def is_new(self) -> bool:
        """Whether there were measurements since the last snapshot that was written."""
        return self._rows > 0 or bool(self.failure)

    def capture(
        self, journal: Journal, sequence: int, skipped: Mapping[int, str],
        holders: Mapping[str, Any], logs: Mapping[str, RowLog],
    ) -> None:  # fmt: skip
        """Take a snapshot, and write it in another thread.

        Parameters
        ----------
        journal : Journal
            The journal.
        sequence : int
            Its last processed entry.
        skipped : mapping of int to str
            Entries that the engine cannot process.
        holders : mapping of str to object
            What has state, by name.
        logs : mapping of str to RowLog
            Tables of rows, by name.
        """
        self.wait()
        begin_s = self._clock.monotonic_s()
        taken = Taken(
            sequence,
            _until(skipped, sequence),
            {name: copied_state(one) for name, one in holders.items()},
            {name: Cut.of(log, self._first(name, log)) for name, log in logs.items()},
        )
        paused_s = self._clock.monotonic_s() - begin_s
        self._rows, self._taken_s, self._writing = 0, begin_s, True

        def write() -> None:
            try:
                octets = self._write(journal, taken)
                self.failure = ""
                cost_s = self._clock.monotonic_s() - begin_s
                _log.info(
                    "snapshot at entry %d: %.1f MB in %.2f s, engine paused for %.0f ms",
                    sequence, octets / 1e6, cost_s, 1e3 * paused_s,
                )  # fmt: skip
            except Exception as error:
                self._folder.tidy()
                is_expected = isinstance(error, SnapshotError | StateError | JournalError)
                level = logging.WARNING if is_expected else logging.ERROR
                _log.log(level, "snapshot at entry %d failed: %s", sequence, error)
                self.failure = (
                    f"the last snapshot, at entry {sequence}, failed; until one is written, the "
                    f"next start replays the journal from an earlier entry on: {error}"
                )
            finally:
                end_s = self._clock.monotonic_s()
                self._earliest_s = end_s + (end_s - begin_s) / SHARE_MAX
                self._writing = False

        self._thread = self._threads.start(write, "snapshot")

    def lead(self) -> None:
        """Write all rows again: another service may have removed the files so far."""
        self._files = {}

    def wait(self) -> None:
        """Wait until the last snapshot is written."""
        thread, self._thread = self._thread, None
        if thread is not None:
            thread.join()

    # The first row of a table that is not yet in a file of the last snapshot.
    def _first(self, name: str, log: RowLog) -> int:
        oldest = max(log.appended - log.capacity, 0)
        files = self._files.get(name, ())
        if not files or len(files) >= FILES_MAX or not oldest <= files[-1].end <= log.appended:
            return oldest
        return files[-1].end

    def _write(self, journal: Journal, taken: Taken) -> int:
        # At once: the next rows overwrite the oldest.
        rows = rows_of_cuts(taken.cuts)
        arrays: list[NDArray[Any]] = []
        states = {name: encoded_state(one, arrays) for name, one in taken.copies.items()}
        new = sum(one.nbytes for one in [*arrays, *rows.values()])
        self._require_space(journal.space(), new)
        tables = {
            name: self._extended(name, taken.cuts[name], rows.pop(name)) for name in taken.cuts
        }
        key = _key(self._key, taken.skipped, {n: c.kind for n, c in taken.copies.items()})
        position = Position(taken.sequence, journal.digest(taken.sequence))
        octets = self._folder.write(Snapshot(position, key, states, tables))
        self._files = tables
        return octets

    def _extended(self, name: str, cut: Cut, rows: NDArray[Any]) -> list[RowFile]:
        oldest = max(cut.end - cut.log.capacity, 0)
        before = [one for one in self._files.get(name, ()) if one.end > oldest]
        if not before or before[-1].end != cut.first:
            before = []
        if len(rows) or not before:
            before.append(self._folder.write_rows(name, cut.first, rows))
        return before

    def _require_space(self, space: Space | None, octets: int) -> None:
        if space is not None and space.free_bytes - octets < self._free_bytes_min:
            raise SnapshotError(
                f"the snapshot needs {octets / 1e6:.0f} MB, but the journal disk has only "
                f"{space.free_bytes / 1e6:.0f} MB left; free some space"
            )

    def restore(
        self, journal: Journal, skipped: Mapping[int, str], holders: Mapping[str, Any],
        tables: Tables, restart: Callable[[], None],
    ) -> int:  # fmt: skip
        """Restore the newest intact snapshot; others are named in the log.

        Parameters
        ----------
        journal : Journal
            The journal.
        skipped : mapping of int to str
            Entries that the engine cannot process.
        holders : mapping of str to object
            What gets the states, without any.
        tables : Tables
            Tables of rows, without any.
        restart : callable
            Discards what was restored by half.

        Returns
        -------
        int
            The last entry that it covers; 0 without one.

        Raises
        ------
        JournalError
            If the journal cannot be read.
        """
        self.wait()
        self._files, self._restored = {}, Position(0, b"")
        for path in self._folder.files():
            try:
                snapshot = self._folder.read(path)
                self._check(snapshot, journal, skipped, holders)
                rows = {
                    name: self._folder.read_rows(files) for name, files in snapshot.tables.items()
                }
            except SnapshotError as error:
                self._reject(path, error)
                continue
            try:
                for name, holder in holders.items():
                    restore_state(holder, snapshot.states[name])
                for name, log in tables.logs.items():
                    log.refill(snapshot.tables[name][0].first, rows[name])
                tables.refill(rows)
            except (KeyError, StateError, TypeError, ValueError) as error:
                self._reject(path, error)
                restart()
                continue
            self._files, self._restored = snapshot.tables, snapshot.position
            break
        return self._restored.sequence

    def verify_before(
        self, journal: Journal, on_damage: Callable[[JournalError], None], *, keep: bool = False
    ) -> None:
        """Verify what the start from a snapshot has not read of the journal, beside the service.

        Damage discards the snapshots, so that no further start is before it is mended. Those of
        another service (`keep`) stay, and those of a shortened journal: a start finds it again.
        """

        def damaged(error: JournalError) -> None:
            try:
                # Without them a shortened journal could not be continued at all.
                if not keep and not journal.removed_until():
                    self._folder.clear()
            except (JournalError, OSError) as further:
                _log.warning("snapshots are kept: %s", further)
            finally:
                on_damage(error)

        if self._restored.sequence:
            given = (self._restored, damaged, self._clock, self._threads)
            self._check_beside = JournalCheck(journal, *given)

    def close(self) -> None:
        """Wait until the last snapshot is written, and end the verification."""
        self.wait()
        if self._check_beside is not None:
            self._check_beside.stop()

    def _reject(self, path: Path, error: Exception) -> None:
        _log.warning("ignoring snapshot %s: %s", path.name, error)
        self._folder.reject(path)

    def _check(
        self, snapshot: Snapshot, journal: Journal, skipped: Mapping[int, str],
        holders: Mapping[str, Any],
    ) -> None:  # fmt: skip
        sequence, digest = snapshot.position
        kinds = {name: type(one) for name, one in holders.items()}
        _check_whole(snapshot, _key(self._key, _until(skipped, sequence), kinds))
        if sequence > journal.counts().entries:
            raise SnapshotError(
                f"the snapshot refers to entry {sequence}, which is not in the journal"
            )
        if journal.digest(sequence) != digest:
            raise SnapshotError(
                f"the snapshot belongs to another journal: entry {sequence} differs"
            )


def open_snapshots(
    rules: SnapshotRules | None, limits: RuntimeLimits, repeating: Sequence[str], clock: Clock,
    threads: Threads,
) -> Snapshots | None:  # fmt: skip
    """Return the snapshots of a service; None if it can have none, which is logged.

    Parameters
    ----------
    rules : SnapshotRules or None
        Where they are, and when they are taken; None for no snapshots.
    limits : RuntimeLimits
        Limits of the service. Its histories must retain what its events are made of.
    repeating : sequence of str
        Parts of the service that need the whole output again at each start.
    clock, threads : Clock, Threads
        Those of the service.
    """
    if rules is None:
        return None
    reasons = why_none(limits, repeating)
    if reasons:
        _log.warning(
            "snapshots are disabled; each start replays the journal: %s", "; ".join(reasons)
        )
        return None
    return Snapshots(rules, limits, clock, threads)


def why_none(limits: RuntimeLimits, repeating: Sequence[str]) -> list[str]:
    """Return why a service can have no snapshots; see `open_snapshots` for the parameters."""
    short = [
        f"{name} is less than events_max"
        for name in ("history_rows_max", "bias_history_rows_max")
        if getattr(limits, name) < limits.events_max
    ]
    return [*short, *(f"{part} requires the complete output" for part in repeating)]


def usable_snapshots(
    rules: SnapshotRules, limits: RuntimeLimits, kinds: Mapping[str, type],
    skipped: Mapping[int, str], digests: Callable[[list[int]], Mapping[int, bytes]],
) -> list[Position]:  # fmt: skip
    """Return the entries of those newest snapshots that a service can start from, newest first.

    Parameters
    ----------
    rules : SnapshotRules
        Where they are, and for which service.
    limits : RuntimeLimits
        Limits of the service.
    kinds : mapping of str to type
        What has state in it, by name.
    skipped : mapping of int to str
        Entries that the engine cannot process.
    digests : callable
        Returns the digests of entries that the journal has.
    """
    given, found = _given_key(rules.fingerprint, limits), []
    for path in rules.folder.files()[:KEPT]:
        try:
            snapshot = rules.folder.read(path)
            sequence, digest = snapshot.position
            _check_whole(snapshot, _key(given, _until(skipped, sequence), kinds))
            for files in snapshot.tables.values():
                rules.folder.read_rows(files)
        except SnapshotError as error:
            _log.warning("snapshot %s cannot be used: %s", path.name, error)
            continue
        if digests([sequence]).get(sequence) == digest:
            found.append(snapshot.position)
    return found


# What holds of a snapshot whatever the journal: it is of this service, and no rows are missing.
def _check_whole(snapshot: Snapshot, expected: Mapping[str, str]) -> None:
    other = [name for name in expected if snapshot.key.get(name) != expected[name]]
    if other:
        raise SnapshotError(f"the snapshot differs from this service in: {', '.join(other)}")
    for name, files in snapshot.tables.items():
        ends = [file.end for file in files]
        if not files or ends[:-1] != [file.first for file in files[1:]]:
            raise SnapshotError(f"rows of {name} are missing")


def _given_key(fingerprint: str, limits: RuntimeLimits) -> dict[str, str]:
    sizes = ", ".join(f"{name} {getattr(limits, name)}" for name in _LIMITS)
    return {"configuration": fingerprint, "limits": sizes}


def _key(
    given: Mapping[str, str], skipped: Sequence[int], kinds: Mapping[str, type]
) -> dict[str, str]:
    layout = "\n".join(f"{name}\n{layout_of(kind)}" for name, kind in sorted(kinds.items()))
    return {
        **given,
        "state format": hashlib.sha256(layout.encode()).hexdigest(),
        "skipped entries": ",".join(map(str, skipped)),
    }


def _until(skipped: Mapping[int, str], sequence: int) -> tuple[int, ...]:
    return tuple(sorted(one for one in skipped if one <= sequence))
