"""Verification of the part of the journal that a start from a snapshot did not read.

It runs beside the service, which processes measurements meanwhile, and takes a small share of the
time. Damage stops the service, as it prevents a start that reads the whole journal.
"""

import logging
from collections.abc import Callable

from multiradar.clock import Clock
from multiradar.errors import JournalError, RemovedEntriesError
from multiradar.runtime.live.threads import Thread, Threads
from multiradar.storage.journal import Journal
from multiradar.storage.snapshots import Position

_log = logging.getLogger(__name__)

#: Share of the time of one processor.
SHARE = 0.1
#: Entries between two pauses: as many as the journal reads at once.
_PIECE_ENTRIES = 256


class JournalCheck:
    """Verifies a journal from its start to an entry, in a thread of its own.

    Parameters
    ----------
    journal : Journal
        The journal; it verifies what it reads.
    until : Position
        The last entry to verify, and the digest that it must have.
    on_damage : callable
        Called with the error, in the thread of the check.
    clock : Clock
        Times the pauses.
    threads : Threads
        Starts the thread.
    """

    def __init__(
        self, journal: Journal, until: Position, on_damage: Callable[[JournalError], None],
        clock: Clock, threads: Threads,
    ) -> None:  # fmt: skip
        self._journal, self._until, self._on_damage = journal, until, on_damage
        self._clock = clock
        self._stopping = threads.event()
        self._thread: Thread = threads.start(self._run, "journal-check")

    def stop(self) -> None:
        """Stop, whether or not all is verified."""
        self._stopping.set()
        self._journal.stop_verifying()
        self._thread.join()

    def _run(self) -> None:
        try:
            self._journal.verify_pages()
            if self._verify():
                _log.info("journal verified up to entry %d", self._until.sequence)
        except JournalError as error:
            # The journal may have been closed meanwhile.
            if not self._stopping.wait(0.0):
                self._on_damage(error)

    def _verify(self) -> bool:
        while True:
            first = self._journal.removed_until()
            # Removed entries are in an archive, which was verified.
            if first >= self._until.sequence:
                return True
            try:
                return self._verify_from(first)
            except RemovedEntriesError:
                # Overtaken by the removal of entries.
                _log.info("entries were removed from the journal during verification")

    def _verify_from(self, first: int) -> bool:
        begin_s = self._clock.monotonic_s()
        digest = b""
        for stored in self._journal.read(first):
            if stored.sequence == self._until.sequence:
                digest = stored.digest
                break
            if stored.sequence % _PIECE_ENTRIES == 0:
                busy_s = self._clock.monotonic_s() - begin_s
                if self._stopping.wait(busy_s * (1.0 / SHARE - 1.0)):
                    return False
                begin_s = self._clock.monotonic_s()
        if digest != self._until.digest:
            sequence = self._until.sequence
            raise JournalError(f"entry {sequence} of the journal does not match the snapshot")
        return True
