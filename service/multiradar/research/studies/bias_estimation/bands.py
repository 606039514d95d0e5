"""Bands for the NEES of a consistent filter: at one time, and at all times."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from multiradar.research.sequential.theory import Theory

Floats = NDArray[np.float64]

LEVEL = 0.95
# Simulated chains of errors, and means over runs computed from them.
_CHAINS = 2000
_MEANS = 4000
_STREAM = 2
# Fraction of the variances that is added before a root is computed.
_ROUNDING = 1e-9


@dataclass(frozen=True, slots=True)
class Bands:
    """Bands of the mean over the runs, for a filter that reports its true covariance.

    Attributes
    ----------
    low, high : (t, 2) float64
        At each time separately, with the given probability; aircraft and biases.
    all_low, all_high : (t, 2) float64
        At all times together, with the same probability.
    """

    low: Floats
    high: Floats
    all_low: Floats
    all_high: Floats


def consistency_bands(theory: Theory, runs: int, seed: int, level: float = LEVEL) -> Bands:
    """Return the bands of the mean over runs.

    Parameters
    ----------
    theory : Theory
        Of a filter that reports its true covariance: the joint one.
    runs : int
        Independent runs.
    seed : int
        Seed of the chains that widen the band to all times.
    level : float
        Probability of a band: at most 0.999 for the band of all times, which is simulated.

    Returns
    -------
    Bands
        For the mean over the aircraft, and for the biases.

    Notes
    -----
    Runs are independent. Aircraft of one run are not: they share the biases. Their mean is a
    quadratic form eᵀ B e / n of a normal vector, with B the blocks P_kk⁻¹ on the diagonal; it is
    approximated by χ² with ν = n² / tr(B Σ B Σ) degrees of freedom over ν, which has its mean 1 and
    its variance (Satterthwaite). For the biases ν is their number, exactly. Errors at different
    times are correlated: the level of the χ² band of all times is found by simulating chains of
    errors with the covariance and the transition of the theory.

    References
    ----------
    Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
    Navigation", Wiley 2001, section 5.4.2: NEES over runs. F. E. Satterthwaite, "An approximate
    distribution of estimates of variance components", Biometrics Bulletin 2 (1946), 110-114. The
    band of all times is the project's own.
    """
    freedom = np.stack([_freedom(theory), np.full(len(theory.biases), theory.biases.shape[-1])], 1)
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence((seed, _STREAM))))
    tail = np.full((1, 2), (1.0 - level) / 2.0)
    sample = _drawn(theory, rng)
    chosen = rng.integers(_CHAINS, size=(_MEANS, runs))
    tails = np.empty((1, 2))
    for which in range(2):
        means = np.stack([sample[row, :, which].mean(axis=0) for row in chosen])
        below = chi2.cdf(means * freedom[:, which] * runs, freedom[:, which] * runs)
        tails[0, which] = np.quantile(np.minimum(below, 1.0 - below).min(axis=1), 1.0 - level)
    edges = [
        chi2.ppf(part, freedom * runs) / (freedom * runs)
        for part in (tail, 1.0 - tail, tails, 1.0 - tails)
    ]
    return Bands(*edges)


# ν of the mean over the aircraft at each time.
def _freedom(theory: Theory) -> Floats:
    blocks = theory.aircraft
    times, count, size = blocks.shape[:3]
    whole = theory.covariance[:, : count * size, : count * size]
    parts = whole.reshape(times, count, size, count, size).transpose(0, 1, 3, 2, 4)
    weighted = np.linalg.inv(blocks)[:, :, None] @ parts
    power = np.einsum("tklij,tlkji->t", weighted, weighted)
    return np.asarray((count * size) ** 2 / power)


# (chains, t, 2): NEES per dimension of simulated errors.
def _drawn(theory: Theory, rng: np.random.Generator) -> Floats:
    size = theory.covariance.shape[-1]
    biases = theory.biases.shape[-1]
    found = np.empty((_CHAINS, len(theory.covariance), 2))
    error = np.zeros((_CHAINS, size))
    before = np.zeros((size, size))
    for t, (covariance, transition) in enumerate(
        zip(theory.covariance, theory.transition, strict=True)
    ):
        fresh = covariance if t == 0 else covariance - transition @ before @ transition.T
        error = error @ transition.T + rng.normal(size=error.shape) @ _root(fresh, covariance).T
        before = covariance
        own = error[:, :-biases].reshape(_CHAINS, -1, 4)
        roots = np.linalg.inv(np.linalg.cholesky(theory.aircraft[t]))
        white = np.einsum("kij,mkj->mki", roots, own)
        found[:, t, 0] = np.square(white).sum(axis=-1).mean(axis=1) / own.shape[-1]
        sigma = np.sqrt(np.diagonal(theory.biases[t]))
        root = np.linalg.cholesky(theory.biases[t] / np.outer(sigma, sigma))
        scaled = np.linalg.solve(root, (error[:, -biases:] / sigma).T)
        found[:, t, 1] = np.square(scaled).sum(axis=0) / biases
    return found


# R with R Rᵀ = the matrix, which may be indefinite by rounding; in units of the sigmas.
def _root(matrix: Floats, whole: Floats) -> Floats:
    sigma = np.sqrt(np.diagonal(whole))
    scaled = matrix / np.outer(sigma, sigma) + _ROUNDING * np.eye(len(sigma))
    return np.asarray(sigma[:, None] * np.linalg.cholesky(scaled))
