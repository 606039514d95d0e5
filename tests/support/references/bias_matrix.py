"""Derivative of a plot by the bias parameters of its radar, as a matrix."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ShapeError
from multiradar.estimation.array_checks import require_numbers
from multiradar.estimation.measurement.bias_parameters import known_kinds
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
)


def bias_matrix(
    kinds: ArrayLike,
    range_m: ArrayLike,
    range_rate_mps: ArrayLike,
    azimuth_rate_rad_per_s: ArrayLike,
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
    result = np.zeros((*slant.shape, 2, len(kind)))
    for column, name in enumerate(kind):
        if name == PARAMETER_RANGE_OFFSET:
            result[..., 0, column] = 1.0
        elif name == PARAMETER_AZIMUTH_OFFSET:
            result[..., 1, column] = 1.0
        elif name == PARAMETER_RANGE_GAIN:
            result[..., 0, column] = slant
        elif name == PARAMETER_TIME_OFFSET:
            result[..., 0, column] = -slant_rate
            result[..., 1, column] = -azimuth_rate
    return result


def _side_by_side(*arrays: NDArray[np.float64]) -> tuple[NDArray[np.float64], ...]:
    try:
        return np.broadcast_arrays(*arrays)
    except ValueError as error:
        shapes = ", ".join(str(one.shape) for one in arrays)
        expected = "shapes that broadcast"
        raise ShapeError("range and rates", expected, (), f"of the shapes {shapes}") from error
