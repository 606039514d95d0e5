"""How far past forecasts were off: which motion fits the traffic, and how large regions must be.

References
----------
Gibbs, I., Candès, E., "Adaptive conformal inference under distribution shift", Advances in Neural
Information Processing Systems 34 (2021): regions whose size follows from past misses. The
project's own: a fading histogram of errors for each motion and horizon, each on top of that of the
shorter horizon, and the motion whose calibrated regions are smallest.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.forecast.regions import gaussian_factor

Floats = NDArray[np.float64]

#: Times ahead by which forecasts are judged, s; regions between them are in between.
HORIZONS_S = np.array([10.0, 30.0, 60.0, 120.0, 300.0])
#: Errors, as error² / sigma², are counted in steps of an eighth of e from exp(−7) to exp(9).
CELL = 0.125
EDGES = np.arange(-7.0, 9.0 + 1e-9, CELL)
#: Forecasts after which one counts for a third of a new one.
MEMORY = 1000.0
#: For how many forecasts the shorter horizon, and at the shortest the covariance itself, counts at
#: first; for half as many when `SHORTER_HALF` have been judged, or it would rule the rare errors.
SHORTER = 20.0
SHORTER_HALF = 100.0
#: After so many forecasts a horizon has a say in which motion fits.
HEARD = 8.0
#: After so many it is calibrated.
CALIBRATED = 60.0
#: Regions of these probabilities are compared: how far off most are, and how far the worst.
COMPARED = (0.5, 0.95)
#: Most of an error of a forecast that a later place is taken to have still.
LEFT_MAX = 0.5


class Plan(NamedTuple):
    """How tracks are forecast.

    Attributes
    ----------
    motion : int
        Which motion of the family.
    calibrated : (k,) bool
        Whether enough forecasts have been judged as far ahead; elsewhere the covariance has to
        cover what aircraft may do at worst.
    factor : (k,) float64
        The region is {x : (x − m)ᵀ C⁻¹ (x − m) ≤ factor}.
    single : float
        The factor of one Gaussian of this probability.
    """

    motion: int
    calibrated: NDArray[np.bool_]
    factor: Floats
    single: float


class Learnt(NamedTuple):
    """What was learnt up to some time; it stays as it is while more is learnt.

    Attributes
    ----------
    shares : (j, h, cells) float64
        Shares of errors by motion and horizon.
    motion : int
        The motion that fits best.
    calibrated_to_s : float
        How far ahead its regions are known.
    """

    shares: Floats
    motion: int
    calibrated_to_s: float

    def plan(self, ahead_s: Floats, probability: float, motion: int | None = None) -> Plan:
        """Return the motion and the size of the region at times ahead: `ForecastScores.plan`."""
        one = gaussian_factor(probability)
        single = np.log(one)
        chosen = self.motion if motion is None else motion
        learnt = np.log(_quantiles(self.shares[chosen], probability))
        ahead = np.asarray(ahead_s, np.float64)
        # Logarithms of factors lie on lines over that of the time.
        knots = np.log1p(np.r_[0.0, HORIZONS_S] / HORIZONS_S[0])
        factor = np.interp(np.log1p(ahead / HORIZONS_S[0]), knots, np.r_[single, learnt])
        calibrated = ahead <= self.calibrated_to_s
        return Plan(chosen, calibrated, np.exp(np.where(calibrated, factor, single)), one)


class ForecastScores:
    """What past forecasts tell of future ones.

    Parameters
    ----------
    motions : int
        Number of motions that are compared.
    first : int
        The one that is taken before the shortest horizon has been judged.
    """

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
        """Forecasts that count, by horizon; old ones count less."""
        return self._heard.copy()

    @property
    def motion(self) -> int:
        """The motion that fits best."""
        return self._settled.motion

    @property
    def learnt(self) -> Learnt:
        """What has been learnt until now."""
        return self._settled

    @property
    def calibrated_to_s(self) -> float:
        """How far ahead enough forecasts have been judged, s: 0 at first, infinite in the end."""
        return self._settled.calibrated_to_s

    def take(self, horizon: int, scores: Floats, sizes: Floats) -> None:
        """Count forecasts whose truth has become known; `settle` makes them tell.

        Parameters
        ----------
        horizon : int
            Place in `HORIZONS_S`.
        scores : (m, j) ndarray
            error² / sigma² of each forecast by each motion.
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
        """Return the motion and the size of the region at times ahead.

        Parameters
        ----------
        ahead_s : (k,) ndarray
            Times after the state, s, not negative.
        probability : float
            That of the region, above 0 and below 1.
        motion : int, optional
            The motion that is asked for; the one that fits best without.

        Returns
        -------
        Plan
            Beyond the longest horizon as there; before the shortest on the way from the
            covariance itself.
        """
        # Read at once, for any thread may ask while another one learns.
        return self._settled.plan(ahead_s, probability, motion)

    def settle(self) -> None:
        """Find the motion that fits best, and how far its regions are known."""
        before = np.broadcast_to(self._first, self._counts[:, 0].shape)
        shares = np.empty_like(self._counts)
        for horizon, heard in enumerate(self._heard.tolist()):
            weight = SHORTER / (1.0 + heard / SHORTER_HALF)
            before = (self._counts[:, horizon] + weight * before) / (heard + weight)
            shares[:, horizon] = before
        told = self._heard > HEARD
        cost = np.sum(self._size[:, told] / self._heard[told], axis=1)
        for probability in COMPARED:
            scale = _quantiles(shares[:, told], probability) / gaussian_factor(probability)
            cost += np.log(scale).sum(axis=1) / len(COMPARED)
        enough = int(np.cumprod(self._heard > CALIBRATED).sum())
        self._settled = Learnt(
            shares,
            int(np.argmin(cost)) if told[0] else self._first_motion,
            # What holds at the longest horizon is taken to hold beyond it.
            float(np.r_[0.0, HORIZONS_S[:-1], np.inf][enough]),
        )


