"""Counts of rejected rows and the last ones by code; read by any thread.

It is filled in the order of the journal, so its content is the same after a restart.
"""

import json
import threading
from collections import Counter, deque
from collections.abc import Sequence
from typing import ClassVar, NamedTuple

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.state import Fields
from multiradar.storage.entries import Quarantined, RejectedRow
from multiradar.tracking.input.duplicates import Duplicates
from multiradar_schemas.reject import RejectCode

#: Sources counted separately; further ones are counted together.
SOURCES_MAX = 64
OTHER_SOURCES = "other"
# Source of what the tracker rejects.
_TRACKER = "tracker"


class Packed(NamedTuple):
    """Rejected rows of a message and a code, in one piece.

    As objects they would keep the memory of the message in which they were made: they are spread
    over it, and it is returned only where nothing is in use.

    Attributes
    ----------
    number : int
        Number of the first row within its code, from 1.
    sequence : int
        Journal entry.
    source : str
        Input it was received from.
    rows : bytes
        Index, reason and content of each row, as JSON.
    """

    number: int
    sequence: int
    source: str
    rows: bytes

    def unpacked(self, code: str) -> list[Quarantined]:
        """Return the rows, of a code."""
        return [
            Quarantined(number, self.sequence, self.source, RejectedRow(index, code, reason, raw))
            for number, (index, reason, raw) in enumerate(json.loads(self.rows), self.number)
        ]


class RejectBoard:
    """Counts rejected rows by code and retains the last of each code.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    kept_max : int
        Retained rows of each code.
    """

    STATE: ClassVar[Fields] = {
        "_counts": Counter[str],
        "_sources": dict[str, Counter[str]],
        "_twice": Counter[int],
        "_last": dict[str, deque[Packed]],
    }

    def __init__(self, sensors: SensorTable, kept_max: int) -> None:
        #: The sensors.
        self.sensors = sensors
        self._kept_max = kept_max
        self._counts: Counter[str] = Counter()
        self._sources: dict[str, Counter[str]] = {}
        self._twice: Counter[int] = Counter()
        self._last: dict[str, deque[Packed]] = {}
        self._lock = threading.Lock()

    @property
    def counts(self) -> dict[str, int]:
        """Number of rejected rows by code, in the order of the codes."""
        with self._lock:
            return dict(sorted(self._counts.items()))

    @property
    def counts_by_source(self) -> dict[str, dict[str, int]]:
        """Number of rejected rows by source and code; the tracker found the duplicates."""
        with self._lock:
            return {source: dict(sorted(codes.items())) for source, codes in self._sources.items()}

    @property
    def duplicates_by_sensor(self) -> dict[str, int]:
        """Number of duplicate measurements by sensor, where there are any."""
        with self._lock:
            return {self.sensors.ids[sensor]: n for sensor, n in sorted(self._twice.items())}

    def last(self, code: str) -> list[Quarantined]:
        """Return the last rows of a code, oldest first; they are numbered within their code."""
        with self._lock:
            pieces = list(self._last.get(code, ()))
        return [row for piece in pieces for row in piece.unpacked(code)][-self._kept_max :]

    def record(self, sequence: int, source: str, rows: Sequence[RejectedRow]) -> None:
        """Record the rejected rows of a message."""
        by_code: dict[str, list[RejectedRow]] = {}
        for row in rows:
            by_code.setdefault(row.code, []).append(row)
        with self._lock:
            for code, those in by_code.items():
                self._keep(sequence, source, code, those)
                self._count(source or _TRACKER, code, len(those))

    def record_duplicates(self, found: Duplicates, entries: Sequence[tuple[int, int]]) -> None:
        """Record measurements accepted first and then found to be duplicates.

        Parameters
        ----------
        found : Duplicates
            The measurements.
        entries : sequence of (int, int)
            Journal entry of each, and its index among the measurements of that entry.
        """
        code = str(RejectCode.DUPLICATE)
        # Only the last are retained: no others are converted to text.
        skipped = max(len(found) - self._kept_max, 0)
        reasons = found.reasons()[skipped:]
        raw = wire.measurement_rows(found.batch.select(slice(skipped, None)), self.sensors)
        with self._lock:
            self._counts[code] += skipped
            self._count(_TRACKER, code, len(found))
            self._twice.update(found.batch.sensor.tolist())
            for (sequence, index), reason, row in zip(entries[skipped:], reasons, raw, strict=True):
                self._keep(sequence, "", code, [RejectedRow(index, code, reason, json.dumps(row))])

    def clear(self) -> None:
        """Discard everything: the journal is replayed."""
        with self._lock:
            self._counts.clear()
            self._sources.clear()
            self._twice.clear()
            self._last.clear()

    def _count(self, source: str, code: str, rows: int) -> None:
        if source not in self._sources and len(self._sources) >= SOURCES_MAX:
            source = OTHER_SOURCES
        self._sources.setdefault(source, Counter())[code] += rows

    def _keep(self, sequence: int, source: str, code: str, rows: Sequence[RejectedRow]) -> None:
        # Of a message of 100 000 only the last are retained.
        last = rows[-self._kept_max :]
        self._counts[code] += len(rows)
        number = self._counts[code] - len(last) + 1
        text = json.dumps([(row.index, row.reason, row.raw) for row in last])
        kept = self._last.setdefault(code, deque())
        kept.append(Packed(number, sequence, source, text.encode()))
        while len(kept) > 1 and self._counts[code] - kept[1].number + 1 >= self._kept_max:
            kept.popleft()
