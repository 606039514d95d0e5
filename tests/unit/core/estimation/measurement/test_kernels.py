"""The compiled measurement model equals its plain forms."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from multiradar.estimation.measurement import _kernels as kernels
from multiradar.estimation.measurement import kinds
from multiradar.estimation.measurement.linearised import cartesian_plot
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES
from multiradar.geodesy._kernels import (
    EE,
    EN,
    NE,
    NN,
    PE,
    PN,
    plane_parameters,
    predict_polar,
    site_parameters,
)
from support.kernels import plain
from support.references.linearised import bias_matrix
from support.references.measurement_models import FlatCartesian, FlatPolar
from support.references.reference_filters import Observation
from support.references.unknown_height import range_variance

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
    found = kernel("bias_column", form)(kinds.KIND_RADAR, kind, SITE, 87e3, 1.2, -140.0, 2e-3)
    expected = bias_matrix([kind], 87e3, -140.0, 2e-3, azimuth_rad=1.2)[:, 0]
    np.testing.assert_allclose(found, expected, rtol=1e-14)


@BOTH
@pytest.mark.parametrize("parameter", [3, 6, 7, 8])
def test_bias_column_of_a_position_is_the_displacement_of_its_frame(
    parameter: int, form: str
) -> None:
    """The shift is along east and north at the site, the rotation clockwise about it."""
    east, north = 9e4, -3e4
    found = kernel("bias_column", form)(
        kinds.KIND_POSITION, parameter, SITE, east, north, 150.0, -80.0
    )
    axes = SITE[[EE, EN]], SITE[[NE, NN]]
    expected: dict[int, Any] = {
        3: [-150.0, 80.0], 6: axes[0], 7: axes[1], 8: [north - SITE[PN], SITE[PE] - east],
    }  # fmt: skip
    np.testing.assert_allclose(found, expected[parameter], rtol=1e-14)


@pytest.mark.parametrize("kind", [kinds.KIND_BEARING, kinds.KIND_DIRECTION])
@pytest.mark.parametrize("name", ["frame_east_m", "frame_north_m"])
def test_bearings_have_no_bias_that_depends_on_their_distance(kind: int, name: str) -> None:
    parameter = PARAMETER_NAMES.index(name)
    found = plain(kernels.bias_column)(kind, parameter, SITE, 0.0, 1.2, 0.1, 0.2)
    assert found == (0.0, 0.0)


@BOTH
def test_spread_of_the_biases_is_j_p_jt(form: str) -> None:
    rng = np.random.default_rng(1)
    root = rng.normal(size=(6, 6))
    covariance = root @ root.T
    parameters = np.array([0, 1, 2, 0, 1, 3])
    plot = (kinds.KIND_RADAR, SITE)
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
        kinds.KIND_RADAR, PLANE, SITE, NOISE, 9e4, -3e4, 8_000.0, 0.0, by_state, noise
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
        kinds.KIND_RADAR, PLANE, SITE, NOISE, *place, 8_000.0, 3_000.0**2, by_state, noise
    )
    expected = range_variance(slant, 8_000.0, 420.0, 3_000.0)
    assert np.sqrt(noise[0] - NOISE[0]) == pytest.approx(np.sqrt(expected), rel=0.02)
    assert noise[2] == NOISE[1]


@BOTH
def test_a_reported_position_is_measured_directly(form: str) -> None:
    by_state, noise = np.zeros((2, 2)), np.zeros(3)
    found = kernel("predict_measurement", form)(
        kinds.KIND_POSITION, PLANE, SITE, NOISE, 9e4, -3e4, 8_000.0, 9e6, by_state, noise
    )
    assert found[:2] == (9e4, -3e4)
    assert np.isnan(found[2])
    np.testing.assert_array_equal(by_state, np.eye(2))
    np.testing.assert_array_equal(noise, [900.0, 0.0, 900.0])


FLAT_SITES = np.array([[-20e3, -20e3], [-30e3, 230e3]])
FLAT_NOISE = np.array([15.0**2, np.radians(0.05) ** 2, np.nan, 0.0])
FLAT_FORMS: dict[int, type[FlatPolar | FlatCartesian]] = {
    kinds.KIND_FLAT_POLAR: FlatPolar,
    kinds.KIND_FLAT_POSITION: FlatCartesian,
}


@BOTH
@pytest.mark.parametrize("kind", FLAT_FORMS)
@pytest.mark.parametrize("radar", [0, 1])
def test_a_plot_on_a_flat_plane_is_predicted_as_in_the_plain_form(
    kind: int, radar: int, form: str
) -> None:
    """(1.11) as a position, or range and azimuth directly; biases of range and azimuth in both."""
    state = np.array([83e3, -45e3, 120.0, -160.0])
    value = np.array([140e3, 2.3])
    expected = FLAT_FORMS[kind](FLAT_SITES, 15.0, float(np.radians(0.05))).linearise(
        Observation(0.0, 0, radar, value), state
    )
    by_state, noise = np.zeros((2, 2)), np.zeros(3)
    site = FLAT_SITES[radar]
    p0, p1, ground = kernel("predict_measurement", form)(
        kind, PLANE, site, FLAT_NOISE, *state[:2], 0.0, 0.0, by_state, noise
    )
    seen = value if kind == kinds.KIND_FLAT_POLAR else cartesian_plot(site, *value)
    np.testing.assert_allclose(seen - [p0, p1], expected.innovation, rtol=1e-12)
    np.testing.assert_allclose(by_state, expected.by_state[:, :2], rtol=1e-14)
    np.testing.assert_allclose(noise, expected.noise[[0, 0, 1], [0, 1, 1]], rtol=1e-12)
    assert ground == pytest.approx(np.hypot(*(state[:2] - site)))
    rates = by_state @ state[2:]
    columns = [
        kernel("bias_column", form)(kind, parameter, site, p0, p1, *rates)
        for parameter in range(len(PARAMETER_NAMES))
    ]
    own = expected.by_bias[:, 2 * radar : 2 * radar + 2]
    np.testing.assert_allclose(np.transpose(columns[:2]), own, rtol=1e-14)
    # A gain acts as an offset proportional to the range; a late stamp shows the past.
    np.testing.assert_allclose(columns[2], ground * np.array(columns[0]), rtol=1e-12)
    np.testing.assert_array_equal(columns[3], -rates)


@BOTH
@pytest.mark.parametrize("kind", FLAT_FORMS)
def test_a_plot_on_a_flat_plane_is_located_where_it_was_made(kind: int, form: str) -> None:
    place = (83e3, -45e3)
    seen = kernel("predict_measurement", form)(
        kind, PLANE, FLAT_SITES[1], FLAT_NOISE, *place, 0.0, 0.0, np.zeros((2, 2)), np.zeros(3)
    )
    ok, *found = kernel("locate_measurement", form)(kind, PLANE, FLAT_SITES[1], *seen[:2], 0.0)
    assert ok
    np.testing.assert_allclose(found, place, rtol=1e-12)


@BOTH
@pytest.mark.parametrize("kind", FLAT_FORMS)
def test_above_a_flat_radar_the_line_of_sight_is_nan(kind: int, form: str) -> None:
    """There is no line of sight: dependent values are NaN, and fail every gate."""
    by_state, noise = np.zeros((2, 2)), np.zeros(3)
    with np.errstate(invalid="ignore", divide="ignore"):
        kernel("predict_measurement", form)(
            kind, PLANE, FLAT_SITES[0], FLAT_NOISE, *FLAT_SITES[0], 0.0, 0.0, by_state, noise
        )
    assert np.isnan(by_state).any() or np.isnan(noise).any()
