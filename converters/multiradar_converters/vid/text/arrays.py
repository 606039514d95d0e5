"""Arrays of the compiled parser, grouped by owner."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]
Words = NDArray[np.int64]
Numbers = NDArray[np.float64]


class Limits(NamedTuple):
    """Bounds and units of numbers, by role.

    Attributes
    ----------
    low, high : float64[6]
        Bounds, SI, inclusive.
    scale : float64[6]
        Factor to SI.
    """

    low: Numbers
    high: Numbers
    scale: Numbers


class Keys(NamedTuple):
    """Known keys of pairs.

    Attributes
    ----------
    names : uint8[k, w]
        Their names, padded.
    lengths, roles : int64[k]
        Length and role of each name.
    required : int
        Required roles of a line, as bits.
    """

    names: Bytes
    lengths: Words
    roles: Words
    required: int


class ParsedLines(NamedTuple):
    """Output of the compiled parser, a column or row per line.

    Attributes
    ----------
    numbers, integers : float64[6, r], int64[6, r]
        A column per non-blank line.
    begins : int64[r]
        Begin of the line of each column.
    odd : int64[r, 4]
        A row per line left to the reference form: its column in the arrays, its number within this
        call (from 0), its begin and end (line end excluded).
    """

    numbers: Numbers
    integers: Words
    begins: Words
    odd: Words
