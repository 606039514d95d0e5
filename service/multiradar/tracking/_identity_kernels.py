"""Compiled look-up of aircraft by identity, and conversion of readouts into track updates.

The look-up tables are open hash tables with linear probing: ``keys`` (−1 = free) and ``values``,
whose length is a power of two. They are at most a quarter full.
"""

from math import atan2, hypot, sqrt

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import NO_ROOM_SLOT
from multiradar.estimation.filters.arrays import Aircraft
from multiradar.estimation.filters.height._height_kernels import reset_height
from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION
from multiradar.geodesy._kernels import geodetic_to_plane, local_matrix, plane_to_geodetic
from multiradar.tracking.lifecycle.lifecycle import BY_IDENTITY, TENTATIVE, Lifecycle
from multiradar.tracking.roster import (
    MISSING,
    NEW_TRACK,
    OTHER_AZIMUTH,
    TWIN,
    NewTracks,
    Roster,
    RowIdentities,
)
from multiradar_compiled.kernels import in_loop, kernel, loop

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@in_loop
def find_bucket(keys: Integers, key: int) -> int:
    """Return the slot of a key, or the free slot where it would be inserted."""
    mask: int = keys.shape[0] - 1
    # Multiplicative hashing (Knuth): the high bits of a product with an odd constant.
    bucket = ((key * 2654435761) >> 8) & mask
    while keys[bucket] != MISSING and keys[bucket] != key:
        bucket = (bucket + 1) & mask
    return bucket


@in_loop
def look_up(keys: Integers, values: Integers, key: int) -> int:
    """Return the value of a key, −1 where there is none."""
    if key < 0:
        return MISSING
    bucket = find_bucket(keys, key)
    return values[bucket] if keys[bucket] == key else MISSING


@kernel
def insert(keys: Integers, values: Integers, key: int, value: int) -> None:
    """Set the value of a key."""
    bucket = find_bucket(keys, key)
    keys[bucket] = key
    values[bucket] = value


@kernel
def rebuild(roster: Roster) -> None:
    """Rebuild both tables from the aircraft in use; of several with one address, the first."""
    roster.number_keys[:] = MISSING
    roster.address_keys[:] = MISSING
    for slot in range(roster.track_id.shape[0]):
        if roster.track_id[slot] == MISSING:
            continue
        if roster.track_number[slot] >= 0:
            insert(roster.number_keys, roster.number_slots, roster.track_number[slot], slot)
        address = roster.mode_s_address[slot]
        if address >= 0:
            other = look_up(roster.address_keys, roster.address_slots, address)
            if other < 0 or roster.track_id[slot] < roster.track_id[other]:
                insert(roster.address_keys, roster.address_slots, address, slot)


@in_loop
def differ(one: int, other: int) -> bool:
    """Return whether two identities are both known and different."""
    return one >= 0 and other >= 0 and one != other


@in_loop
def find_by_identity(number: int, address: int, roster: Roster) -> int:
    """Return the slot of the aircraft with a track number or Mode S address, −1 for none.

    It is never an aircraft with another address.
    """
    slot = look_up(roster.number_keys, roster.number_slots, number)
    if slot >= 0 and differ(roster.mode_s_address[slot], address):
        slot = MISSING
    if slot < 0:
        slot = look_up(roster.address_keys, roster.address_slots, address)
        # An address already known under another track number belongs to another aircraft.
        if slot >= 0 and differ(roster.track_number[slot], number):
            slot = MISSING
    return slot


@loop
def identify(
    first: int,
    last: int,
    track_numbers: Integers,
    addresses: Integers,
    roster: Roster,
    identities: RowIdentities,
) -> int:
    """Find the aircraft of rows by identity; return the number of rows without one."""
    unknown = 0
    for row in range(first, last):
        slot = find_by_identity(track_numbers[row], addresses[row], roster)
        identities.slot[row] = slot
        unknown += slot < 0
    return unknown


