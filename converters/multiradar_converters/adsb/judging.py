"""Reports that say what an earlier one of the same aircraft said.

Feeds of positions tell every second what they know, so a position that was heard once comes again
under later times until the next one is heard. While the aircraft flies on, such a report is wrong
by the way flown since.

=================== ===========================================================================
a report            is
=================== ===========================================================================
same position and   `REPEATED`: refused
time as the last
same position, and  `STALE`: refused. Ground speed times the time since the position was first
more than `STALE_M` told gives the way
flown since
same position       good: it stands, or its speed is not told
farther away than   good, but counted as a jump. Times are often whole seconds, so a second
`SPEED_MAX_MPS`     more or less may lie between two
times the time
earlier than the    good, but counted as backwards: files are often flight by flight, and the
last                table is put in order of time
=================== ===========================================================================
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.adsb import _judging_kernels
from multiradar_converters.adsb._judging_kernels import GOOD, REPEATED
from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.batches import Batch, Refused
from multiradar_converters.errors import LayoutError
from multiradar_schemas.measurements.reject import RejectCode

#: A position stands for so long a way, m: the resolution of ADS-B is 5 m, of tables up to 11 m.
STALE_M = 20.0
#: No aircraft that tells its position flies faster, m/s (Mach 2).
SPEED_MAX_MPS = 600.0
#: Resolution of times, s.
STEP_S = 1.0

#: Aircraft of one file, which are remembered: bounds the memory.
AIRCRAFT_MAX = 1 << 20


class Judge:
    """Judges the reports of a file in its order.

    Parameters
    ----------
    file : str
        Its name.
    of_day : bool
        Whether its times have no date.
    """

    def __init__(self, file: str, of_day: bool) -> None:
        self._file = file
        self._of_day = of_day
        self._rows: dict[int, int] = {}
        self._state = np.full((1024, _judging_kernels.STATE_NUMBERS), np.nan)
        self._midnight = np.array([np.nan, 0.0])
        self._counts = np.zeros(2, dtype=np.int64)
        self.repeated = 0
        self.stale = 0

    @property
    def backwards(self) -> int:
        """Reports whose time is before that of the report before."""
        return int(self._counts[_judging_kernels.BACKWARDS])

    @property
    def jumps(self) -> int:
        """Reports farther from the one before than any aircraft flies."""
        return int(self._counts[_judging_kernels.JUMPS])

    def judge(self, batch: Batch) -> NDArray[np.bool_]:
        """Move times past midnight; refuse what is told again.

        Parameters
        ----------
        batch : Batch
            Reports; times are changed in place, and `refused` is added to.

        Returns
        -------
        bool[n]
            Which reports stand.

        Raises
        ------
        LayoutError
            There are more than `AIRCRAFT_MAX` aircraft.
        """
        numbers = batch.numbers
        time = np.ascontiguousarray(numbers[roles.TIME])
        if self._of_day:
            _judging_kernels.past_midnight(time, self._midnight)
            numbers[roles.TIME] = time
        verdict = np.zeros(len(time), dtype=np.int64)
        _judging_kernels.judge_reports(
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
            verdict,
            self._counts,
        )
        for k in np.flatnonzero(verdict != GOOD).tolist():
            batch.refused.append(self._refused(batch, k, int(verdict[k])))
        return np.asarray(verdict == GOOD, dtype=np.bool_)

    def _rows_of(self, addresses: NDArray[np.int64]) -> NDArray[np.int64]:
        distinct, places = np.unique(addresses, return_inverse=True)
        rows = self._rows
        numbers = [rows.setdefault(address, len(rows)) for address in distinct.tolist()]
        if len(rows) > AIRCRAFT_MAX:
            msg = f"{self._file}: expected at most {AIRCRAFT_MAX} aircraft, was more"
            raise LayoutError(msg)
        while len(self._state) < len(rows):
            self._state = np.concatenate([self._state, np.full_like(self._state, np.nan)])
        return np.array(numbers, dtype=np.int64)[places.ravel()]

    def _refused(self, batch: Batch, k: int, verdict: int) -> Refused:
        if verdict == REPEATED:
            self.repeated += 1
            reason = "the position and time of the report before it, once more"
        else:
            self.stale += 1
            reason = "an old position under a new time: the aircraft has flown on since it was told"
        return Refused(int(batch.places[k]), RejectCode.DUPLICATE, reason, batch.raw(k))
