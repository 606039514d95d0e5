"""Where the tracks are expected in a window, in cells: what the compiled association works on.

Named tuples of arrays, because compiled functions take them as they are; one owner changes them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Tracks that a plot may choose between at most: the likeliest.
CANDIDATES_MAX = 16
#: Places in the table of cells for each slot.
_CELLS_PER_SLOT = 2

# Positions in the vector of rules.
SPEED_MAX = 0
MANOEUVRE = 1
ASTRAY = 2
HITS_MIN = 3
SCORE_MIN = 4
DROP_AFTER = 5
RULE_COUNT = 6


class Sky(NamedTuple):
    """Predicted tracks, found by the cell of the plane that they are in.

    Attributes
    ----------
    state : (s, 8) float64
        East, north (m) and their rates (m/s) at the time of the window, the reach, how far off,
        m, the place is without the way since, and room: one cache line.
    reach : (s,) float64
        Distance, m, that the position may be wrong by.
    cell : (s, 2) int64
        Cell.
    following : (s,) int64
        Next track in the same place of the table, −1 for none.
    heads : (t,) int64
        First track of each place of the table, −1 for none; ``t`` is a power of two.
    far_following, far_heads : (s,) and (t,) int64
        The same for the tracks whose reach is long, once more in cells of their own: with these
        set aside, a plot need not look far around for all the others.
    longest : (2,) float64
        Longest reach of the tracks whose reach is not long, and of those whose it is; below zero
        for none.
    owner, local : (s,) int64
        Room for an assignment, −1 outside of it.
    """

    state: Floats
    reach: Floats
    cell: Integers
    following: Integers
    heads: Integers
    far_following: Integers
    far_heads: Integers
    longest: Floats
    owner: Integers
    local: Integers

    @classmethod
    def empty(cls, capacity: int) -> "Sky":
        """Return room for tracks; ``capacity`` is a power of two."""
        return cls(
            state=np.zeros((capacity, 8)),
            reach=np.zeros(capacity),
            cell=np.zeros((capacity, 2), np.int64),
            following=np.full(capacity, -1, np.int64),
            heads=np.full(_CELLS_PER_SLOT * capacity, -1, np.int64),
            far_following=np.full(capacity, -1, np.int64),
            far_heads=np.full(_CELLS_PER_SLOT * capacity, -1, np.int64),
            longest=np.full(2, -1.0),
            owner=np.full(capacity, -1, np.int64),
            local=np.full(capacity, -1, np.int64),
        )


class Candidates(NamedTuple):
    """Tracks that the plots of a window may be of, the likeliest first.

    Attributes
    ----------
    number : (n,) int64
        How many of them; −1 for a plot that locates nothing.
    slot : (n, CANDIDATES_MAX) int64
        The tracks.
    score : (n, CANDIDATES_MAX) float64
        Logarithm of the likelihood ratio to a false plot, positive.
    anew : (n, CANDIDATES_MAX) int64
        Whether the score takes the velocity of the track for wrong.
    place : (n, 3) float64
        Where the plot points to at the published biases, east and north, and how far off, m, the
        aircraft may be.
    """

    number: Integers
    slot: Integers
    score: Floats
    anew: Integers
    place: Floats

    @classmethod
    def empty(cls, rows: int) -> "Candidates":
        """Return room for so many plots."""
        return cls(
            number=np.zeros(rows, np.int64),
            slot=np.full((rows, CANDIDATES_MAX), -1, np.int64),
            score=np.zeros((rows, CANDIDATES_MAX)),
            anew=np.zeros((rows, CANDIDATES_MAX), np.int64),
            place=np.zeros((rows, 3)),
        )