def standardised(error_m: Floats, covariance_m2: Floats, left_m2: Floats) -> tuple[Floats, Floats]:
    """Return errors of forecasts as `ForecastScores.take` takes them.

    Parameters
    ----------
    error_m : (n, j, 2) ndarray
        From where each motion expected an aircraft to where it is said to be later.
    covariance_m2 : (n, j, 2, 2) ndarray
        Of the forecasts.
    left_m2 : (n, 2, 2) ndarray
        Of the errors that what is said later has itself.

    Returns
    -------
    scores, sizes : (n, j) ndarray
        error² / sigma², and the logarithm of the area of one sigma.
    """
    inverse = np.linalg.inv(covariance_m2)
    # Where forecasts are right, what a track has moved by when the time has come has the
    # covariance C − P: the part P C⁻¹ of the error it still has.
    left = np.minimum(0.5 * np.einsum("njik,nki->nj", inverse, left_m2), LEFT_MAX)
    scores = np.einsum("nji,njik,njk->nj", error_m, inverse, error_m) / (1.0 - left)
    return scores, 0.5 * np.log(np.linalg.det(covariance_m2))


# The error² / sigma² below which a share of the errors lies, on a line within its cell.
def _quantiles(shares: Floats, probability: float) -> Floats:
    below = np.cumsum(shares, axis=-1)
    level = probability * below[..., -1:]
    cell = np.clip((below < level).sum(axis=-1, keepdims=True), 1, len(EDGES) - 1)
    least = np.take_along_axis(below, cell - 1, axis=-1)
    width = np.take_along_axis(below, cell, axis=-1) - least
    part = np.divide(level - least, width, out=np.ones_like(width), where=width > 0.0)
    found: Floats = np.exp(EDGES[cell - 1] + CELL * np.clip(part, 0.0, 1.0))[..., 0]
    return found
