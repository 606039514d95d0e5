"""The output of the engine as numbered events, with periodic status events."""

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import StateError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.row_ring import RowLog, RowRing
from multiradar.runtime.stream.event_encoding import (
    CHANGE_DTYPE,
    EVENT_KINDS,
    SENSOR_EVENT,
    EventEncoder,
    StatusMarks,
    change_rows,
    event_order,
    status_marks,
)
from multiradar.runtime.stream.events import EventRing
from multiradar.runtime.stream.region_marks import MARK_DTYPE, RegionMarks
from multiradar.settings.limits import RuntimeLimits
from multiradar.state import Fields
from multiradar.tracking.columns import row_type, rows_of, table_of
from multiradar.tracking.outputs import (
    NO_OUTPUT,
    BiasRecords,
    EndedTracks,
    EngineOutput,
    TrackUpdates,
)

#: A status event: data time, and number of track updates so far.
STATUS_DTYPE = np.dtype([("time_s", np.float64), ("updates", np.int64)])
_NO_MARKS = StatusMarks(np.empty(0), np.empty(0, np.int64))
_NO_CHANGES = np.empty(0, CHANGE_DTYPE)
# Events that are restored together.
_RESTORED_EVENTS = 8192


class OutputEvents:
    """Converts output to events in the ring; written by the engine's thread.

    The events themselves are not in a snapshot: it has the kind of each, and where they come from
    has the rest. Tracks and biases are in the histories of the service.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    limits : RuntimeLimits
        The size of the ring, and the data time between two status events.
    """

    STATE: ClassVar[Fields] = {"_reached_s": float, "_last_mark": float}

    _reached_s: float
    _last_mark: float
    _kinds: RowRing
    _ends: RowRing
    _marks: RowRing
    _changes: RowRing
    _region_marks: RowRing

    def __init__(self, sensors: SensorTable, limits: RuntimeLimits) -> None:
        #: The sensors.
        self.sensors = sensors
        self._limits = limits
        self._period_s = limits.status_period_s
        self.ring = EventRing(limits.events_max)
        #: Returns the time of the machine less data time, s; None without data in real time.
        self.delay_s: Callable[[], float | None] = lambda: None
        # Name of the region; None for a service without neighbours.
        self._region: str | None = None
        self._start()

    @property
    def logs(self) -> dict[str, RowLog]:
        """What the events are made of again.

        Kinds, ended tracks, times of status events, changes of sensors; marks of regions.
        """
        marks = {} if self._region is None else {"event_regions": self._region_marks}
        return {
            "event_kinds": self._kinds,
            "event_ends": self._ends,
            "event_marks": self._marks,
            "event_changes": self._changes,
            **marks,
        }

    def add_marks(self, region: str) -> None:
        """Add to each track update what it is in a region. To be called before the start."""
        self._region = region
        self._start()

    def publish(self, output: EngineOutput, of_regions: NDArray[np.void] | None = None) -> None:
        """Append the events of one output, and to its updates what `region_marks` has of them."""
        reached_s = np.maximum.accumulate(np.r_[self._reached_s, output.updates.time_s])
        self._reached_s, reached_s = float(reached_s[-1]), reached_s[1:]
        marks, self._last_mark = status_marks(
            reached_s, output.updates.sequence, self._last_mark, self._period_s
        )
        order, kinds = event_order(reached_s, output, marks)
        if len(order):
            self._kinds.append(kinds)
            if len(output.ended):
                self._ends.append(rows_of(output.ended))
            if len(marks.time_s):
                self._marks.append(_mark_rows(marks))
            if of_regions is not None:
                self._region_marks.append(of_regions)
            # The ring must not keep the rest: states and plots of a call are ten times as large.
            kept = EngineOutput(output.updates, output.biases, output.ended)
            self._append(kept, marks, order, self.delay_s(), of_regions=of_regions)

    def publish_change(self, change: Mapping[str, Any]) -> None:
        """Append the event of a change of a sensor, after the output that it caused.

        Parameters
        ----------
        change : mapping
            As in the status (`sensor_changes`); the sensors are already those after it.
        """
        rows = change_rows(change, self.sensors)
        self._kinds.append(np.array([SENSOR_EVENT], np.int8))
        self._changes.append(rows)
        self._append(NO_OUTPUT, _NO_MARKS, np.zeros(1, np.intp), self.delay_s(), changes=rows)

    def set_back(self) -> None:
        """Expect earlier times."""
        self._reached_s, self._last_mark = -np.inf, np.nan

    def restart(self) -> None:
        """Discard all events: the journal is replayed from the start."""
        self._start()
        self.ring.clear()

    def refill(self, updates: NDArray[np.void], biases: NDArray[np.void]) -> None:
        """Make the events again, after the logs were refilled.

        Parameters
        ----------
        updates, biases : structured arrays
            The last track updates and biases of the service, rows of their tables: as many as
            there are events of each kind, or more.
        """
        kinds = self._kinds.last(self._kinds.capacity)
        counts = np.bincount(kinds, minlength=EVENT_KINDS).tolist()
        tables = [
            biases, self._ends.last(counts[1]), self._marks.last(counts[2]), updates,
            self._changes.last(counts[4]),
        ]  # fmt: skip
        of_regions = None if self._region is None else self._region_marks.last(counts[3])
        if of_regions is not None and len(of_regions) < counts[3]:
            raise StateError(f"expected {counts[3]} region marks, found fewer")
        first_update = len(tables[3]) - counts[3]
        if any(len(table) < count for table, count in zip(tables, counts, strict=True)):
            raise StateError(f"expected {counts} event rows, by kind, found fewer")
        self.ring.clear(self._kinds.appended - len(kinds))
        begin = np.array([len(table) for table in tables]) - counts
        for first in range(0, len(kinds), _RESTORED_EVENTS):
            chunk = kinds[first : first + _RESTORED_EVENTS]
            end = begin + np.bincount(chunk, minlength=EVENT_KINDS)
            span = slice(*(int(one) - first_update for one in (begin[3], end[3])))
            self._refill(
                chunk,
                [table[slice(*cut)] for table, *cut in zip(tables, begin, end, strict=True)],
                None if of_regions is None else of_regions[span],
            )
            begin = end

    def _refill(
        self, kinds: NDArray[np.int8], rows: list[NDArray[np.void]],
        of_regions: NDArray[np.void] | None,
    ) -> None:  # fmt: skip
        biases, ends, marks, updates, changes = rows
        output = EngineOutput(
            updates=table_of(TrackUpdates, updates),
            biases=table_of(BiasRecords, biases),
            ended=table_of(EndedTracks, ends),
        )
        # Position of each event among all rows, kind by kind.
        order = np.empty(len(kinds), np.intp)
        order[np.argsort(kinds, kind="stable")] = np.arange(len(kinds))
        marked = StatusMarks(marks["time_s"].copy(), marks["updates"].copy())
        self._append(output, marked, order, None, changes=changes, of_regions=of_regions)

    def _start(self) -> None:
        events_max = self._limits.events_max
        self._reached_s, self._last_mark = -np.inf, np.nan
        self._kinds = RowRing(events_max, np.dtype(np.int8))
        self._ends = RowRing(events_max, row_type(EndedTracks))
        self._marks = RowRing(events_max, STATUS_DTYPE)
        self._changes = RowRing(events_max, CHANGE_DTYPE)
        if self._region is not None:
            self._region_marks = RowRing(events_max, MARK_DTYPE)

    def _append(
        self, output: EngineOutput, marks: StatusMarks, order: NDArray[np.intp],
        delay_s: float | None, *, changes: NDArray[np.void] = _NO_CHANGES,
        of_regions: NDArray[np.void] | None = None,
    ) -> None:  # fmt: skip
        first, table = self.ring.head + 1, self.sensors
        regions = None
        if self._region is not None and of_regions is not None:
            regions = RegionMarks(self._region, of_regions)
        encoder = EventEncoder(
            first, output, marks, order, table, changes=changes, delay_s=delay_s, regions=regions
        )
        self.ring.append(len(order), encoder.part)


def _mark_rows(marks: StatusMarks) -> NDArray[np.void]:
    rows = np.empty(len(marks.time_s), STATUS_DTYPE)
    rows["time_s"], rows["updates"] = marks.time_s, marks.updates
    return rows
