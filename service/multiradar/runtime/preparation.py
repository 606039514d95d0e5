"""From a message to an entry of the journal: validation, admission, and what was refused."""

import io
import json
from dataclasses import dataclass

import numpy as np
import polars as pl

from multiradar import wire
from multiradar.errors import JournalError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime import admission as admissions
from multiradar.runtime.admission import Admission
from multiradar.runtime.backlog import Journalled
from multiradar.runtime.intake import Submission
from multiradar.runtime.reject_file import TimeRefusals
from multiradar.storage.entries import Entry, EntryKind, RejectedRow, StoredEntry
from multiradar.tracking.measurements import MeasurementBatch
from multiradar_schemas.arrow import MEASUREMENT_SCHEMA

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


def prepare(submission: Submission, table: SensorTable, admission: Admission) -> Prepared:
    """Decide about each row of a message.

    Parameters
    ----------
    submission : Submission
        The message.
    table : SensorTable
        The sensors.
    admission : Admission
        Decides by time; its state goes on.

    Returns
    -------
    Prepared
        Its accepted and refused rows are all rows of the message.

    Raises
    ------
    InputError
        If the columns are not those of measurements; the admission is untouched then.
    """
    if submission.kind is EntryKind.FLUSH:
        admission.flush()
        return Prepared(
            Entry(
                kind=EntryKind.FLUSH,
                source=submission.source,
                idempotency_key=submission.idempotency_key,
                payload=b"",
                accepted=0,
                rejects=(),
                admission=admission.state(),
            ),
            MeasurementBatch.empty(),
        )
    frame = submission.frame
    batch, refused = wire.measurement_batch(frame, table)
    clock_s = admission.data_clock_s
    code = admission.admit(batch)
    kept, rejects = _plausible(frame, refused)
    if code.any():
        rejects += _untimely(kept, TimeRefusals(admission, clock_s, batch.time_s, code))
        kept = kept.filter(pl.Series(code == admissions.ACCEPTED))
        batch = batch.take(code == admissions.ACCEPTED)
    every = sorted([*rejects, *submission.rejected], key=lambda row: row.index)
    return Prepared(
        Entry(
            kind=EntryKind.BATCH,
            source=submission.source,
            idempotency_key=submission.idempotency_key,
            payload=encode_rows(kept),
            accepted=len(kept),
            rejects=tuple(every),
            admission=admission.state(),
        ),
        batch,
    )


def journalled(stored: StoredEntry, table: SensorTable) -> Journalled:
    """Return an entry of the journal as the engine takes it: the same as when it came in.

    Raises
    ------
    JournalError
        If rows that were accepted are refused now: the sensors or the rules have changed.
    """
    entry = stored.entry
    if not entry.payload:
        return Journalled(stored.sequence, entry.kind, MeasurementBatch.empty())
    batch, refused = wire.measurement_batch(decode_rows(entry.payload), table)
    if len(refused) or len(batch) != entry.accepted:
        raise JournalError(
            f"entry {stored.sequence} of the journal: expected {entry.accepted} measurements that "
            f"can be taken, was {len(batch)}; it was written under other rules"
        )
    return Journalled(stored.sequence, entry.kind, batch)


def same_message(submission: Submission, stored: StoredEntry) -> bool:
    """Tell whether a message is the one that is in the journal already."""
    entry = stored.entry
    if entry.kind is not submission.kind:
        return False
    if submission.rows != entry.accepted + len(entry.rejects):
        return False
    refused = {row.index for row in entry.rejects}
    places = pl.Series(_places(submission.frame))
    accepted = submission.frame.filter(~places.is_in(list(refused)))
    if not entry.payload:
        return not len(accepted)
    return complete(accepted).equals(decode_rows(entry.payload))


def encode_rows(frame: pl.DataFrame) -> bytes:
    """Return measurements as an Arrow IPC stream; nothing for no rows."""
    if not len(frame):
        return b""
    buffer = io.BytesIO()
    complete(frame).rechunk().write_ipc_stream(buffer)
    return buffer.getvalue()


def decode_rows(payload: bytes) -> pl.DataFrame:
    """Return the measurements of an Arrow IPC stream."""
    return pl.read_ipc_stream(io.BytesIO(payload))


def complete(frame: pl.DataFrame) -> pl.DataFrame:
    """Return exactly the columns of `MEASUREMENT_SCHEMA`; absent ones are null."""
    if frame.schema == MEASUREMENT_SCHEMA:
        return frame
    return frame.select(
        pl.col(name) if name in frame.columns else pl.lit(None, dtype).alias(name)
        for name, dtype in MEASUREMENT_SCHEMA.items()
    )


def _plausible(
    frame: pl.DataFrame, refused: wire.Rejected
) -> tuple[pl.DataFrame, list[RejectedRow]]:
    # The rows that the gates let through, and the others with their place and content.
    if not len(refused):
        return frame, []
    chosen = frame[refused.index]
    rejects = [
        RejectedRow(place, str(code), reason, raw)
        for place, code, reason, raw in zip(
            _places(frame)[refused.index].tolist(),
            refused.code,
            refused.reason,
            _raw(chosen),
            strict=True,
        )
    ]
    passed = np.ones(len(frame), np.bool_)
    passed[refused.index] = False
    # The places must survive the filter.
    return _with_places(frame).filter(pl.Series(passed)), rejects


def _untimely(frame: pl.DataFrame, refused: TimeRefusals) -> list[RejectedRow]:
    rows = [row for row, _, _ in refused.verdicts]
    return [
        RejectedRow(place, str(code), reason, raw)
        for place, (_, code, reason), raw in zip(
            _places(frame)[rows].tolist(), refused.verdicts, _raw(frame[rows]), strict=True
        )
    ]


def _with_places(frame: pl.DataFrame) -> pl.DataFrame:
    return frame if INDEX_COLUMN in frame.columns else frame.with_row_index(INDEX_COLUMN)


def _places(frame: pl.DataFrame) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    if INDEX_COLUMN in frame.columns:
        return frame[INDEX_COLUMN].cast(pl.Int64).to_numpy()
    return np.arange(len(frame))


def _raw(frame: pl.DataFrame) -> list[str]:
    content = frame.drop(INDEX_COLUMN, strict=False)
    return [json.dumps(row, ensure_ascii=False) for row in content.iter_rows(named=True)]
