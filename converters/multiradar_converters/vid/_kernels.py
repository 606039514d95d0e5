"""Compiled operations on records: interning, unwrapping of times, partitioning, plot association.

Between passes, rows are *records*: rows of int64 words, some of which contain the bits of a
float64. Word 0 is always the time.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop

Words = NDArray[np.int64]
Numbers = NDArray[np.float64]
Flags = NDArray[np.bool_]

# Nothing here allocates, see `text._kernels`.

#: Consecutive rows, far in time from the previous rows but near one another, that indicate a gap.
AGREEING_ROWS = 5

_DAY_S = 86_400.0
_HALF_DAY_S = 43_200.0
# Threshold of "far in time", s.
_FAR_S = 3600.0
# Jumps that are reversed within so many rows were errors of the recorder's clock.
_RETURN_ROWS = 1000
# Indices in the state of `mark_outliers`.
_LAST, _RAW, _BEFORE, _SINCE = 2, 3, 4, 5
_HALF = np.uint64(0xFFFF_FFFF)
_SHIFT = np.uint64(32)
_POSITIVE = 2**62 - 1
# Odd constants of xxHash32.
_MIX_LOW, _MIX_HIGH, _MIX_LAST = np.uint64(2654435761), np.uint64(2246822519), np.uint64(3266489917)


@in_loop
def _hash(key: int, salt: int, bits: int) -> np.int64:
    """Hash a key to 2**bits bins; products of 32-bit halves do not overflow."""
    word = np.uint64(key)
    low = (word & _HALF) * _MIX_LOW
    high = (word >> _SHIFT) * _MIX_HIGH + np.uint64(salt)
    mixed = (low & _HALF) ^ (high & _HALF)
    mixed = ((mixed ^ (mixed >> np.uint64(15))) * _MIX_LAST) & _HALF
    mixed = ((mixed ^ (mixed >> np.uint64(13))) * _MIX_LOW) & _HALF
    return np.int64(mixed >> np.uint64(32 - bits))


@loop
def intern(
    keys: Words,
    bits: int,
    table_keys: Words,
    table_numbers: Words,
    known: int,
    known_max: int,
    numbers: Words,
) -> tuple[int, int]:
    """Assign numbers to distinct keys in order of first appearance.

    Parameters
    ----------
    keys : int64[n]
        Keys, not negative.
    bits : int
        The table has 2**bits slots.
    table_keys, table_numbers : int64[2**bits]
        Open-addressing table, updated in place; a free slot has the key -1.
    known : int
        Distinct keys so far.
    known_max : int
        Limit at which to stop.
    numbers : int64[n]
        Filled with the number of each key.

    Returns
    -------
    tuple of int
        Keys processed (fewer than n when `known_max` is reached) and distinct keys.
    """
    places = 1 << bits
    last_key = -1
    last_number = -1
    for k in range(len(keys)):
        key = keys[k]
        if key != last_key:
            place = _hash(key, 0, bits)
            while table_keys[place] != key and table_keys[place] != -1:
                place = (place + 1) & (places - 1)
            if table_keys[place] == -1:
                if known == known_max:
                    return k, known
                table_keys[place] = key
                table_numbers[place] = known
                known += 1
            last_key = key
            last_number = table_numbers[place]
        numbers[k] = last_number
    return len(keys), known


@in_loop
def _nearest(time: float, reference: float, of_day: bool) -> float:
    """Shift a time of day by whole days to the day nearest to a reference.

    A shift by a day back occurs only shortly before the midnight at which the recording began.
    Times that continue past 86 400, and dates, are unchanged.
    """
    if not of_day:
        return time
    days = np.floor((reference - time + _HALF_DAY_S) / _DAY_S)
    if days < 0.0:
        early = _HALF_DAY_S <= time < _DAY_S and reference - (time - _DAY_S) <= _FAR_S
        days = -1.0 if early else 0.0
    return float(time + days * _DAY_S)


@in_loop
def _landing(time: float, state: Numbers, of_day: bool) -> float:
    """Return the time of the first of several consistent rows after a gap in the recording.

    The day advances only if the time of day decreases by more than half a day, and not if times
    soon return to those before the jump.
    """
    current, before = state[_LAST], state[_BEFORE]
    if not of_day or time >= _DAY_S:
        return time
    landed = time + max(0.0, np.floor(current / _DAY_S)) * _DAY_S
    if landed >= current - _HALF_DAY_S:
        return float(landed)
    if state[_SINCE] < _RETURN_ROWS and not np.isnan(before):
        back = _nearest(time, before, of_day)
        if abs(back - before) <= _FAR_S:
            return float(back)
    return float(landed + _DAY_S)


@in_loop
def _accept(state: Numbers, time: float, raw: float) -> None:
    """Update the state with an accepted row."""
    state[0], state[1], state[_LAST] = state[1], state[_LAST], time
    state[_RAW] = raw
    state[_SINCE] += 1.0


@loop
def mark_outliers(times: Numbers, state: Numbers, of_day: bool, kept: Flags) -> tuple[int, int]:
    """Unwrap times of day past midnight, in place and in file order, and mark outliers.

    The reference is the median of the last three accepted rows. A row within an hour of it, or of
    the last row, is accepted. Other rows are pending: once `AGREEING_ROWS` consecutive ones lie
    within an hour of one another, the recording had a gap and they are accepted. Before that, a row
    that agrees with the reference or with neither, but not with the pending rows, rejects these.

    Parameters
    ----------
    times : float64[n]
        Times of the file, s. Changed: accepted rows to times of the recording, rejected rows to the
        file time of the last accepted row before.
    state : float64[6]
        Last three times, s (NaN before the first row), the last file time, the time before the last
        jump (NaN: none), rows since then. Updated.
    of_day : bool
        Whether the times are times of day.
    kept : bool[n]
        Filled: whether a row is accepted.

    Returns
    -------
    tuple of int
        Rows decided, and how many of these were rejected. Fewer than `AGREEING_ROWS` rows after
        them are pending; start the next call with them and the same state.
    """
    begin = 0
    rejected = 0
    chain = 0.0
    for k in range(len(times)):
        time = times[k]
        if np.isnan(state[_LAST]):
            state[0] = state[1] = state[_LAST] = time
        low, high = min(state[0], state[1]), max(state[0], state[1])
        median = max(low, min(high, state[_LAST]))
        near = _nearest(time, median, of_day)
        taken = abs(near - median) <= _FAR_S or abs(near - state[_LAST]) <= _FAR_S
        chained = _nearest(time, chain, of_day)
        if taken or (begin < k and not abs(chained - chain) <= _FAR_S):
            for j in range(begin, k):
                kept[j] = False
                times[j] = state[_RAW]
                rejected += 1
            begin = k
        if taken:
            _accept(state, near, time)
            times[k] = near
            kept[k] = True
            begin = k + 1
            continue
        chain = time if begin == k else chained
        if k + 1 - begin == AGREEING_ROWS:
            chain = times[begin]
            moved = _landing(chain, state, of_day) - chain
            state[_BEFORE] = state[_LAST]
            state[_SINCE] = 0.0
            for j in range(begin, k + 1):
                chain = _nearest(times[j], chain, of_day)
                _accept(state, chain + moved, times[j])
                times[j] = chain + moved
                kept[j] = True
            begin = k + 1
    return begin, rejected


@loop
def count_bins(places: Words, counts: Words) -> None:
    """Add the number of records in each bin to `counts`."""
    for k in range(len(places)):
        counts[places[k]] += 1


@loop
def spread(keys: Words, salt: int, bits: int, places: Words) -> None:
    """Fill `places` with the bin of each key, of 2**bits; the salt changes which keys collide."""
    for k in range(len(keys)):
        places[k] = _hash(keys[k], salt, bits)


@loop
def distribute(records: Words, places: Words, starts: Words, out: Words) -> None:
    """Move each record to the next position of its bin; stable; `starts` is advanced."""
    words = records.shape[1]
    for k in range(len(places)):
        place = places[k]
        target = starts[place]
        starts[place] = target + 1
        for word in range(words):
            out[target, word] = records[k, word]


@loop
def is_sorted(times: Numbers) -> bool:
    """Return whether times are non-decreasing."""
    k = 1
    while k < len(times) and times[k] >= times[k - 1]:
        k += 1
    return k >= len(times)


@loop
def name_plots(
    plot_key: Words,
    plot_sensor: Words,
    plot_time: Numbers,
    reference_key: Words,
    reference_sensor: Words,
    reference_time: Numbers,
    reference_global: Words,
    tolerance_s: float,
    bits: int,
    heads: Words,
    chain: Words,
    best_distance: Numbers,
    best_global: Words,
    matched: Words,
) -> None:
    """Associate every reference of a track with a plot: same key, same sensor if possible, nearest.

    Parameters
    ----------
    plot_key, plot_sensor : int64[n]
        Source and plot number as one key; number of the sensor.
    plot_time : float64[n]
        Times, s, non-decreasing.
    reference_key, reference_sensor, reference_time, reference_global : [m]
        The same for the track rows, and their aircraft.
    tolerance_s : float
        Maximum time difference, s.
    bits, heads, chain : int, int64[2**bits], int64[n]
        Scratch for the hash table.
    best_distance, best_global : float64[n], int64[n]
        Updated in place: the aircraft whose row is nearest in time to each plot.
    matched : int64[m]
        Filled with the plot of each reference, -1 for none.
    """
    slot_s = 2.0 * tolerance_s
    heads[:] = -1
    for k in range(len(plot_key) - 1, -1, -1):
        slot = int(np.floor(plot_time[k] / slot_s))
        place = _hash((plot_key[k] * 31 + slot) & _POSITIVE, 0, bits)
        chain[k] = heads[place]
        heads[place] = k
    for r in range(len(reference_key)):
        key = reference_key[r]
        time = reference_time[r]
        first = int(np.floor((time - tolerance_s) / slot_s))
        last = int(np.floor((time + tolerance_s) / slot_s))
        best = -1
        distance = tolerance_s
        same_sensor = False
        for slot in range(first, last + 1):
            k = heads[_hash((key * 31 + slot) & _POSITIVE, 0, bits)]
            while k >= 0:
                if plot_key[k] == key:
                    away = abs(plot_time[k] - time)
                    same = plot_sensor[k] == reference_sensor[r]
                    if away <= tolerance_s and (
                        best < 0
                        or (same and not same_sensor)
                        or (
                            same == same_sensor
                            and (away < distance or (away == distance and k < best))
                        )
                    ):
                        best = k
                        distance = away
                        same_sensor = same
                k = chain[k]
        matched[r] = best
        if best >= 0 and distance < best_distance[best]:
            best_distance[best] = distance
            best_global[best] = reference_global[r]
