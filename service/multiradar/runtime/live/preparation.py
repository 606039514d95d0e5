"""From messages to journal entries: validation, admission and rejected rows.

Queued messages are translated together, because the cost of a translation depends little on its
number of rows. The result for each message is the same as if it had come alone.
"""

import itertools
from collections.abc import Container, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar import wire
from multiradar.errors import JournalError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission import admission_by_time as admissions
from multiradar.runtime.admission.admission_by_time import Admission
from multiradar.runtime.admission.reject_file import TimeRejects
from multiradar.runtime.live.backlog import Journalled
from multiradar.runtime.live.intake import Submission
from multiradar.runtime.live.payload import decode_rows, encode_rows, row_texts
from multiradar.storage.entries import Entry, EntryKind, RejectedRow, StoredEntry, bounded
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA, complete
from multiradar_schemas.measurements.directions import (
    filled_columns,
    without_empty_columns,
)
from multiradar_schemas.reject import RejectCode

#: Column of a frame with the index of each row in its message.
INDEX_COLUMN = "index"
#: Rows of a message beyond the rate of their sensor that are kept with their content. The others
#: are kept with index, code and reason: a storm must not delay the messages of other sensors.
EXCESS_KEPT_MAX = 100
#: Journal entries in memory at once during a replay.
PIECE_ENTRIES_MAX = 256

#: The arguments of `ArrivalBoard.count`.
Counted = tuple[MeasurementBatch, NDArray[np.int8], NDArray[np.float64]]


@dataclass(frozen=True, slots=True)
class Prepared:
    """A message after admission, not yet in the journal.

    Attributes
    ----------
    entry : Entry
        The entry for the journal.
    batch : MeasurementBatch
        The accepted measurements, for the engine.
    clock_s : float
        The data clock after them, s.
    counted : tuple, optional
        The arguments with which its arrivals were counted.
    """

    entry: Entry
    batch: MeasurementBatch
    clock_s: float
    counted: Counted | None = None


# Kinds of entries whose payload is not measurements.
_WITH_TEXT = (EntryKind.SENSOR, EntryKind.HANDOVER)
# The plausible measurements of one message, and the rejected rows.
_Translated = tuple[MeasurementBatch, wire.Rejected]


def prepare(
    submissions: Sequence[Submission], table: SensorTable, admission: Admission
) -> list[Prepared | Exception]:
    """Accept or reject each row of messages, in their order.

    Parameters
    ----------
    submissions : sequence of Submission
        The messages.
    table : SensorTable
        The sensors.
    admission : Admission
        Accepts or rejects by time; its state is updated.

    Returns
    -------
    list of Prepared or Exception
        One for each message. Accepted and rejected rows together are all rows of the message. An
        exception means that the message as a whole is invalid; it did not change the admission.
    """
    prepared: list[Prepared | Exception] = []
    translated = _translate([submission.frame for submission in submissions], table)
    for submission, found in zip(submissions, translated, strict=True):
        if isinstance(found, Exception):
            prepared.append(found)
        elif submission.kind is not EntryKind.BATCH:
            if submission.kind is EntryKind.FLUSH:
                admission.flush()
            elif submission.kind is EntryKind.CLOCK:
                admission.set_clock(submission.clock_s)
            entry = _entry(submission, pl.DataFrame(), [], admission)
            prepared.append(Prepared(entry, MeasurementBatch.empty(), admission.released_to_s))
        else:
            prepared.append(_decide(submission, *found, admission))
    return prepared


def pieces(
    entries: Iterable[StoredEntry], until: int, skipped: Container[int], rows_max: int
) -> Iterator[list[StoredEntry]]:
    """Yield stored entries that are translated together: bounded in number and in measurements.

    Parameters
    ----------
    entries : iterable of StoredEntry
        Entries of the journal.
    until : int
        The last one.
    skipped : container of int
        Entries to leave out.
    rows_max : int
        Measurements after which a piece ends.
    """
    piece: list[StoredEntry] = []
    rows = 0
    for stored in entries:
        if stored.sequence > until:
            break
        if stored.sequence in skipped:
            continue
        piece.append(stored)
        rows += stored.entry.accepted
        # The sensors of what follows a change are known once it is processed.
        full = rows >= rows_max or len(piece) >= PIECE_ENTRIES_MAX
        if full or stored.entry.kind is EntryKind.SENSOR:
            yield piece
            piece, rows = [], 0
    if piece:
        yield piece


