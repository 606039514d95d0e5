"""Reordering of measurements by time."""

import math
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.state import Fields
from multiradar.tracking.input._order_kernels import TIED_MAX, find_repeats, order_tied
from multiradar.tracking.input.duplicates import NO_DUPLICATES, Duplicates
from multiradar.tracking.input.measurements import SINGLE, MeasurementBatch

#: Rows are released in steps of this much data time: whole windows of the association. This also
#: makes single measurements cheap.
RELEASE_STEP_S = 0.5

#: Buffered pieces are joined up to this number of rows, which makes single measurements cheap.
PIECE_ROWS = 4096

# Columns by which simultaneous rows are sorted, the most significant first. They are the whole row:
# rows equal in all of them are duplicates.
_TIE_COLUMNS = (
    "sensor",
    "track_number",
    "mode_s_address",
    "range_m",
    "azimuth_rad",
    "latitude_rad",
    "longitude_rad",
    "height_m",
    "mode_3a",
    "kind",
    "callsign",
)


class _Piece(NamedTuple):
    # Buffered measurements, and their positions in the order of arrival.
    rows: MeasurementBatch
    arrivals: NDArray[np.int64]


class ReorderBuffer:
    """Buffers measurements until no earlier ones can arrive.

    Rows before the data clock minus the horizon are released. The sequence of released rows is
    sorted by time, then by content. It is a function of the set of rows, independent of batches and
    of disorder within the horizon.

    Parameters
    ----------
    horizon_s : float
        Maximum delay of a measurement, s of data time.

    Attributes
    ----------
    late, duplicates : int
        Numbers of measurements left out as late, and as duplicates.
    arrivals : (n,) int64
        Positions in the order of arrival, from 0, of the rows of the last release.
    dropped : Duplicates
        Duplicates left out by the last release.
    waiting_from : int
        Position of the first measurement that may still be buffered; all earlier ones were
        released.
    """

    STATE: ClassVar[Fields] = {
        "_waiting": list[_Piece],
        "_arrived": int,
        "_latest_s": float,
        "_released_s": float,
        "late": int,
        "duplicates": int,
        "waiting_from": int,
    }

    def __init__(self, horizon_s: float) -> None:
        self._horizon_s = horizon_s
        self._waiting: list[_Piece] = []
        self._arrived = 0
        self._latest_s = -math.inf
        self._released_s = -math.inf
        self.late = 0
        self.duplicates = 0
        self.arrivals = np.empty(0, np.int64)
        self.waiting_from = 0
        self.dropped = NO_DUPLICATES

    def push(
        self, batch: MeasurementBatch, clock_s: float | None = None
    ) -> MeasurementBatch | None:
        """Add rows; return the released ones, in order, or None.

        Parameters
        ----------
        batch : MeasurementBatch
            Rows in the order of their arrival.
        clock_s : float, optional
            The data clock, s; by default the greatest time so far.

        Returns
        -------
        MeasurementBatch or None
            Rows in canonical order, without duplicates.
        """
        if len(batch) == 0:
            return None
        arrivals = np.arange(self._arrived, self._arrived + len(batch))
        self._arrived += len(batch)
        late = batch.time_s < self._released_s
        if late.any():
            # Admission rejects these; after a flush some may still arrive.
            self.late += int(late.sum())
            batch, arrivals = batch.select(~late), arrivals[~late]
            if len(batch) == 0:
                return None
        self._waiting.append(_Piece(batch, arrivals))
        self._latest_s = max(self._latest_s, float(batch.time_s.max()))
        watermark = (self._latest_s if clock_s is None else clock_s) - self._horizon_s
        # Also without a data clock: −∞ cannot be rounded.
        if watermark <= self._released_s:
            return None
        watermark = math.floor(watermark / RELEASE_STEP_S) * RELEASE_STEP_S
        if watermark <= self._released_s:
            return None
        return self._release(watermark)

    @property
    def released_s(self) -> float:
        """Time before which all rows were released, s; later ones are left out as late."""
        return self._released_s

    def flush(self) -> MeasurementBatch | None:
        """Return all buffered rows, in order, or None."""
        if not self._waiting:
            return None
        return self._release(math.nextafter(self._latest_s, math.inf))

    def rewind(self) -> None:
        """Accept earlier rows again; to be called when the buffer is empty."""
        self._latest_s = self._released_s = -math.inf

    def _release(self, watermark_s: float) -> MeasurementBatch | None:
        ready: list[_Piece] = []
        later: list[_Piece] = []
        for piece in self._waiting:
            early, late = _split(piece, watermark_s)
            ready += early
            later += late
        self._released_s = watermark_s
        self._waiting = _joined(later)
        self.waiting_from = min((int(one.arrivals.min()) for one in later), default=self._arrived)
        if not ready:
            return None
        rows, arrivals = _together(ready)
        order = canonical_order(rows)
        repeat = np.empty(len(order), np.bool_)
        repeats = find_repeats(order, repeat, rows.time_s, *_tie_columns(rows))
        self.duplicates += repeats
        self.dropped = NO_DUPLICATES
        if repeats:
            twice, order = order[repeat], order[~repeat]
            self.dropped = Duplicates.equal(arrivals[twice], rows.select(twice))
        self.arrivals = arrivals[order]
        return rows.select(order)


