"""From messages to entries of the journal: validation, admission, and what was refused.

Messages that wait together are translated together, because a translation costs much and its rows
cost little; what becomes of each message is the same as if it had come alone.
"""

import itertools
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar import wire
from multiradar.errors import JournalError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission import admission as admissions
from multiradar.runtime.admission.admission import Admission
from multiradar.runtime.admission.reject_file import TimeRefusals
from multiradar.runtime.live.backlog import Journalled
from multiradar.runtime.live.intake import Submission
from multiradar.runtime.live.payload import complete, decode_rows, encode_rows
from multiradar.storage.entries import Entry, EntryKind, RejectedRow, StoredEntry
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.measurements.directions import has_directions, without_empty_directions
from multiradar_schemas.measurements.reject import RejectCode

#: Column of a frame with the place of each row in its message.
INDEX_COLUMN = "index"


@dataclass(frozen=True, slots=True)
class Prepared:
    """A message, decided but not yet in the journal.

    Attributes
    ----------
    entry : Entry
        What the journal will hold.
    batch : MeasurementBatch
        The accepted measurements, for the engine.
    """

    entry: Entry
    batch: MeasurementBatch


# The measurements of one message that can be true, and the rows that cannot.
_Translated = tuple[MeasurementBatch, wire.Rejected]


def prepare(
    submissions: Sequence[Submission], table: SensorTable, admission: Admission
) -> list[Prepared | Exception]:
    """Decide about each row of messages, in their order.

    Parameters
    ----------
    submissions : sequence of Submission
        The messages.
    table : SensorTable
        The sensors.
    admission : Admission
        Decides by time; its state goes on.

    Returns
    -------
    list of Prepared or Exception
        One for each message. Accepted and refused rows are all rows of the message; an exception
        tells that the message as a whole cannot be understood, and it left no trace in the
        admission.
    """
    prepared: list[Prepared | Exception] = []
    translated = _translate([submission.frame for submission in submissions], table)
    for submission, found in zip(submissions, translated, strict=True):
        if isinstance(found, Exception):
            prepared.append(found)
        elif submission.kind is EntryKind.FLUSH:
            admission.flush()
            entry = _entry(submission, pl.DataFrame(), [], admission)
            prepared.append(Prepared(entry, MeasurementBatch.empty()))
        else:
            prepared.append(_decide(submission, *found, admission))
    return prepared


def journalled(entries: Sequence[StoredEntry], table: SensorTable) -> list[Journalled]:
    """Return entries of the journal as the engine takes them: the same as when they came in.

    Raises
    ------
    JournalError
        If rows that were accepted are refused now: the rules have changed.
    """
    frames = [
        decode_rows(stored.entry.payload) if stored.entry.payload else _NO_ROWS
        for stored in entries
    ]
    found = []
    for stored, translated in zip(entries, _translate(frames, table), strict=True):
        taken = 0 if isinstance(translated, Exception) else len(translated[0])
        if isinstance(translated, Exception) or taken != stored.entry.accepted:
            raise JournalError(
                f"entry {stored.sequence} of the journal: expected {stored.entry.accepted} "
                f"measurements that can be taken, was {taken}; it was written under other rules"
            )
        entry = stored.entry
        found.append(
            Journalled(stored.sequence, entry.kind, translated[0], entry.source, entry.rejects)
        )
    return found


def same_message(submission: Submission, entry: Entry) -> bool:
    """Tell whether a message is the one that an entry was made of."""
    if entry.kind is not submission.kind:
        return False
    if submission.rows != entry.accepted + len(entry.rejects):
        return False
    refused = np.array([row.index for row in entry.rejects], np.int64)
    accepted = submission.frame.filter(pl.Series(~np.isin(_places(submission.frame), refused)))
    if not entry.payload:
        return not len(accepted)
    # An entry of an earlier version has fewer columns: what it had no room for cannot differ.
    stored = decode_rows(entry.payload)
    sent = complete(accepted)
    if has_directions(sent) != has_directions(stored):
        return False
    return sent.select(stored.columns).equals(stored)


_NO_ROWS = pl.DataFrame(schema=MEASUREMENT_SCHEMA)
_NOTHING: _Translated = (
    MeasurementBatch.empty(),
    wire.Rejected(np.empty(0, np.int64), (), ()),
)


