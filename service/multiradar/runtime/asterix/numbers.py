"""Track numbers of 16 bits for tracks with unbounded identifiers."""

import numpy as np
from numpy.typing import NDArray

#: Number of track numbers.
NUMBERS = 1 << 16
#: Time before a number is reused, s of data time: a receiver that missed the end of the track has
#: dropped it by then.
REST_S = 120.0
NO_NUMBER = -1
_UNUSED = -1


class TrackNumbers:
    """Assigns each live track a unique number.

    The number is the track identifier modulo 65 536. So it is the same for every user and after a
    restart, and is reused only after 65 536 further tracks. Where an older track still has that
    number, the next free one is assigned.
    """

    def __init__(self) -> None:
        self._holder = np.full(NUMBERS, _UNUSED, np.int64)
        self._freed_s = np.full(NUMBERS, -np.inf)
        #: Tracks for which no number was free, counted at each attempt.
        self.unassigned = 0

    def give(self, track_ids: NDArray[np.int64], time_s: float) -> NDArray[np.int64]:
        """Return the numbers of new tracks, `NO_NUMBER` for those for which none is free."""
        numbers = np.full(len(track_ids), NO_NUMBER, np.int64)
        for k, track_id in enumerate(track_ids.tolist()):
            number = self._free_number(track_id % NUMBERS, time_s)
            if number == NO_NUMBER:
                # None is free for the following tracks either.
                self.unassigned += len(track_ids) - k
                break
            self._holder[number] = track_id
            numbers[k] = number
        return numbers

    def free(self, numbers: NDArray[np.int64], time_s: float) -> None:
        """Free numbers; `NO_NUMBER` is skipped."""
        given = numbers[numbers != NO_NUMBER]
        self._holder[given] = _UNUSED
        self._freed_s[given] = time_s

    def _free_number(self, wanted: int, time_s: float) -> int:
        if self._holder[wanted] == _UNUSED and time_s >= self._freed_s[wanted] + REST_S:
            return wanted
        free = (self._holder == _UNUSED) & (time_s >= self._freed_s + REST_S)
        ahead = np.roll(free, -wanted)
        step = int(ahead.argmax())
        return (wanted + step) % NUMBERS if ahead[step] else NO_NUMBER
