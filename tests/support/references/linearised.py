"""The linearised Cartesian form of a radar plot, as in the report."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ShapeError
from multiradar.estimation.array_checks import component_array


def cartesian_bias_matrix(site_m: ArrayLike, position_m: ArrayLike) -> NDArray[np.float64]:
    """Return C^ς = D: derivative of the position by range and azimuth, equation (1.11).

    Parameters
    ----------
    site_m : (..., 2) array_like
        East and north of the radar, m.
    position_m : (..., 2) array_like
        East and north of the aircraft, m; in a filter the predicted position.

    Returns
    -------
    (..., 2, 2) ndarray
        Columns: along the line of sight for a metre of range; across it, clockwise, for a radian
        of azimuth.

    Raises
    ------
    ShapeError
        If an aircraft is at the position of the radar, without a line of sight, or a position is
        not two numbers.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.11), with Ω = [[0, 1], [−1, 0]].
    """
    place = component_array(position_m, "position", 2)
    line = place - component_array(site_m, "site of the radar", 2)
    length = np.linalg.norm(line, axis=-1)
    if not (length > 0.0).all():
        raise ShapeError("position", "a distance from the radar", place.shape, "the radar's own")
    across = np.stack([line[..., 1], -line[..., 0]], axis=-1)  # Ω (x − x^R), (1.11)
    return np.stack([line / length[..., None], across], axis=-1)


def cartesian_noise(
    bias_matrix: NDArray[np.float64], range_sigma_m: ArrayLike, azimuth_sigma_rad: ArrayLike
) -> NDArray[np.float64]:
    """Return D W Dᵀ, the covariance of the noise of the position; W is that of (1.13).

    Parameters
    ----------
    bias_matrix : (..., 2, 2) ndarray
        D = C^ς, from `cartesian_bias_matrix`.
    range_sigma_m, azimuth_sigma_rad : (...) array_like
        Standard deviations of the random errors.

    Returns
    -------
    (..., 2, 2) ndarray
        Covariance, m².

    References
    ----------
    IMM UrO RAN report (2016), equations (1.11) and (1.13); the noise term of (1.28).
    """
    sigmas = np.stack(np.broadcast_arrays(range_sigma_m, azimuth_sigma_rad), axis=-1)
    scaled = bias_matrix * sigmas[..., None, :]
    return np.asarray(scaled @ np.swapaxes(scaled, -1, -2))