def journalled(entries: Sequence[StoredEntry], table: SensorTable) -> list[Journalled]:
    """Return journal entries as input of the engine, identical to their first processing.

    Raises
    ------
    JournalError
        If rows accepted before are rejected now: the rules have changed.
    """
    frames = [
        decode_rows(stored.entry.payload)
        if stored.entry.kind is EntryKind.BATCH and stored.entry.payload
        else _NO_ROWS
        for stored in entries
    ]
    found = []
    for stored, translated in zip(entries, _translate(frames, table), strict=True):
        count = 0 if isinstance(translated, Exception) else len(translated[0])
        if isinstance(translated, Exception) or count != stored.entry.accepted:
            raise JournalError(
                f"journal entry {stored.sequence}: expected {stored.entry.accepted} accepted "
                f"measurements, found {count}; the entry was written by a version with "
                "different rules"
            )
        entry = stored.entry
        found.append(
            Journalled(
                stored.sequence,
                entry.kind,
                translated[0],
                entry.source,
                entry.rejects,
                admissions.data_clock_of(entry.admission),
                change=entry.payload if entry.kind in _WITH_TEXT else b"",
            )
        )
    return found


def same_message(submission: Submission, entry: Entry) -> bool:
    """Return whether a message is identical to that of a journal entry."""
    if entry.kind is not submission.kind:
        return False
    if submission.kind is EntryKind.CLOCK:
        return submission.clock_s == admissions.data_clock_of(entry.admission)
    if submission.kind in _WITH_TEXT:
        # Of a removed entry no payload is left.
        return entry.payload in (submission.change, b"")
    same_rows = submission.rows == entry.accepted + len(entry.rejects)
    if not (same_rows and _same_rejects(submission, entry.rejects)):
        return False
    rejected = np.isin(_indices(submission.frame), [row.index for row in entry.rejects])
    accepted = submission.frame.filter(~rejected)
    if not entry.payload:
        # Of a removed entry only the counts are left.
        return len(accepted) == entry.accepted
    # An entry of an earlier version has fewer columns: only those are compared.
    stored = decode_rows(entry.payload)
    sent = complete(accepted)
    same_columns = filled_columns(sent) == filled_columns(stored)
    return same_columns and sent.select(stored.columns).equals(stored)


# By content: code and reason depend on when they were rejected. Some have no content.
def _same_rejects(submission: Submission, stored: Sequence[RejectedRow]) -> bool:
    kept = [row for row in stored if row.raw]
    compared = np.isin(_indices(submission.frame), [row.index for row in kept])
    places = np.flatnonzero(compared).tolist()
    own = _rejected_rows(submission.frame, [(place, "", "") for place in places])
    sent = {row.index: row.raw for row in (*submission.rejected, *own)}
    again = [replace(row, raw=sent.get(row.index, "")) for row in kept]
    return bounded(again) == tuple(kept)


_NO_ROWS = pl.DataFrame(schema=MEASUREMENT_SCHEMA)
_NOTHING: _Translated = (
    MeasurementBatch.empty(),
    wire.Rejected(np.empty(0, np.int64), (), ()),
)


def _translate(frames: Sequence[pl.DataFrame], table: SensorTable) -> list[_Translated | Exception]:
    found: list[_Translated | Exception] = [_NOTHING] * len(frames)
    whole = {}
    for index, frame in enumerate(frames):
        if not len(frame):
            continue
        try:
            wire.require_columns(frame)
            whole[index] = complete(frame)
        except Exception as error:
            found[index] = error
    for index, one in zip(whole, _translate_together(list(whole.values()), table), strict=True):
        found[index] = one
    return found


