"""When the data time was set back, in terms of the rows of a table."""

from collections.abc import Iterable, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.state import Fields

#: A step back, which terminates all tracks: the number of the last track, and the time, s.
TrackStep = tuple[int, float]
#: Steps of a history that are known; the last ones.
TRACK_STEPS_MAX = 1000


class SetBacks:
    """The steps back of the data time since the oldest row of a table; one owner.

    Rows before a step with later times are superseded. Readers have no lock.
    """

    STATE: ClassVar[Fields] = {"_steps": list[tuple[int, float]]}

    def __init__(self) -> None:
        # Number of the next row, and the time, s.
        self._steps: list[tuple[int, float]] = []

    def __len__(self) -> int:
        return len(self._steps)

    def add(self, number: int, time_s: float, oldest: int) -> None:
        """Note a step.

        Parameters
        ----------
        number : int
            Number of the next row.
        time_s : float
            The time, s.
        oldest : int
            Number of the oldest row that is retained.
        """
        kept = [one for one in self._steps if one[0] > oldest]
        if kept and kept[-1][0] == number:
            time_s = min(time_s, kept.pop()[1])
        # Replaced, because readers have no lock.
        self._steps = [*kept, (number, time_s)]

    @property
    def last(self) -> int:
        """Number of the first row since the last step; 0 if there was none."""
        return self._steps[-1][0] if self._steps else 0

    def between(self, first: int, last: int) -> bool:
        """Return whether there was a step after one row and before another."""
        return any(first < number <= last for number, _ in self._steps)

    def limit_s(self, number: int) -> float:
        """Return the time from which on a row is superseded, s; inf if there was no step since."""
        return min((time_s for first, time_s in self._steps if number < first), default=np.inf)

    def limits_s(self, numbers: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the same for rows; (n,) each."""
        found = np.full(len(numbers), np.inf)
        for first, time_s in self._steps:
            found[numbers < first] = np.minimum(found[numbers < first], time_s)
        return found


def joined_steps(*given: Iterable[TrackStep]) -> list[TrackStep]:
    """Return steps by ascending track and time, without those that a later one includes."""
    found: list[TrackStep] = []
    for track, time_s in sorted({one for steps in given for one in steps}):
        if found and found[-1][0] == track:
            continue
        while found and found[-1][1] >= time_s:
            found.pop()
        found.append((track, time_s))
    return found[-TRACK_STEPS_MAX:]


def superseded_from_s(
    track_ids: NDArray[np.int64], steps: Sequence[TrackStep]
) -> NDArray[np.float64]:
    """Return the time from which on updates of tracks are superseded, s; inf without a step.

    Parameters
    ----------
    track_ids : (n,) int64
        The tracks.
    steps : sequence of TrackStep
        As from `joined_steps`.
    """
    found = np.full(len(track_ids), np.inf)
    for last, time_s in reversed(steps):
        found[track_ids <= last] = time_s
    return found
