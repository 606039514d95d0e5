"""Scale mixture of two Gaussians: mostly small errors, and a few large ones.

For an error in the plane let r be its square over that of its sigma. For a Gaussian of s times the
covariance, r exceeds x with probability exp(−x / 2s). The sizes of two Gaussians, the large one in
the fraction `RARE_SHARE` of cases, follow from the median of r and its 95 % quantile.

References
----------
The project's own; scale mixtures of Gaussians are those of D. F. Andrews, C. L. Mallows, Journal of
the Royal Statistical Society B 36 (1974), 99-102.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.encounters._relative_kernels import RARE_SHARE

Floats = NDArray[np.float64]

#: Probabilities of the quantiles used.
MEDIAN, UPPER = 0.5, 0.95
#: Maximum logarithm of the ratio of both sizes.
_RATIO_MAX = 14.0
_STEPS = 60


def mixture_scales(half: Floats, most: Floats) -> tuple[Floats, Floats]:
    """Return the sizes of both Gaussians.

    Parameters
    ----------
    half, most : ndarray
        Median of r, and its 95 % quantile.

    Returns
    -------
    usual, rare : ndarray
        The s of the usual Gaussian, and of the one with the fraction `RARE_SHARE`; equal for errors
        of one Gaussian. With fewer large errors than that, those of Gaussians fitted to each
        quantile.
    """
    ratio = np.log(most / half)
    usual = half * np.exp(np.interp(ratio, _RATIO, _USUAL))
    return usual, most * np.exp(np.interp(ratio, _RATIO, _RARE))


def _quantiles(sizes: Floats, share: float) -> Floats:
    # Quantile of r for Gaussians of sizes 1 and these: by bisection.
    low, high = np.zeros_like(sizes), -2.0 * np.log1p(-share) * sizes
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        beyond = (1.0 - RARE_SHARE) * np.exp(-0.5 * middle)
        beyond += RARE_SHARE * np.exp(-0.5 * middle / sizes)
        low = np.where(beyond > 1.0 - share, middle, low)
        high = np.where(beyond > 1.0 - share, high, middle)
    return np.asarray(0.5 * (low + high))


_SIZES = np.exp(np.linspace(0.0, _RATIO_MAX, 113))
_MEDIAN_SQUARE, _UPPER_SQUARE = _quantiles(_SIZES, MEDIAN), _quantiles(_SIZES, UPPER)
_RATIO = np.log(_UPPER_SQUARE / _MEDIAN_SQUARE)
_USUAL, _RARE = -np.log(_MEDIAN_SQUARE), np.log(_SIZES / _UPPER_SQUARE)
