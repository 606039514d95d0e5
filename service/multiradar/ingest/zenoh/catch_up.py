"""The last track updates by their number: who has number n can ask for what follows."""

import threading
from bisect import bisect_left
from collections import deque
from dataclasses import dataclass
from itertools import islice


@dataclass(frozen=True, slots=True)
class NumberedUpdate:
    """One track update, as published.

    Attributes
    ----------
    sequence : int
        Number of the update, 1, 2, 3, … over all tracks.
    key : str
        Key it was published under.
    payload : bytes
        JSON.
    """

    sequence: int
    key: str
    payload: bytes


class CatchUp:
    """Keeps the last updates.

    Parameters
    ----------
    samples_max : int
        How many.
    """

    def __init__(self, samples_max: int) -> None:
        self._updates: deque[NumberedUpdate] = deque(maxlen=samples_max)
        self._lock = threading.Lock()

    def append(self, update: NumberedUpdate) -> None:
        """Add the newest update; numbers ascend until the journal is played anew."""
        with self._lock:
            if self._updates and update.sequence <= self._updates[-1].sequence:
                self._updates.clear()
            self._updates.append(update)

    def after(self, sequence: int, limit: int) -> tuple[list[NumberedUpdate], int]:
        """Return what follows a number.

        Parameters
        ----------
        sequence : int
            Last number that the asker has; 0 for none.
        limit : int
            Most updates to return.

        Returns
        -------
        updates : list of NumberedUpdate
            By ascending number.
        lost : int
            Updates after `sequence` that are not kept any more.
        """
        with self._lock:
            if not self._updates:
                return [], 0
            oldest = self._updates[0].sequence
            start = bisect_left(self._updates, sequence + 1, key=lambda one: one.sequence)
            found = list(islice(self._updates, start, start + limit))
        return found, max(oldest - sequence - 1, 0)
