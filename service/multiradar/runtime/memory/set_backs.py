"""When the data time was set back, in terms of the rows of a table."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.state import Fields


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
