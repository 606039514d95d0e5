"""Rounds numbers to significant digits."""

import math
from collections.abc import Mapping
from typing import Any

#: Digits of a number of unknown accuracy.
_DIGITS = 6
#: Digits of the standard deviation of an estimate.
_SIGMA_DIGITS = 3
#: Decimals of values that are large relative to their error, by suffix of the name: 1 µs, 1 mm.
_DECIMALS = {"_s": 6, "latitude_deg": 8, "longitude_deg": 8}


def rounded(value: Any) -> Any:
    """Return a JSON value with its floating-point numbers rounded.

    Parameters
    ----------
    value : JSON
        Any value; not modified.

    Returns
    -------
    JSON
        Numbers have six significant digits, and all digits before the decimal point; an `estimate`
        beside its `sigma` ends with the third digit of the sigma; times and durations (`…_s`) are
        exact to a microsecond, latitudes and longitudes to a millimetre. Other values are
        unchanged.
    """
    if isinstance(value, float):
        return _significant(value)
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return rounded_members(value) if isinstance(value, dict) else value


def rounded_members(members: Mapping[str, Any]) -> dict[str, Any]:
    """Return a JSON object with its floating-point numbers rounded, as `rounded` does."""
    sigma = members.get("sigma")
    return {name: _member(name, value, sigma) for name, value in members.items()}


def _member(name: str, value: Any, sigma: Any) -> Any:
    if not isinstance(value, float) or not math.isfinite(value):
        return rounded(value)
    for ending, decimals in _DECIMALS.items():
        if name.endswith(ending):
            return round(value, decimals)
    if name == "estimate" and isinstance(sigma, float) and 0.0 < sigma < math.inf:
        return round(value, _decimals(sigma, _SIGMA_DIGITS))
    return _significant(value)


def _significant(number: float) -> float:
    if number == 0.0 or not math.isfinite(number):
        return number
    return round(number, _decimals(number, _DIGITS))


def _decimals(number: float, digits: int) -> int:
    return max(0, digits - 1 - math.floor(math.log10(abs(number))))
