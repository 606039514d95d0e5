"""What the service has in memory and in its journal, as rows of its history.

Rows of the rings are numbered, and the same rows have the same numbers after a restart, because the
output is a function of the journal. So the history continues behind its last row, whatever snapshot
the service began from.
"""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar import wire
from multiradar.errors import RemovedEntriesError, StateError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.live.payload import decode_rows
from multiradar.runtime.memory.bias_board import bias_rows_frame
from multiradar.runtime.memory.history import update_rows_frame
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.offline.offline_job import (
    BIASES_FILE,
    HEALTH_FILE,
    TRACKS_FILE,
    TRANSITIONS_FILE,
)
from multiradar.storage.entries import EntryKind
from multiradar.storage.journal import Journal
from multiradar.storage.recording import MEASUREMENTS_FILE
from multiradar.tracking.columns import table_of
from multiradar.tracking.lifecycle.transitions import TrackTransitions
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA, complete

#: Rows of a table in one write.
PART_ROWS = 131_072
#: Rows that are translated at once, so that other threads run between.
_CHUNK_ROWS = 8192
#: A write is due when a ring has this fraction of its capacity that is not yet written.
_RING_SHARE = 4

Frame = Callable[[NDArray[np.void], SensorTable], pl.DataFrame]


class NewRows(NamedTuple):
    """New rows of a table.

    Attributes
    ----------
    rows : DataFrame
        The rows.
    position : object
        Where to continue, for JSON.
    lost : int
        Rows before them that memory no longer had, or entries that the journal no longer has.
    more : bool
        Whether there are more rows already.
    """

    rows: pl.DataFrame
    position: Any
    lost: int = 0
    more: bool = False


def _transitions(rows: NDArray[np.void], sensors: SensorTable) -> pl.DataFrame:
    del sensors
    return wire.transitions_frame(table_of(TrackTransitions, rows))


#: Tables from a ring: its name, and the translation of its rows.
_RINGS: Mapping[str, tuple[str, Frame]] = {
    TRACKS_FILE: ("history", update_rows_frame),
    TRANSITIONS_FILE: ("transitions", _transitions),
    BIASES_FILE: ("biases", bias_rows_frame),
}


def present_positions(known: Knowledge, journal: Journal) -> dict[str, Any]:
    """Return the positions behind everything so far, where a new history begins."""
    found: dict[str, Any] = {
        table: known.logs[ring].appended for table, (ring, _) in _RINGS.items()
    }
    return found | {
        HEALTH_FILE: known.healths.appended, MEASUREMENTS_FILE: journal.counts().entries,
    }  # fmt: skip


def is_due(known: Knowledge, positions: Mapping[str, Any]) -> bool:
    """Return whether a ring has so many new rows that they are to be written at once."""
    for table, (ring, _) in _RINGS.items():
        log = known.logs[ring]
        if log.appended - positions[table] >= min(PART_ROWS, log.capacity // _RING_SHARE):
            return True
    return False


def new_rows(
    known: Knowledge, journal: Journal, until: int, positions: Mapping[str, Any]
) -> dict[str, NewRows]:
    """Return the new rows of all tables, at most `PART_ROWS` each.

    Parameters
    ----------
    known : Knowledge
        The output of the engine.
    journal : Journal
        The measurements.
    until : int
        The last entry whose measurements are included.
    positions : mapping
        Where to continue, by table.

    Raises
    ------
    JournalError
        The journal cannot be read.
    """
    position = positions[HEALTH_FILE]
    records, lost = known.healths.after(position)
    health = wire.health_frame(records, known.sensors)
    found = {
        table: _of_ring(known, ring, frame, positions[table])
        for table, (ring, frame) in _RINGS.items()
    }
    found[HEALTH_FILE] = NewRows(health, position + lost + len(records), lost)
    found[MEASUREMENTS_FILE] = _measurements(journal, until, positions[MEASUREMENTS_FILE])
    return found


def _of_ring(known: Knowledge, ring: str, frame: Frame, position: int) -> NewRows:
    log = known.logs[ring]
    end = log.appended
    if end <= position:
        # Nothing new; or the engine is processing the journal again.
        return NewRows(pl.DataFrame(), position)
    first = max(position, end - log.capacity)
    last, lost = min(end, first + PART_ROWS), first - position
    frames = []
    for start in range(first, last, _CHUNK_ROWS):
        try:
            rows = log.rows(start, min(start + _CHUNK_ROWS, last))
        except StateError:
            # Overwritten meanwhile.
            lost += min(_CHUNK_ROWS, last - start)
            continue
        frames.append(frame(rows, known.sensors))
    found = pl.concat(frames) if frames else pl.DataFrame()
    return NewRows(found, last, lost, last < end)


def _measurements(journal: Journal, until: int, position: int) -> NewRows:
    lost = max(journal.removed_until() - position, 0)
    reached, rows, frames = position + lost, 0, []
    if reached >= until:
        return NewRows(pl.DataFrame(), position)
    skipped = journal.skipped()
    try:
        for stored in journal.read(reached):
            entry = stored.entry
            if stored.sequence > until or rows >= PART_ROWS:
                break
            reached = stored.sequence
            if entry.kind is EntryKind.BATCH and entry.payload and reached not in skipped:
                frames.append(decode_rows(entry.payload))
                rows += entry.accepted
    except RemovedEntriesError:
        # Next time, from the first entry that is left.
        return NewRows(pl.DataFrame(), position, more=True)
    names = MEASUREMENT_SCHEMA.names()
    joined = pl.concat([complete(one).select(names) for one in frames]) if frames else None
    found = pl.DataFrame() if joined is None else joined
    return NewRows(found, reached, lost, reached < until)
