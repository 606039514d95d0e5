"""Identities of aircraft by slot, and hash tables from identity to slot.

Named tuples of arrays, as compiled functions require; one owner modifies them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Integers = NDArray[np.int64]

#: In place of an identity, a code or a track that a row or a slot does not have.
MISSING = -1
#: In `RowIdentities.slot`: the row initiates a new track, whatever its identity.
NEW_TRACK = -3
#: The row is of a second azimuth in a revolution of its radar, and updates nothing.
OTHER_AZIMUTH = -5
#: The row belongs to the track initiated by an earlier row: `TWIN` minus the distance in rows.
TWIN = -16


class Roster(NamedTuple):
    """Identities of the aircraft of a pool.

    Attributes
    ----------
    track_id : (s,) int64
        Identifier of the track in each slot, −1 for a free slot.
    track_number, mode_s_address, mode_3a, callsign : (s,) int64
        Identity, −1 where unknown.
    free : (s,) int64
        Free slots; the last one is used next.
    counters : (2,) int64
        Last track identifier assigned, and number of free slots.
    number_keys, number_slots, address_keys, address_slots : (t,) int64
        Hash tables from track number and Mode S address to slot.
    """

    track_id: Integers
    track_number: Integers
    mode_s_address: Integers
    mode_3a: Integers
    callsign: Integers
    free: Integers
    counters: Integers
    number_keys: Integers
    number_slots: Integers
    address_keys: Integers
    address_slots: Integers

    @classmethod
    def empty(cls, capacity: int) -> "Roster":
        """Return a roster of free slots; ``capacity`` is a power of two."""
        # Four entries per slot: the tables stay at most a quarter full.
        table = 4 * capacity
        return cls(
            track_id=np.full(capacity, MISSING, np.int64),
            track_number=np.full(capacity, MISSING, np.int64),
            mode_s_address=np.full(capacity, MISSING, np.int64),
            mode_3a=np.full(capacity, MISSING, np.int64),
            callsign=np.full(capacity, MISSING, np.int64),
            free=np.arange(capacity - 1, -1, -1, dtype=np.int64),
            counters=np.array([0, capacity], np.int64),
            number_keys=np.full(table, MISSING, np.int64),
            number_slots=np.full(table, MISSING, np.int64),
            address_keys=np.full(table, MISSING, np.int64),
            address_slots=np.full(table, MISSING, np.int64),
        )


class NewTracks(NamedTuple):
    """Tentative tracks by the sensor that initiated them.

    Attributes
    ----------
    sensor : (s,) int64
        Sensor that initiated the track in each slot, −1 for a free slot and for tracks that do not
        count any more.
    initiated, most : (m,) int64
        Tracks that count, of each sensor, and their greatest number.
    """

    sensor: Integers
    initiated: Integers
    most: Integers

    @classmethod
    def empty(cls, capacity: int, most: Integers) -> "NewTracks":
        """Return no tracks."""
        return cls(np.full(capacity, MISSING, np.int64), np.zeros_like(most), most)

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """Sensors that may initiate no more tracks, (m,)."""
        return self.initiated >= self.most


class ReportedIdentities(NamedTuple):
    """Identities contained in the measurements of a batch, −1 for none.

    Attributes
    ----------
    track_number, mode_s_address, mode_3a : (n,) int64
        As received.
    """

    track_number: Integers
    mode_s_address: Integers
    mode_3a: Integers


class RowIdentities(NamedTuple):
    """Aircraft and identity of each row of a batch, −1 for none.

    Attributes
    ----------
    slot, track_id, track_number, mode_s_address, mode_3a, callsign : (n,) int64
        As known when the row is processed.
    """

    slot: Integers
    track_id: Integers
    track_number: Integers
    mode_s_address: Integers
    mode_3a: Integers
    callsign: Integers

    @classmethod
    def empty(cls, length: int) -> "RowIdentities":
        """Return rows without aircraft."""
        return cls(*(np.full(length, MISSING, np.int64) for _ in cls._fields))
