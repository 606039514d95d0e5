"""Regions of given probability: ellipses of Gaussians and of mixtures."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ConfigurationError
from multiradar.estimation.array_checks import finite_array, require_shape
from multiradar.estimation.gaussian import require_covariance
from multiradar.tracking.forecast._region_kernels import find_radii

Floats = NDArray[np.float64]

#: Minimum width of a component, as a fraction of the mixture's sigma.
NARROWEST = 0.002
# Tolerance of the sum of weights.
_SUM_ERROR = 1e-6


class Ellipses(NamedTuple):
    """Ellipses in the plane.

    Attributes
    ----------
    major_m, minor_m : (n,) float64
        Semi-axes, m.
    azimuth_rad : (n,) float64
        Direction of the major axis, clockwise from north, 0 to below π.
    """

    major_m: Floats
    minor_m: Floats
    azimuth_rad: Floats


def gaussian_factor(probability: float) -> float:
    """Return the size of the ellipse of a Gaussian with a given probability.

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
        If it is out of these bounds.
    """
    # Written so that NaN fails.
    if not 0.0 < probability < 1.0:
        msg = f"probability: expected a number above 0 and below 1, was {probability}"
        raise ConfigurationError(msg)
    return float(-2.0 * np.log1p(-probability))


def region_factor(
    weights: ArrayLike, means: ArrayLike, covariances: ArrayLike, probability: float
) -> float:
    """Return the size of the ellipse of a mixture with a given probability.

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
    # The axis added before the checks of shape makes them those of all mixtures.
    rows = [np.asarray(one)[None] for one in (whole, means, covariances)]
    return float(region_factors(rows[0], rows[1], rows[2], probability)[0])


def region_factors(
    weights: ArrayLike, means: ArrayLike, covariances: ArrayLike, probability: float
) -> Floats:
    """Return the sizes of the ellipses of mixtures with a given probability.

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
        If the probability or weights are invalid.
    ShapeError
        If the shapes do not match, or values are not finite numbers.
    CovarianceError
        If a component with a weight has an invalid covariance.

    Notes
    -----
    Within 1e-8 of the probability. A component narrower than `NARROWEST` of the mixture's sigma in
    some direction is widened to it, which moves the rim by less than a hundredth of a sigma.
    """
    single = gaussian_factor(probability)
    shares = finite_array(weights, "weights of a mixture", (None, None))
    n, k = shares.shape
    centres = finite_array(means, "means of a mixture", (n, k, 2))
    spreads = finite_array(covariances, "covariances of a mixture", (n, k, 2, 2))
    if (shares < 0.0).any() or (np.abs(shares.sum(axis=1) - 1.0) > _SUM_ERROR).any():
        msg = "weights of a mixture: expected non-negative weights with a sum of 1"
        raise ConfigurationError(msg)
    require_covariance(spreads[shares > 0.0], "covariances of a mixture")
    if n == 0 or k == 1:
        return np.full(n, single)
    whitened = _whitened(shares, centres, spreads)
    radii = np.empty(n)
    find_radii(shares, *whitened, probability, radii)
    # A single component has the exact factor.
    return np.where((shares > 0.0).sum(axis=1) == 1, single, radii**2)


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
        Including the spread of the components.
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
        One per covariance; the azimuth of a circle is arbitrary.
    """
    values, vectors = np.linalg.eigh(covariances)
    axes = np.sqrt(np.maximum(values, 0.0) * np.asarray(factors)[..., None])
    azimuth_rad = np.arctan2(vectors[..., 0, 1], vectors[..., 1, 1]) % np.pi
    return Ellipses(axes[..., 1], axes[..., 0], azimuth_rad)


# The mixtures in coordinates with mean 0 and unit covariance.
def _whitened(shares: Floats, centres: Floats, spreads: Floats) -> tuple[Floats, Floats]:
    mean, covariance = mixed(shares, centres, spreads)
    root = np.linalg.inv(np.linalg.cholesky(covariance))
    seen = np.einsum("nij,nkj->nki", root, centres - mean[:, None])
    within = root[:, None] @ spreads @ root[:, None].swapaxes(-1, -2)
    # A component without weight has no information.
    within[shares == 0.0] = np.eye(2)
    values, vectors = np.linalg.eigh(0.5 * (within + within.swapaxes(-1, -2)))
    values = np.maximum(values, NARROWEST**2)
    wide = (vectors * values[..., None, :]) @ vectors.swapaxes(-1, -2)
    return seen, np.stack([wide[..., 0, 0], wide[..., 0, 1], wide[..., 1, 1]], axis=-1)
