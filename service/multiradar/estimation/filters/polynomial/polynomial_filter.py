"""The polynomial filter: a trajectory that is a polynomial of time, observed in white noise.

X_t = Σ α_k t^k / k!, k = 0 … n, with α normal a priori and t counted from the start. It is observed
through dη = X dt + √C₂ dw (1), or at discrete times with given variances. Estimated are the value
and the derivatives Θ_k(t) = X_t^(k) at any time: at the last observation (filtering), after it
(forecast) or before it (smoothing).

The paper integrates the Riccati equation of the covariance, which diverges numerically for a wide
prior and small noise. There is no process noise (dΘ_n = 0), so no integration is needed: the
information of the observations adds up. It is stored as a root of the information matrix, B with
BᵀB = Σ hᵀh / R, for the coefficients of Legendre polynomials on the observed interval. The prior is
stored separately as given; an estimate combines both in one least squares problem.

Several axes (x and y, or ten thousand runs of a simulation) share one state if they share the
prior covariance, the times and the noise: their means are columns side by side.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.linalg import solve_triangular

from multiradar.errors import ConfigurationError, ForecastError, TimeOrderError
from multiradar.estimation.array_checks import (
    ascending_times,
    finite_array,
    interval_edges,
    is_integer,
    positive_array,
    require_numbers,
    require_shape,
)
from multiradar.estimation.filters.polynomial.polynomial_basis import (
    averages,
    legendre_table,
    restriction,
)
from multiradar.estimation.filters.polynomial.polynomial_information import (
    derivative_rows,
    extended_until,
    legendre_part,
    legendre_points,
    sorted_factor,
    with_measurements,
)
from multiradar.estimation.filters.polynomial.polynomial_state import (
    PolynomialEstimate,
    PolynomialState,
)
from multiradar.estimation.gaussian import require_covariance

Floats = NDArray[np.float64]

#: Maximum magnitude of a time, s: differences of such times are exact to a millisecond.
TIME_MAX_S = 1e12
#: Minimum observed interval, s; shorter ones do not determine derivatives.
SPAN_MIN_S = 1e-9
#: Maximum magnitude of a value, and of 1, in sigmas.
WEIGHT_MAX = 1e100


def start(
    degree: int, mean: ArrayLike, covariance: ArrayLike, start_s: float = 0.0
) -> PolynomialState:
    """Return the state of a prior.

    Parameters
    ----------
    degree : int
        Degree n, 0 or more.
    mean : (n + 1, ...) array_like
        Mean of α_0 … α_n: value (m) and derivatives (m/s, m/s² …) at the start; further
        dimensions are independent axes.
    covariance : (n + 1, n + 1) array_like
        Their covariance, Γ_0, the same for each axis.
    start_s : float
        Time of the prior, s.

    Returns
    -------
    PolynomialState
        State without observations.

    Raises
    ------
    ConfigurationError
        If the degree is negative or not an integer, or the start not finite or beyond `TIME_MAX_S`.
    ShapeError
        If mean or covariance are not of that degree, or not finite.
    CovarianceError
        If the covariance is not symmetric or not positive definite.

    References
    ----------
    Koptev, Rozov, Romanovsky, the initial conditions after equation (1): m_k(0) and γ_ij(0). The
    one given as γ_01(0) = D α_0 is γ_00(0).
    """
    if not is_integer(degree) or degree < 0:
        raise ConfigurationError(f"degree: expected an integer of at least 0, was {degree!r}")
    size = degree + 1
    start_s = float(require_shape(start_s, "start", ()))
    if not abs(start_s) <= TIME_MAX_S:
        expected = f"a finite time within {TIME_MAX_S:g} s of 0"
        raise ConfigurationError(f"start: expected {expected}, was {start_s} s")
    means = require_numbers(mean, "prior mean")
    means = finite_array(means, "prior mean", (size, *means.shape[1:]))
    covariances = finite_array(covariance, "prior covariance", (size, size))
    require_covariance(covariances, "prior covariance")
    return PolynomialState(
        start_s=float(start_s),
        observed_until_s=float(start_s),
        prior_mean=means,
        prior_covariance=covariances,
        root=np.zeros((size, size)),
        vector=np.zeros(means.shape),
    )


def observe(
    state: PolynomialState, times_s: ArrayLike, values_m: ArrayLike, variances_m2: ArrayLike
) -> PolynomialState:
    """Update by measurements of X at discrete times.

    Parameters
    ----------
    state : PolynomialState
        State before.
    times_s : (m,) array_like
        Times in ascending order, equal ones allowed, none before the last observation, s.
    values_m : (m, *axes) array_like
        Measured values, m.
    variances_m2 : (m,) or () array_like
        Variances of the errors, independent of each other, m².

    Returns
    -------
    PolynomialState
        State after. The order of calls does not matter beyond rounding.

    Raises
    ------
    TimeOrderError
        If the times decrease.
    ShapeError
        If the shape of the values is not that of times and axes, or one is not finite.
    ConfigurationError
        If a variance is not above 0, a time is beyond `TIME_MAX_S`, the last time is within
        `SPAN_MIN_S` of the start, or a value exceeds `WEIGHT_MAX` sigmas.

    References
    ----------
    Koptev, Rozov, Romanovsky, equation (1) at discrete times; follows from the linear dependence of
    X on α. Least squares: Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to
    Tracking and Navigation", Wiley 2001, section 3.4.
    """
    times = ascending_times(times_s, "measurement time", state.observed_until_s)
    values = finite_array(values_m, "values", (*times.shape, *state.axes))
    sigmas = np.sqrt(positive_array(variances_m2, "measurement variance", times.shape))
    if not len(times):
        return state
    _require_span(state, times)
    _require_weight(values, sigmas)
    longer = extended_until(state, float(times[-1]))
    rows = legendre_table(state.degree, legendre_points(longer, times), 0)[:, 0, :]
    return with_measurements(longer, rows, values, sigmas)


def observe_increments(
    state: PolynomialState, edges_s: ArrayLike, increments: ArrayLike, noise_intensity: float
) -> PolynomialState:
    """Update by increments η(t_{j+1}) − η(t_j) of the observed process.

    Parameters
    ----------
    state : PolynomialState
        State before.
    edges_s : (m + 1,) array_like
        Times in strictly ascending order, the first not before the last observation, s.
    increments : (m, *axes) array_like
        Increments over the m intervals between the edges, m·s.
    noise_intensity : float
        C₂, above 0, m²·s.

    Returns
    -------
    PolynomialState
        State after, exactly: each increment is the integral of X over its interval, with the
        variance C₂ (t_{j+1} − t_j). Intervals need not be short.

    Raises
    ------
    TimeOrderError, ShapeError, ConfigurationError
        As in `observe`, the last if C₂ is not above 0.

    References
    ----------
    Koptev, Rozov, Romanovsky, equation (1). The paper approximates X as constant over an interval.
    """
    times = interval_edges(edges_s, "interval edge", state.observed_until_s)
    _require_span(state, times)
    lengths = np.diff(times)
    values = finite_array(increments, "increments", (*lengths.shape, *state.axes))
    sigmas = np.sqrt(positive_array(noise_intensity, "noise intensity", ()) * lengths)
    _require_weight(values, sigmas)
    longer = extended_until(state, float(times[-1]))
    rows = averages(state.degree, *legendre_part(longer, times[:-1], times[1:])) * lengths[:, None]
    return with_measurements(longer, rows, values, sigmas)


def observe_interval(
    state: PolynomialState,
    begin_s: float,
    end_s: float,
    moments: ArrayLike,
    noise_intensity: float,
) -> PolynomialState:
    """Update by the observed process over an interval, in continuous time.

    Parameters
    ----------
    state : PolynomialState
        State before.
    begin_s, end_s : float
        The interval, s, at or after the last observation.
    moments : (n + 1, *axes) array_like
        ∫ P_k(u(t)) dη, k = 0 … n, with u running from −1 to 1 over the interval, m·s: sums of the
        increments, each weighted with the Legendre polynomial of its time.
    noise_intensity : float
        C₂, above 0, m²·s.

    Returns
    -------
    PolynomialState
        State after. The information is ∫ φ φᵀ dt / C₂ without discretisation error, so intervals
        may be split anywhere.

    Raises
    ------
    TimeOrderError, ShapeError, ConfigurationError
        As in `observe_increments`.

    Notes
    -----
    The moments are sufficient, and independent of each other: the k-th is (end − begin)/(2k + 1)
    times the k-th Legendre coefficient of X on the interval, with the variance
    C₂ (end − begin)/(2k + 1).

    References
    ----------
    Koptev, Rozov, Romanovsky, equation (1) and the equations of m and γ after it, of which this is
    the exact solution.
    """
    begin, end = interval_edges([begin_s, end_s], "interval end", state.observed_until_s)
    _require_span(state, np.array([begin, end]))
    values = finite_array(moments, "moments", state.prior_mean.shape)
    variance = positive_array(noise_intensity, "noise intensity", ())
    weights = (end - begin) / (2.0 * np.arange(state.degree + 1) + 1.0)
    sigmas = np.sqrt(variance * weights)
    _require_weight(values, sigmas)
    longer = extended_until(state, float(end))
    rows = restriction(state.degree, *legendre_part(longer, begin, end)) * weights[:, None]
    return with_measurements(longer, rows, values, sigmas)


def estimate(state: PolynomialState, times_s: ArrayLike) -> PolynomialEstimate:
    """Estimate the value and all derivatives at given times.

    Parameters
    ----------
    state : PolynomialState
        The state.
    times_s : (...) array_like
        Times, s: at the last observation (filtering), after it (forecast) or before it (smoothing).

    Returns
    -------
    PolynomialEstimate
        m(t) and γ(t).

    Raises
    ------
    ShapeError
        If a time is not finite.
    ForecastError
        If a time is so far ahead that X or its variance exceeds double precision.

    Notes
    -----
    The posterior is that of Bayesian linear regression on t^k / k!, exact but for rounding.
    Compared with exact arithmetic, up to degree 8 and over 1e-3 s to 1e4 s, at all observed times
    and as far ahead, sigmas and correlations are accurate to 1e-11 with at least n + 1
    observations, or with a prior sigma of X below about 1e8 sigmas of an observation. Fewer
    observations under a wider prior (three over 1e4 s at degree 8, with 10 m/s⁸) leave X uncertain
    by 1e30 m, beyond double precision: no result is valid there.

    References
    ----------
    Koptev, Rozov, Romanovsky, the section on the forecast: the estimates of α from m(t), and X̄_t
    from them.
    """
    times = finite_array(times_s, "estimation times")
    # Any interval serves where all observations are at the start.
    alone = state.observed_until_s == state.start_s
    seen = (
        extended_until(state, float(np.nextafter(state.start_s + 1.0, np.inf))) if alone else state
    )
    with np.errstate(over="ignore", invalid="ignore"):
        at_start = derivative_rows(seen, np.array([state.start_s]))[0]
    if not np.isfinite(at_start).all():
        raise ForecastError("time", f"observed interval too short for degree {state.degree}")
    sigmas = np.sqrt(np.diagonal(state.prior_covariance))
    factor = np.linalg.cholesky(state.prior_covariance / np.outer(sigmas, sigmas))
    prior = np.hstack([at_start, state.prior_mean.reshape(state.degree + 1, -1)])
    prior = solve_triangular(factor, prior / sigmas[:, None], lower=True)
    given = np.hstack([seen.root, seen.vector.reshape(state.degree + 1, -1)])
    size = state.degree + 1
    stacked = np.vstack([prior, given])
    triangle, order, vector = sorted_factor(stacked[:, :size], stacked[:, size:])
    with np.errstate(over="ignore", invalid="ignore"):
        rows = derivative_rows(seen, times.reshape(-1))[:, :, order].reshape(-1, size)
        spread = solve_triangular(triangle, rows.T, trans="T", check_finite=False).T
        mean = (spread @ vector).reshape(*times.shape, size, *state.axes)
        spread = spread.reshape(*times.shape, size, size)
        covariance = spread @ np.swapaxes(spread, -1, -2)
    if not (np.isfinite(mean).all() and np.isfinite(covariance).all()):
        raise ForecastError("time", "too far ahead: the estimate exceeds double precision")
    return PolynomialEstimate(times, mean, covariance)


def forecast(state: PolynomialState, horizons_s: ArrayLike) -> PolynomialEstimate:
    """Forecast from the last observation.

    Parameters
    ----------
    state : PolynomialState
        The state.
    horizons_s : (...) array_like
        Forecast horizons, 0 s or more.

    Returns
    -------
    PolynomialEstimate
        The forecast with its covariance: `estimate` at the last observation plus the horizon.

    Raises
    ------
    ShapeError
        If a horizon is not finite.
    TimeOrderError
        If a horizon is negative.

    References
    ----------
    Koptev, Rozov, Romanovsky, the section on the forecast: X̄_t for t ≥ t*, and D_п(t).
    """
    horizons = finite_array(horizons_s, "forecast horizons")
    if (horizons < 0.0).any():
        raise TimeOrderError("forecast horizon", float(horizons.min()), 0.0)
    return estimate(state, state.observed_until_s + horizons)


# The squares of normalised values must not overflow.
def _require_weight(values: Floats, sigmas: Floats) -> None:
    most = float(np.abs(values).max(initial=0.0))
    least = float(sigmas.min(initial=1.0))
    if not max(most, 1.0) < WEIGHT_MAX * least:
        raise ConfigurationError(
            f"values: expected sigmas above 1e-100 and values below 1e+100 sigmas, found {most:g} "
            f"with a sigma of {least:g}"
        )


# Times within `TIME_MAX_S`, and either at the start or at least `SPAN_MIN_S` after it.
def _require_span(state: PolynomialState, times: Floats) -> None:
    if np.abs(times).max() > TIME_MAX_S:
        far = float(times[np.abs(times).argmax()])
        raise ConfigurationError(
            f"observation time: expected within {TIME_MAX_S:g} s of 0, was {far:g} s"
        )
    span = float(times[-1]) - state.start_s
    if 0.0 < span < SPAN_MIN_S:
        raise ConfigurationError(
            f"observation time: expected the start time, or at least {SPAN_MIN_S:g} s later; was "
            f"{span:g} s later"
        )
