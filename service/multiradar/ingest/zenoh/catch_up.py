"""The last track updates by number, for queries of the updates after number n."""

import threading
from bisect import bisect_left
from collections import deque
from dataclasses import dataclass
from itertools import islice


@dataclass(frozen=True, slots=True)
class NumberedUpdate:
    """A published track update.

    Attributes
    ----------
    sequence : int
        Number of the update over all tracks, from 1.
    key : str
        Its key.
    payload : bytes
        JSON.
    """

    sequence: int
    key: str
    payload: bytes


class CatchUp:
    """Ring of the last updates.

    Parameters
    ----------
    samples_max : int
        Capacity.
    """

    def __init__(self, samples_max: int) -> None:
        self._updates: deque[NumberedUpdate] = deque(maxlen=samples_max)
        self._lock = threading.Lock()

    def append(self, update: NumberedUpdate) -> None:
        """Add the newest update; numbers ascend until the journal is replayed."""
        with self._lock:
            if self._updates and update.sequence <= self._updates[-1].sequence:
                self._updates.clear()
            self._updates.append(update)

    def after(
        self, sequence: int, limit: int, key: str | None = None
    ) -> tuple[list[NumberedUpdate], int]:
        """Return the updates after a number.

        Parameters
        ----------
        sequence : int
            Last known number; 0 for none.
        limit : int
            Maximum number of updates to return.
        key : str, optional
            Return only updates with this key; default: those of all tracks.

        Returns
        -------
        updates : list of NumberedUpdate
            By ascending number.
        lost : int
            Number of updates after `sequence` that are no longer retained, of all tracks.
        """
        with self._lock:
            if not self._updates:
                return [], 0
            oldest = self._updates[0].sequence
            start = bisect_left(self._updates, sequence + 1, key=lambda one: one.sequence)
            end = start + limit if key is None else None
            found = list(islice(self._updates, start, end))
        if key is not None:
            found = list(islice((one for one in found if one.key == key), limit))
        return found, max(oldest - sequence - 1, 0)
