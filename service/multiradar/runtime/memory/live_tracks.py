"""The latest update of every live track."""

import numpy as np
from numpy.typing import NDArray

from multiradar.runtime.memory.history import UPDATE_DTYPE
from multiradar.tracking.outputs import STATE_COASTING, STATE_CONFIRMED

_NONE = -1


def ages_and_states(
    rows: NDArray[np.void], time_s: float, coast_after_s: float
) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """Return how old updates are at a data time, and the states of their tracks then.

    Parameters
    ----------
    rows : (n,) ndarray of `UPDATE_DTYPE`
        Last updates of tracks.
    time_s : float
        The data time, s.
    coast_after_s : float
        A confirmed track that is older coasts, s.

    Returns
    -------
    age_s : (n,) float64
        Ages, not negative.
    state : (n,) int8
        Index into `STATE_NAMES`.
    """
    age_s = np.maximum(time_s - rows["time_s"], 0.0)
    coasting = (age_s > coast_after_s) & (rows["state"] == STATE_CONFIRMED)
    return age_s, np.where(coasting, STATE_COASTING, rows["state"]).astype(np.int8)


class LiveTracks:
    """The latest update of every live track, in arrays that are changed in place by one owner."""

    def __init__(self) -> None:
        self._rows = np.zeros(64, UPDATE_DTYPE)
        self._free: list[int] = list(range(63, -1, -1))
        # Place of each live track, by track identifier.
        self._place = np.full(1024, _NONE, np.int32)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def capacity(self) -> int:
        """Places that there are now; more when they are needed."""
        return len(self._rows)

    def places(self, tracks: NDArray[np.int64]) -> NDArray[np.int32]:
        """Return the place of each track, a number below the capacity, -1 for those not live."""
        known = (tracks > 0) & (tracks < len(self._place))
        found = np.full(len(tracks), _NONE, np.int32)
        found[known] = self._place[tracks[known]]
        return found

    def update(self, rows: NDArray[np.void]) -> None:
        """Keep the last of the rows of each track."""
        if not len(rows):
            return
        # The first of each in the reversed order is the last in the order of arrival.
        tracks, backwards = np.unique(rows["track_id"][::-1], return_index=True)
        self._make_room(int(tracks[-1]))
        for track in tracks[self._place[tracks] == _NONE]:
            self._place[track] = self._take_place()
        self._rows[self._place[tracks]] = rows[len(rows) - 1 - backwards]

    def end(self, tracks: NDArray[np.int64]) -> None:
        """Forget tracks; those that are not live are passed over."""
        for track in tracks:
            place = int(self._place[track]) if track < len(self._place) else _NONE
            if place != _NONE:
                self._place[track] = _NONE
                self._rows[place]["track_id"] = 0
                self._free.append(place)
                self._count -= 1

    def get(self, track_id: int) -> NDArray[np.void] | None:
        """Return the row of a live track, shape (1,), a copy."""
        if not 0 < track_id < len(self._place) or self._place[track_id] == _NONE:
            return None
        place = int(self._place[track_id])
        return self._rows[place : place + 1].copy()

    def all(self) -> NDArray[np.void]:
        """Return the rows of all live tracks by ascending identifier, a copy."""
        rows = self._rows[self._rows["track_id"] > 0]
        return rows[np.argsort(rows["track_id"])]

    def _take_place(self) -> int:
        if not self._free:
            held = len(self._rows)
            self._rows = np.concatenate([self._rows, np.zeros(held, UPDATE_DTYPE)])
            self._free = list(range(2 * held - 1, held - 1, -1))
        self._count += 1
        return self._free.pop()

    def _make_room(self, track_id: int) -> None:
        if track_id >= len(self._place):
            grown = np.full(max(track_id + 1, 2 * len(self._place)), _NONE, np.int32)
            grown[: len(self._place)] = self._place
            self._place = grown
