"""Records of the last moments, to find the copies that a second network brings."""

import numpy as np

from multiradar_converters.asterix.decoding import clocks
from multiradar_converters.asterix.decoding.timing import Timed
from multiradar_converters.asterix.layout.columns import Flags, Integers, Numbers
from multiradar_converters.asterix.live import _copy_kernels
from multiradar_converters.asterix.table import SAME_S

#: Records that are remembered (8 MiB): those of 25 s at 20 000 records/s.
REMEMBERED = 1 << 19
# Spreads sources over all bits of a key (the golden ratio of 64 bits).
_SPREAD = np.int64(-7046029254386353131)


class RecentRecords:
    """Remembers records; owned by one thread.

    Parameters
    ----------
    window_s : float
        Equal records of one source that tell a time, received at most so far apart, are one, s.
        Without a time of their own they may be equal each turn: then `SAME_S` at most.
    remembered : int
        So many records at most; a power of two.
    """

    def __init__(self, window_s: float, remembered: int = REMEMBERED) -> None:
        self._window_s = window_s
        self._keys = np.zeros(remembered, dtype=np.int64)
        self._received_s = np.full(remembered, -np.inf)

    def copies(self, reports: Timed) -> Flags:
        """Tell which reports came before; remember all of them."""
        told = np.isin(reports.origin, (clocks.RECORD, clocks.TRUNCATED))
        window_s = np.where(told, self._window_s, min(self._window_s, SAME_S))
        return self.repeated(reports.same, reports.rows.source, reports.rows.received_s, window_s)

    def repeated(
        self, same: Integers, source: Integers, received_s: Numbers, window_s: Numbers
    ) -> Flags:
        """Tell which records came before; remember all of them.

        Parameters
        ----------
        same : int64[n]
            Equal for records of equal octets.
        source : int64[n]
            Who wrote them.
        received_s : float64[n]
            When they came, s.
        window_s : float64[n]
            How far apart copies of each may come, s.

        Returns
        -------
        bool[n]
            Whether each repeats one before it.
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

    def forget(self) -> None:
        """Remember nothing."""
        self._received_s[:] = -np.inf
