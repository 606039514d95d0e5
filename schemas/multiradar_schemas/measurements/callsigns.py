"""Callsigns as text and as integers: eight characters of six bits, as in the downlink format."""

import numpy as np
import polars as pl
from numpy.typing import NDArray

LETTERS = 8
_BITS = 6
_SHIFTS = np.arange(_BITS * (LETTERS - 1), -1, -_BITS, dtype=np.int64)
_MISSING = -1
# The six low bits of ASCII distinguish capitals, digits and the blank.
_MASK = 63
_CAPITALS = 64
_FIRST_NO_LETTER = 32


def packed_callsigns(texts: pl.Series) -> NDArray[np.int64]:
    """Pack callsigns into integers.

    Parameters
    ----------
    texts : Series of String
        One to eight letters, digits and embedded spaces, with optional blanks around them, or
        null. Case is ignored.

    Returns
    -------
    (n,) int64
        The first character in the highest of 48 bits, padded with blanks; -1 for null.

    References
    ----------
    The coding is that of ICAO Annex 10, volume IV, table 3-9.
    """
    if texts.null_count() == len(texts):
        return np.full(len(texts), _MISSING, np.int64)
    whole = texts.str.strip_chars(" ").str.to_uppercase().str.pad_end(LETTERS).fill_null("")
    letters = np.array(whole.to_list(), f"S{LETTERS}").view(np.uint8).reshape(-1, LETTERS)
    numbers: NDArray[np.int64] = ((letters.astype(np.int64) & _MASK) << _SHIFTS).sum(axis=1)
    numbers[texts.is_null().to_numpy()] = _MISSING
    return numbers


def callsign_texts(numbers: NDArray[np.int64]) -> pl.Series:
    """Return callsigns as text.

    Parameters
    ----------
    numbers : (n,) int64
        As from `packed_callsigns`; -1 for none.

    Returns
    -------
    Series of String
        Capitals, digits and embedded spaces; null for none.
    """
    if not (numbers >= 0).any():
        return pl.repeat(None, len(numbers), dtype=pl.String, eager=True)
    # Callsigns are repeated: each distinct one is converted once.
    column = pl.Series(numbers)
    distinct = column.unique()
    distinct = distinct.filter(distinct >= 0)
    codes = distinct.to_numpy()[:, None] >> _SHIFTS & _MASK
    letters = np.where(codes < _FIRST_NO_LETTER, codes + _CAPITALS, codes).astype(np.uint8)
    texts = np.ascontiguousarray(letters).view(f"S{LETTERS}")[:, 0].astype(str).tolist()
    names = pl.Series(texts, dtype=pl.String).str.strip_chars(" ")
    return column.replace_strict(distinct, names, default=None, return_dtype=pl.String)
