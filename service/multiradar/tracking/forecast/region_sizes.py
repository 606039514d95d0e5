"""Errors of past forecasts: selection of the motion model, and size of regions.

References
----------
Gibbs, I., Candès, E., "Adaptive conformal inference under distribution shift", Advances in Neural
Information Processing Systems 34 (2021): the idea of regions sized by past misses. The project's
own: a fading histogram of errors for each motion model and horizon, with that of the next shorter
horizon as prior, and the model with the smallest calibrated regions.
"""

from typing import ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.state import Fields
from multiradar.tracking.forecast.regions import gaussian_factor

Floats = NDArray[np.float64]

#: Horizons at which forecasts are scored, s; regions between them are interpolated.
HORIZONS_S = np.array([10.0, 30.0, 60.0, 120.0, 300.0])
#: Errors, as error² / sigma², are counted in logarithmic bins of width 1/8 from exp(−7) to exp(9).
CELL = 0.125
EDGES = np.arange(-7.0, 9.0 + 1e-9, CELL)
#: Number of forecasts after which the weight of one has fallen to 1/e.
MEMORY = 1000.0
#: Initial weight, in forecasts, of the next shorter horizon, and at the shortest one of the
#: covariance itself; halved after `SHORTER_HALF` forecasts, so that it does not determine rare
#: errors.
SHORTER = 20.0
SHORTER_HALF = 100.0
#: Number of forecasts from which a horizon counts in the selection of the model.
HEARD = 8.0
#: Number of forecasts from which a horizon is calibrated.
CALIBRATED = 60.0
#: Probabilities of the compared regions: of typical and of large errors.
COMPARED = (0.5, 0.95)
#: Largest fraction of a forecast error that the later position is assumed to share.
LEFT_MAX = 0.5


class Plan(NamedTuple):
    """Model and region size of forecasts.

    Attributes
    ----------
    motion : int
        Index of the motion model.
    calibrated : (k,) bool
        Whether enough forecasts were scored at this horizon; otherwise the covariance has to cover
        the worst case.
    factor : (k,) float64
        The region is {x : (x − m)ᵀ C⁻¹ (x − m) ≤ factor}.
    single : float
        Factor of a Gaussian for this probability.
    """

    motion: int
    calibrated: NDArray[np.bool_]
    factor: Floats
    single: float


class RegionSizes(NamedTuple):
    """Calibration at some time; immutable.

    Attributes
    ----------
    shares : (j, h, cells) float64
        Fractions of errors by model and horizon.
    motion : int
        The best model.
    calibrated_to_s : float
        Horizon up to which its regions are calibrated.
    """

    shares: Floats
    motion: int
    calibrated_to_s: float

    def plan(self, ahead_s: Floats, probability: float, motion: int | None = None) -> Plan:
        """Return model and region size at times ahead: `ForecastScores.plan`."""
        one = gaussian_factor(probability)
        single = np.log(one)
        chosen = self.motion if motion is None else motion
        factors = np.log(_quantiles(self.shares[chosen], probability))
        ahead = np.asarray(ahead_s, np.float64)
        # Logarithms of factors are interpolated linearly over the logarithm of time.
        knots = np.log1p(np.r_[0.0, HORIZONS_S] / HORIZONS_S[0])
        factor = np.interp(np.log1p(ahead / HORIZONS_S[0]), knots, np.r_[single, factors])
        calibrated = ahead <= self.calibrated_to_s
        return Plan(chosen, calibrated, np.exp(np.where(calibrated, factor, single)), one)


