"""The events of one output of the engine: their order, and their JSON.

Within an output the events are in order of data time: the end of an epoch (biases, terminated
tracks) precedes the first later update, independently of the engine's batches. So the numbers of
the events depend only on the journal.
"""

import json
import math
import threading
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

import numpy as np
import polars as pl
import polars.selectors as cs
from numpy.typing import NDArray

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.stream.events import BIAS, ENDED, SENSOR, STATUS, TRACK, EventTable
from multiradar.runtime.stream.region_marks import RegionMarks, mark_texts
from multiradar.tracking.lifecycle.transitions import NO_TRACK, REASON_NAMES
from multiradar.tracking.outputs import EngineOutput
from multiradar_schemas.sensors.sensor import Sensor

# Classes of events at one time, in their order.
_BIAS, _ENDED, _STATUS, _TRACK, SENSOR_EVENT = range(5)
EVENT_KINDS = 5
#: A change of a sensor: data time, NaN before the first measurement; row of the sensor; entry of
#: the journal; fields that differ, a bit for each of `Sensor`.
CHANGE_DTYPE = np.dtype(
    [
        ("time_s", np.float64), ("sensor", np.int64), ("journal_sequence", np.int64),
        ("fields", np.int64), ("added", np.bool_), ("enabled", np.bool_),
        ("biases_reset", np.bool_),
    ]
)  # fmt: skip
_FIELDS = tuple(Sensor.model_fields)
# For fewer rows, encoding each is faster than encoding a table.
_FEW_ROWS = 4


@dataclass(frozen=True, slots=True)
class StatusMarks:
    """Data times of status events.

    Attributes
    ----------
    time_s : (n,) float64
        Data time.
    updates : (n,) int64
        Number of track updates so far.
    """

    time_s: NDArray[np.float64]
    updates: NDArray[np.int64]


def status_marks(
    reached_s: NDArray[np.float64],
    sequence: NDArray[np.int64],
    last_mark: float,
    period_s: float,
) -> tuple[StatusMarks, float]:
    """Return the status events among updates.

    Parameters
    ----------
    reached_s : (n,) ndarray
        Greatest data time reached with each update, s, ascending.
    sequence : (n,) ndarray
        Numbers of the updates.
    last_mark : float
        Number of the period of the last status event; NaN before the first.
    period_s : float
        Data time between two status events.

    Returns
    -------
    marks : StatusMarks
        One for each update that starts a new period; it precedes that update.
    last_mark : float
        For the next call.
    """
    if not len(reached_s):
        return StatusMarks(np.empty(0), np.empty(0, np.int64)), last_mark
    period = np.floor(reached_s / period_s)
    before = np.r_[last_mark, period[:-1]]
    starts = period > before
    marks = StatusMarks(period[starts] * period_s, sequence[starts] - 1)
    return marks, float(period[-1])


def event_order(
    reached_s: NDArray[np.float64], output: EngineOutput, marks: StatusMarks
) -> tuple[NDArray[np.intp], NDArray[np.int8]]:
    """Return the order of the events, and the class of each in that order.

    Biases, ends, status marks and updates, concatenated. The events of a class keep their order.
    """
    time_s = np.concatenate([output.biases.time_s, output.ended.time_s, marks.time_s, reached_s])
    kind = np.repeat(
        np.array([_BIAS, _ENDED, _STATUS, _TRACK], np.int8),
        [len(output.biases), len(output.ended), len(marks.time_s), len(reached_s)],
    )
    order = np.lexsort((kind, time_s))
    return order, kind[order]


