"""Compiled formatting of numbers for `new4` and `plt`, which have the reference forms."""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop, loop

Bytes = NDArray[np.uint8]
Words = NDArray[np.int64]
#: Rows of time (s), latitude, longitude (degrees), height (m, NaN: none) and further columns.
Points = NDArray[np.float64]


_TAB, _LF, _CR, _BLANK, _COMMA, _MINUS, _POINT, _ZERO, _COLON = 9, 10, 13, 32, 44, 45, 46, 48, 58
_TEN = np.uint64(10)
_SIXTY = np.uint64(60)
_MONTHS = np.frombuffer(b"JanFebMarAprMayJunJulAugSepOctNovDec", dtype=np.uint8)
_DAY_S = 86_400
#: Days from 1899-12-30 to 1970-01-01.
_EPOCH_DAYS = 25_569
_METRES_A_FOOT = 0.3048
_NO_HEIGHT_FT = -777.0


@in_loop
def _put_digits(out: Bytes, i: int, value: np.uint64, count: int) -> int:
    """Write the last `count` digits of a number (uint64 has the fastest division by ten)."""
    for k in range(count):
        rest = value // _TEN
        out[i + count - 1 - k] = np.uint8(_ZERO + np.int64(value - rest * _TEN))
        value = rest
    return i + count


@in_loop
def _put_integer(out: Bytes, i: int, value: np.uint64) -> int:
    """Write a number (uint64) without leading zeros."""
    count = 1
    power = _TEN
    while value >= power and count < 19:
        count += 1
        power *= _TEN
    return _put_digits(out, i, value, count)


@in_loop
def _scaled(value: float, factor: float) -> tuple[bool, np.uint64]:
    """Return whether a number is negative, and its magnitude times a factor, as uint64."""
    scaled = np.rint(value * factor)
    return scaled < 0.0, np.uint64(np.int64(abs(scaled)))


@in_loop
def _put_trimmed(
    out: Bytes, i: int, value: float, factor: float, decimals_max: int, decimals_min: int
) -> int:
    """Write a number without trailing zeros, with decimals between two bounds."""
    negative, scaled = _scaled(value, factor)
    if negative:
        out[i] = _MINUS
        i += 1
    whole = np.uint64(np.int64(abs(value)))
    rest = scaled - whole * np.uint64(factor)
    if rest == np.uint64(factor):
        whole += np.uint64(1)
        rest = np.uint64(0)
    i = _put_integer(out, i, whole)
    out[i] = _POINT
    i = _put_digits(out, i + 1, rest, decimals_max)
    for _ in range(decimals_max - decimals_min):
        if out[i - 1] != _ZERO:
            break
        i -= 1
    return i


@in_loop
def _put_padded(out: Bytes, i: int, value: float, factor: float, decimals: int, width: int) -> int:
    """Write a number with fixed decimals, padded with blanks on the left."""
    negative, scaled = _scaled(value, factor)
    whole = np.uint64(np.int64(abs(value)))
    rest = scaled - whole * np.uint64(factor)
    if rest == np.uint64(factor):
        whole += np.uint64(1)
        rest = np.uint64(0)
    length = decimals + 2 + (1 if negative else 0)
    power = _TEN
    while whole >= power and length < 30:
        length += 1
        power *= _TEN
    while length < width:
        out[i] = _BLANK
        i += 1
        length += 1
    if negative:
        out[i] = _MINUS
        i += 1
    i = _put_integer(out, i, whole)
    out[i] = _POINT
    return _put_digits(out, i + 1, rest, decimals)


@in_loop
def _put_date(out: Bytes, i: int, days: np.int64) -> int:
    """Write days since 1970-01-01 as 01-Aug-18 (Hinnant's civil calendar)."""
    z = days + 719_468
    era = z // 146_097
    day_of_era = z - era * 146_097
    year_of_era = (
        day_of_era - day_of_era // 1460 + day_of_era // 36_524 - day_of_era // 146_096
    ) // 365
    day_of_year = day_of_era - (365 * year_of_era + year_of_era // 4 - year_of_era // 100)
    shifted = (5 * day_of_year + 2) // 153
    day = day_of_year - (153 * shifted + 2) // 5 + 1
    month = shifted + 3 if shifted < 10 else shifted - 9
    year = year_of_era + era * 400 + (1 if month <= 2 else 0)
    i = _put_digits(out, i, np.uint64(day), 2)
    out[i] = _MINUS
    for k in range(3):
        out[i + 1 + k] = _MONTHS[3 * (month - 1) + k]
    out[i + 4] = _MINUS
    return _put_digits(out, i + 5, np.uint64(year % 100), 2)


@loop
def new4_lines(points: Points, out: Bytes) -> int:
    """Write `.new4` lines; return the number of bytes (see `new4.format_lines`)."""
    i = 0
    for k in range(len(points)):
        i = _put_trimmed(out, i, points[k, 0], 1e6, 6, 3)
        out[i] = _TAB
        i = _put_trimmed(out, i + 1, points[k, 1], 1e9, 9, 7)
        out[i] = _TAB
        i = _put_trimmed(out, i + 1, points[k, 2], 1e9, 9, 7)
        out[i] = _TAB
        i += 1
        if not np.isnan(points[k, 3]):
            i = _put_trimmed(out, i, points[k, 3], 1e3, 3, 1)
        out[i] = _LF
        i += 1
    return i


@loop
def plt_lines(
    points: Points, unix_start_s: float, before_s: float, gap_s: float, out: Bytes
) -> int:
    """Write `.plt` point lines; return the number of bytes (see `plt.format_points`)."""
    i = 0
    day_begin = np.int64(0)
    for k in range(len(points)):
        time = points[k, 0] + unix_start_s
        i = _put_padded(out, i, points[k, 1], 1e6, 6, 11)
        out[i] = _COMMA
        i = _put_padded(out, i + 1, points[k, 2], 1e6, 6, 11)
        out[i] = _COMMA
        # A comparison with NaN, the time before the first point, is false.
        out[i + 1] = _ZERO if time - before_s <= gap_s else _ZERO + 1
        out[i + 2] = _COMMA
        before_s = time
        feet = _NO_HEIGHT_FT
        if not np.isnan(points[k, 3]):
            feet = points[k, 3] / _METRES_A_FOOT
        i = _put_padded(out, i + 3, feet, 10.0, 1, 7)
        out[i] = _COMMA
        i = _put_padded(out, i + 1, time / _DAY_S + _EPOCH_DAYS, 1e7, 7, 0)
        out[i] = _COMMA
        out[i + 1] = _BLANK
        seconds = np.int64(np.floor(time))
        if seconds < day_begin or seconds >= day_begin + _DAY_S:
            day_begin = seconds // _DAY_S * _DAY_S
        i = _put_date(out, i + 2, day_begin // _DAY_S)
        out[i] = _COMMA
        out[i + 1] = _BLANK
        second = np.uint64(seconds - day_begin)
        minute = second // _SIXTY
        hour = minute // _SIXTY
        i = _put_digits(out, i + 2, hour, 2)
        out[i] = _COLON
        i = _put_digits(out, i + 1, minute - hour * _SIXTY, 2)
        out[i] = _COLON
        i = _put_digits(out, i + 1, second - minute * _SIXTY, 2)
        out[i] = _CR
        out[i + 1] = _LF
        i += 2
    return i
