"""Errors whose most are small and a few are large, as two Gaussians.

Of an error in the plane let r be its square over that of its sigma. For a Gaussian that is s times
as large, r exceeds x with the probability exp(−x / 2s). Of two of them, the large one in the share
`RARE_SHARE` of cases, the sizes follow from the r that half of the errors exceed and the one that
one in twenty does.

References
----------
The project's own; scale mixtures of Gaussians are those of D. F. Andrews, C. L. Mallows, Journal of
the Royal Statistical Society B 36 (1974), 99-102.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.encounters._relative_kernels import RARE_SHARE

Floats = NDArray[np.float64]

#: The r of these shares of errors are asked for.
HALF, MOST = 0.5, 0.95
#: The large Gaussian is at most e to this times as large as the small one.
_RATIO_MAX = 14.0
_STEPS = 60


def two_sizes(half: Floats, most: Floats) -> tuple[Floats, Floats]:
    """Return how large the two Gaussians are.

    Parameters
    ----------
    half, most : ndarray
        The r below which half of the errors, and 95 % of them, are.

    Returns
    -------
    usual, rare : ndarray
        The s of the Gaussian of most cases, and of the share `RARE_SHARE`; equal where the errors
        are those of one Gaussian. Where there are fewer large errors than that has, they are those
        of one that holds half and one that holds 95 %.
    """
    ratio = np.log(most / half)
    usual = half * np.exp(np.interp(ratio, _RATIO, _USUAL))
    return usual, most * np.exp(np.interp(ratio, _RATIO, _RARE))


def _quantiles(sizes: Floats, share: float) -> Floats:
    # The r below which a share is, of Gaussians of the sizes 1 and these: by bisection.
    low, high = np.zeros_like(sizes), -2.0 * np.log1p(-share) * sizes
    for _ in range(_STEPS):
        middle = 0.5 * (low + high)
        beyond = (1.0 - RARE_SHARE) * np.exp(-0.5 * middle)
        beyond += RARE_SHARE * np.exp(-0.5 * middle / sizes)
        low = np.where(beyond > 1.0 - share, middle, low)
        high = np.where(beyond > 1.0 - share, high, middle)
    return np.asarray(0.5 * (low + high))


_SIZES = np.exp(np.linspace(0.0, _RATIO_MAX, 113))
_HALF, _MOST = _quantiles(_SIZES, HALF), _quantiles(_SIZES, MOST)
_RATIO = np.log(_MOST / _HALF)
_USUAL, _RARE = -np.log(_HALF), np.log(_SIZES / _MOST)
