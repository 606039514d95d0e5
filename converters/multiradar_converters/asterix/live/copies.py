"""Recent records, to find duplicates delivered by a second network."""

import numpy as np

from multiradar_converters.asterix.decoding import clocks
from multiradar_converters.asterix.decoding.timing import Timed
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers
from multiradar_converters.asterix.live import _copy_kernels
from multiradar_converters.asterix.table import SAME_S

#: Records retained (8 MiB): 25 s at 20 000 records/s.
CAPACITY = 1 << 19
# Spreads sources over all bits of a key (the golden ratio of 64 bits).
_SPREAD = np.int64(-7046029254386353131)


class RecentRecords:
    """Retains recent records; owned by one thread.

    Parameters
    ----------
    window_s : float
        Equal records of a source with a time, received within this time, are duplicates, s.
        Records without a time may be equal in every scan: for them at most `SAME_S`.
    capacity : int
        Maximum number of records; a power of two.
    """

    def __init__(self, window_s: float, capacity: int = CAPACITY) -> None:
        self._window_s = window_s
        self._keys = np.zeros(capacity, dtype=np.int64)
        self._received_s = np.zeros(capacity)

    def copies(self, reports: Timed) -> Flags:
        """Return which reports are duplicates; retain all of them."""
        timed = np.isin(reports.origin, (clocks.RECORD, clocks.TRUNCATED))
        window_s = np.where(timed, self._window_s, min(self._window_s, SAME_S))
        return self.repeated(reports.same, reports.rows.source, reports.rows.received_s, window_s)

    def repeated(
        self, same: Integers, source: Integers, received_s: Numbers, window_s: Numbers
    ) -> Flags:
        """Return which records are duplicates; retain all of them.

        Parameters
        ----------
        same : int64[n]
            Equal for records with equal octets.
        source : int64[n]
            Source.
        received_s : float64[n]
            Time of reception, s.
        window_s : float64[n]
            Maximum time difference of duplicates of each, s.

        Returns
        -------
        bool[n]
            Whether each is a duplicate.
        """
        again = np.zeros(len(same), dtype=np.bool_)
        _copy_kernels.find_copies(
            same ^ (source + 1) * _SPREAD,
            np.ascontiguousarray(received_s),
            window_s,
            self._keys,
            self._received_s,
            again,
        )
        return again

    def clear(self) -> None:
        """Discard all records."""
        self._keys[:] = 0
