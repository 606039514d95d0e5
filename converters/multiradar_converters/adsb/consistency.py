"""Consistency of the reports of an aircraft: repeated and stale positions, jumps.

Feeds output the last known position every second, so a position that was received once is repeated
with later times until the next reception. While the aircraft moves, the error of such a report is
the distance flown since.

=================== ===========================================================================
a report            is
=================== ===========================================================================
same position and   `REPEATED`: rejected
time as the last
same position, and  `STALE`: rejected. The distance is the ground speed times the time since the
more than `STALE_M` position was first reported
flown since
same position       good: the aircraft is stationary, or its speed is unknown
farther away than   good, but counted as a jump. Times often have a resolution of 1 s, which is
`SPEED_MAX_MPS`     allowed for
times the time
earlier than the    good, but counted as backwards: files are often ordered by flight, and the
last                table is sorted by time
=================== ===========================================================================
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.adsb import _consistency_kernels
from multiradar_converters.adsb._consistency_kernels import GOOD, REPEATED
from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.batches import Batch, RejectedRecord
from multiradar_converters.errors import LayoutError
from multiradar_schemas.reject import RejectCode

#: Minimum distance flown for a stale position, m: the resolution of ADS-B is 5 m, of tables up to
#: 11 m.
STALE_M = 20.0
#: Maximum speed of aircraft with ADS-B, m/s (Mach 2).
SPEED_MAX_MPS = 600.0
#: Resolution of times, s.
STEP_S = 1.0

#: Maximum number of aircraft per file; bounds the memory.
AIRCRAFT_MAX = 1 << 20


class ConsistencyCheck:
    """Checks the reports of a file in file order.

    Parameters
    ----------
    file : str
        Its name.
    """

    def __init__(self, file: str) -> None:
        self._file = file
        self._rows: dict[int, int] = {}
        self._state = np.full((1024, _consistency_kernels.STATE_NUMBERS), np.nan)
        self._counts = np.zeros(2, dtype=np.int64)
        self.repeated = 0
        self.stale = 0

    @property
    def aircraft(self) -> int:
        """Number of aircraft so far."""
        return len(self._rows)

    @property
    def backwards(self) -> int:
        """Number of reports earlier than the previous one."""
        return int(self._counts[_consistency_kernels.BACKWARDS])

    @property
    def jumps(self) -> int:
        """Number of reports farther from the previous one than an aircraft can fly."""
        return int(self._counts[_consistency_kernels.JUMPS])

    def push(self, batch: Batch) -> NDArray[np.bool_]:
        """Reject repeated and stale reports.

        Parameters
        ----------
        batch : Batch
            Reports; `rejected` is extended.

        Returns
        -------
        bool[n]
            Which reports are good.

        Raises
        ------
        LayoutError
            There are more than `AIRCRAFT_MAX` aircraft.
        """
        numbers = batch.numbers
        time = np.ascontiguousarray(numbers[roles.TIME])
        result = np.zeros(len(time), dtype=np.int64)
        _consistency_kernels.check_reports(
            time,
            np.ascontiguousarray(numbers[roles.LATITUDE]),
            np.ascontiguousarray(numbers[roles.LONGITUDE]),
            np.ascontiguousarray(numbers[roles.SPEED]),
            np.ascontiguousarray(batch.words[roles.GROUND - roles.FIRST_WORD]),
            self._rows_of(batch.words[roles.ADDRESS - roles.FIRST_WORD]),
            STALE_M,
            SPEED_MAX_MPS,
            STEP_S,
            self._state,
            result,
            self._counts,
        )
        for k in np.flatnonzero(result != GOOD).tolist():
            batch.rejected.append(self._rejected(batch, k, int(result[k])))
        return np.asarray(result == GOOD, dtype=np.bool_)

    def _rows_of(self, addresses: NDArray[np.int64]) -> NDArray[np.int64]:
        distinct, places = np.unique(addresses, return_inverse=True)
        rows = self._rows
        numbers = [rows.setdefault(address, len(rows)) for address in distinct.tolist()]
        if len(rows) > AIRCRAFT_MAX:
            msg = f"{self._file}: expected at most {AIRCRAFT_MAX} aircraft, found more"
            raise LayoutError(msg)
        while len(self._state) < len(rows):
            self._state = np.concatenate([self._state, np.full_like(self._state, np.nan)])
        return np.array(numbers, dtype=np.int64)[places.ravel()]

    def _rejected(self, batch: Batch, k: int, result: int) -> RejectedRecord:
        if result == REPEATED:
            self.repeated += 1
            reason = "repeats the position and time of the previous report"
        else:
            self.stale += 1
            reason = (
                "a stale position with a new time: the aircraft has moved since this position was "
                "reported"
            )
        return RejectedRecord(int(batch.places[k]), RejectCode.DUPLICATE, reason, batch.raw(k))
