"""Compiled ordering of simultaneous measurements by content."""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop

Indices = NDArray[np.intp]
Floats = NDArray[np.float64]
Longs = NDArray[np.int64]
Integers = NDArray[np.int32]
Bytes = NDArray[np.int8]

# Simultaneous rows above this number are sorted by another algorithm: the time of this one is
# quadratic.
TIED_MAX = 64


@in_loop
def sign_of(more: bool, less: bool) -> int:
    """Return 1, −1, or 0 where neither holds."""
    return (1 if more else 0) - (1 if less else 0)


@in_loop
def sign_of_floats(one: float, other: float) -> int:
    """Return how two numbers compare; NaN comes last and equals NaN."""
    first, second = np.isnan(one), np.isnan(other)
    return sign_of(one > other or (first and not second), one < other or (second and not first))


@in_loop
def compare(
    i: int, j: int, sensor: Integers, track_number: Longs, mode_s_address: Longs, range_m: Floats,
    azimuth_rad: Floats, latitude_rad: Floats, longitude_rad: Floats, height_m: Floats,
    mode_3a: Integers, kind: Bytes, callsign: Longs,
) -> int:  # fmt: skip
    """Return how rows i and j compare in all columns, the most significant first."""
    sign = sign_of(sensor[i] > sensor[j], sensor[i] < sensor[j])
    if sign == 0:
        sign = sign_of(track_number[i] > track_number[j], track_number[i] < track_number[j])
    if sign == 0:
        sign = sign_of(mode_s_address[i] > mode_s_address[j], mode_s_address[i] < mode_s_address[j])
    if sign == 0:
        sign = sign_of_floats(range_m[i], range_m[j])
    if sign == 0:
        sign = sign_of_floats(azimuth_rad[i], azimuth_rad[j])
    if sign == 0:
        sign = sign_of_floats(latitude_rad[i], latitude_rad[j])
    if sign == 0:
        sign = sign_of_floats(longitude_rad[i], longitude_rad[j])
    if sign == 0:
        sign = sign_of_floats(height_m[i], height_m[j])
    if sign == 0:
        sign = sign_of(mode_3a[i] > mode_3a[j], mode_3a[i] < mode_3a[j])
    if sign == 0:
        sign = sign_of(kind[i] > kind[j], kind[i] < kind[j])
    if sign == 0:
        sign = sign_of(callsign[i] > callsign[j], callsign[i] < callsign[j])
    return sign


@loop
def order_tied(
    order: Indices, time_s: Floats, sensor: Integers, track_number: Longs, mode_s_address: Longs,
    range_m: Floats, azimuth_rad: Floats, latitude_rad: Floats, longitude_rad: Floats,
    height_m: Floats, mode_3a: Integers, kind: Bytes, callsign: Longs,
) -> int:  # fmt: skip
    """Sort simultaneous rows by content, in place; ``order`` is the order by time.

    Returns the greatest number of simultaneous rows; groups larger than `TIED_MAX` are left
    unsorted.
    """
    n = order.shape[0]
    most = 0
    first = 0
    while first < n:
        last = first + 1
        while last < n and time_s[order[last]] == time_s[order[first]]:
            last += 1
        most = max(most, last - first)
        if last - first <= TIED_MAX:
            for position in range(first + 1, last):
                row = order[position]
                at = position
                while at > first and compare(
                    order[at - 1], row, sensor, track_number, mode_s_address, range_m, azimuth_rad,
                    latitude_rad, longitude_rad, height_m, mode_3a, kind, callsign,
                ) > 0:  # fmt: skip
                    order[at] = order[at - 1]
                    at -= 1
                order[at] = row
        first = last
    return most


@loop
def find_repeats(
    order: Indices, repeat: NDArray[np.bool_], time_s: Floats, sensor: Integers,
    track_number: Longs, mode_s_address: Longs, range_m: Floats, azimuth_rad: Floats,
    latitude_rad: Floats, longitude_rad: Floats, height_m: Floats, mode_3a: Integers, kind: Bytes,
    callsign: Longs,
) -> int:  # fmt: skip
    """Mark the positions in ``order`` whose row equals the previous one; return how many."""
    count = 0
    for position in range(order.shape[0]):
        repeat[position] = False
        if position > 0 and time_s[order[position]] == time_s[order[position - 1]]:
            repeat[position] = compare(
                order[position - 1], order[position], sensor, track_number, mode_s_address, range_m,
                azimuth_rad, latitude_rad, longitude_rad, height_m, mode_3a, kind, callsign,
            ) == 0  # fmt: skip
        count += repeat[position]
    return count
