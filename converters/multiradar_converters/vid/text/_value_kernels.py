"""Compiled reading of one value of a dump line: numbers, times, codes and addresses.

The text ends with a line end, where every search stops.
"""

import numpy as np

from multiradar_compiled.kernels import in_loop
from multiradar_converters.vid.text.arrays import Bytes, Limits, Numbers, Words

_PLUS, _MINUS, _POINT, _COLON, _T, _Z = 43, 45, 46, 58, 84, 90
# Roles of `vid.fields`; the other integers are unsigned.
TIME, HEIGHT, FIRST_INTEGER, CODE, ADDRESS = 0, 3, 6, 10, 11
_INTEGER_MAX = 2**31 - 1
# Limit up to which integers and powers of ten are exact in float64, so their quotient is rounded
# once.
_EXACT_MAX = 2**53
_DECIMALS_MAX = 22
POWERS = 10.0 ** np.arange(_DECIMALS_MAX + 1)


@in_loop
def read_decimal(text: Bytes, i: int) -> tuple[float, int, int]:
    """Return value, decimals (-1 without a point) and position after it, -1 on failure."""
    c = int(text[i])
    negative = c == _MINUS
    if negative or c == _PLUS:
        i += 1
    mantissa = 0
    digits = 0
    point = -1
    while True:
        c = int(text[i])
        digit = c - 48
        if 0 <= digit <= 9:
            mantissa = mantissa * 10 + digit
            digits += 1
        elif c == _POINT and point < 0:
            point = digits
        else:
            break
        i += 1
    if digits == 0 or digits > 18 or mantissa > _EXACT_MAX:
        return 0.0, i, -1
    value = float(mantissa)
    if point >= 0:
        value = value / POWERS[digits - point]
    if negative:
        value = -value
    return value, i, i


@in_loop
def read_digits(text: Bytes, i: int, count: int) -> int:
    """Return the number of exactly `count` digits, -1 if they are not digits."""
    value = 0
    for k in range(count):
        digit = int(text[i + k]) - 48
        if digit < 0 or digit > 9:
            return -1
        value = value * 10 + digit
    return value


@in_loop
def days_from_civil(year: int, month: int, day: int) -> int:
    """Days since 1970-01-01 of a Gregorian date (Hinnant's algorithm)."""
    if month <= 2:
        year -= 1
        month += 12
    era = year // 400
    year_of_era = year - era * 400
    day_of_year = (153 * (month - 3) + 2) // 5 + day - 1
    return (
        era * 146097
        + year_of_era * 365
        + year_of_era // 4
        - year_of_era // 100
        + day_of_year
        - 719468
    )


@in_loop
def read_date_time(text: Bytes, i: int, stop: int) -> tuple[float, int]:
    """Read YYYY-MM-DDThh:mm:ss[.f], at most six decimals, with any character for the T.

    Returns seconds since 1970-01-01 and the position after it, -1 on failure.
    """
    if i + 19 > stop or int(text[i + 4]) != _MINUS or int(text[i + 7]) != _MINUS:
        return 0.0, -1
    if int(text[i + 13]) != _COLON or int(text[i + 16]) != _COLON:
        return 0.0, -1
    year, month, day = (
        read_digits(text, i, 4),
        read_digits(text, i + 5, 2),
        read_digits(text, i + 8, 2),
    )
    hour, minute = read_digits(text, i + 11, 2), read_digits(text, i + 14, 2)
    second = read_digits(text, i + 17, 2)
    # Days 29 to 31 are left to the reference form unless every month has them.
    if year < 0 or month < 1 or month > 12 or day < 1 or day > 30 or (day > 28 and month == 2):
        return 0.0, -1
    if hour < 0 or hour > 23 or minute < 0 or minute > 59 or second < 0 or second > 59:
        return 0.0, -1
    whole = days_from_civil(year, month, day) * 86400 + hour * 3600 + minute * 60 + second
    i += 19
    decimals = 0
    if i < stop and int(text[i]) == _POINT:
        i += 1
        while i < stop and 48 <= int(text[i]) <= 57:
            whole = whole * 10 + int(text[i]) - 48
            decimals += 1
            i += 1
            if decimals > 6:
                return 0.0, -1
        if decimals == 0:
            return 0.0, -1
    return float(whole) / POWERS[decimals], i


@in_loop
def read_iso_time(text: Bytes, i: int, stop: int) -> tuple[float, int]:
    """Read YYYY-MM-DDThh:mm:ss[.fff][Z]; other forms are left to the reference form."""
    if i + 20 > stop or int(text[i + 10]) != _T:
        return 0.0, -1
    value, after = read_date_time(text, i, stop)
    if after >= 0 and int(text[after]) == _Z:
        after += 1
    return value, after


@in_loop
def read_code(text: Bytes, i: int) -> tuple[int, int]:
    """Return four octal digits as a number and the position after them, -1 on failure."""
    value = 0
    for k in range(4):
        digit = int(text[i + k]) - 48
        if digit < 0 or digit > 7:
            return 0, -1
        value = value * 8 + digit
    return value, i + 4


@in_loop
def read_address(text: Bytes, i: int) -> tuple[int, int]:
    """Return six hexadecimal digits as a number and the position after them, -1 on failure."""
    value = 0
    for k in range(6):
        c = int(text[i + k])
        if 48 <= c <= 57:
            digit = c - 48
        elif 97 <= c <= 102:
            digit = c - 87
        elif 65 <= c <= 70:
            digit = c - 55
        else:
            return 0, -1
        value = value * 16 + digit
    return value, i + 6


@in_loop
def read_unsigned(text: Bytes, i: int) -> tuple[int, int]:
    """Return an unsigned integer and the position after it, -1 on failure."""
    begin = i
    value = 0
    while True:
        digit = int(text[i]) - 48
        if digit < 0 or digit > 9:
            break
        value = value * 10 + digit
        i += 1
        if i - begin > 10:
            return 0, -1
    if i == begin or value > _INTEGER_MAX:
        return 0, -1
    return value, i


@in_loop
def read_value(
    text: Bytes,
    i: int,
    stop: int,
    role: int,
    iso: bool,
    limits: Limits,
    numbers: Numbers,
    integers: Words,
    row: int,
) -> int:
    """Read a value into its array; return the position after it, -1 when it is odd."""
    if role < FIRST_INTEGER:
        if role == TIME and iso:
            number, after = read_iso_time(text, i, stop)
        else:
            number, _, after = read_decimal(text, i)
        if after < 0:
            return -1
        number = number * limits.scale[role] + 0.0
        if not (limits.low[role] <= number <= limits.high[role]):
            return -1
        numbers[role, row] = number
        return after
    if role == CODE:
        whole, after = read_code(text, i)
    elif role == ADDRESS:
        whole, after = read_address(text, i)
    else:
        whole, after = read_unsigned(text, i)
    if after < 0:
        return -1
    integers[role - FIRST_INTEGER, row] = whole
    return after
