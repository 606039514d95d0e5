"""Sums for the health of each sensor, between ends of epochs.

A named tuple of arrays, as compiled functions require; one owner modifies them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Maximum number of innovations of one sensor that are tested together.
VALUES_MAX = 512
#: Columns of `HealthSums.seen`: last update, last tested innovation.
LAST_UPDATE, LAST_TEST = 0, 1
#: Parameters of the innovation pattern: range offset (m), azimuth offset (rad), range gain (m in
#: `GAIN_SCALE_M`), shift of the site to the east and to the north (m).
PATTERNS = 5
SITE = 3
NORMALS = PATTERNS * (PATTERNS + 1) // 2
GAIN_SCALE_M = 100_000.0


class HealthSums(NamedTuple):
    """Sums of each of m sensors; i is 0 for range, 1 for azimuth.

    Attributes
    ----------
    owner, updates : (s,) int64
        Track of each slot of the pool, and its updates by radars.
    seen : (s, m, 2) float64
        Data times as `LAST_UPDATE` and `LAST_TEST`, −∞ for never.
    last_plot : (m,) float64
        Data time of the last plot, whatever its disposition; −∞ for never.
    hits, scans : (m,) float64
        Updates of confirmed tracks, and scans from one to the next.
    opened : (m,) float64
        Start of the test window.
    values : (m, 2, VALUES_MAX) float64
        First innovation of each aircraft in the window, over its standard deviation.
    tested : (m,) int64
        Number of these.
    common : (m, 2) float64
        Sums of the relative variance that the biases add to these.
    commons : (m,) int64
        Number of innovations with known bias variance.
    settled : (m, 2) int64
        Whether the biases are known well enough to estimate noise.
    scale : (m, 2) float64
        λ²: variance of innovations over the expected one.
    clipped, noise_share, noises : (m, 2) float64
        Sums for it: of clipped squares, of the fraction of the configured noise, and their number.
    pattern : (m, NORMALS) float64
        Upper triangle of the information on `PATTERNS`.
    pattern_vector : (m, PATTERNS) float64
        Its information vector.
    """

    owner: Integers
    updates: Integers
    seen: Floats
    last_plot: Floats
    hits: Floats
    scans: Floats
    opened: Floats
    values: Floats
    tested: Integers
    common: Floats
    commons: Integers
    settled: Integers
    scale: Floats
    clipped: Floats
    noise_share: Floats
    noises: Floats
    pattern: Floats
    pattern_vector: Floats

    @classmethod
    def empty(cls, slots: int, sensors: int) -> "HealthSums":
        """Return empty sums."""
        return cls(
            owner=np.full(slots, -1, np.int64),
            updates=np.zeros(slots, np.int64),
            seen=np.full((slots, sensors, 2), -np.inf),
            last_plot=np.full(sensors, -np.inf),
            hits=np.zeros(sensors),
            scans=np.zeros(sensors),
            opened=np.full(sensors, np.finfo(np.float64).min),
            values=np.zeros((sensors, 2, VALUES_MAX)),
            tested=np.zeros(sensors, np.int64),
            common=np.zeros((sensors, 2)),
            commons=np.zeros(sensors, np.int64),
            settled=np.zeros((sensors, 2), np.int64),
            scale=np.ones((sensors, 2)),
            clipped=np.zeros((sensors, 2)),
            noise_share=np.zeros((sensors, 2)),
            noises=np.zeros((sensors, 2)),
            pattern=np.zeros((sensors, NORMALS)),
            pattern_vector=np.zeros((sensors, PATTERNS)),
        )

    def grown(self, slots: int) -> "HealthSums":
        """Return the same for more aircraft."""
        wider = HealthSums.empty(slots, len(self.hits))
        old = len(self.owner)
        for name in ("owner", "updates", "seen"):
            getattr(wider, name)[:old] = getattr(self, name)
        return self._replace(owner=wider.owner, updates=wider.updates, seen=wider.seen)