@kernel
def assign(
    first: int,
    last: int,
    full: bool,
    track_numbers: Integers,
    addresses: Integers,
    codes: Integers,
    callsigns: Integers,
    kinds: NDArray[np.int8],
    sensors: NDArray[np.int32],
    roster: Roster,
    new_tracks: NewTracks,
    aircraft: Aircraft,
    life: Lifecycle,
    identities: RowIdentities,
) -> int:
    """Find or create the aircraft of rows first…last; return the row that needs a slot, or last.

    A row with a slot keeps it, unless the aircraft has another Mode S address: nothing updates a
    track with the address of another aircraft. `NEW_TRACK` always creates an aircraft. A value
    below `TWIN` refers to the aircraft of an earlier row. A row without identity gets none. A
    bearing gives no position and creates none, nor does a row of a second azimuth. When the pool is
    ``full``, or its sensor has initiated as many tentative tracks as it may, rows that need a slot
    get `NO_ROOM_SLOT`.

    ``roster.counters`` holds the last track identifier assigned and the number of free slots; free
    slots are used from the end of ``roster.free``.
    """
    for row in range(first, last):
        number = track_numbers[row]
        address = addresses[row]
        slot = identities.slot[row]
        if slot == OTHER_AZIMUTH:
            continue
        if slot < TWIN:
            slot = identities.slot[row - (TWIN - slot)]
        if slot >= 0 and differ(roster.mode_s_address[slot], address):
            slot = MISSING
        anonymous = slot == NEW_TRACK
        if slot < 0 and not anonymous:
            slot = find_by_identity(number, address, roster)
        if slot < 0 and kinds[row] == KIND_BEARING:
            identities.slot[row] = MISSING
            continue
        created = slot < 0
        if slot < 0 and (number >= 0 or address >= 0 or anonymous):
            s = sensors[row]
            if new_tracks.initiated[s] >= new_tracks.most[s]:
                identities.slot[row] = NO_ROOM_SLOT
                continue
            if roster.counters[1] == 0:
                if not full:
                    return row
                identities.slot[row] = NO_ROOM_SLOT
                continue
            new_tracks.initiated[s] += 1
            roster.counters[1] -= 1
            slot = roster.free[roster.counters[1]]
            roster.counters[0] += 1
            new_tracks.sensor[slot] = s
            roster.track_id[slot] = roster.counters[0]
            roster.track_number[slot] = MISSING
            roster.mode_s_address[slot] = MISSING
            roster.mode_3a[slot] = MISSING
            roster.callsign[slot] = MISSING
            aircraft.time[slot] = np.nan
            reset_height(slot, aircraft.height, aircraft.vertical)
            aircraft.rejections[slot] = 0
            aircraft.updates[slot] = 0
            aircraft.updated[slot] = np.nan
            aircraft.measured_from[slot] = MISSING
            aircraft.on_ground[slot] = MISSING
            aircraft.velocity[slot] = np.nan
            reset_lifecycle(slot, TENTATIVE if anonymous else BY_IDENTITY, life)
        identities.slot[row] = slot
        if slot < 0:
            continue
        # The number of a track with another address passes to this one with its second measurement:
        # a single one may have a garbled address.
        held = created and look_up(roster.number_keys, roster.number_slots, number) >= 0
        if number >= 0 and roster.track_number[slot] < 0 and not held:
            roster.track_number[slot] = number
            insert(roster.number_keys, roster.number_slots, number, slot)
        if address >= 0 and roster.mode_s_address[slot] < 0:
            update_address(slot, address, created or number >= 0, roster, life)
        if codes[row] >= 0:
            update_code(slot, codes[row], roster, life)
        if callsigns[row] >= 0:
            roster.callsign[slot] = callsigns[row]
        identities.track_id[row] = roster.track_id[slot]
        identities.track_number[row] = roster.track_number[slot]
        identities.mode_s_address[row] = roster.mode_s_address[slot]
        identities.mode_3a[row] = roster.mode_3a[slot]
        identities.callsign[row] = roster.callsign[slot]
    return last


@kernel
def reset_lifecycle(slot: int, stage: int, life: Lifecycle) -> None:
    """Reset the lifecycle of the track in a slot."""
    life.stage[slot] = stage
    life.hits[slot] = 0
    life.hits_needed[slot] = 0
    life.score[slot] = 0.0
    life.born[slot] = np.nan
    life.period[slot] = 0.0
    life.last_seen[slot] = -np.inf
    life.pending_code[slot] = MISSING
    life.pending_address[slot] = MISSING
    life.bias_excluded[slot] = stage == TENTATIVE
    life.partner[slot] = MISSING
    life.meetings[slot] = 0


@kernel
def update_address(slot: int, address: int, sure: bool, roster: Roster, life: Lifecycle) -> None:
    """Set the Mode S address of a track without one: if not sure, when received twice in a row.

    It never changes. A garbled one would separate the track from all further plots. Where two
    aircraft send one address, it names the first; plots far from that are associated by position.
    """
    if sure or address == life.pending_address[slot]:
        roster.mode_s_address[slot] = address
        if look_up(roster.address_keys, roster.address_slots, address) < 0:
            insert(roster.address_keys, roster.address_slots, address, slot)
        life.pending_address[slot] = MISSING
    else:
        life.pending_address[slot] = address


@kernel
def update_code(slot: int, code: int, roster: Roster, life: Lifecycle) -> None:
    """Update the Mode 3/A code: by identity at once, else when received twice in a row."""
    known = roster.mode_3a[slot]
    if known < 0 or life.stage[slot] == BY_IDENTITY or code == life.pending_code[slot]:
        roster.mode_3a[slot] = code
        life.pending_code[slot] = MISSING
    else:
        life.pending_code[slot] = MISSING if code == known else code


@kernel
def observe(
    kinds: Integers,
    ranges: Floats,
    azimuths: Floats,
    latitudes: Floats,
    longitudes: Floats,
    plane: Floats,
    z: Floats,
) -> None:
    """Fill z: range and azimuth of a plot, east and north of a position report.

    A bearing has 0 in place of the range: see `measurement._kernels`.
    """
    for row in range(kinds.shape[0]):
        if kinds[row] == KIND_POSITION:
            z[row, 0], z[row, 1] = geodetic_to_plane(plane, latitudes[row], longitudes[row])
        else:
            z[row, 0] = 0.0 if kinds[row] == KIND_BEARING else ranges[row]
            z[row, 1] = azimuths[row]


@kernel
def describe(rows: Integers, readouts: Floats, plane: Floats, described: Floats) -> None:
    """Convert readouts into latitude, longitude, speed, heading and both sigmas (columns)."""
    for i in range(rows.shape[0]):
        out = readouts[rows[i]]
        latitude, longitude = plane_to_geodetic(plane, out[0], out[1])
        height = 0.0 if np.isnan(out[8]) else out[8]
        e_e, e_n, n_e, n_n = local_matrix(plane, out[0], out[1], height)
        east = e_e * out[2] + e_n * out[3]
        north = n_e * out[2] + n_n * out[3]
        v_east = e_e * e_e * out[4] + 2.0 * e_e * e_n * out[5] + e_n * e_n * out[6]
        v_north = n_e * n_e * out[4] + 2.0 * n_e * n_n * out[5] + n_n * n_n * out[6]
        described[i, 0] = latitude
        described[i, 1] = longitude
        described[i, 2] = hypot(east, north)
        described[i, 3] = atan2(east, north)
        described[i, 4] = sqrt(v_east + v_north)
        described[i, 5] = sqrt(out[7])
