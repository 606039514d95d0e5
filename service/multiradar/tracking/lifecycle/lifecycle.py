"""What is kept of the life of each track, beside its state and its identity.

Named tuples of arrays, because compiled functions take them as they are; one owner changes them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# `Lifecycle.stage`: a track that is found by identity alone lives by its number of updates.
BY_IDENTITY = 0
TENTATIVE = 1
CONFIRMED = 2

NONE = -1

# With so many measurements at most, the velocity of a track may rest on a false one.
YOUNG_HITS = 4
# Nearly all aircraft are no faster than this over ground, m/s.
USUAL_SPEED = 350.0


class Lifecycle(NamedTuple):
    """The lives of the tracks of a pool.

    Attributes
    ----------
    stage : (s,) int64
        `BY_IDENTITY`, `TENTATIVE` or `CONFIRMED`.
    hits : (s,) int64
        Measurements taken.
    hits_needed : (s,) int64
        Measurements after which the track may be confirmed.
    score : (s,) float64
        Logarithm of the likelihood ratio of an aircraft to false plots.
    born : (s,) float64
        Data time of its first measurement.
    period : (s,) float64
        Longest turn, s, of the sensors that measured it.
    first_sensor, first_ring : (s,) int64
        Where its first plot is counted among the false ones.
    heard : (s, m) float64
        Data time of the last measurement by each sensor, −∞ when there was none.
    code_heard : (s,) int64
        A Mode 3/A code other than that of the track, heard last; −1 when there was none.
    quiet : (s,) int64
        Whether what it measures now must not speak about the biases.
    partner, meetings : (s,) int64
        Track that seems to be of the same aircraft, −1 for none, and how often in a row it did.
    """

    stage: Integers
    hits: Integers
    hits_needed: Integers
    score: Floats
    born: Floats
    period: Floats
    first_sensor: Integers
    first_ring: Integers
    heard: Floats
    code_heard: Integers
    quiet: Integers
    partner: Integers
    meetings: Integers

    @classmethod
    def empty(cls, capacity: int, sensors: int) -> "Lifecycle":
        """Return room for tracks, none of which lives."""
        return cls(
            stage=np.zeros(capacity, np.int64),
            hits=np.zeros(capacity, np.int64),
            hits_needed=np.zeros(capacity, np.int64),
            score=np.zeros(capacity),
            born=np.full(capacity, np.nan),
            period=np.zeros(capacity),
            first_sensor=np.zeros(capacity, np.int64),
            first_ring=np.zeros(capacity, np.int64),
            heard=np.full((capacity, sensors), -np.inf),
            code_heard=np.full(capacity, NONE, np.int64),
            quiet=np.zeros(capacity, np.int64),
            partner=np.full(capacity, NONE, np.int64),
            meetings=np.zeros(capacity, np.int64),
        )
