"""Each bias parameter against a plot that has it."""

import math

import numpy as np
import pytest

from multiradar.errors import ShapeError, UnknownParameterError
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_NAMES,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
)
from multiradar.geodesy import _kernels as kernels
from support.references.linearised import bias_matrix

PLANE = kernels.plane_parameters(0.98, 1.06)
SITE = kernels.site_parameters(PLANE, 0.985, 1.05, 300.0)
STATE = np.array([61_000.0, -18_000.0, 140.0, 195.0])
HEIGHT_M = 9_500.0


def true_plot(time_s: float) -> np.ndarray:
    east, north = STATE[:2] + time_s * STATE[2:]
    return np.array(kernels.predict_polar(PLANE, SITE, east, north, HEIGHT_M)[:2])


def rates() -> np.ndarray:
    found = kernels.predict_polar(PLANE, SITE, STATE[0], STATE[1], HEIGHT_M)
    jacobian = np.array(found[2:6]).reshape(2, 2)
    return np.asarray(jacobian @ STATE[2:])


def test_every_named_parameter_has_a_column() -> None:
    kinds = np.arange(len(PARAMETER_NAMES))
    assert bias_matrix(kinds, 1e5, 100.0, 1e-3).shape == (2, len(PARAMETER_NAMES))


def test_offsets_add_unchanged() -> None:
    matrix = bias_matrix([PARAMETER_AZIMUTH_OFFSET, PARAMETER_RANGE_OFFSET], 1e5, 100.0, 1e-3)
    np.testing.assert_array_equal(matrix, [[0.0, 1.0], [1.0, 0.0]])


def test_gain_is_measured_over_true_range() -> None:
    """A radar that measures 0.1 % long has the gain +0.001."""
    slant, azimuth = true_plot(0.0)
    measured = np.array([slant * 1.001, azimuth])
    matrix = bias_matrix([PARAMETER_RANGE_GAIN], slant, *rates())
    np.testing.assert_allclose(measured - matrix @ [0.001], true_plot(0.0), rtol=1e-12)


def test_a_late_time_stamp_is_a_positive_time_offset() -> None:
    """Stamped 0.8 s late, the plot shows the position of 0.8 s before; the rest is below 1 m."""
    measured = true_plot(-0.8)
    matrix = bias_matrix([PARAMETER_TIME_OFFSET], true_plot(0.0)[0], *rates())
    left = measured - matrix @ [0.8] - true_plot(0.0)
    assert abs(left[0]) < 1.0
    assert abs(left[1]) * 6e4 < 1.0
    # The shift is 0.8 s of flight: the wrong sign would double it.
    moved = measured - true_plot(0.0)
    assert math.hypot(moved[0], moved[1] * 6e4) > 100.0


def test_columns_follow_the_order_asked_for_and_broadcast() -> None:
    matrix = bias_matrix(
        [PARAMETER_TIME_OFFSET, PARAMETER_RANGE_GAIN], [1e5, 2e5], [10.0, -20.0], [1e-3, 2e-3]
    )
    np.testing.assert_array_equal(
        matrix, [[[-10.0, 1e5], [-1e-3, 0.0]], [[20.0, 2e5], [-2e-3, 0.0]]]
    )


def test_an_unknown_kind_is_rejected() -> None:
    with pytest.raises(UnknownParameterError, match="parameter 9"):
        bias_matrix([0, 9], 1.0, 0.0, 0.0)
    for part in (0.9, np.nan, -1.0):
        with pytest.raises(UnknownParameterError, match="known: 0"):
            bias_matrix([part], 1.0, 0.0, 0.0)


def test_invalid_numbers_and_shapes_are_rejected() -> None:
    with pytest.raises(ShapeError, match="kinds of the bias parameters: expected numbers"):
        bias_matrix(["range"], 1.0, 0.0, 0.0)
    with pytest.raises(ShapeError, match=r"range rate: expected numbers, was 'fast'"):
        bias_matrix([0], 1.0, "fast", 0.0)
    with pytest.raises(ShapeError, match=r"broadcast, was of the shapes \(2,\), \(3,\), \(\)"):
        bias_matrix([0], [1.0, 2.0], [0.0, 0.0, 0.0], 0.0)
