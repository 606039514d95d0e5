"""What is summed about the health of each sensor between two ends of epochs.

A named tuple of arrays, because compiled functions take it as it is; one owner changes them.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Innovations of one sensor that are judged together, at most.
VALUES_MAX = 512
#: Columns of `HealthSums.seen`: last update, last innovation that was judged.
HEARD, JUDGED = 0, 1
#: What the pattern of innovations is made of: range offset (m), azimuth offset (rad), range gain
#: (m in `GAIN_SCALE_M`), shift of the site to the east and to the north (m).
PATTERNS = 5
SITE = 3
NORMALS = PATTERNS * (PATTERNS + 1) // 2
GAIN_SCALE_M = 100_000.0


class HealthSums(NamedTuple):
    """Sums of each of m sensors; i is 0 for range, 1 for azimuth.

    Attributes
    ----------
    owner, updates : (s,) int64
        Track of each slot of the pool, and its updates by radars so far.
    seen : (s, m, 2) float64
        Data times as `HEARD` and `JUDGED`, −∞ for never.
    last_plot : (m,) float64
        Data time of the last plot, whatever became of it; −∞ for never.
    hits, looks : (m,) float64
        Updates of confirmed tracks, and looks from one to the next.
    opened : (m,) float64
        Since when innovations are judged together.
    values : (m, 2, VALUES_MAX) float64
        The first innovation of each aircraft since, over its standard deviation.
    judged : (m,) int64
        How many.
    common : (m, 2) float64
        Sums of what the biases add to the variance of these, in parts of it.
    commons : (m,) int64
        Of how many it is known.
    settled : (m, 2) int64
        Whether the biases are known well enough for innovations to tell of noise.
    scale : (m, 2) float64
        λ²: variance of innovations, in parts of what is expected.
    clipped, told, noises : (m, 2) float64
        Sums for it: of clipped squares, of the part of the noise as told, and their number.
    pattern : (m, NORMALS) float64
        Upper triangle of the information on `PATTERNS`.
    pattern_vector : (m, PATTERNS) float64
        Its vector.
    """

    owner: Integers
    updates: Integers
    seen: Floats
    last_plot: Floats
    hits: Floats
    looks: Floats
    opened: Floats
    values: Floats
    judged: Integers
    common: Floats
    commons: Integers
    settled: Integers
    scale: Floats
    clipped: Floats
    told: Floats
    noises: Floats
    pattern: Floats
    pattern_vector: Floats

    @classmethod
    def empty(cls, slots: int, sensors: int) -> "HealthSums":
        """Return sums of nothing."""
        return cls(
            owner=np.full(slots, -1, np.int64),
            updates=np.zeros(slots, np.int64),
            seen=np.full((slots, sensors, 2), -np.inf),
            last_plot=np.full(sensors, -np.inf),
            hits=np.zeros(sensors),
            looks=np.zeros(sensors),
            opened=np.full(sensors, np.finfo(np.float64).min),
            values=np.zeros((sensors, 2, VALUES_MAX)),
            judged=np.zeros(sensors, np.int64),
            common=np.zeros((sensors, 2)),
            commons=np.zeros(sensors, np.int64),
            settled=np.zeros((sensors, 2), np.int64),
            scale=np.ones((sensors, 2)),
            clipped=np.zeros((sensors, 2)),
            told=np.zeros((sensors, 2)),
            noises=np.zeros((sensors, 2)),
            pattern=np.zeros((sensors, NORMALS)),
            pattern_vector=np.zeros((sensors, PATTERNS)),
        )

    def grown(self, slots: int) -> "HealthSums":
        """Return the same with room for more aircraft."""
        wider = HealthSums.empty(slots, len(self.hits))
        old = len(self.owner)
        for name in ("owner", "updates", "seen"):
            getattr(wider, name)[:old] = getattr(self, name)
        return self._replace(owner=wider.owner, updates=wider.updates, seen=wider.seen)
