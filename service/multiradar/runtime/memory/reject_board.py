"""What was refused, by reason: how often, and the last of each; for any thread to read.

It is filled in the order of the journal, so a restart shows the same again.
"""

import json
import threading
from collections import Counter, deque
from collections.abc import Sequence

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.storage.entries import Quarantined, RejectedRow
from multiradar.tracking.input.duplicates import Duplicates
from multiradar_schemas.measurements.reject import RejectCode


class RejectBoard:
    """Counts refusals by code and keeps the last of each code.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    kept_max : int
        Refusals that are kept of each code.
    """

    def __init__(self, sensors: SensorTable, kept_max: int) -> None:
        self._sensors = sensors
        self._kept_max = kept_max
        self._counts: Counter[str] = Counter()
        self._twice: Counter[int] = Counter()
        self._last: dict[str, deque[Quarantined]] = {}
        self._lock = threading.Lock()

    @property
    def counts(self) -> dict[str, int]:
        """How many were refused, by code, in the order of the codes."""
        with self._lock:
            return dict(sorted(self._counts.items()))

    @property
    def duplicates_by_sensor(self) -> dict[str, int]:
        """How many measurements of each sensor were there twice, of sensors that have some."""
        with self._lock:
            return {self._sensors.ids[sensor]: n for sensor, n in sorted(self._twice.items())}

    def last(self, code: str) -> list[Quarantined]:
        """Return the last refusals of a code, oldest first; they are numbered within their code."""
        with self._lock:
            return list(self._last.get(code, ()))

    def refuse(self, sequence: int, source: str, rows: Sequence[RejectedRow]) -> None:
        """Take rows that were refused when their message came."""
        with self._lock:
            for row in rows:
                self._add(sequence, source, row)

    def drop(self, found: Duplicates, entries: Sequence[tuple[int, int]]) -> None:
        """Take measurements that were accepted and then found to be there twice.

        Parameters
        ----------
        found : Duplicates
            The measurements.
        entries : sequence of (int, int)
            Entry of the journal of each, and its place among the measurements of that entry.
        """
        code = str(RejectCode.DUPLICATE)
        # Only the last can be read: of a flood of duplicates nothing else is made into text.
        silent = max(len(found) - self._kept_max, 0)
        reasons = found.reasons()[silent:]
        raw = wire.measurement_rows(found.batch.select(slice(silent, None)), self._sensors)
        with self._lock:
            self._counts[code] += silent
            self._twice.update(found.batch.sensor.tolist())
            for (sequence, place), reason, said in zip(entries[silent:], reasons, raw, strict=True):
                self._add(sequence, "", RejectedRow(place, code, reason, json.dumps(said)))

    def clear(self) -> None:
        """Forget everything: the journal is about to be played again."""
        with self._lock:
            self._counts.clear()
            self._twice.clear()
            self._last.clear()

    def _add(self, sequence: int, source: str, row: RejectedRow) -> None:
        self._counts[row.code] += 1
        kept = self._last.setdefault(row.code, deque(maxlen=self._kept_max))
        kept.append(Quarantined(self._counts[row.code], sequence, source, row))
