"""Parsing of records into columns, by the compiled form where possible."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.adsb.reading import _kernels, plain, roles
from multiradar_converters.adsb.reading.layout import Layout
from multiradar_converters.adsb.reading.splitting import Piece
from multiradar_converters.vid.text.lines import RejectedError
from multiradar_schemas.reject import RejectCode

Numbers = NDArray[np.float64]
Words = NDArray[np.int64]


@dataclass(frozen=True)
class RejectedRecord:
    """A rejected record; its place is a byte offset of JSON or a line of CSV."""

    place: int
    code: RejectCode
    reason: str
    raw: bytes


@dataclass
class Batch:
    """A batch of records of a file.

    Attributes
    ----------
    numbers, words : float64[16, n], int64[5, n]
        Values by role (see `roles`), in SI units.
    places : int64[n]
        Place of each record.
    raw : callable
        Returns the original text of a record.
    rejected : list of RejectedRecord
        Rejected records.
    found : int
        Number of records, including text that is not a record.
    duplicate, other : int
        Of feeds: records that repeat a position, and messages without a position, which are not
        records.
    old : int
        Of feeds: records without values of registers that may be old.
    received_s : float64[n] or None
        Of live feeds: Unix time of reception, s.
    sigma_m : float64[n] or None
        Of feeds: standard deviation of each position on each axis, m; NaN for none.
    """

    numbers: Numbers
    words: Words
    places: Words
    raw: Callable[[int], bytes]
    rejected: list[RejectedRecord] = field(default_factory=list)
    found: int = 0
    duplicate: int = 0
    other: int = 0
    old: int = 0
    received_s: Numbers | None = None
    sigma_m: Numbers | None = None

    def sigma_of(self, valid: NDArray[np.bool_]) -> Numbers | None:
        """Return the standard deviations of some records, m; None if there are none."""
        return None if self.sigma_m is None else self.sigma_m[valid]


def read_objects(
    piece: Piece, layout: Layout, numbers: Numbers, words: Words, odd: NDArray[np.bool_]
) -> None:
    """Read JSON objects by the compiled form; see `_kernels.read_objects`."""
    _kernels.read_objects(
        piece.text, piece.begins, piece.ends, layout.keys, layout.lengths, layout.key_roles,
        layout.hints, layout.worded, layout.scale, layout.divisor, numbers, words, odd,
    )  # fmt: skip


def read_columns(
    piece: Piece, layout: Layout, numbers: Numbers, words: Words, odd: NDArray[np.bool_]
) -> None:
    """Read lines of columns by the compiled form; see `_kernels.read_columns`."""
    _kernels.read_columns(
        piece.text, piece.begins, piece.ends, layout.separator[0],
        np.array(layout.columns, dtype=np.int64), layout.worded, layout.scale, layout.divisor,
        numbers, words, odd,
    )  # fmt: skip


def batch_of(
    piece: Piece,
    layout: Layout,
    cells_of: Callable[[bytes], dict[int, str]],
    fast: Callable[[Piece, Layout, Numbers, Words, NDArray[np.bool_]], None] | None,
) -> Batch:
    """Read records.

    Parameters
    ----------
    piece : Piece
        The records.
    layout : Layout
        Their layout.
    cells_of : callable
        The reference form: text by role of a record; raises RejectedError.
    fast : callable or None
        The compiled form, which leaves odd records to the reference form; the result does not
        depend on it.

    Returns
    -------
    Batch
        Accepted and rejected records.
    """
    count = len(piece.begins)
    numbers = np.full((roles.NUMBERS, count), np.nan)
    words = np.full((roles.WORDS, count), roles.ABSENT, dtype=np.int64)
    odd = np.ones(count, dtype=np.bool_)
    if fast is not None:
        fast(piece, layout, numbers, words, odd)
    rejected = [
        RejectedRecord(each.place, each.code, each.reason, each.raw) for each in piece.faults
    ]
    kept = np.ones(count, dtype=np.bool_)
    for k in np.flatnonzero(odd).tolist():
        try:
            row = plain.read_cells(cells_of(piece.raw(k)), layout)
        except RejectedError as error:
            rejected.append(_rejected_record(piece, k, error))
            kept[k] = False
        else:
            numbers[:, k], words[:, k] = row.numbers, row.words
    for k in np.flatnonzero(kept & ~plain.possible(numbers, words, layout)).tolist():
        row = plain.Row(tuple(numbers[:, k].tolist()), tuple(words[:, k].tolist()))
        fault = plain.fault_of(row, layout)
        if fault is not None:
            rejected.append(_rejected_record(piece, k, fault))
            kept[k] = False
    numbers, words = numbers[:, kept], words[:, kept]
    own = np.flatnonzero(kept)
    position = numbers[roles.POSITION_TIME]
    numbers[roles.TIME] = np.where(np.isnan(position), numbers[roles.TIME], position)
    found = count + len(piece.faults)
    return Batch(
        numbers, words, piece.places[own], lambda k: piece.raw(int(own[k])), rejected, found
    )


def _rejected_record(piece: Piece, record: int, error: RejectedError) -> RejectedRecord:
    return RejectedRecord(int(piece.places[record]), error.code, error.reason, piece.raw(record))