class EventEncoder:
    """Encodes the events of one output, or of a change of a sensor, part by part.

    Parameters
    ----------
    first : int
        Number of the first event.
    output : EngineOutput
        Output of the engine.
    marks : StatusMarks
        The status events.
    order : (n,) ndarray
        Order of the events, from `event_order`: one for each bias record, ended track, status
        mark, update and change.
    table : SensorTable
        The sensors.
    changes : (n,) ndarray
        Changes of sensors, rows of `CHANGE_DTYPE`.
    delay_s : float or None
        Time of the machine less data time at the output, s; each event has it.
    regions : RegionMarks, optional
        What is added to each update, in a service with neighbours.
    """

    def __init__(
        self,
        first: int,
        output: EngineOutput,
        marks: StatusMarks,
        order: NDArray[np.intp],
        table: SensorTable,
        *,
        changes: NDArray[np.void],
        delay_s: float | None,
        regions: RegionMarks | None = None,
    ) -> None:
        delay = "null" if delay_s is None else f"{delay_s:.2f}"
        self._end = f',"data_delay_s":{delay}}}'
        self._first, self._order, self._table = first, order, table
        self._output, self._marks, self._changes = output, marks, changes
        self._regions = regions
        # What all parts share is computed for the first one, by whichever thread that is.
        self._lock = threading.Lock()
        self._shared: _Shared | None = None

    def part(self, begin: int, end: int) -> EventTable:
        """Return the events at places begin…end; each is the same in any part."""
        frame, before, after = self._of_all_parts()
        order = self._order[begin:end]
        # Of the concatenated classes, the updates stand between the others. The events of a class
        # keep their order, so the updates of a part are consecutive.
        first_update = sum(len(keys) for _, keys, _ in before)
        first_after = first_update + len(frame)
        updates = order[(order >= first_update) & (order < first_after)] - first_update
        span = slice(int(updates[0]), int(updates[-1]) + 1) if len(updates) else slice(0, 0)
        shift = np.where(order < first_after, span.start, len(frame) - len(updates))
        places = np.where(order < first_update, order, order - shift).tolist()
        parts = [*before, self._updates(frame, span), *after]
        kinds = [kind for kind, keys, _ in parts for _ in keys]
        every_key = [key for _, keys, _ in parts for key in keys]
        payloads = [row for _, _, rows in parts for row in rows]
        numbers = range(self._first + begin, self._first + end)
        if len(places) > 1:
            chosen = itemgetter(*places)
            kinds, every_key = list(chosen(kinds)), list(chosen(every_key))
            payloads = list(chosen(payloads))
        else:
            kinds, every_key = [kinds[one] for one in places], [every_key[one] for one in places]
            payloads = [payloads[one] for one in places]
        return EventTable(numbers, kinds, every_key, payloads)

    def _of_all_parts(self) -> "_Shared":
        with self._lock:
            if self._shared is None:
                output, table, end = self._output, self._table, self._end
                before = (
                    _bias_events(output, table, end),
                    _ended_events(output, end),
                    _status_events(self._marks, end),
                )
                frame = pl.DataFrame()
                if len(output.updates):
                    frame = _finite(wire.tracks_frame(output.updates, table))
                self._shared = frame, before, (_change_events(self._changes, table, end),)
            return self._shared

    def _updates(self, frame: pl.DataFrame, span: slice) -> "_Part":
        if span.start == span.stop:
            return TRACK, [], []
        ends: str | list[str] = self._end
        if self._regions is not None:
            name, marks = self._regions
            ends = [more + self._end for more in mark_texts(name, marks[span])]
        # As if all were encoded at once.
        few = len(frame) <= _FEW_ROWS
        rows = _finite_rows(frame[span], ends, one_by_one=few)
        return TRACK, [str(one) for one in self._output.updates.track_id[span].tolist()], rows


def change_rows(change: Mapping[str, Any], table: SensorTable) -> NDArray[np.void]:
    """Return a change of a sensor as one row of `CHANGE_DTYPE`.

    Parameters
    ----------
    change : mapping
        As in the status (`sensor_changes`).
    table : SensorTable
        The sensors after it.
    """
    time_s, row = change["data_time_s"], table.ids.index(change["sensor_id"])
    fields = sum(1 << _FIELDS.index(name) for name in change["fields"])
    return np.array(
        [
            (
                math.nan if time_s is None else time_s, row, change["journal_sequence"], fields,
                change["added"], not table.disabled[row], change["biases_reset"],
            )
        ],
        CHANGE_DTYPE,
    )  # fmt: skip


