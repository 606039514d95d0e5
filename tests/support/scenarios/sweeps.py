"""Plots of an antenna that rotates, nothing but times and azimuths."""

import numpy as np
from numpy.typing import NDArray


def sweep(
    period_s: float, duration_s: float, seed: int, *, targets: int = 40, sector_deg: float = 360.0
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return times and azimuths of targets that fly, a fifth of them missed, in disorder."""
    generator = np.random.default_rng(seed)
    bearing = generator.uniform(0.0, sector_deg, targets)
    drift = generator.uniform(-0.1, 0.1, targets)
    scan = np.arange(int(duration_s / period_s))[:, None]
    azimuth = bearing + drift * scan * period_s
    time_s = (
        1.5e9 + (scan + azimuth / 360.0) * period_s + generator.normal(0.0, 0.01, azimuth.shape)
    )
    seen = generator.random(azimuth.shape) < 0.8
    order = generator.permutation(int(seen.sum()))
    return time_s[seen][order], (azimuth[seen] % 360.0)[order]
