"""Refracted ranges against rays traced through an exponential atmosphere."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.geodesy.refraction import (
    EARTH_RADIUS_M,
    HEIGHT_M,
    refracted_range,
    straight_range,
)

Floats = NDArray[np.float64]

# Mean atmosphere of Recommendation ITU-R P.453.
REFRACTIVITY, SCALE_HEIGHT_M = 315e-6, 7350.0
SITE_M = 300.0
STEP_M = 250.0


def index(height_m: Floats) -> Floats:
    return np.asarray(1.0 + REFRACTIVITY * np.exp(-height_m / SCALE_HEIGHT_M))


def rate(state: Floats) -> Floats:
    """Return the derivative of radius, angle at the centre, elevation and optical path by length.

    The elevation follows from Snell's law on spheres, n r cos(elevation) = constant.
    """
    radius, _, elevation, _ = state
    n = index(radius - EARTH_RADIUS_M)
    by_height = -(n - 1.0) / SCALE_HEIGHT_M
    bend = np.cos(elevation) * (1.0 / radius + by_height / n)
    return np.stack([np.sin(elevation), np.cos(elevation) / radius, bend, n])


def rays(height_m: float) -> tuple[Floats, Floats]:
    """Return straight ranges from the antenna to this height, and optical paths, of many rays."""
    elevation = np.linspace(-0.004, 0.35, 400)
    state = np.zeros((4, len(elevation)))
    state[0], state[2] = EARTH_RADIUS_M + SITE_M, elevation
    found = np.full((2, len(elevation)), np.nan)
    for _ in range(int(500e3 / STEP_M)):
        before = state
        k1 = rate(before)
        k2 = rate(before + 0.5 * STEP_M * k1)
        k3 = rate(before + 0.5 * STEP_M * k2)
        k4 = rate(before + STEP_M * k3)
        state = before + STEP_M / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
        low, high = (one[0] - EARTH_RADIUS_M - height_m for one in (before, state))
        passes = (low < 0.0) & (high >= 0.0) & np.isnan(found[0])
        part = -low[passes] / (high - low)[passes]
        ends = before[[1, 3]][:, passes], state[[1, 3]][:, passes]
        found[:, passes] = ends[0] + part * (ends[1] - ends[0])
    angle, path = found
    own, other = EARTH_RADIUS_M + SITE_M, EARTH_RADIUS_M + height_m
    straight = np.sqrt((other - own) ** 2 + 4.0 * own * other * np.sin(0.5 * angle) ** 2)
    known = np.isfinite(straight)
    return straight[known], path[known]


@pytest.mark.parametrize("height_m", [3000.0, 6000.0, 10_000.0, 12_000.0])
def test_ranges_are_those_of_traced_rays(height_m: float) -> None:
    straight, path = rays(height_m)
    near = straight < 400e3
    straight, path = straight[near], path[near]
    far = straight > 0.9 * straight.max()
    # The range by the speed of light in the air at the antenna.
    measured = path / index(np.array(SITE_M))
    found = refracted_range(straight, height_m, SITE_M, 1.2)
    assert np.abs(found - measured).max() < 3.0
    # The usual 4/3 holds near the ground; higher up the index falls less.
    usual = refracted_range(straight, height_m, SITE_M, 4.0 / 3.0)
    assert np.abs(usual - measured).max() < 26.0
    if height_m >= 6000.0:
        assert (straight - measured)[far].min() > 13.0
    # A radar with the speed of light in vacuum measures more than the straight range.
    assert (path - straight)[straight > 150e3].min() > 20.0
    assert np.abs(found * (1.0 + 3.02e-4) - path).max() < 4.0


def test_straight_ranges_are_the_inverse() -> None:
    straight = np.linspace(13e3, 450e3, 50)[:, None]
    height = np.array([0.0, 500.0, 3000.0, 12_000.0])
    for factor in (1.0, 1.2, 4.0 / 3.0, 4.0):
        bent = refracted_range(straight, height, 800.0, factor)
        back = straight_range(bent, height, 800.0, factor)
        np.testing.assert_allclose(back, np.broadcast_to(straight, back.shape), atol=1e-4)
    same = refracted_range(straight, height, 800.0, 1.0)
    np.testing.assert_allclose(same, np.broadcast_to(straight, same.shape), atol=1e-6)


def test_the_range_is_that_of_a_larger_earth() -> None:
    along, k = np.array([50e3, 200e3, 400e3]), 1.3
    own, other = SITE_M, 11_000.0

    def line(radius: float) -> Floats:
        chord = 4.0 * (radius + own) * (radius + other) * np.sin(0.5 * along / radius) ** 2
        return np.asarray(np.sqrt((other - own) ** 2 + chord))

    found = refracted_range(line(EARTH_RADIUS_M), other, own, k)
    np.testing.assert_allclose(found, line(k * EARTH_RADIUS_M), atol=0.02)


def test_without_a_factor_and_where_nothing_is_seen_ranges_stay() -> None:
    ranges = np.array([np.nan, 100.0, 5000.0, 200e3])
    factor = np.array([1.2, 1.2, 1.2, np.nan])
    for form in (straight_range, refracted_range):
        # Shorter than the difference of the heights: 9700 m.
        np.testing.assert_array_equal(form(ranges, 10_000.0, SITE_M, factor), ranges)


def test_an_unknown_height_is_assumed() -> None:
    assert straight_range(200e3, np.nan, 0.0, 1.2) == straight_range(200e3, HEIGHT_M, 0.0, 1.2)
