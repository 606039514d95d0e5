"""Compiled reading of decimal numbers, rounded as exactly as Python does.

D. Lemire, *Number parsing at a gigabyte per second*, Software: Practice and Experience 51 (2021),
algorithm 1: the digits times a power of five of 128 bits; the reasons for its cases are there.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar_compiled.kernels import in_loop

Bytes = NDArray[np.uint8]
Words = NDArray[np.uint64]

#: Exponents of the powers of ten in the table: beyond them a number is zero, tiny or infinite.
EXPONENT_MIN, EXPONENT_MAX = -342, 308
# Of these reciprocals, products with digits may be halfway between two numbers.
_SHORT_MIN = -27
_DIGITS_MAX = 19
#: More digits than this are read elsewhere.
_EXPONENT_DIGITS_MAX = 4

_U = np.uint64
_ONE, _HALF, _LOW, _TOP = _U(1), _U(32), _U(0xFFFFFFFF), _U(63)
# Bits of a product beyond those of the result, which decide on its rounding.
_SPARE = _U(0x1FF)
_SHIFT = _U(9)
_FRACTION_BITS = _U(52)
_HIDDEN = _U(1 << 52)
_BIAS, _EXPONENT_END = 1023, 2047
_EXACT = _U(1 << 53)
_EXACT_POWER_MAX = 22
_MINUS, _PLUS, _POINT, _ZERO, _NINE, _E, _CAPITAL_E = 45, 43, 46, 48, 57, 101, 69


def powers_of_five() -> Words:
    """Return the first 128 bits of the powers of five, short reciprocals rounded up.

    Returns
    -------
    (n, 2) uint64
        High and low half, from `EXPONENT_MIN` to `EXPONENT_MAX`.
    """
    found = []
    for exponent in range(EXPONENT_MIN, EXPONENT_MAX + 1):
        power: int = 5 ** abs(exponent)
        if exponent < 0:
            bits = power.bit_length()
            is_short = exponent >= _SHORT_MIN
            power = (1 << (bits + 127 if is_short else 2 * bits + 128)) // power + 1
        shift = power.bit_length() - 128
        power = power >> shift if shift > 0 else power << -shift
        found.append((power >> 64, power & (1 << 64) - 1))
    return np.array(found, np.uint64)


@in_loop
def _is_digit(text: Bytes, i: int, stop: int) -> bool:
    return i < stop and _ZERO <= int(text[i]) <= _NINE


@in_loop
def scan_number(text: Bytes, i: int, stop: int) -> tuple[int, bool, np.uint64, int, bool, bool]:
    """Scan a number of JSON.

    Returns
    -------
    int
        Place after it; −1 if it is not a number of JSON.
    bool
        Whether it is negative.
    uint64
        Its first 19 significant digits.
    int
        Exponent of ten of the last of them.
    bool
        Whether it has no fraction and no exponent.
    bool
        Whether it has further digits, other than zeros.
    """
    negative = i < stop and int(text[i]) == _MINUS
    i += negative
    good = _is_digit(text, i, stop)
    leading_zero = good and int(text[i]) == _ZERO
    digits, count, exponent, further = _U(0), 0, 0, False
    begin = i
    while _is_digit(text, i, stop):
        if count < _DIGITS_MAX:
            digits = digits * _U(10) + _U(int(text[i]) - _ZERO)
            count += digits != _U(0)
        else:
            exponent += 1
            further = further or int(text[i]) != _ZERO
        i += 1
    good = good and not (leading_zero and i - begin > 1)
    is_integer = True
    if good and i < stop and int(text[i]) == _POINT:
        is_integer = False
        i += 1
        good = _is_digit(text, i, stop)
        while _is_digit(text, i, stop):
            if count < _DIGITS_MAX:
                digits = digits * _U(10) + _U(int(text[i]) - _ZERO)
                count += digits != _U(0)
                exponent -= 1
            else:
                further = further or int(text[i]) != _ZERO
            i += 1
    if good and i < stop and int(text[i]) in (_E, _CAPITAL_E):
        is_integer = False
        i += 1
        down = i < stop and int(text[i]) == _MINUS
        i += i < stop and int(text[i]) in (_MINUS, _PLUS)
        begin, power = i, 0
        while _is_digit(text, i, stop) and i - begin <= _EXPONENT_DIGITS_MAX:
            power = 10 * power + int(text[i]) - _ZERO
            i += 1
        good = 0 < i - begin <= _EXPONENT_DIGITS_MAX
        exponent += -power if down else power
    return i if good else -1, negative, digits, exponent, is_integer, further


@in_loop
def _product(one: np.uint64, other: np.uint64) -> tuple[np.uint64, np.uint64]:
    """Return the high and the low half of a product."""
    one_low, one_high = one & _LOW, one >> _HALF
    low, high = other & _LOW, other >> _HALF
    lowest = one_low * low
    middle = one_high * low + (lowest >> _HALF)
    second = one_low * high + (middle & _LOW)
    return one_high * high + (middle >> _HALF) + (second >> _HALF), (second << _HALF) | (
        lowest & _LOW
    )


@in_loop
def _leading_zeros(word: np.uint64) -> int:
    count = 0
    for bits in (32, 16, 8, 4, 2, 1):
        if word >> _U(64 - bits) == _U(0):
            count += bits
            word = word << _U(bits)
    return count


@in_loop
def _rounded(digits: np.uint64, exponent: int, powers: Words) -> np.uint64:
    """Return the bits of a number above 0; 0 if it is too large, or less than normal numbers."""
    zeros = _leading_zeros(digits)
    normal = digits << _U(zeros)
    place = exponent - EXPONENT_MIN
    high, low = _product(normal, powers[place, 0])
    if high & _SPARE == _SPARE:
        more, _ = _product(normal, powers[place, 1])
        low = low + more
        if more > low:
            high = high + _ONE
    upper = high >> _TOP
    fraction = high >> (upper + _SHIFT)
    binary = ((217706 * exponent) >> 16) + 63 + int(upper) - zeros + _BIAS
    if (
        low <= _ONE
        and -4 <= exponent <= 23
        and fraction & _U(3) == _ONE
        and fraction << (upper + _SHIFT) == high
    ):
        # Halfway: to the even one.
        fraction = fraction & ~_ONE
    fraction = (fraction + (fraction & _ONE)) >> _ONE
    if fraction >= _HIDDEN << _ONE:
        fraction = _HIDDEN
        binary += 1
    if not 0 < binary < _EXPONENT_END:
        return _U(0)
    return (fraction & ~_HIDDEN) | (_U(binary) << _FRACTION_BITS)


@in_loop
def number_bits(
    negative: bool, digits: np.uint64, exponent: int, further: bool, powers: Words
) -> tuple[bool, np.uint64]:
    """Return whether a number can be read here, and the bits of the double closest to it.

    Parameters
    ----------
    negative, digits, exponent, further
        As of `scan_number`.
    powers : (n, 2) uint64
        As of `powers_of_five`.
    """
    sign = _U(negative) << _TOP
    if digits == _U(0):
        return not further, sign
    if not EXPONENT_MIN <= exponent <= EXPONENT_MAX:
        return False, sign
    bits = _rounded(digits, exponent, powers)
    good = bits != _U(0)
    if good and further:
        # Between these digits and the next: both must be the same number.
        good = _rounded(digits + _ONE, exponent, powers) == bits
    return good, bits | sign