def _translate(frames: Sequence[pl.DataFrame], table: SensorTable) -> list[_Translated | Exception]:
    found: list[_Translated | Exception] = [_NOTHING] * len(frames)
    whole = {}
    for place, frame in enumerate(frames):
        if not len(frame):
            continue
        try:
            # Refuses columns of the wrong type.
            if not _is_complete(frame):
                wire.measurement_batch(frame.clear(), table)
            whole[place] = complete(frame)
        except Exception as error:
            found[place] = error
    for place, one in zip(whole, _translate_together(list(whole.values()), table), strict=True):
        found[place] = one
    return found


def _translate_together(
    frames: Sequence[pl.DataFrame], table: SensorTable
) -> Iterator[_Translated | Exception]:
    if not frames:
        return
    try:
        batch, refused = wire.measurement_batch(pl.concat(frames), table)
    except Exception as error:
        # One of them is poison: each for itself, so that the others do not suffer.
        if len(frames) == 1:
            yield error
            return
        for frame in frames:
            yield from _translate_together([frame], table)
        return
    ends = list(itertools.accumulate((len(frame) for frame in frames), initial=0))
    cuts = np.searchsorted(refused.index, np.array(ends)).tolist()
    for (start, end), (first, last) in zip(
        itertools.pairwise(ends), itertools.pairwise(cuts), strict=True
    ):
        rejected = wire.Rejected(
            refused.index[first:last] - start,
            refused.code[first:last],
            refused.reason[first:last],
        )
        # Rows taken before a row are the rows before it less those refused before it.
        yield batch.select(slice(start - first, end - last)), rejected


def _decide(
    submission: Submission,
    batch: MeasurementBatch,
    refused: wire.Rejected,
    admission: Admission,
) -> Prepared:
    frame = submission.frame
    batch, refused = _until(submission.latest_s, frame, batch, refused)
    clock_s = admission.data_clock_s
    code = admission.admit(batch)
    if not len(refused) and not code.any():
        return Prepared(_entry(submission, frame, [], admission), batch)
    late_or_future = TimeRefusals(admission, clock_s, batch.time_s, code).verdicts
    passed = np.delete(np.arange(len(frame)), refused.index)
    verdicts = [
        *zip(refused.index.tolist(), refused.code, refused.reason, strict=True),
        *((int(passed[row]), why, reason) for row, why, reason in late_or_future),
    ]
    accepted = code == admissions.ACCEPTED
    kept = frame[passed[accepted]]
    entry = _entry(submission, kept, _rejected_rows(frame, verdicts), admission)
    return Prepared(entry, batch.select(accepted))


def _until(
    latest_s: float, frame: pl.DataFrame, batch: MeasurementBatch, refused: wire.Rejected
) -> _Translated:
    """Refuse measurements that lie ahead of the time of day; the journal holds none of them."""
    ahead = batch.time_s > latest_s
    if not ahead.any():
        return batch, refused
    rows = np.delete(np.arange(len(frame)), refused.index)[ahead]
    reasons = [
        f"expected a time that is not ahead of the time of day ({latest_s:.0f} s), was {time_s} s"
        for time_s in batch.time_s[ahead].tolist()
    ]
    together = wire.Rejected(
        np.concatenate([refused.index, rows]),
        (*refused.code, *[RejectCode.TIME_FUTURE] * len(rows)),
        (*refused.reason, *reasons),
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
        payload=encode_rows(kept),
        accepted=len(kept),
        rejects=tuple(every),
        admission=admission.state(),
    )


def _rejected_rows(
    frame: pl.DataFrame, verdicts: Sequence[tuple[int, str, str]]
) -> list[RejectedRow]:
    rows = [row for row, _, _ in verdicts]
    content = (
        without_empty_directions(frame[rows]).drop(INDEX_COLUMN, strict=False).iter_rows(named=True)
    )
    return [
        RejectedRow(place, str(code), reason, json.dumps(raw, ensure_ascii=False))
        for place, (_, code, reason), raw in zip(
            _places(frame)[rows].tolist(), verdicts, content, strict=True
        )
    ]


def _is_complete(frame: pl.DataFrame) -> bool:
    columns = itertools.filterfalse(lambda one: one[0] == INDEX_COLUMN, frame.schema.items())
    return list(columns) == list(MEASUREMENT_SCHEMA.items())


def _places(frame: pl.DataFrame) -> NDArray[np.int64]:
    if INDEX_COLUMN in frame.columns:
        return frame[INDEX_COLUMN].cast(pl.Int64).to_numpy()
    return np.arange(len(frame), dtype=np.int64)
