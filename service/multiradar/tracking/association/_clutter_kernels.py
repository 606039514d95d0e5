"""Compiled clutter density of a sensor by range."""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar_compiled.kernels import in_loop, kernel

Floats = NDArray[np.float64]

# Range rings around a radar; the last one is unbounded.
RING_M = 20_000.0
RINGS = 32


@in_loop
def ring_of(range_m: float) -> int:
    """Return the ring of a range."""
    return min(int(min(max(range_m, 0.0), 1e9) / RING_M), RINGS - 1)


@in_loop
def log_density_of_clutter(kind: int, s: int, z0: float, log_clutters: Floats) -> float:
    """Return log λ in the coordinates of the measurement: 1/(m rad) for plots, 1/m² for positions.

    ``log_clutters`` is that on the ground, 1/m², by sensor and ring.
    """
    value: float = log_clutters[s, 0]
    if kind == KIND_RADAR:
        value = log_clutters[s, ring_of(z0)] + math.log(max(z0, 1.0))
    return value


@kernel
def fill_log_clutters(
    counts: Floats, scans: Floats, usual: float, prior_scans: float, log_clutters: Floats
) -> None:
    """Convert counts of false plots into densities.

    ``counts`` (m, RINGS) are fading counts over ``scans`` (m,) scans. The prior density ``usual``,
    1/m² per scan, has the weight of ``prior_scans``.
    """
    for s in range(counts.shape[0]):
        for ring in range(RINGS):
            area = math.pi * RING_M * RING_M * (2.0 * ring + 1.0)
            known = usual * area * prior_scans
            density = (known + max(counts[s, ring], 0.0)) / (area * (prior_scans + scans[s]))
            log_clutters[s, ring] = math.log(max(density, 0.1 * usual))
