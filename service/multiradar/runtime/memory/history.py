"""The last rows of all tracks, in a ring of fixed size with a chain through each track.

The cost of appending does not depend on the rows retained; the cost of reading a track is
proportional to the rows returned. One thread appends, any thread reads without a lock: a reader
copies rows and then drops those overwritten meanwhile.
"""

from bisect import bisect_right
from typing import ClassVar

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar import wire
from multiradar.estimation.filters._kernels import NONE
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime import _kernels as kernels
from multiradar.runtime.memory.set_backs import SetBacks
from multiradar.runtime.row_ring import RowRing, store
from multiradar.state import Fields
from multiradar.tracking.columns import row_type, table_of
from multiradar.tracking.outputs import TrackUpdates

#: A row of `TrackUpdates`; field names are the same.
UPDATE_DTYPE = row_type(TrackUpdates)
#: The same with the covariance of the position as in `EngineOutput.spread`, m²; NaN for none.
SPREAD_DTYPE = np.dtype([*UPDATE_DTYPE.descr, ("spread", np.float32, (3,))])
#: Maximum time by which a row may precede rows appended before it, s.
DISORDER_S = 30.0


def with_spread(rows: NDArray[np.void], spread: NDArray[np.float64]) -> NDArray[np.void]:
    """Return rows of `UPDATE_DTYPE` as rows of `SPREAD_DTYPE`.

    Parameters
    ----------
    rows : (n,) ndarray of `UPDATE_DTYPE`
        Updates.
    spread : (n, 5) ndarray, or of another length
        `EngineOutput.spread` of them, if the engine has it.
    """
    wide = np.empty(len(rows), SPREAD_DTYPE)
    wide[list(UPDATE_DTYPE.names or ())] = rows
    wide["spread"] = spread[:, 2:] if len(spread) == len(rows) else np.nan
    return wide


def update_rows_frame(rows: NDArray[np.void], sensors: SensorTable) -> pl.DataFrame:
    """Return rows of `UPDATE_DTYPE` as rows of `tracks.parquet`."""
    return wire.tracks_frame(table_of(TrackUpdates, rows), sensors)