def json_rows(frame: pl.DataFrame, ends: str | Sequence[str]) -> list[bytes]:
    """Return each row of a frame as a JSON object; NaN and infinities become null.

    Parameters
    ----------
    frame : DataFrame
        The rows.
    ends : str or sequence of str
        What replaces the closing brace, of all rows or of each.
    """
    if not len(frame):
        return []
    return _finite_rows(_finite(frame), ends, one_by_one=len(frame) <= _FEW_ROWS)


def _finite(frame: pl.DataFrame) -> pl.DataFrame:
    floats = cs.float()
    return frame.with_columns(pl.when(floats.is_finite()).then(floats).otherwise(None))


def _finite_rows(
    finite: pl.DataFrame, ends: str | Sequence[str], *, one_by_one: bool
) -> list[bytes]:
    if one_by_one:
        each = [ends] * len(finite) if isinstance(ends, str) else ends
        texts = [
            json.dumps(row, separators=(",", ":"), allow_nan=False)
            for row in finite.iter_rows(named=True)
        ]
        return [_ended(text, end) for text, end in zip(texts, each, strict=True)]
    # Not as lines, which would be copied once more.
    rows = pl.struct(pl.all()).struct.json_encode().str.strip_suffix("}")
    whole = rows + (pl.lit(ends) if isinstance(ends, str) else pl.Series(ends))
    return finite.select(whole.cast(pl.Binary)).to_series().to_list()


def _ended(text: str, end: str) -> bytes:
    return f"{text[:-1]}{end}".encode()


# Kind, keys and JSON objects.
_Part = tuple[str, list[str], list[bytes]]
# Rows of the updates, and the events of the classes before and after them.
_Shared = tuple[pl.DataFrame, Sequence[_Part], Sequence[_Part]]


def _bias_events(output: EngineOutput, table: SensorTable, end: str) -> _Part:
    if not len(output.biases):
        return BIAS, [], []
    frame = wire.biases_frame(output.biases, table)
    return BIAS, frame["sensor_id"].to_list(), json_rows(frame, end)


def _ended_events(output: EngineOutput, end: str) -> _Part:
    ended = output.ended
    columns = ended.track_id, ended.time_s, ended.reason, ended.into_track_id
    keys, rows = [], []
    for track, time_s, reason, into in zip(*(column.tolist() for column in columns), strict=True):
        members = {"time_s": time_s, "track_id": track, "reason": REASON_NAMES[reason]}
        if into != NO_TRACK:
            members["into_track_id"] = into
        keys.append(str(track))
        rows.append(_ended(json.dumps(members), end))
    return ENDED, keys, rows


def _status_events(marks: StatusMarks, end: str) -> _Part:
    rows = [
        _ended(json.dumps({"time_s": time_s, "updates": updates}), end)
        for time_s, updates in zip(marks.time_s.tolist(), marks.updates.tolist(), strict=True)
    ]
    return STATUS, [""] * len(rows), rows


def _change_events(changes: NDArray[np.void], table: SensorTable, end: str) -> _Part:
    keys, rows = [], []
    for time_s, row, sequence, fields, added, enabled, biases_reset in changes.tolist():
        change = {
            "time_s": None if math.isnan(time_s) else time_s,
            "sensor_id": table.ids[row],
            "added": added,
            "fields": sorted(name for bit, name in enumerate(_FIELDS) if fields >> bit & 1),
            "enabled": enabled,
            "biases_reset": biases_reset,
            "journal_sequence": sequence,
        }
        keys.append(table.ids[row])
        rows.append(_ended(json.dumps(change), end))
    return SENSOR, keys, rows
