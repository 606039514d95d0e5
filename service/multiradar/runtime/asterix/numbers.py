"""Track numbers of sixteen bits for tracks that are counted without end."""

import numpy as np
from numpy.typing import NDArray

#: There are so many numbers.
NUMBERS = 1 << 16
#: A number rests so long before another track gets it, s of data time: whoever missed the end of
#: the last track has forgotten it by then.
REST_S = 120.0
NO_NUMBER = -1
_NOBODY = -1


class TrackNumbers:
    """Gives each track a number of its own for as long as it lives.

    The number is what is left of the track's identifier, so that it is the same for every user and
    after a restart, and comes back only after 65 536 further tracks. Where an older track still
    holds that number, the next one that is free and rested is given.
    """

    def __init__(self) -> None:
        self._holder = np.full(NUMBERS, _NOBODY, np.int64)
        self._freed_s = np.full(NUMBERS, -np.inf)
        #: How often a track asked for a number when none was free.
        self.refused = 0

    def give(self, track_ids: NDArray[np.int64], time_s: float) -> NDArray[np.int64]:
        """Return the numbers of new tracks, `NO_NUMBER` for those for which none is free."""
        numbers = np.full(len(track_ids), NO_NUMBER, np.int64)
        for place, track_id in enumerate(track_ids.tolist()):
            number = self._free_number(track_id % NUMBERS, time_s)
            if number == NO_NUMBER:
                # There is none for those that follow, either.
                self.refused += len(track_ids) - place
                break
            self._holder[number] = track_id
            numbers[place] = number
        return numbers

    def free(self, numbers: NDArray[np.int64], time_s: float) -> None:
        """Take numbers back; `NO_NUMBER` is passed over."""
        given = numbers[numbers != NO_NUMBER]
        self._holder[given] = _NOBODY
        self._freed_s[given] = time_s

    def _free_number(self, wanted: int, time_s: float) -> int:
        if self._holder[wanted] == _NOBODY and time_s >= self._freed_s[wanted] + REST_S:
            return wanted
        free = (self._holder == _NOBODY) & (time_s >= self._freed_s + REST_S)
        ahead = np.roll(free, -wanted)
        step = int(ahead.argmax())
        return (wanted + step) % NUMBERS if ahead[step] else NO_NUMBER