def _translate_together(
    frames: Sequence[pl.DataFrame], table: SensorTable
) -> Iterator[_Translated | Exception]:
    if not frames:
        return
    try:
        whole = frames[0] if len(frames) == 1 else pl.concat(frames)
        batch, rejected = wire.measurement_batch(whole, table)
    except Exception as error:
        # One of them cannot be processed: translate each separately.
        if len(frames) == 1:
            yield error
            return
        for frame in frames:
            yield from _translate_together([frame], table)
        return
    if len(frames) == 1:
        yield batch, rejected
        return
    ends = list(itertools.accumulate((len(frame) for frame in frames), initial=0))
    cuts = np.searchsorted(rejected.index, np.array(ends)).tolist()
    for (start, end), (first, last) in zip(
        itertools.pairwise(ends), itertools.pairwise(cuts), strict=True
    ):
        own = wire.Rejected(
            rejected.index[first:last] - start,
            rejected.code[first:last],
            rejected.reason[first:last],
        )
        # Rows accepted before a row: the rows before it less those rejected before it.
        yield batch.select(slice(start - first, end - last)), own


def _decide(
    submission: Submission,
    batch: MeasurementBatch,
    rejected: wire.Rejected,
    admission: Admission,
) -> Prepared:
    frame = submission.frame
    every = batch
    batch, rejected = _until(submission.latest_s, frame, batch, rejected)
    code = admission.admit(batch, submission.received_s)
    counted = batch, code, admission.clock_s
    if len(batch) < len(every) and submission.received_s is not None:
        # The clock of the machine may be the wrong one.
        ahead = every.time_s > submission.latest_s
        admission.hear(every.time_s[ahead], every.sensor[ahead], submission.received_s)
    if not len(rejected) and not code.any():
        entry = _entry(submission, frame, [], admission)
        return Prepared(entry, batch, admission.released_to_s, counted)
    by_time = TimeRejects(admission, admission.clock_s, batch, code).rejections
    passed = np.delete(np.arange(len(frame)), rejected.index)
    rejections = [
        *zip(rejected.index.tolist(), rejected.code, rejected.reason, strict=True),
        *((int(passed[row]), why, reason) for row, why, reason in by_time),
    ]
    accepted = code == admissions.ACCEPTED
    kept = frame[passed[accepted]]
    entry = _entry(submission, kept, _rejected_rows(frame, rejections), admission)
    return Prepared(entry, batch.select(accepted), admission.released_to_s, counted)


def _until(
    latest_s: float, frame: pl.DataFrame, batch: MeasurementBatch, rejected: wire.Rejected
) -> _Translated:
    """Reject measurements ahead of the system clock; the journal contains none of them."""
    ahead = batch.time_s > latest_s
    if not ahead.any():
        return batch, rejected
    rows = np.delete(np.arange(len(frame)), rejected.index)[ahead]
    reasons = [
        f"expected a time no later than the system clock ({latest_s:.0f} s), was {time_s} s"
        for time_s in batch.time_s[ahead].tolist()
    ]
    together = wire.Rejected(
        np.concatenate([rejected.index, rows]),
        (*rejected.code, *[RejectCode.TIME_FUTURE] * len(rows)),
        (*rejected.reason, *reasons),
    )
    return batch.select(~ahead), together


def _entry(
    submission: Submission,
    kept: pl.DataFrame,
    rejects: Sequence[RejectedRow],
    admission: Admission,
) -> Entry:
    every = sorted([*rejects, *submission.rejected], key=lambda row: row.index)
    return Entry(
        kind=submission.kind,
        source=submission.source,
        idempotency_key=submission.idempotency_key,
        payload=submission.change or encode_rows(kept),
        accepted=len(kept),
        rejects=bounded(every),
        admission=admission.state(),
    )


def _rejected_rows(
    frame: pl.DataFrame, rejections: Sequence[tuple[int, str, str]]
) -> list[RejectedRow]:
    excess = [row for row, code, _ in rejections if code is RejectCode.RATE_EXCEEDED]
    without = frozenset(excess[EXCESS_KEPT_MAX:])
    rows = [row for row, _, _ in rejections if row not in without]
    kept = without_empty_columns(frame[rows]).drop(INDEX_COLUMN, strict=False)
    content = iter(row_texts(kept))
    indices = _indices(frame).tolist()
    return [
        RejectedRow(
            indices[row], str(code), reason, "" if row in without else next(content)
        )
        for row, code, reason in rejections
    ]  # fmt: skip


def _indices(frame: pl.DataFrame) -> NDArray[np.int64]:
    if INDEX_COLUMN in frame.columns:
        return frame[INDEX_COLUMN].cast(pl.Int64).to_numpy()
    return np.arange(len(frame), dtype=np.int64)
