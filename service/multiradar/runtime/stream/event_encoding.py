"""The events of one output of the engine: their order, and their JSON.

Within an output the events are in order of data time: the end of an epoch (biases, terminated
tracks) precedes the first later update, independently of the engine's batches. So the numbers of
the events depend only on the journal.
"""

import json
import math
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


def encode_events(
    first: int,
    output: EngineOutput,
    marks: StatusMarks,
    order: NDArray[np.intp],
    table: SensorTable,
    *,
    changes: NDArray[np.void],
    delay_s: float | None,
    regions: RegionMarks | None = None,
) -> EventTable:
    """Return the events of one output, or of a change of a sensor.

    Parameters
    ----------
    first : int
        Number of the first event.
    output : EngineOutput
        Output of the engine.
    marks : StatusMarks
        The status events.
    order : (n,) ndarray
        Order of the events, from `event_order`.
    table : SensorTable
        The sensors.
    changes : (n,) ndarray
        Changes of sensors, rows of `CHANGE_DTYPE`.
    delay_s : float or None
        Time of the machine less data time at the output, s; each event has it.
    regions : RegionMarks, optional
        What is added to each update, in a service with neighbours.

    Returns
    -------
    EventTable
        One for each bias record, ended track, status mark, update and change.
    """
    delay = "null" if delay_s is None else f"{delay_s:.2f}"
    end = f',"data_delay_s":{delay}}}'
    parts = (
        _bias_events(output, table, end),
        _ended_events(output, end),
        _status_events(marks, end),
        _track_events(output, table, regions, end),
        _change_events(changes, table, end),
    )
    kinds = [kind for kind, keys, _ in parts for _ in keys]
    every_key = [key for _, keys, _ in parts for key in keys]
    payloads = [row for _, _, rows in parts for row in rows]
    numbers = range(first, first + len(order))
    if len(order) > 1:
        chosen = itemgetter(*order.tolist())
        kinds, every_key = list(chosen(kinds)), list(chosen(every_key))
        payloads = list(chosen(payloads))
    return EventTable(numbers, kinds, every_key, payloads)


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
    floats = cs.float()
    finite = frame.with_columns(pl.when(floats.is_finite()).then(floats).otherwise(None))
    if len(finite) <= _FEW_ROWS:
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


def _track_events(
    output: EngineOutput, table: SensorTable, regions: RegionMarks | None, end: str
) -> _Part:
    if not len(output.updates):
        return TRACK, [], []
    ends = end if regions is None else [more + end for more in mark_texts(*regions)]
    rows = json_rows(wire.tracks_frame(output.updates, table), ends)
    return TRACK, [str(track) for track in output.updates.track_id.tolist()], rows


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
