"""Predicted tracks of a window, indexed by a grid of cells.

Named tuples of arrays, as compiled functions require; one owner modifies them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Maximum number of candidate tracks of a plot: the likeliest.
CANDIDATES_MAX = 16
#: Hash table entries per slot.
_CELLS_PER_SLOT = 2

# Positions in the vector of rules.
SPEED_MAX = 0
MANOEUVRE = 1
VELOCITY_ERROR = 2
HITS_MIN = 3
SCORE_MIN = 4
DROP_AFTER = 5
RULE_COUNT = 6


class Gating(NamedTuple):
    """What plots of every sensor are compared by.

    Attributes
    ----------
    periods : (m,) float64
        Scan period of each sensor, s; 0 where unknown.
    rules : (RULE_COUNT,) float64
        The rules.
    log_clutters : (m, r) float64
        Logarithm of the density of false plots on the ground, 1/m², by sensor and range ring.
    """

    periods: Floats
    rules: Floats
    log_clutters: Floats


class PlotPosition(NamedTuple):
    """Position of a plot on the plane.

    Attributes
    ----------
    distance : float
        Distance from the predicted track, m.
    east, north : float
        At the published biases, m.
    reach : float
        Bound of its error, m.
    """

    distance: float
    east: float
    north: float
    reach: float


class BiasScratch(NamedTuple):
    """Uncertainty of the biases, and scratch of its projection.

    Attributes
    ----------
    sigmas : (c,) float64
        Standard deviations of the biases.
    U, R : (2, c) float64
        Scratch: derivative of an innovation with respect to the biases, and a product with it.
    """

    sigmas: Floats
    U: Floats
    R: Floats


class TrackGrid(NamedTuple):
    """Predicted tracks, indexed by cell of the plane.

    Attributes
    ----------
    state : (s, 8) float64
        East, north (m) and their rates (m/s) at the time of the window, search radius, search
        radius without the motion since the last plot, and padding to a cache line.
    reach : (s,) float64
        Search radius: bound of the position error, m.
    cell : (s, 2) int64
        Cell.
    following : (s,) int64
        Next track in the same bucket, −1 for none.
    heads : (t,) int64
        First track of each bucket, −1 for none; ``t`` is a power of two.
    far_following, far_heads : (s,) and (t,) int64
        The same for tracks with a large search radius, in larger cells. A plot then searches few
        cells for all other tracks.
    longest : (2,) float64
        Largest search radius of the other tracks, and of those with a large one; negative for none.
    owner, local : (s,) int64
        Scratch for an assignment, −1 outside of it.
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
    def empty(cls, capacity: int) -> "TrackGrid":
        """Return an empty grid; ``capacity`` is a power of two."""
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


class RowScores(NamedTuple):
    """Association of the rows of a window, from the first on.

    Attributes
    ----------
    released : (n,) int64
        Whether the row was assigned by address to an aircraft far away.
    score : (n,) float64
        Score of the row in its track.
    shadow : (n,) int64
        Whether the row may belong to a track that was assigned another row.
    """

    released: Integers
    score: Floats
    shadow: Integers

    @classmethod
    def of(cls, rows: int, score: float) -> "RowScores":
        """Return rows with one score."""
        return cls(np.zeros(rows, np.int64), np.full(rows, score), np.zeros(rows, np.int64))


class Candidates(NamedTuple):
    """Candidate tracks of the plots of a window, the likeliest first.

    Attributes
    ----------
    number : (n,) int64
        Number of candidates; −1 for a plot without a position.
    slot : (n, CANDIDATES_MAX) int64
        The tracks.
    score : (n, CANDIDATES_MAX) float64
        Logarithm of the likelihood ratio to a false plot, positive.
    reinitialised : (n, CANDIDATES_MAX) int64
        Whether the score assumes that the velocity of the track is wrong.
    position : (n, 3) float64
        Position of the plot at the published biases, east and north, and bound of its error, m.
    """

    number: Integers
    slot: Integers
    score: Floats
    reinitialised: Integers
    position: Floats

    @classmethod
    def empty(cls, rows: int) -> "Candidates":
        """Return empty candidates."""
        return cls(
            number=np.zeros(rows, np.int64),
            slot=np.full((rows, CANDIDATES_MAX), -1, np.int64),
            score=np.zeros((rows, CANDIDATES_MAX)),
            reinitialised=np.zeros((rows, CANDIDATES_MAX), np.int64),
            position=np.zeros((rows, 3)),
        )