def canonical_order(batch: MeasurementBatch) -> NDArray[np.intp]:
    """Return the order of rows by time, then by content.

    Parameters
    ----------
    batch : MeasurementBatch
        Rows in any order.

    Returns
    -------
    (n,) intp
        Indices.
    """
    order = np.argsort(batch.time_s, kind="stable")
    if order_tied(order, batch.time_s, *_tie_columns(batch)) > TIED_MAX:
        times = batch.time_s[order]
        same = np.flatnonzero(times[1:] == times[:-1])
        ties = np.union1d(same, same + 1)
        tied = order[ties]
        keys = [column[tied] for column in reversed(_tie_columns(batch))]
        order[ties] = tied[np.lexsort([*keys, batch.time_s[tied]])]
    return order


def _tie_columns(batch: MeasurementBatch) -> list[Any]:
    columns = [getattr(batch, name) for name in _TIE_COLUMNS]
    rare: list[NDArray[Any]] = [] if batch.directions is None else [*batch.directions]
    rare += [column for name in SINGLE if (column := getattr(batch, name)) is not None]
    rare += [] if batch.aircraft_data is None else [*batch.aircraft_data]
    if rare:
        columns[-1] = _ranks([columns[-1], *rare])
    return columns


# Ranks of rows by content; equal rows have equal ranks.
def _ranks(columns: list[NDArray[Any]]) -> NDArray[np.int64]:
    order = np.lexsort(columns[::-1])
    differs = np.zeros(max(len(order) - 1, 0), np.bool_)
    for column in columns:
        now, before = column[order[1:]], column[order[:-1]]
        differs |= (now != before) & ~(np.isnan(now) & np.isnan(before))
    ranks = np.zeros(len(order), np.int64)
    ranks[order[1:]] = np.cumsum(differs)
    return ranks


def _split(piece: _Piece, watermark_s: float) -> tuple[list[_Piece], list[_Piece]]:
    """Return the parts before a time and after it, each in a list that may be empty."""
    rows, arrivals = piece
    ready = rows.time_s < watermark_s
    count = int(np.count_nonzero(ready))
    if count == 0:
        return [], [piece]
    if count == len(rows):
        return [piece], []
    early, late = (
        _Piece(rows.select(ready), arrivals[ready]),
        _Piece(rows.select(~ready), arrivals[~ready]),
    )
    return [early], [late]


def _joined(pieces: list[_Piece]) -> list[_Piece]:
    """Join neighbouring pieces of up to `PIECE_ROWS` together."""
    groups: list[list[_Piece]] = []
    room = 0
    for piece in pieces:
        if len(piece.rows) > room:
            groups.append([])
            room = PIECE_ROWS
        groups[-1].append(piece)
        room -= len(piece.rows)
    return [_together(group) for group in groups]


def _together(pieces: list[_Piece]) -> _Piece:
    """Return all rows, one piece after the other."""
    if len(pieces) == 1:
        return pieces[0]
    return _Piece(
        MeasurementBatch.concatenate([one.rows for one in pieces]),
        np.concatenate([one.arrivals for one in pieces]),
    )