class TrackHistory(RowRing):
    """The last rows of all tracks: their updates, or another table by track and time.

    The data time may be set back. Rows before that with later times are superseded: a search by
    time finds the rows after the step instead. The rows of one track are read whole.

    Parameters
    ----------
    rows_max : int
        Number of retained rows; the oldest are overwritten first.
    row_type : dtype
        Of the rows, with `track_id` and `time_s`.
    """

    STATE: ClassVar[Fields] = {"_set_backs": SetBacks, "last_track": int}

    def __init__(self, rows_max: int, row_type: np.dtype[np.void] = UPDATE_DTYPE) -> None:
        super().__init__(rows_max, row_type)
        self._time_s = np.empty(rows_max, np.float64)
        # Not filled: memory of rows that are never appended stays unused.
        self._previous = np.empty(rows_max, np.int64)
        # Number of the newest row of each track, by track identifier (from 1).
        self._newest = np.full(1024, NONE, np.int64)
        self._set_backs = SetBacks()
        #: Greatest number of a track so far.
        self.last_track = 0

    def __len__(self) -> int:
        return min(self._appended, len(self._rows))

    def append(self, rows: NDArray[np.void]) -> None:
        """Add rows, in order."""
        capacity = len(self._rows)
        for start in range(0, len(rows), capacity):
            self._append(rows[start : start + capacity])

    def set_back(self, time_s: float) -> None:
        """Expect rows from an earlier time on."""
        self._set_backs.add(self._appended, time_s, self.oldest)

    @property
    def first_since_set_back(self) -> int:
        """Number of the first row since the data time was last set back; 0 if it never was."""
        return self._set_backs.last

    def read(self, track_id: int, since_s: float | None, limit: int) -> NDArray[np.void]:
        """Return rows of a track, oldest first.

        Parameters
        ----------
        track_id : int
            The track, live or dropped.
        since_s : float or None
            With a data time: the first `limit` updates from then on, so that a reader can page
            forward. None: the last `limit` updates.
        limit : int
            Maximum number of rows.

        Returns
        -------
        (n,) ndarray of the type of the rows
            A copy.
        """
        if not 0 < track_id < len(self._newest) or limit < 1:
            return self._rows[:0].copy()
        found = np.empty(limit, np.int64)
        since = -np.inf if since_s is None else float(since_s)
        newest = int(self._newest[track_id])
        count = kernels.follow(
            self._previous, self._time_s, newest, self.oldest, since, found, since_s is not None
        )
        start = count % limit if count > limit else 0
        numbers = np.roll(found[: min(count, limit)], -start)[::-1]
        rows: NDArray[np.void] = self._rows[numbers % len(self._rows)]
        # Without rows overwritten during the copy, or reached by a link of one.
        intact: NDArray[np.void] = rows[(numbers >= self.oldest) & (rows["track_id"] == track_id)]
        return intact

    def read_until(
        self, track_id: int, since_s: float | None, until_s: float, limit: int
    ) -> NDArray[np.void]:
        """Return the last rows of a track in a span of time, oldest first.

        Parameters
        ----------
        track_id : int
            The track, live or dropped.
        since_s : float or None
            Rows not earlier than that; None: all.
        until_s : float
            Rows not later than that.
        limit : int
            Maximum number of rows.

        Returns
        -------
        (n,) ndarray of the type of the rows
            A copy.
        """
        begin_s = -np.inf if since_s is None else since_s
        rows = self.read(track_id, begin_s, len(self._rows))
        last: NDArray[np.void] = rows[rows["time_s"] <= until_s][-limit:]
        return last

    def after(self, number: int | None, limit: int) -> tuple[NDArray[np.void], int, int]:
        """Return the newest rows of all tracks after a number, in the order of appending.

        Parameters
        ----------
        number : int or None
            The number that an earlier call returned; None or a greater one than ever returned:
            the newest rows, since the data time was last set back.
        limit : int
            Maximum number of rows.

        Returns
        -------
        rows : (n,) ndarray of the type of the rows
            A copy.
        number : int
            For the next call.
        skipped : int
            Rows after `number` that are not returned: beyond `limit`, or overwritten.
        """
        end = self._appended
        known = number is not None and 0 <= number <= end
        first = min(max(end - limit, self.first_since_set_back), end)
        wanted = number if known and number is not None else first
        start = max(wanted, end - limit, self.oldest)
        numbers = np.arange(start, end)
        rows: NDArray[np.void] = self._rows[numbers % len(self._rows)]
        intact = numbers >= self.oldest
        return rows[intact], end, end - wanted - int(np.count_nonzero(intact))

    def between(
        self, after_s: float, until_s: float, *, superseded: bool = False
    ) -> NDArray[np.void]:
        """Return the retained rows of all tracks in a span of time, by ascending time.

        Parameters
        ----------
        after_s, until_s : float
            Rows later than the first and not later than the second.
        superseded : bool
            Whether superseded rows are included, too, as of the time of the step.

        Returns
        -------
        (n,) ndarray of the type of the rows
            A copy.
        """
        first = self._number_after(after_s - DISORDER_S)
        last = self._number_after(until_s + DISORDER_S)
        return self._within(first, last, (after_s, until_s), superseded=superseded)

    # Number of the first retained row after a time, if they were in order.
    def _number_after(self, time_s: float) -> int:
        held = range(self.oldest, self._appended)
        return held.start + bisect_right(held, time_s, key=self._ordered_s)

    # The time of a row; of a superseded one that of the step. These ascend.
    def _ordered_s(self, number: int) -> float:
        return min(self._own_s(number), self._set_backs.limit_s(number))

    def _own_s(self, number: int) -> float:
        return float(self._time_s[number % len(self._rows)])

    # Of the rows with these numbers, those of a span that are not overwritten, by ascending time.
    def _within(
        self, first: int, last: int, span_s: tuple[float, float], *, superseded: bool = False
    ) -> NDArray[np.void]:
        numbers = np.arange(first, last)
        rows: NDArray[np.void] = self._rows[numbers % len(self._rows)]
        times = np.minimum(rows["time_s"], self._set_backs.limits_s(numbers))
        wanted = (numbers >= self.oldest) & (times > span_s[0]) & (times <= span_s[1])
        if not superseded:
            wanted &= times == rows["time_s"]
        chosen: NDArray[np.void] = rows[wanted]
        ordered: NDArray[np.void] = chosen[np.argsort(chosen["time_s"], kind="stable")]
        return ordered

    def last_until(self, until_s: float, limit: int) -> NDArray[np.void]:
        """Return the last retained rows of all tracks up to a time, by ascending time; a copy.

        Parameters
        ----------
        until_s : float
            Rows not later than that.
        limit : int
            Maximum number of rows.
        """
        sure = self._number_after(until_s - DISORDER_S)
        last = self._number_after(until_s + DISORDER_S)
        count = limit
        while True:
            first = max(sure - count, self.oldest)
            found = self._within(first, last, (-np.inf, until_s))[-limit:]
            if len(found) >= limit or first <= self.oldest:
                return found
            # Superseded rows are among them.
            count *= 4

    @property
    def oldest_s(self) -> float | None:
        """The time of the oldest retained row, s; None without rows."""
        return self._ordered_s(self.oldest) if self._appended else None

    @property
    def complete_from_s(self) -> float:
        """Time from which all rows are retained, s; -inf if none was overwritten."""
        return self._ordered_s(self.oldest) if self.oldest else -np.inf

    def complete_of_s(self, track_id: int) -> float:
        """Return the time from which all rows of a track are retained, s.

        -inf if none was overwritten, inf if all may have been. A step terminates all tracks, so
        that a track has no rows on both sides of one.
        """
        oldest = self.oldest
        known = 0 < track_id < len(self._newest)
        newest = int(self._newest[track_id]) if known else NONE
        if not oldest or self._set_backs.between(oldest, newest):
            return -np.inf
        if newest < oldest and len(self._set_backs):
            return np.inf
        return self._own_s(oldest) + DISORDER_S

    def _append(self, rows: NDArray[np.void]) -> None:
        self._claimed = self._appended + len(rows)
        numbers = np.arange(self._appended, self._claimed)
        order = np.argsort(rows["track_id"], kind="stable")
        tracks = rows["track_id"][order]
        starts = np.r_[True, tracks[1:] != tracks[:-1]]
        self.last_track = max(self.last_track, int(tracks[-1]))
        self._grow(int(tracks[-1]))
        previous = np.empty(len(rows), np.int64)
        previous[1:] = numbers[order[:-1]]
        previous[starts] = self._newest[tracks[starts]]
        store(self._rows, self._appended, rows)
        store(self._time_s, self._appended, rows["time_s"])
        self._previous[numbers[order] % len(self._rows)] = previous
        ends = np.r_[starts[1:], True]
        self._newest[tracks[ends]] = numbers[order[ends]]
        self._appended = self._claimed

    def _grow(self, track_id: int) -> None:
        if track_id >= len(self._newest):
            grown = np.full(max(track_id + 1, 2 * len(self._newest)), NONE, np.int64)
            grown[: len(self._newest)] = self._newest
            self._newest = grown
