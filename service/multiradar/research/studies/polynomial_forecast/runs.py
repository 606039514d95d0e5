"""The Monte Carlo simulation of the polynomial-forecast study, and its exact values."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from math import factorial

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from multiradar.estimation.filters.polynomial.polynomial_filter import (
    estimate,
    forecast,
    observe_interval,
    start,
)
from multiradar.estimation.filters.polynomial.polynomial_state import PolynomialState

Floats = NDArray[np.float64]

DEGREE = 2
#: Variances of α_0 (m²), α_1 ((m/s)²) and α_2 ((m/s²)²) in the paper, independent, means 0.
PRIOR = np.diag([100.0, 25.0, 0.04])
#: C₂ of the paper, m²·s.
INTENSITIES = (0.1, 1.0)
STEP_S = 2.0
#: Evaluation times of the filter, s, and start times of forecasts.
FILTER_TIMES_S = (2.0, 4.0, 6.0, 8.0, 10.0)
FORECAST_FROM_S = (10.0, 20.0)
HORIZONS_S = (2.0, 4.0, 6.0, 8.0, 10.0)
#: Probability of the band of the mean square of a Monte Carlo simulation.
BAND = 0.999


@dataclass(frozen=True, slots=True)
class Figure:
    """One cell of the tables.

    Attributes
    ----------
    intensity : float
        C₂, m²·s.
    observed_until_s, time_s : float
        Times of the last observation and of the estimate, s.
    exact, filtered, mean_square : float
        Variance of the error by regression, by the filter, and mean square over the runs, m².
    """

    intensity: float
    observed_until_s: float
    time_s: float
    exact: float
    filtered: float
    mean_square: float


def simulate(
    intensity: float, rng: np.random.Generator, runs: int, step: Callable[[], None]
) -> list[Figure]:
    """Filter and forecast many trajectories at once.

    Parameters
    ----------
    intensity : float
        C₂, m²·s.
    rng : Generator
        Random generator of the trajectories and the noise.
    runs : int
        Number of trajectories; each is an axis of one filter.
    step : callable
        Called after each interval of observation.

    Returns
    -------
    list of Figure
        Of the filter at `FILTER_TIMES_S`, then of the forecasts.

    Notes
    -----
    Without integration steps: an interval is observed through its moments, which are sufficient
    and are drawn with their exact distribution.

    References
    ----------
    Koptev, Rozov, Romanovsky, equation (1), and the section on the simulation with its tables.
    """
    truth = np.sqrt(np.diagonal(PRIOR))[:, None] * rng.normal(size=(DEGREE + 1, runs))
    state = start(DEGREE, np.zeros((DEGREE + 1, runs)), PRIOR)
    filtered, forecasts = [], []
    for begin, end in pairwise(np.arange(0.0, FORECAST_FROM_S[-1] + STEP_S, STEP_S)):
        moments = draw_moments(truth, begin, end, intensity, rng)
        state = observe_interval(state, begin, end, moments, intensity)
        if end in FILTER_TIMES_S:
            filtered += _figures(state, (0.0,), truth, intensity)
        if end in FORECAST_FROM_S:
            forecasts += _figures(state, HORIZONS_S, truth, intensity)
        step()
    return filtered + forecasts


def draw_moments(
    truth: Floats, begin_s: float, end_s: float, intensity: float, rng: np.random.Generator
) -> Floats:
    """Draw ∫ P_k dη over an interval: sufficient statistics of observing dη = X dt + √C₂ dw.

    Parameters
    ----------
    truth : (n + 1, ...) float64
        α_0 … α_n of each trajectory.
    begin_s, end_s : float
        The interval, s.
    intensity : float
        C₂, m²·s.
    rng : Generator
        Random generator of the noise.

    Returns
    -------
    (n + 1, ...) float64
        The moments, m·s: independent, with variances C₂ (end − begin)/(2k + 1).

    References
    ----------
    Koptev, Rozov, Romanovsky, follows from equation (1): integrals of dη with a weight.
    """
    degree, half = len(truth) - 1, (end_s - begin_s) / 2.0
    # Exact for the product of two polynomials of this degree.
    nodes, weights = np.polynomial.legendre.leggauss(degree + 1)
    powers = powers_of_time(begin_s + half * (1.0 + nodes), degree)
    basis = np.polynomial.legendre.legvander(nodes, degree)
    means = np.tensordot(basis.T * weights * half @ powers, truth, axes=1)
    sigmas = np.sqrt(intensity * 2.0 * half / (2.0 * np.arange(degree + 1) + 1.0))
    noise = rng.normal(size=means.shape)
    return np.asarray(means + np.tensordot(np.diag(sigmas), noise, axes=1))


def powers_of_time(times_s: Floats, degree: int) -> Floats:
    """Return t^k / k!, k = 0 … n, for each time: (..., n + 1).

    References
    ----------
    Koptev, Rozov, Romanovsky, the section on the model, the polynomial X_t before equation (1).
    """
    orders = np.arange(degree + 1)
    return np.asarray(times_s[..., None] ** orders / [factorial(order) for order in orders])


def regression_variance(intensity: float, observed_until_s: float, time_s: float) -> float:
    """Return the exact variance of the error of X, by Bayesian linear regression on t^k / k!.

    Parameters
    ----------
    intensity : float
        C₂, m²·s.
    observed_until_s, time_s : float
        Duration of the observation from 0 on, and time of the estimate, s.

    Returns
    -------
    float
        φᵀ (Γ_0⁻¹ + ∫ φ φᵀ dt / C₂)⁻¹ φ, m²: normal equations on powers of time, independent of the
        filter, its basis and its factorisation.

    References
    ----------
    Koptev, Rozov, Romanovsky, follows from equation (1) and the prior of the section on the
    simulation; linear regression: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with
    Applications to Tracking and Navigation", Wiley 2001, section 3.4.
    """
    information = np.linalg.inv(PRIOR)
    for i in range(DEGREE + 1):
        for j in range(DEGREE + 1):
            power = i + j + 1
            area = observed_until_s**power / (power * factorial(i) * factorial(j))
            information[i, j] += area / intensity
    row = powers_of_time(np.array(time_s), DEGREE)
    return float(row @ np.linalg.solve(information, row))


def band(runs: int, probability: float = BAND) -> tuple[float, float]:
    """Return the band of the mean square of normal errors, in units of their variance.

    Parameters
    ----------
    runs : int
        Number of independent errors.
    probability : float
        Probability of the band, with equal tails.

    Returns
    -------
    low, high : float
        Quantiles of χ² with that many degrees of freedom, divided by them.

    References
    ----------
    The project's own: quantiles of χ² for the mean of squares of normal errors.
    """
    outside = (1.0 - probability) / 2.0
    low, high = chi2.ppf([outside, 1.0 - outside], runs) / runs
    return float(low), float(high)


def _figures(
    state: PolynomialState, horizons_s: tuple[float, ...], truth: Floats, intensity: float
) -> list[Figure]:
    until = state.observed_until_s
    found = forecast(state, horizons_s) if horizons_s[0] else estimate(state, [until])
    errors = found.value - powers_of_time(found.time_s, DEGREE) @ truth
    squares = np.mean(errors**2, axis=1)
    return [
        Figure(
            intensity, until, float(time), regression_variance(intensity, until, float(time)),
            float(variance), float(square),
        )
        for time, variance, square in zip(found.time_s, found.variance, squares, strict=True)
    ]  # fmt: skip
