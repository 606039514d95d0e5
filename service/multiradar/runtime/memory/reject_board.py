"""Counts of rejected rows and the last ones by code; read by any thread.

It is filled in the order of the journal, so its content is the same after a restart.
"""

import json
import threading
from collections import Counter, deque
from collections.abc import Sequence
from typing import ClassVar

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
        "_last": dict[str, deque[Quarantined]],
    }

    def __init__(self, sensors: SensorTable, kept_max: int) -> None:
        #: The sensors.
        self.sensors = sensors
        self._kept_max = kept_max
        self._counts: Counter[str] = Counter()
        self._sources: dict[str, Counter[str]] = {}
        self._twice: Counter[int] = Counter()
        self._last: dict[str, deque[Quarantined]] = {}
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
            return list(self._last.get(code, ()))

    def record(self, sequence: int, source: str, rows: Sequence[RejectedRow]) -> None:
        """Record the rejected rows of a message."""
        by_code = Counter(row.code for row in rows)
        # Of a message of 100 000 only the last are retained.
        left = dict(by_code)
        with self._lock:
            for row in rows:
                left[row.code] -= 1
                if left[row.code] < self._kept_max:
                    number = self._counts[row.code] + by_code[row.code] - left[row.code]
                    self._keep(Quarantined(number, sequence, source, row))
            for code, count in by_code.items():
                self._counts[code] += count
                self._count(source or _TRACKER, code, count)

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
            self._count(_TRACKER, code, skipped)
            self._twice.update(found.batch.sensor.tolist())
            for (sequence, index), reason, row in zip(entries[skipped:], reasons, raw, strict=True):
                self._counts[code] += 1
                self._count(_TRACKER, code, 1)
                rejected = RejectedRow(index, code, reason, json.dumps(row))
                self._keep(Quarantined(self._counts[code], sequence, "", rejected))

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

    def _keep(self, rejected: Quarantined) -> None:
        kept = self._last.setdefault(rejected.row.code, deque(maxlen=self._kept_max))
        kept.append(rejected)
