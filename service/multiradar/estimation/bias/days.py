"""What separate recordings say about the same biases: combination, steps and linear drift.

Estimates of recordings that started from the same priors, or from each other, are not independent.
The information of the start is therefore subtracted first, with the joint covariance of all biases.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc

from multiradar.estimation.bias.store import BiasState, symmetric_inverse

Floats = NDArray[np.float64]

#: Information below this has no digits of its own; in units of that of the prior.
_INFORMATION_MIN = 1e-6


@dataclass(frozen=True, slots=True)
class OwnInformation:
    """Information of the measurements of one recording about the biases, apart from its start.

    Attributes
    ----------
    matrix : (c, c) float64
        Information matrix in units of prior standard deviations; positive semidefinite.
    vector : (c,) float64
        Information vector: the matrix times the estimate.
    scale : (c,) float64
        Prior standard deviations, m, rad, 1 or s by kind.
    """

    matrix: Floats
    vector: Floats
    scale: Floats


@dataclass(frozen=True, slots=True)
class OwnEstimate:
    """Biases from the measurements of one recording alone.

    Attributes
    ----------
    value : (c,) float64
        Estimates, m, rad, 1 or s by kind; independent of those of other recordings.
    covariance : (c, c) float64
        Their covariance.
    determined : (c,) bool
        Whether sigma is below the prior standard deviation; other estimates have no meaning.
    """

    value: Floats
    covariance: Floats
    determined: NDArray[np.bool_]

    @property
    def sigma(self) -> Floats:
        """Standard deviations, (c,) float64."""
        sigma: Floats = np.sqrt(np.diagonal(self.covariance))
        return sigma


@dataclass(frozen=True, slots=True)
class ChiSquare:
    """A test: its statistic, and the probability of a larger one by chance.

    Attributes
    ----------
    statistic : float
        χ².
    degrees_of_freedom : int
        Of its distribution if nothing has changed.
    """

    statistic: float
    degrees_of_freedom: int

    @property
    def p_value(self) -> float:
        """Probability of a larger statistic if nothing has changed."""
        return float(gammaincc(0.5 * self.degrees_of_freedom, 0.5 * max(self.statistic, 0.0)))


@dataclass(frozen=True, slots=True)
class Line:
    """A straight line through the estimates of one bias.

    Attributes
    ----------
    slope, sigma : float
        Change per unit of time, and its standard deviation by that of the estimates.
    about : ChiSquare
        Scatter of the estimates about the line.
    """

    slope: float
    sigma: float
    about: ChiSquare

    @property
    def drift(self) -> ChiSquare:
        """The test for a slope other than zero."""
        return ChiSquare((self.slope / self.sigma) ** 2, 1)


def own_information(start: BiasState, end: BiasState) -> OwnInformation:
    """Return the information of the measurements between two states of the biases.

    Parameters
    ----------
    start : BiasState
        From which the recording started, with the drift of its duration.
    end : BiasState
        At its end.

    Returns
    -------
    OwnInformation
        Y₁ - Y₀ and Y₁ ς̂₁ - Y₀ ς̂₀, with Y the inverse of the covariance of each state.

    Notes
    -----
    Exact for biases that do not drift. The start of one that drifts says less about its end than
    subtracted here, so that the information is rather too small.

    References
    ----------
    Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
    Navigation", Wiley 2001, section 8.7: decorrelation of estimates by subtraction of the common
    information.
    """
    scale = np.outer(end.scale, end.scale)
    before = symmetric_inverse(start.covariance / scale)
    after = symmetric_inverse(end.covariance / scale)
    amount, axes = np.linalg.eigh(after - before)
    used = amount > _INFORMATION_MIN
    vector = after @ (end.estimate / end.scale) - before @ (start.estimate / end.scale)
    along = np.where(used, axes.T @ vector, 0.0)
    matrix = (axes * np.where(used, amount, 0.0)) @ axes.T
    return OwnInformation((matrix + matrix.T) / 2.0, axes @ along, end.scale)


def own_estimate(information: OwnInformation) -> OwnEstimate:
    """Return the biases from the measurements of one recording alone.

    Parameters
    ----------
    information : OwnInformation
        Of the recording.

    Returns
    -------
    OwnEstimate
        Biases that it does not determine have a sigma above that of the prior.
    """
    amount, axes = np.linalg.eigh(information.matrix)
    spread = 1.0 / np.maximum(amount, _INFORMATION_MIN)
    covariance = (axes * spread) @ axes.T
    scale = information.scale
    return OwnEstimate(
        value=covariance @ information.vector * scale,
        covariance=(covariance + covariance.T) / 2.0 * np.outer(scale, scale),
        determined=np.diagonal(covariance) < 1.0,
    )


def merged(parts: Sequence[OwnInformation], prior: BiasState) -> BiasState:
    """Return the biases from all recordings together, if they are the same in all of them.

    Parameters
    ----------
    parts : sequence of OwnInformation
        Of each recording.
    prior : BiasState
        Counted once.

    Returns
    -------
    BiasState
        The prior with the information of all recordings added.
    """
    scale = np.outer(prior.scale, prior.scale)
    before = symmetric_inverse(prior.covariance / scale)
    matrix = before + sum(part.matrix for part in parts)
    vector = before @ (prior.estimate / prior.scale) + sum(part.vector for part in parts)
    covariance = symmetric_inverse(matrix)
    return BiasState(covariance @ vector * prior.scale, covariance * scale, prior.scale)


def step(before: OwnEstimate, after: OwnEstimate, columns: NDArray[np.intp]) -> ChiSquare:
    """Test whether biases are the same in two recordings.

    Parameters
    ----------
    before, after : OwnEstimate
        Of the recordings, which are independent.
    columns : (k,) int
        The biases to test together, determined by both.

    Returns
    -------
    ChiSquare
        dᵀ C⁻¹ d, with d the difference and C the sum of the covariances.
    """
    block = np.ix_(columns, columns)
    difference = after.value[columns] - before.value[columns]
    covariance = before.covariance[block] + after.covariance[block]
    return ChiSquare(_square(difference, covariance), len(columns))


def scatter(days: Sequence[OwnEstimate], columns: NDArray[np.intp]) -> ChiSquare:
    """Test whether biases are the same in all recordings.

    Parameters
    ----------
    days : sequence of OwnEstimate
        Of the recordings, at least one.
    columns : (k,) int
        The biases to test together, determined by all.

    Returns
    -------
    ChiSquare
        Sum over the recordings of the squared distance from the weighted mean.
    """
    block = np.ix_(columns, columns)
    scale = np.sqrt(np.diagonal(days[0].covariance))[columns]
    weights = [
        symmetric_inverse(np.ascontiguousarray(day.covariance[block]) / np.outer(scale, scale))
        for day in days
    ]
    values = [day.value[columns] / scale for day in days]
    total = sum(weights, np.zeros((len(columns), len(columns))))
    weighted = np.array([one @ value for one, value in zip(weights, values, strict=True)])
    mean = symmetric_inverse(total) @ weighted.sum(axis=0)
    statistic = sum(
        float((value - mean) @ one @ (value - mean))
        for one, value in zip(weights, values, strict=True)
    )
    return ChiSquare(statistic, (len(days) - 1) * len(columns))


def line(time: Floats, value: Floats, sigma: Floats) -> Line:
    """Fit a straight line to independent estimates of one bias.

    Parameters
    ----------
    time : (n,) float64
        Times of the estimates, at least two.
    value, sigma : (n,) float64
        The estimates and their standard deviations.

    Returns
    -------
    Line
        The slope, and the scatter about the line, with n - 2 degrees of freedom.
    """
    weight = sigma**-2.0
    centred = time - np.average(time, weights=weight)
    information = float(np.sum(weight * centred**2))
    slope = float(np.sum(weight * centred * value)) / information
    left = value - np.average(value, weights=weight) - slope * centred
    about = ChiSquare(float(np.sum(weight * left**2)), len(time) - 2)
    return Line(slope, float(information**-0.5), about)


def _square(difference: Floats, covariance: Floats) -> float:
    scale = np.sqrt(np.diagonal(covariance))
    inverse = symmetric_inverse(covariance / np.outer(scale, scale))
    return float((difference / scale) @ inverse @ (difference / scale))
