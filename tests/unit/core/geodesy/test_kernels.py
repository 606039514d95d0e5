"""The compiled geodesy equals its plain forms, PROJ, and numerical differences."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from multiradar.geodesy import _kernels as kernels
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane
from support.kernels import plain
from support.references.oracle import topocentric

CENTRE = (56.3, 61.2)
SITES = [(56.8, 60.6, 250.0), (53.1, 66.9, 430.0), (59.9, 55.0, -12.0)]
PLANE = SystemPlane(*np.radians(CENTRE).tolist())
FORMS = [
    pytest.param(lambda kernel: kernel, id="compiled"),
    pytest.param(plain, id="plain"),
]
Form = Callable[..., Callable[..., tuple[float, ...]]]


def site_of(site: tuple[float, float, float]) -> np.ndarray:
    return kernels.site_parameters(
        PLANE.parameters, math.radians(site[0]), math.radians(site[1]), site[2]
    )


def random_aircraft(
    site: tuple[float, float, float], count: int, range_max_m: float, seed: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    distance = range_max_m * np.sqrt(rng.uniform(1e-6, 1, count)) / 6.37e6
    direction = rng.uniform(0, 2 * np.pi, count)
    latitude = math.radians(site[0]) + distance * np.cos(direction)
    longitude = math.radians(site[1]) + distance * np.sin(direction) / np.cos(latitude)
    return latitude, longitude, rng.uniform(-300.0, 20_000.0, count)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("site", SITES)
def test_predicted_polar_is_that_of_proj_and_of_the_plain_form(
    site: tuple[float, float, float], form: Form
) -> None:
    """Required is 1 m at 400 km; ten micrometres allow for the rounding of PROJ."""
    latitude, longitude, height = random_aircraft(site, 300, 420e3, 2)
    east, north = PLANE.to_plane(latitude, longitude)
    parameters = site_of(site)
    predict = form(kernels.predict_polar)
    rows = zip(east, north, height, strict=True)
    found = np.array([predict(PLANE.parameters, parameters, *row) for row in rows])
    seen = topocentric(site, np.degrees(latitude), np.degrees(longitude), height)
    ground = np.hypot(seen[0], seen[1])
    np.testing.assert_allclose(found[:, 0], np.linalg.norm(seen, axis=0), rtol=0, atol=1e-5)
    np.testing.assert_allclose(found[:, 6], ground, rtol=0, atol=1e-5)
    turn = np.angle(np.exp(1j * (found[:, 1] - np.arctan2(seen[0], seen[1]))))
    np.testing.assert_allclose(turn * ground, 0.0, rtol=0, atol=1e-5)
    slant, azimuth, elevation = slant_range_azimuth(
        (math.radians(site[0]), math.radians(site[1]), site[2]), latitude, longitude, height
    )
    np.testing.assert_allclose(found[:, 0], slant, rtol=0, atol=1e-7)
    np.testing.assert_allclose(found[:, 6], slant * np.cos(elevation), rtol=0, atol=1e-7)
    turn = np.angle(np.exp(1j * (found[:, 1] - azimuth)))
    np.testing.assert_allclose(turn * ground, 0.0, rtol=0, atol=1e-7)


@pytest.mark.parametrize("site", SITES)
def test_jacobian_is_that_of_central_differences(site: tuple[float, float, float]) -> None:
    """Steps of 2 m: the differences are accurate to 1e-7 at best."""
    latitude, longitude, height = random_aircraft(site, 200, 420e3, 3)
    east, north = PLANE.to_plane(latitude, longitude)
    parameters = site_of(site)
    step = 2.0
    for e, n, h in zip(east, north, height, strict=True):
        found = kernels.predict_polar(PLANE.parameters, parameters, e, n, h)
        if found[6] < 5e3:
            continue
        sides = [
            kernels.predict_polar(PLANE.parameters, parameters, e + de, n + dn, h)
            for de, dn in ((step, 0), (-step, 0), (0, step), (0, -step))
        ]
        range_by = [(sides[0][0] - sides[1][0]) / 4.0, (sides[2][0] - sides[3][0]) / 4.0]
        azimuth_by = [
            math.remainder(sides[0][1] - sides[1][1], 2 * math.pi) / 4.0,
            math.remainder(sides[2][1] - sides[3][1], 2 * math.pi) / 4.0,
        ]
        np.testing.assert_allclose(found[2:4], range_by, rtol=0, atol=1e-6)
        np.testing.assert_allclose(
            np.array(found[4:6]) * found[6], np.array(azimuth_by) * found[6], rtol=0, atol=1e-6
        )


def test_height_term_of_the_jacobian_matters() -> None:
    """At 20 km the point moves 0.3 % farther than its foot."""
    parameters = site_of(SITES[0])
    low = kernels.predict_polar(PLANE.parameters, parameters, 2e5, 1e5, 0.0)
    high = kernels.predict_polar(PLANE.parameters, parameters, 2e5, 1e5, 20_000.0)
    assert high[4] / low[4] == pytest.approx(1.0, abs=1e-3)
    assert math.hypot(high[2], high[3]) != pytest.approx(math.hypot(low[2], low[3]), rel=1e-4)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("site", SITES)
def test_locate_finds_the_foot_of_what_was_predicted(
    site: tuple[float, float, float], form: Form
) -> None:
    latitude, longitude, height = random_aircraft(site, 300, 420e3, 4)
    east, north = PLANE.to_plane(latitude, longitude)
    parameters = site_of(site)
    for e, n, h in zip(east, north, height, strict=True):
        slant, azimuth, *_ = kernels.predict_polar(PLANE.parameters, parameters, e, n, h)
        # A full turn more must not matter: azimuths come in [0, 2π).
        found = form(kernels.locate_polar)(
            PLANE.parameters, parameters, slant, azimuth % (2 * math.pi), h
        )
        assert found[0]
        # Nearly above the radar a micrometre of range is much ground range.
        assert math.hypot(found[1] - e, found[2] - n) < 1e-3


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("slant", "azimuth", "height"),
    [
        (9_000.0, 1.0, 10_250.0),  # Shorter than the difference of heights.
        (9_000.0, 1.0, -9_750.0),
        (13e6, 1.0, 10_000.0),  # Through the Earth and out beyond it.
        (9e6, 1.0, 10_000.0),  # A foot outside the plane.
        (0.0, 1.0, 250.0),
        (-5.0, 1.0, 250.0),
        (math.nan, 1.0, 250.0),
        (5e4, math.nan, 250.0),
        (5e4, math.inf, 250.0),
        (5e4, 1.0, math.nan),
    ],
)
def test_locate_fails_without_a_solution(
    slant: float, azimuth: float, height: float, form: Form
) -> None:
    found = form(kernels.locate_polar)(PLANE.parameters, site_of(SITES[0]), slant, azimuth, height)
    assert not found[0]
    assert math.isnan(found[1])
    assert math.isnan(found[2])


@pytest.mark.parametrize("beyond_m", [0.0, 1e-7, 1e-5, 1e-3, 0.1, 10.0])
def test_locate_finds_the_zenith(beyond_m: float) -> None:
    """With an initial error of 7 cm there Newton diverged in azimuth."""
    site = SITES[0]
    slant = 8_000.0 + beyond_m
    ok, e, n = kernels.locate_polar(PLANE.parameters, site_of(site), slant, 0.7, 8_250.0)
    east, north = PLANE.to_plane(math.radians(site[0]), math.radians(site[1]))
    assert ok
    ground = math.sqrt(slant**2 - 8_000.0**2)
    assert math.hypot(e - east, n - north) == pytest.approx(ground, rel=2e-3, abs=0.15)


def test_above_the_radar_nothing_is_divided_by_zero() -> None:
    site = kernels.site_parameters(
        PLANE.parameters, math.radians(CENTRE[0]), math.radians(CENTRE[1]), 0.0
    )
    for form in (kernels.predict_polar, plain(kernels.predict_polar)):
        assert form(PLANE.parameters, site, 0.0, 0.0, 0.0) == (0, 0, 0, 0, 0, 0, 0)


@pytest.mark.parametrize("form", FORMS)
def test_all_kernels_report_points_outside_the_plane(form: Form) -> None:
    parameters = PLANE.parameters
    for e, n in ((5e6, 3e6), (9e6, 0.0), (math.nan, 0.0)):
        assert all(
            math.isnan(value)
            for value in form(kernels.predict_polar)(parameters, site_of(SITES[0]), e, n, 0.0)
        )
        assert all(math.isnan(x) for x in form(kernels.plane_to_geodetic)(parameters, e, n))
        assert all(math.isnan(x) for x in form(kernels.local_matrix)(parameters, e, n, 0.0))
    for latitude, longitude in ((-1.0, 1.0), (1.0, -2.1), (math.nan, 0.0)):
        found = form(kernels.geodetic_to_plane)(parameters, latitude, longitude)
        assert all(math.isnan(x) for x in found)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("centre", [CENTRE, (-12.0, -77.0), (1.0, 179.9), (90.0, 0.0)])
def test_plane_kernels_equal_the_vectorised_forms(centre: tuple[float, float], form: Form) -> None:
    plane = SystemPlane(*np.radians(centre).tolist())
    rng = np.random.default_rng(6)
    east, north = rng.uniform(-2e6, 2e6, (2, 100))
    height = rng.uniform(0, 15e3, 100)
    latitude, longitude = plane.to_geodetic(east, north)
    matrix = plane.local_matrix(east, north, height)
    for i in range(100):
        place = form(kernels.plane_to_geodetic)(plane.parameters, east[i], north[i])
        np.testing.assert_allclose(place, (latitude[i], longitude[i]), rtol=0, atol=2e-13)
        again = form(kernels.geodetic_to_plane)(plane.parameters, *place)
        np.testing.assert_allclose(again, (east[i], north[i]), rtol=0, atol=1e-7)
        local = form(kernels.local_matrix)(plane.parameters, east[i], north[i], height[i])
        np.testing.assert_allclose(np.reshape(local, (2, 2)), matrix[i], rtol=0, atol=1e-12)


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(
    ("angle", "wrapped"),
    [(0.5, 0.5), (3.5, 3.5 - 2 * math.pi), (-3.5, 2 * math.pi - 3.5), (math.pi, -math.pi),
     (-math.pi, -math.pi), (20.0, 20.0 - 6 * math.pi), (np.nextafter(-math.pi, -4), math.pi)],
)  # fmt: skip
def test_angles_wrap_to_the_nearest(angle: float, wrapped: float, form: Form) -> None:
    found = form(kernels.wrap_angle)(angle)
    assert -math.pi <= found < math.pi  # type: ignore[operator]
    assert math.isclose(math.cos(found - wrapped), 1.0)  # type: ignore[operator]
    assert math.isclose(math.sin(found - wrapped), 0.0, abs_tol=1e-14)  # type: ignore[operator]


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize("angle", [math.nan, math.inf, -math.inf])
def test_infinite_angles_become_nan(angle: float, form: Form) -> None:
    assert math.isnan(form(kernels.wrap_angle)(angle))  # type: ignore[arg-type]
