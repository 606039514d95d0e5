"""Lifecycle state of each track, beside its kinematic state and its identity.

Named tuples of arrays, as compiled functions require; one owner modifies them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import NONE
from multiradar.tracking.roster import MISSING

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# `Lifecycle.stage`: a track known by identity is confirmed by its number of updates.
BY_IDENTITY = 0
TENTATIVE = 1
CONFIRMED = 2

# Number of measurements up to which the velocity of a track may be based on a false plot.
YOUNG_HITS = 4
# Usual maximum ground speed of aircraft, m/s.
USUAL_SPEED = 350.0


class Lifecycle(NamedTuple):
    """Lifecycles of the tracks of a pool.

    Attributes
    ----------
    stage : (s,) int64
        `BY_IDENTITY`, `TENTATIVE` or `CONFIRMED`.
    hits : (s,) int64
        Number of accepted measurements.
    hits_needed : (s,) int64
        Number of measurements needed for confirmation.
    score : (s,) float64
        Logarithm of the likelihood ratio of an aircraft to false plots.
    born : (s,) float64
        Data time of its first measurement.
    period : (s,) float64
        Longest scan period, s, of the sensors that measured it.
    first_sensor, first_ring : (s,) int64
        Sensor and range ring in which its first plot is counted as clutter.
    last_seen : (s, m) float64
        Data time of the last measurement by each sensor, −∞ when there was none.
    last_azimuth : (s, m) float64
        Azimuth of the last plot by each radar; undefined when there was none.
    pending_code : (s,) int64
        Last received Mode 3/A code that differs from that of the track; −1 for none.
    pending_address : (s,) int64
        Mode S address that a track without one received last; −1 for none.
    bias_excluded : (s,) int64
        Whether its current measurements are excluded from bias estimation.
    partner, meetings : (s,) int64
        Possible duplicate track, −1 for none, and number of consecutive tests that found it.
    """

    stage: Integers
    hits: Integers
    hits_needed: Integers
    score: Floats
    born: Floats
    period: Floats
    first_sensor: Integers
    first_ring: Integers
    last_seen: Floats
    last_azimuth: Floats
    pending_code: Integers
    pending_address: Integers
    bias_excluded: Integers
    partner: Integers
    meetings: Integers

    @classmethod
    def empty(cls, capacity: int, sensors: int) -> "Lifecycle":
        """Return the lifecycles of free slots."""
        return cls(
            stage=np.zeros(capacity, np.int64),
            hits=np.zeros(capacity, np.int64),
            hits_needed=np.zeros(capacity, np.int64),
            score=np.zeros(capacity),
            born=np.full(capacity, np.nan),
            period=np.zeros(capacity),
            first_sensor=np.zeros(capacity, np.int64),
            first_ring=np.zeros(capacity, np.int64),
            last_seen=np.full((capacity, sensors), -np.inf),
            last_azimuth=np.zeros((capacity, sensors)),
            pending_code=np.full(capacity, MISSING, np.int64),
            pending_address=np.full(capacity, MISSING, np.int64),
            bias_excluded=np.zeros(capacity, np.int64),
            partner=np.full(capacity, NONE, np.int64),
            meetings=np.zeros(capacity, np.int64),
        )
