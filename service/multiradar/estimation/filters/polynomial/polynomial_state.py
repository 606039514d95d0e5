"""State and estimate of the polynomial filter."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True, eq=False)
class PolynomialState:
    """Information about a polynomial trajectory.

    Attributes
    ----------
    start_s : float
        Time of the prior, from which t counts, s.
    observed_until_s : float
        Time of the last observation, s; the start time before the first.
    prior_mean : (n + 1, ...) float64
        Mean of α_0 … α_n (m, m/s, m/s² …), for each axis.
    prior_covariance : (n + 1, n + 1) float64
        Its covariance, the same for each axis.
    root : (n + 1, n + 1) float64
        B: root of the information about the coefficients of P_0 … P_n on that interval, 1/m.
    vector : (n + 1, ...) float64
        B times their least squares solution, for each axis.
    """

    start_s: float
    observed_until_s: float
    prior_mean: Floats
    prior_covariance: Floats
    root: Floats
    vector: Floats

    @property
    def degree(self) -> int:
        """Degree n of the polynomial."""
        return len(self.root) - 1

    @property
    def axes(self) -> tuple[int, ...]:
        """Shape of the axes, such as (2,) for x and y; empty for one axis without a name."""
        return self.prior_mean.shape[1:]


@dataclass(frozen=True, slots=True, eq=False)
class PolynomialEstimate:
    """Value and derivatives at one or several times.

    Attributes
    ----------
    time_s : (...) float64
        The times, s.
    mean : (..., n + 1, *axes) float64
        m_k(t), k = 0 … n: value (m), first derivative (m/s), and so on, for each axis.
    covariance : (..., n + 1, n + 1) float64
        γ_ij(t) of their errors, the same for each axis; symmetric and without negative eigenvalues
        by construction.
    """

    time_s: Floats
    mean: Floats
    covariance: Floats

    @property
    def value(self) -> Floats:
        """Estimate of X itself, m: (..., *axes)."""
        return np.asarray(self.mean[(slice(None),) * self.time_s.ndim + (0,)])

    @property
    def variance(self) -> Floats:
        """Variance of its error, m²: (...)."""
        return np.asarray(self.covariance[..., 0, 0])