class ForecastScores:
    """Errors of past forecasts.

    Parameters
    ----------
    motions : int
        Number of motion models.
    first : int
        Default model before the shortest horizon was scored.
    """

    STATE: ClassVar[Fields] = {
        "_counts": np.ndarray,
        "_heard": np.ndarray,
        "_size": np.ndarray,
        "_settled": RegionSizes,
    }

    def __init__(self, motions: int, first: int) -> None:
        horizons = len(HORIZONS_S)
        self._first_motion = first
        self._counts = np.zeros((motions, horizons, len(EDGES) + 1))
        self._heard = np.zeros(horizons)
        self._size = np.zeros((motions, horizons))
        covariance = np.r_[-np.expm1(-0.5 * np.exp(EDGES)), 1.0]
        self._first = np.diff(covariance, prepend=0.0)
        self.settle()

    @property
    def heard(self) -> Floats:
        """Effective number of forecasts, by horizon; old ones count less."""
        return self._heard.copy()

    @property
    def motion(self) -> int:
        """The best model."""
        return self._settled.motion

    @property
    def sizes(self) -> RegionSizes:
        """The present calibration."""
        return self._settled

    @property
    def calibrated_to_s(self) -> float:
        """Horizon up to which forecasts are calibrated, s: 0 at first, infinite finally."""
        return self._settled.calibrated_to_s

    def record(self, horizon: int, scores: Floats, sizes: Floats) -> None:
        """Record errors of forecasts; `settle` applies them.

        Parameters
        ----------
        horizon : int
            Index in `HORIZONS_S`.
        scores : (m, j) ndarray
            error² / sigma² of each forecast by each model.
        sizes : (m, j) ndarray
            Logarithm of the area of one sigma, half of that of the determinant of the covariance.
        """
        kept = (1.0 - 1.0 / MEMORY) ** len(scores)
        self._counts[:, horizon] *= kept
        self._size[:, horizon] *= kept
        self._heard[horizon] = self._heard[horizon] * kept + len(scores)
        cells = np.searchsorted(EDGES, np.log(np.maximum(scores, 1e-9)))
        motions = np.broadcast_to(np.arange(scores.shape[1]), cells.shape)
        np.add.at(self._counts[:, horizon], (motions, cells), 1.0)
        self._size[:, horizon] += sizes.sum(axis=0)

    def plan(self, ahead_s: Floats, probability: float, motion: int | None = None) -> Plan:
        """Return model and region size at times ahead.

        Parameters
        ----------
        ahead_s : (k,) ndarray
            Times after the state, s, not negative.
        probability : float
            Probability of the region, above 0 and below 1.
        motion : int, optional
            Model; by default the best one.

        Returns
        -------
        Plan
            Constant beyond the longest horizon; interpolated to the covariance itself before the
            shortest.
        """
        # Read once: another thread may update it.
        return self._settled.plan(ahead_s, probability, motion)

    def settle(self) -> None:
        """Select the best model, and the horizon up to which it is calibrated."""
        before = np.broadcast_to(self._first, self._counts[:, 0].shape)
        shares = np.empty_like(self._counts)
        for horizon, heard in enumerate(self._heard.tolist()):
            weight = SHORTER / (1.0 + heard / SHORTER_HALF)
            before = (self._counts[:, horizon] + weight * before) / (heard + weight)
            shares[:, horizon] = before
        counted = self._heard > HEARD
        cost = np.sum(self._size[:, counted] / self._heard[counted], axis=1)
        for probability in COMPARED:
            scale = _quantiles(shares[:, counted], probability) / gaussian_factor(probability)
            cost += np.log(scale).sum(axis=1) / len(COMPARED)
        enough = int(np.cumprod(self._heard > CALIBRATED).sum())
        self._settled = RegionSizes(
            shares,
            int(np.argmin(cost)) if counted[0] else self._first_motion,
            # The longest calibrated horizon is taken to hold beyond it.
            float(np.r_[0.0, HORIZONS_S[:-1], np.inf][enough]),
        )


def standardised(error_m: Floats, covariance_m2: Floats, left_m2: Floats) -> tuple[Floats, Floats]:
    """Return errors of forecasts for `ForecastScores.record`.

    Parameters
    ----------
    error_m : (n, j, 2) ndarray
        From the predicted position of each model to the later estimate.
    covariance_m2 : (n, j, 2, 2) ndarray
        Covariances of the forecasts.
    left_m2 : (n, 2, 2) ndarray
        Covariances of the later estimates.

    Returns
    -------
    scores, sizes : (n, j) ndarray
        error² / sigma², and the logarithm of the area of one sigma.
    """
    inverse = np.linalg.inv(covariance_m2)
    # For correct forecasts the displacement of the track has the covariance C − P: the later
    # estimate shares the fraction P C⁻¹ of the error.
    left = np.minimum(0.5 * np.einsum("njik,nki->nj", inverse, left_m2), LEFT_MAX)
    scores = np.einsum("nji,njik,njk->nj", error_m, inverse, error_m) / (1.0 - left)
    return scores, 0.5 * np.log(np.linalg.det(covariance_m2))


# Quantile of error² / sigma², interpolated linearly within its bin.
def _quantiles(shares: Floats, probability: float) -> Floats:
    below = np.cumsum(shares, axis=-1)
    level = probability * below[..., -1:]
    cell = np.clip((below < level).sum(axis=-1, keepdims=True), 1, len(EDGES) - 1)
    least = np.take_along_axis(below, cell - 1, axis=-1)
    width = np.take_along_axis(below, cell, axis=-1) - least
    part = np.divide(level - least, width, out=np.ones_like(width), where=width > 0.0)
    found: Floats = np.exp(EDGES[cell - 1] + CELL * np.clip(part, 0.0, 1.0))[..., 0]
    return found
