"""The compiled measurement model equals its plain forms."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from multiradar.estimation.measurement import _kernels as kernels
from multiradar.estimation.measurement.bias_parameters import bias_matrix
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES
from multiradar.estimation.measurement.unseen_height import range_variance
from multiradar.geodesy._kernels import plane_parameters, predict_polar, site_parameters
from support.kernels import plain

PLANE = plane_parameters(0.98, 1.06)
SITE = site_parameters(PLANE, 0.985, 1.05, 420.0)
NOISE = np.array([40.0**2, 1e-6, 30.0**2, 420.0])
BOTH = pytest.mark.parametrize("form", ["compiled", "plain"])


def kernel(name: str, form: str) -> Callable[..., Any]:
    found: Callable[..., Any] = getattr(kernels, name)
    return found if form == "compiled" else plain(found)


@BOTH
@pytest.mark.parametrize("kind", range(len(PARAMETER_NAMES)))
def test_bias_column_is_that_of_the_plain_form(kind: int, form: str) -> None:
    found = kernel("bias_column", form)(kernels.KIND_RADAR, kind, SITE, 87e3, 1.2, -140.0, 2e-3)
    np.testing.assert_array_equal(found, bias_matrix([kind], 87e3, -140.0, 2e-3)[:, 0])


@BOTH
def test_spread_of_the_biases_is_j_p_jt(form: str) -> None:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(6, 6))
    covariance = root @ root.T
    parameters = np.array([0, 1, 2, 0, 1, 3])
    plot = (kernels.KIND_RADAR, SITE)
    seen = (87e3, 1.2, -140.0, 2e-3)
    found = kernel("bias_spread", form)(*plot, 3, 6, parameters, covariance, *seen)
    matrix = bias_matrix(parameters[3:], 87e3, -140.0, 2e-3)
    expected = matrix @ covariance[3:, 3:] @ matrix.T
    np.testing.assert_allclose(found, expected[[0, 0, 1], [0, 1, 1]], rtol=1e-12)
    assert kernel("bias_spread", form)(*plot, 3, 3, parameters, covariance, *seen) == (0, 0, 0)


@BOTH
def test_predicted_plot_is_that_of_the_geodesy(form: str) -> None:
    by_state, noise = np.zeros((2, 2)), np.zeros(3)
    found = kernel("predict_measurement", form)(
        kernels.KIND_RADAR, PLANE, SITE, NOISE, 9e4, -3e4, 8_000.0, 0.0, by_state, noise
    )
    expected = predict_polar(PLANE, SITE, 9e4, -3e4, 8_000.0)
    np.testing.assert_allclose(found, [expected[0], expected[1], expected[6]], rtol=1e-14)
    np.testing.assert_allclose(by_state.ravel(), expected[2:6], rtol=1e-14)
    np.testing.assert_array_equal(noise, [NOISE[0], 0.0, NOISE[1]])


@BOTH
@pytest.mark.parametrize("place", [(12e3, 5e3), (9e4, -3e4), (-2e5, 1.5e5)])
def test_an_assumed_height_widens_the_range_as_in_the_plain_form(
    place: tuple[float, float], form: str
) -> None:
    """Two spheres of slightly different radius and a term of second order: within 2 %."""
    by_state, noise = np.zeros((2, 2)), np.zeros(3)
    slant, _, _ = kernel("predict_measurement", form)(
        kernels.KIND_RADAR, PLANE, SITE, NOISE, *place, 8_000.0, 3_000.0**2, by_state, noise
    )
    expected = range_variance(slant, 8_000.0, 420.0, 3_000.0)
    assert np.sqrt(noise[0] - NOISE[0]) == pytest.approx(np.sqrt(expected), rel=0.02)
    assert noise[2] == NOISE[1]


@BOTH
def test_a_reported_position_is_measured_as_it_is(form: str) -> None:
    by_state, noise = np.zeros((2, 2)), np.zeros(3)
    found = kernel("predict_measurement", form)(
        kernels.KIND_POSITION, PLANE, SITE, NOISE, 9e4, -3e4, 8_000.0, 9e6, by_state, noise
    )
    assert found[:2] == (9e4, -3e4)
    assert np.isnan(found[2])
    np.testing.assert_array_equal(by_state, np.eye(2))
    np.testing.assert_array_equal(noise, [900.0, 0.0, 900.0])
