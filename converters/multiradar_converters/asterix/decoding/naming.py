"""Text columns from integers: codes, addresses, callsigns."""

import re
from collections.abc import Callable

import numpy as np
import polars as pl

from multiradar_converters.asterix.layout.columns import Integers
from multiradar_converters.asterix.layout.fields import letters
from multiradar_schemas.measurements.gates import LISTED_ROWS_MAX
from multiradar_schemas.measurements.measurement import CALLSIGN_PATTERN

_CALLSIGN_BITS = 48
# Some senders pad with zeros, which are no character.
_INVALID = "\0"
_PADDING = " " + _INVALID
_CALLSIGN = re.compile(CALLSIGN_PATTERN)


def named(values: Integers, name: Callable[[int], str | None]) -> pl.Series:
    """Convert integers to text, each distinct value once."""
    if len(values) <= LISTED_ROWS_MAX:
        numbers = values.tolist()
        texts = {value: name(value) for value in dict.fromkeys(numbers)}
        return pl.Series([texts[value] for value in numbers], dtype=pl.String)
    distinct, places = np.unique(values, return_inverse=True)
    names = pl.Series([name(value) for value in distinct.tolist()], dtype=pl.String)
    return names.gather(pl.Series(places.astype(np.uint32)))


def code_names(codes: Integers) -> pl.Series:
    """Return four octal digits; null for negative ones."""
    return named(codes, lambda value: None if value < 0 else f"{value:04o}")


def address_names(addresses: Integers) -> pl.Series:
    """Return six hexadecimal digits; null for none, and for 0, which is not an aircraft address."""
    return named(addresses, lambda value: None if value <= 0 else f"{value:06x}")


def ground_statuses(on_ground: Integers) -> pl.Series:
    """Return the ground status: true for 1, false for 0, null for -1."""
    return pl.Series(on_ground == 1).set(pl.Series(on_ground < 0), None)


def callsign_names(callsigns: Integers) -> pl.Series:
    """Return callsigns of six-bit characters without surrounding blanks; null for none.

    Inner blanks are kept; null with a character that is neither a letter, a digit nor a blank.
    """
    return named(callsigns, _callsign)


def _callsign(value: int) -> str | None:
    text = "" if value < 0 else letters(value, _CALLSIGN_BITS, invalid=_INVALID).strip(_PADDING)
    return text if _CALLSIGN.fullmatch(text) else None
