"""Regions that hold a given probability: ellipses of mean and covariance, for mixtures too."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ConfigurationError
from multiradar.estimation.array_checks import finite_array, require_shape
from multiradar.estimation.gaussian import require_covariance
from multiradar.tracking.forecast._region_kernels import find_radii

Floats = NDArray[np.float64]

#: A component is taken to be at least as wide as this part of the mixture's own sigma.
NARROWEST = 0.002
# How far weights may be from a sum of one.
_SUM_ERROR = 1e-6


class Ellipses(NamedTuple):
    """Ellipses in a plane of east and north.

    Attributes
    ----------
    major_m, minor_m : (n,) float64
        Semi-axes, m.
    azimuth_rad : (n,) float64
        Direction of the major one, clockwise from north, 0 to below π.
    """

    major_m: Floats
    minor_m: Floats
    azimuth_rad: Floats


def gaussian_factor(probability: float) -> float:
    """Return how large an ellipse of one Gaussian in the plane must be to hold a probability.

    Parameters
    ----------
    probability : float
        Above 0 and below 1.

    Returns
    -------
    float
        The k of {x : (x − m)ᵀ C⁻¹ (x − m) ≤ k}: −2 ln(1 − p).

    Raises
    ------
    ConfigurationError
        If it is no such probability.
    """
    # Written so that NaN fails.
    if not 0.0 < probability < 1.0:
        msg = f"probability: expected more than 0 and less than 1, was {probability}"
        raise ConfigurationError(msg)
    return float(-2.0 * np.log1p(-probability))


def region_factor(
    weights: ArrayLike, means: ArrayLike, covariances: ArrayLike, probability: float
) -> float:
    """Return how large the ellipse of a mixture must be to hold a probability of it.

    Parameters
    ----------
    weights : (k,) array_like
        Of sum one, none negative.
    means : (k, 2) array_like
        East and north, m.
    covariances : (k, 2, 2) array_like
        m².
    probability : float
        Above 0 and below 1.

    Returns
    -------
    float
        See `region_factors`.

    Raises
    ------
    ConfigurationError, ShapeError, CovarianceError
        See `region_factors`.
    """
    whole = require_shape(weights, "weights of a mixture", (None,))
    # Adding an axis before the checks of shape are made makes them those of all mixtures.
    rows = [np.asarray(one)[None] for one in (whole, means, covariances)]
    return float(region_factors(rows[0], rows[1], rows[2], probability)[0])


def region_factors(
    weights: ArrayLike, means: ArrayLike, covariances: ArrayLike, probability: float
) -> Floats:
    """Return how large the ellipses of mixtures must be to hold a probability of them.

    Parameters
    ----------
    weights : (n, k) array_like
        Weights of the components of each mixture, of sum one, none negative.
    means : (n, k, 2) array_like
        East and north, m.
    covariances : (n, k, 2, 2) array_like
        m².
    probability : float
        Above 0 and below 1.

    Returns
    -------
    (n,) ndarray
        The k of {x : (x − m)ᵀ C⁻¹ (x − m) ≤ k} with the mean m and the covariance C of the whole
        mixture; −2 ln(1 − p) for one component.

    Raises
    ------
    ConfigurationError
        If the probability or weights are none.
    ShapeError
        If the shapes do not belong together, or numbers are none or not finite.
    CovarianceError
        If a component with a weight has no covariance.

    Notes
    -----
    Within 1e-8 of the probability, by the same steps for the same numbers. A component that is
    narrower than `NARROWEST` of the mixture's sigma in some direction is taken to be so wide: that
    moves the rim by less than a hundredth of a sigma.
    """
    single = gaussian_factor(probability)
    chances = finite_array(weights, "weights of a mixture", (None, None))
    n, k = chances.shape
    centres = finite_array(means, "means of a mixture", (n, k, 2))
    spreads = finite_array(covariances, "covariances of a mixture", (n, k, 2, 2))
    if (chances < 0.0).any() or (np.abs(chances.sum(axis=1) - 1.0) > _SUM_ERROR).any():
        msg = "weights of a mixture: expected none below 0 and a sum of 1, were others"
        raise ConfigurationError(msg)
    require_covariance(spreads[chances > 0.0], "covariances of a mixture")
    if n == 0 or k == 1:
        return np.full(n, single)
    whitened = _whitened(chances, centres, spreads)
    radii = np.empty(n)
    find_radii(chances, *whitened, probability, radii)
    # One component alone is known exactly.
    return np.where((chances > 0.0).sum(axis=1) == 1, single, radii**2)


def mixed(weights: Floats, means: Floats, covariances: Floats) -> tuple[Floats, Floats]:
    """Return the means (…, 2) and covariances (…, 2, 2) of mixtures of k components.

    Parameters
    ----------
    weights : (…, k) ndarray
        Of sum one.
    means : (…, k, 2) ndarray
        East and north, m.
    covariances : (…, k, 2, 2) ndarray
        m².

    Returns
    -------
    means, covariances : (…, 2) and (…, 2, 2) ndarray
        What the components differ by included.
    """
    mean = np.einsum("...k,...ki->...i", weights, means)
    apart = means - mean[..., None, :]
    spread = covariances + apart[..., :, None] * apart[..., None, :]
    return mean, np.einsum("...k,...kij->...ij", weights, spread)


def ellipses(covariances: Floats, factors: Floats | float) -> Ellipses:
    """Return the ellipses of covariances.

    Parameters
    ----------
    covariances : (n, 2, 2) ndarray
        Of east and north, m².
    factors : (n,) ndarray or float
        The k of {x : xᵀ C⁻¹ x ≤ k}.

    Returns
    -------
    Ellipses
        One for each; the azimuth of a circle is that of rounding.
    """
    values, vectors = np.linalg.eigh(covariances)
    axes = np.sqrt(np.maximum(values, 0.0) * np.asarray(factors)[..., None])
    azimuth_rad = np.arctan2(vectors[..., 0, 1], vectors[..., 1, 1]) % np.pi
    return Ellipses(axes[..., 1], axes[..., 0], azimuth_rad)


# The mixtures as seen where their own mean is 0 and their covariance the unit matrix.
def _whitened(chances: Floats, centres: Floats, spreads: Floats) -> tuple[Floats, Floats]:
    mean, covariance = mixed(chances, centres, spreads)
    root = np.linalg.inv(np.linalg.cholesky(covariance))
    seen = np.einsum("nij,nkj->nki", root, centres - mean[:, None])
    within = root[:, None] @ spreads @ root[:, None].swapaxes(-1, -2)
    # Of a component without weight nothing is known.
    within[chances == 0.0] = np.eye(2)
    values, vectors = np.linalg.eigh(0.5 * (within + within.swapaxes(-1, -2)))
    values = np.maximum(values, NARROWEST**2)
    wide = (vectors * values[..., None, :]) @ vectors.swapaxes(-1, -2)
    return seen, np.stack([wide[..., 0, 0], wide[..., 0, 1], wide[..., 1, 1]], axis=-1)
