"""The latest update of every live track."""

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import NONE
from multiradar.estimation.measurement.kinds import KIND_POSITION
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.memory.history import UPDATE_DTYPE
from multiradar.state import Fields
from multiradar.tracking.outputs import SPREAD_COUNT, STATE_COASTING, STATE_CONFIRMED


def ages_and_states(
    rows: NDArray[np.void], time_s: float, coast_after_s: float
) -> tuple[NDArray[np.float64], NDArray[np.int8]]:
    """Return the ages of updates at a data time, and the states of their tracks.

    Parameters
    ----------
    rows : (n,) ndarray of `UPDATE_DTYPE`
        Last updates of tracks.
    time_s : float
        The data time, s.
    coast_after_s : float
        Age from which a confirmed track is coasting, s.

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


#: Sources of updates: ADS-B, multilateration, and radars with direction finders.
BY_ADSB, BY_MLAT, BY_RADAR = range(3)
_SOURCES = 3


def sources_of(sensors: SensorTable) -> NDArray[np.int8]:
    """Return the source of the updates by each sensor."""
    position = np.where(sensors.self_reported, BY_ADSB, BY_MLAT)
    return np.where(sensors.kinds == KIND_POSITION, position, BY_RADAR).astype(np.int8)


class LiveTracks:
    """The latest update of every live track, in arrays updated in place by one owner.

    Parameters
    ----------
    sources : (s,) int8, optional
        Source of the updates by each sensor, as from `sources_of`.
    """

    STATE: ClassVar[Fields] = {
        "_rows": np.ndarray,
        "_updates": np.ndarray,
        "_heard_s": np.ndarray,
        "_spread": np.ndarray,
        "_free": list[int],
        "_slot": np.ndarray,
        "_count": int,
    }

    def __init__(self, sources: NDArray[np.int8] | None = None) -> None:
        #: Source of the updates by each sensor.
        self.sources = sources
        self._rows = np.zeros(64, UPDATE_DTYPE)
        # Number of updates, and time of the last one by each source.
        self._updates = np.zeros(64, np.int64)
        self._heard_s = np.full((64, _SOURCES), -np.inf)
        self._spread = np.full((64, SPREAD_COUNT), np.nan)
        self._free: list[int] = list(range(63, -1, -1))
        # Slot of each live track, by track identifier.
        self._slot = np.full(1024, NONE, np.int32)
        self._count = 0

    def __len__(self) -> int:
        return self._count

    @property
    def capacity(self) -> int:
        """Present number of slots; grows as needed."""
        return len(self._rows)

    def slots(self, tracks: NDArray[np.int64]) -> NDArray[np.int32]:
        """Return the slot of each track, below the capacity, -1 for those not live."""
        known = (tracks > 0) & (tracks < len(self._slot))
        found = np.full(len(tracks), NONE, np.int32)
        found[known] = self._slot[tracks[known]]
        return found

    def update(self, rows: NDArray[np.void], spread: NDArray[np.float64] | None = None) -> None:
        """Set the last row of each track, and its position with covariance.

        Parameters
        ----------
        rows : (n,) ndarray of `UPDATE_DTYPE`
            Updates in order.
        spread : (n, 5) ndarray, optional
            `EngineOutput.spread` of the updates.
        """
        if not len(rows):
            return
        # The first of each in reversed order is the last by arrival.
        tracks, backwards = np.unique(rows["track_id"][::-1], return_index=True)
        self._grow(int(tracks[-1]))
        for track in tracks[self._slot[tracks] == NONE]:
            self._slot[track] = self._allocate()
        last = len(rows) - 1 - backwards
        self._rows[self._slot[tracks]] = rows[last]
        if spread is not None and len(spread) == len(rows):
            self._spread[self._slot[tracks]] = spread[last]
        slots = self._slot[rows["track_id"]]
        np.add.at(self._updates, slots, 1)
        if self.sources is not None:
            source = self.sources[rows["sensor"]]
            np.maximum.at(self._heard_s, (slots, source), rows["time_s"])

    def remove(self, tracks: NDArray[np.int64]) -> None:
        """Remove tracks; those not live are skipped."""
        for track in tracks:
            slot = int(self._slot[track]) if track < len(self._slot) else NONE
            if slot != NONE:
                self._slot[track] = NONE
                self._rows[slot]["track_id"] = 0
                self._free.append(slot)
                self._count -= 1

    def get(self, track_id: int) -> NDArray[np.void] | None:
        """Return the row of a live track, shape (1,), a copy."""
        if not 0 < track_id < len(self._slot) or self._slot[track_id] == NONE:
            return None
        slot = int(self._slot[track_id])
        return self._rows[slot : slot + 1].copy()

    def all(self) -> NDArray[np.void]:
        """Return the rows of all live tracks by ascending identifier, a copy."""
        rows = self._rows[self._rows["track_id"] > 0]
        return rows[np.argsort(rows["track_id"])]

    def heard(self) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
        """Return how the tracks of `all` were updated, in the same order.

        Returns
        -------
        updates : (n,) int64
            Number of updates.
        heard_s : (n, 3) float64
            Time of the last update by each source, -inf for none.
        """
        slots = self._ordered()
        return self._updates[slots], self._heard_s[slots]

    def spread(self) -> NDArray[np.float64]:
        """Return the spread of the last update of the tracks of `all`, NaN for none, (n, 5)."""
        return self._spread[self._ordered()]

    def _ordered(self) -> NDArray[np.intp]:
        slots = np.flatnonzero(self._rows["track_id"] > 0)
        return slots[np.argsort(self._rows["track_id"][slots])]

    def _allocate(self) -> int:
        if not self._free:
            held = len(self._rows)
            self._rows = np.concatenate([self._rows, np.zeros(held, UPDATE_DTYPE)])
            self._updates = np.concatenate([self._updates, np.zeros(held, np.int64)])
            self._heard_s = np.concatenate([self._heard_s, np.full((held, _SOURCES), -np.inf)])
            unknown = np.full((held, SPREAD_COUNT), np.nan)
            self._spread = np.concatenate([self._spread, unknown])
            self._free = list(range(2 * held - 1, held - 1, -1))
        self._count += 1
        slot = self._free.pop()
        self._updates[slot], self._heard_s[slot], self._spread[slot] = 0, -np.inf, np.nan
        return slot

    def _grow(self, track_id: int) -> None:
        if track_id >= len(self._slot):
            grown = np.full(max(track_id + 1, 2 * len(self._slot)), NONE, np.int32)
            grown[: len(self._slot)] = self._slot
            self._slot = grown
