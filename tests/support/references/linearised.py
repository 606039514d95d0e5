"""Derivatives of a radar plot by its biases, in polar form and linearised in Cartesian form."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ShapeError
from multiradar.estimation.array_checks import component_array, require_numbers
from multiradar.estimation.measurement.bias_parameters import known_kinds
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_COSINE,
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_AZIMUTH_SINE,
    PARAMETER_FRAME_EAST,
    PARAMETER_FRAME_NORTH,
    PARAMETER_FRAME_ROTATION,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
)


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


def bias_matrix(
    kinds: ArrayLike,
    range_m: ArrayLike,
    range_rate_mps: ArrayLike,
    azimuth_rate_rad_per_s: ArrayLike,
    azimuth_rad: float = 0.0,
) -> NDArray[np.float64]:
    """Return J: derivative of a plot by the bias parameters of its sensor, equation (1.5).

    Parameters
    ----------
    kinds : (c,) array_like of int
        Kinds of the parameters, as in `SensorTable.parameter_kind`.
    range_m : (...) array_like
        Predicted slant range.
    range_rate_mps, azimuth_rate_rad_per_s : (...) array_like
        Predicted rates of range and azimuth; only the time offset needs them.
    azimuth_rad : float
        Predicted azimuth; only eccentricity and shift of the frame need it.

    Returns
    -------
    (..., 2, c) ndarray
        Derivative of (range m, azimuth rad) with respect to the parameters.

    Raises
    ------
    UnknownParameterError
        If a kind is unknown.
    ShapeError
        If range and rates are not numeric, or their shapes do not match.

    Notes
    -----
    The matrix is exact for offsets and gain. For the time offset it is the first order: the
    error is half the second rate times τ², for an aircraft at 250 m/s passing at 20 km below 2 m
    with τ = 1 s.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.5) and (1.7); C^ς there is J here, in polar form.
    """
    kind = known_kinds(kinds)
    slant, slant_rate, azimuth_rate = _side_by_side(
        require_numbers(range_m, "range"),
        require_numbers(range_rate_mps, "range rate"),
        require_numbers(azimuth_rate_rad_per_s, "azimuth rate"),
    )
    sine, cosine, none = np.sin(azimuth_rad), np.cos(azimuth_rad), np.zeros_like(slant)
    columns = {
        PARAMETER_RANGE_OFFSET: (1.0, 0.0),
        PARAMETER_AZIMUTH_OFFSET: (0.0, 1.0),
        PARAMETER_RANGE_GAIN: (slant, 0.0),
        PARAMETER_TIME_OFFSET: (-slant_rate, -azimuth_rate),
        PARAMETER_AZIMUTH_SINE: (0.0, sine),
        PARAMETER_AZIMUTH_COSINE: (0.0, cosine),
        PARAMETER_FRAME_EAST: (sine, cosine / slant),
        PARAMETER_FRAME_NORTH: (cosine, -sine / slant),
        PARAMETER_FRAME_ROTATION: (0.0, 0.0),
    }
    result = np.zeros((*slant.shape, 2, len(kind)))
    for at, name in enumerate(kind.tolist()):
        result[..., 0, at], result[..., 1, at] = (none + one for one in columns[name])
    return result


def _side_by_side(*arrays: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    try:
        return np.broadcast_arrays(*arrays)
    except ValueError as error:
        shapes = ", ".join(str(one.shape) for one in arrays)
        expected = "shapes that broadcast"
        raise ShapeError("range and rates", expected, (), f"of the shapes {shapes}") from error
