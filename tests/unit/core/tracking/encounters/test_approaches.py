"""Standard deviations of closest approaches against simulated motions, and chords."""

import numpy as np
import pytest

from multiradar.tracking.encounters import _approach_kernels as kernels
from multiradar.tracking.encounters import _relative_kernels as relative
from multiradar.tracking.encounters.approaches import (
    bounds,
    closest_approaches,
    conflict_probabilities,
    height_at,
    least_heights,
)
from multiradar.tracking.encounters.pairs import Paths
from support.references.straight_forecast import forecast
from support.scenarios.encounter_paths import covariance, straight_paths

TIMES_S = np.array([0.0, 30.0, 60.0, 120.0])
PAIR = np.array([[0, 1]])
STATES = np.array([[0.0, 0.0, 200.0, 0.0], [12_000.0, -9_000.0, 0.0, 190.0]])
SPREAD = covariance(60.0, 3.0)


def _paths(density: float = 0.0) -> Paths:
    return straight_paths(STATES, np.array([SPREAD, SPREAD]), TIMES_S, density)


def test_sigmas_are_those_of_drawn_motions() -> None:
    """Of 40 000: accurate to one per cent, and first order to a few."""
    found = closest_approaches(_paths(), PAIR, np.eye(2)[None], 9260.0)
    drawn = np.random.default_rng(1).multivariate_normal(
        STATES[1] - STATES[0], 2.0 * SPREAD, 40_000
    )
    position, rate = drawn[:, :2], drawn[:, 2:]
    speed = np.hypot(*rate.T)
    time_s = -(position * rate).sum(axis=1) / speed**2
    signed_m = (position[:, 0] * rate[:, 1] - position[:, 1] * rate[:, 0]) / speed
    assert found.time_s[0] == pytest.approx(time_s.mean(), abs=0.05)
    assert found.distance_m[0] == pytest.approx(abs(signed_m.mean()), abs=5.0)
    assert found.time_sigma_s[0] == pytest.approx(time_s.std(), rel=0.03)
    assert found.sigma_m[0] == pytest.approx(signed_m.std(), rel=0.03)


@pytest.mark.parametrize("time_s", [0.0, 12.0, 30.0, 95.0])
def test_between_two_points_the_covariance_is_that_of_the_forecast(time_s: float) -> None:
    """White acceleration: the stored covariance is linear in time."""
    paths = _paths(density=2.0)
    k = max(int(np.searchsorted(TIMES_S, time_s, side="right")) - 1, 0)
    part = (time_s - TIMES_S[k]) / (TIMES_S[k + 1] - TIMES_S[k])
    flat, no_common_error = np.eye(2).ravel(), relative.common_covariance(paths.shared, 0, 1)
    walk = np.array(
        relative.relative_velocity_spread(
            paths.velocity_spreads, no_common_error, 0, 1, k, part, 0.0, 1.0, flat
        )
    )
    now = relative.relative_covariance(paths.now, no_common_error, 0, 1, flat)
    start = np.array([now[0], now[1], now[4]])
    common = np.array([2.0 * now[2], now[3] + now[5], 2.0 * now[6]])
    _, (expected,) = forecast(STATES[0], SPREAD, 2.0, np.array([time_s]))
    np.testing.assert_allclose(
        start + time_s * common + time_s**2 * walk,
        2.0 * expected[[0, 0, 1], [0, 1, 1]],
        atol=1e-6,
    )


def test_true_metres_scale_positions_and_errors() -> None:
    matrix = np.array([[1.02, 0.03], [-0.01, 1.1]])
    paths = _paths(density=1.0)
    found = closest_approaches(paths, PAIR, matrix[None], 9260.0)
    whole = np.kron(np.eye(2), matrix)
    stretched = straight_paths(
        STATES @ whole.T, np.array([whole @ SPREAD @ whole.T] * 2), TIMES_S, 0.0
    )
    # The noise of the motion is stretched too.
    spreads = np.empty((2, 4, 3))
    for k, time_s in enumerate(TIMES_S):
        _, (moved,) = forecast(STATES[0], SPREAD, 1.0, np.array([time_s]))
        spreads[:, k] = (whole @ moved @ whole.T)[[0, 0, 1], [0, 1, 1]]
    growth = TIMES_S[1:, None]
    now = stretched.now[0]
    common = np.array([2.0 * now[2], now[3] + now[5], 2.0 * now[6]])
    velocity_spreads = (spreads[:, 1:] - now[[0, 1, 4]] - growth * common) / growth**2
    stretched.velocity_spreads[:, 1:] = np.tile(velocity_spreads, 2)
    expected = closest_approaches(stretched, PAIR, np.eye(2)[None], 9260.0)
    for name in ("time_s", "time_sigma_s", "distance_m", "sigma_m", "chords"):
        np.testing.assert_allclose(
            getattr(found, name), getattr(expected, name), rtol=1e-9, atol=1e-6
        )


