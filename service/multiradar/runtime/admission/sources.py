"""What each source sends, and the quarantine of sources that send mostly rejected rows.

A source in quarantine may send a few rows a second; the rest it has to keep, and is asked to send
later. So nothing is lost, its return is noticed, and it costs the others little.
"""

import threading
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field

from multiradar.clock import Clock
from multiradar.errors import QuarantineError
from multiradar.settings.limits import RuntimeLimits
from multiradar.storage.entries import Entry
from multiradar_schemas.reject import RejectCode

#: Fractions of rejected rows from which a quarantine begins, and below which it ends.
BEGIN_SHARE, END_SHARE = 0.9, 0.5
#: Share of the rejected rows of a quarantine from which the queued rows of a source count too.
EXPECTED_FROM = 0.2
#: A rejected row takes as long as so many accepted ones, since its content is kept as text.
REJECTED_COST = 16
#: Rows of a source after which its share of rejected rows is that of the last message.
_KNOWN_ROWS = 1000
#: Rows count for the quarantine half after so long, s.
HALF_LIFE_S = 60.0
#: Longest time after which a source is asked to try again, s.
RETRY_MAX_S = 60.0
#: Octets of a message that cannot be read which count as one rejected row.
UNREADABLE_ROW_OCTETS = 1024
#: Sources with counts of their own; further ones are counted together.
SOURCES_MAX = 1000
OTHERS = "others"

# Rejected by the time of their arrival or by an operator's choice, which says nothing about what a
# source sends: one that catches up after a failure is not hostile, nor is the feed of a sensor that
# was disabled, and storms are bounded by sensor.
_CIRCUMSTANCES = frozenset(
    {
        RejectCode.TIME_LATE,
        RejectCode.TIME_FUTURE,
        RejectCode.RATE_EXCEEDED,
        RejectCode.DUPLICATE,
        RejectCode.SENSOR_DISABLED,
    }
)


@dataclass(slots=True)
class _Source:
    counts: Counter[str] = field(default_factory=Counter)
    # Rows of the last minutes that were accepted or rejected because of their content, and when
    # they were last reduced.
    recent: float = 0.0
    recent_rejected: float = 0.0
    reduced_s: float = 0.0
    quarantined: bool = False
    # Share of rejected rows, for whatever reason, of the last messages.
    share: float = 0.0
    # In quarantine: when the next message may come.
    next_s: float = 0.0


class Sources:
    """Counts by source, and the quarantine; for any thread.

    Parameters
    ----------
    limits : RuntimeLimits
        When a quarantine begins, and what a source may then send.
    clock : Clock
        Monotonic time.
    """

    def __init__(self, limits: RuntimeLimits, clock: Clock) -> None:
        self._limits = limits
        self._clock = clock
        self._known: dict[str, _Source] = {}
        self._lock = threading.Lock()

    def require(self, name: str, rows: int, queued_rows: int = 0) -> None:
        """Admit a message of a source, by its number of rows; 0 before they are read.

        Its queued rows are expected to be like those before: a quarantine that came only when they
        are processed would come too late for the other sources.

        Raises
        ------
        QuarantineError
            If the source is in quarantine and has sent what it may.
        """
        now_s = self._clock.monotonic_s()
        with self._lock:
            source = self._of(name)
            self._reduce(source, now_s)
            self._expect(source, queued_rows)
            if not source.quarantined:
                return
            if now_s < source.next_s:
                source.counts.update(deferred_messages=1, deferred_rows=rows)
                raise QuarantineError(name, min(source.next_s - now_s, RETRY_MAX_S))
            source.next_s = now_s + rows / self._limits.quarantine_rows_per_s

    def cost_rows(self, name: str, rows: int) -> float:
        """Return how many accepted rows are expected to take as long as some rows of a source."""
        with self._lock:
            source = self._known.get(name)
            return rows if source is None else rows * (1.0 + (REJECTED_COST - 1) * source.share)

    def defer(self, name: str, rows: int) -> None:
        """Count a message that the source has to send again, because its queue is full."""
        with self._lock:
            self._of(name).counts.update(deferred_messages=1, deferred_rows=rows)

    def note(self, entry: Entry) -> None:
        """Count the rows of an entry of the journal."""
        rejected = sum(row.code not in _CIRCUMSTANCES for row in entry.rejects)
        with self._lock:
            source = self._of(entry.source)
            source.counts.update(accepted=entry.accepted, rejected=len(entry.rejects))
            if rows := entry.accepted + len(entry.rejects):
                weight = min(rows / _KNOWN_ROWS, 1.0)
                source.share += weight * (len(entry.rejects) / rows - source.share)
            self._add(source, entry.accepted + rejected, rejected)

    def note_unreadable(self, name: str, octets: int) -> None:
        """Count a message of which no row could be read, for the quarantine."""
        rows = octets / UNREADABLE_ROW_OCTETS
        with self._lock:
            source = self._of(name)
            self._add(source, rows, rows)
            if source.quarantined:
                begin_s = max(source.next_s, self._clock.monotonic_s())
                source.next_s = begin_s + rows / self._limits.quarantine_rows_per_s

    def document(self) -> dict[str, dict[str, int | bool]]:
        """Return, by source, rows by result, what was deferred, and whether it is in quarantine."""
        with self._lock:
            now_s = self._clock.monotonic_s()
            for source in self._known.values():
                self._reduce(source, now_s)
            names = ("accepted", "rejected", "deferred_messages", "deferred_rows")
            return {
                name: {
                    **{one: source.counts[one] for one in names},
                    "quarantined": source.quarantined,
                }
                for name, source in self._known.items()
            }

    def warnings(self) -> Iterable[str]:
        """Return a sentence for each source in quarantine."""
        for name, counts in self.document().items():
            if counts["quarantined"]:
                yield (
                    f"{name}: in quarantine, because most of its rows are rejected (see "
                    "/v1/rejects) or its messages cannot be read; limited to "
                    f"{self._limits.quarantine_rows_per_s} rows per second until it sends valid "
                    "rows: check the sender"
                )

    # ---------------------------------------------------------------- inside

    def _of(self, name: str) -> _Source:
        if name not in self._known and len(self._known) >= SOURCES_MAX:
            name = OTHERS
        return self._known.setdefault(name, _Source(reduced_s=self._clock.monotonic_s()))

    def _add(self, source: _Source, rows: float, rejected: float) -> None:
        self._reduce(source, self._clock.monotonic_s())
        source.recent += rows
        source.recent_rejected += rejected
        self._decide(source)

    def _reduce(self, source: _Source, now_s: float) -> None:
        factor = 0.5 ** ((now_s - source.reduced_s) / HALF_LIFE_S)
        source.recent *= factor
        source.recent_rejected *= factor
        source.reduced_s = now_s
        self._decide(source)

    def _expect(self, source: _Source, queued_rows: int) -> None:
        least, rejected = self._limits.quarantine_rejects_min, source.recent_rejected
        if rejected >= max(EXPECTED_FROM * least, BEGIN_SHARE * source.recent, 1.0):
            expected = rejected + queued_rows * rejected / source.recent
            source.quarantined = source.quarantined or expected >= least

    def _decide(self, source: _Source) -> None:
        least = self._limits.quarantine_rejects_min
        if source.quarantined:
            source.quarantined = source.recent_rejected >= END_SHARE * max(
                source.recent, 0.2 * least
            )
        else:
            source.quarantined = source.recent_rejected >= max(least, BEGIN_SHARE * source.recent)