def test_common_errors_cancel_and_opposite_ones_add_up() -> None:
    paths = _paths()
    own = np.zeros((2, 4, 2))
    own[:, 0, 0] = own[:, 1, 1] = 500.0
    spread = SPREAD + np.diag([500.0**2, 500.0**2, 0.0, 0.0])
    biased = straight_paths(STATES, np.array([spread, spread]), TIMES_S)
    alike = closest_approaches(biased._replace(shared=own), PAIR, np.eye(2)[None], 9260.0)
    alone = closest_approaches(paths, PAIR, np.eye(2)[None], 9260.0)
    assert alike.sigma_m[0] == pytest.approx(alone.sigma_m[0], rel=1e-9)
    own[1] *= -1.0
    apart = closest_approaches(biased._replace(shared=own), PAIR, np.eye(2)[None], 9260.0)
    assert apart.sigma_m[0] == pytest.approx(np.hypot(alone.sigma_m[0], 1000.0), rel=1e-9)


def test_the_least_height_between_two_is_that_of_their_time_together() -> None:
    """They are within 9 260 m for some seconds on both sides of the closest approach."""
    found = closest_approaches(_paths(), PAIR, np.eye(2)[None], 9260.0)
    between = np.array([[2000.0, -20.0, 0.0, 0.0, 0.0, 0.0]])
    height_m, sigma_m = height_at(between, found.time_s)
    assert height_m[0] == pytest.approx(2000.0 - 20.0 * found.time_s[0])
    assert sigma_m[0] == 0.0
    half_s = np.sqrt(9260.0**2 - found.distance_m[0] ** 2) / np.hypot(200.0, 190.0)
    expected = 2000.0 - 20.0 * (found.time_s[0] + half_s)
    least = least_heights(found, between, 9260.0)[0]
    assert least == pytest.approx(max(expected, 0.0), abs=1.0)
    assert least_heights(found, between - [[1200.0, 0, 0, 0, 0, 0]], 9260.0)[0] == 0.0
    assert np.isnan(least_heights(found, np.full((1, 6), np.nan), 9260.0)[0])


def test_a_curved_path_is_followed() -> None:
    """Both turn around one point, 2 km apart: their distance is constant."""
    angle = 0.03 * TIMES_S
    means = np.empty((2, 4, 4))
    for row, radius in enumerate((6_000.0, 8_000.0)):
        means[row, :, 0], means[row, :, 1] = radius * np.cos(angle), radius * np.sin(angle)
        means[row, :, 2], means[row, :, 3] = (
            -radius * 0.03 * np.sin(angle),
            radius * 0.03 * np.cos(angle),
        )
    paths = _paths()._replace(means=means)
    found = closest_approaches(paths, PAIR, np.eye(2)[None], 9260.0)
    # A cubic through points 54° apart is within 1 % of its circle; of 103°, within 4 %.
    assert found.distance_m[0] == pytest.approx(2000.0, rel=0.04)


@pytest.mark.parametrize(("rate_mps", "together"), [(0.0, True), (-10.0, False)])
def test_states_without_errors_have_a_certain_approach(rate_mps: float, together: bool) -> None:
    """They are 1 km apart; the approaching pair meets, and its interval has no width."""
    states = np.array([[0.0, 0.0, 200.0, 0.0], [1000.0, 30.0, 200.0 + rate_mps, 0.0]])
    paths = straight_paths(states, np.zeros((2, 4, 4)), TIMES_S)
    found = closest_approaches(paths, PAIR, np.eye(2)[None], 9260.0)
    assert found.together[0] == together
    assert found.time_s[0] == pytest.approx(0.0 if together else 100.0)
    assert found.distance_m[0] == pytest.approx(np.hypot(1000.0, 30.0) if together else 30.0)
    low_m, high_m = bounds(found)
    assert low_m[0] == pytest.approx(found.distance_m[0], abs=0.1)
    assert high_m[0] == pytest.approx(found.distance_m[0], abs=0.1)
    for distance_m, certain in ((found.distance_m[0] - 1.0, 0.0), (found.distance_m[0] + 1.0, 1.0)):
        within, _ = conflict_probabilities(found, np.full((1, 6), np.nan), distance_m, None)
        assert within[0] == certain


def test_diverging_tracks_have_the_chord_to_their_likeliest_return() -> None:
    """The last point with noise that grows faster than the distance, else the first."""
    states = np.array([[0.0, 0.0, 60.0, 0.0], [-9_000.0, 0.0, -60.0, 0.0]])
    times_s = np.arange(0.0, 301.0, 30.0)
    sure = covariance(60.0, 0.01)
    for density in (0.0, 20.0):
        paths = straight_paths(states, np.array([sure, sure]), times_s, density)
        found = closest_approaches(paths, PAIR, np.eye(2)[None], 9260.0)
        assert found.time_s[0] == 0.0
        apart = paths.means[1, :, :2] - paths.means[0, :, :2]
        spread = [2.0 * forecast(states[0], sure, density, times_s)[1][:, i, i] for i in (0, 1)]
        ratio = (apart**2).sum(axis=1) / (spread[0] + spread[1])
        likeliest = 1 + int(np.argmin(ratio[1:]))
        walk = 2.0 * paths.velocity_spreads[0, likeliest, 0]
        assert found.chords[0, kernels.CHORD_V] == pytest.approx(walk, rel=1e-9)
        assert (likeliest == len(times_s) - 1) == (density > 0.0)
