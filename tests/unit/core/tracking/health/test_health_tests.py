"""Tests of radars by innovations: jumps, noise, and site errors."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.tracking.health._health_kernels import CLIP, CLIPPED_MEAN
from multiradar.tracking.health.health_sums import GAIN_SCALE_M, NORMALS, PATTERNS, HealthSums
from multiradar.tracking.health.health_tests import (
    JUMP_SIGMAS,
    jump_evidence,
    noise_ratio,
    scale_after,
    shift_of_site,
)
from multiradar.tracking.health.jump_tests import JUMP_THRESHOLD, JumpTests

Floats = NDArray[np.float64]


def cumulated(values: Floats, common: float = 0.0, scale: float = 1.0) -> Floats:
    """Return the greatest sum of each test over windows (w, n)."""
    sums = np.zeros((2, len(JUMP_SIGMAS)))
    most = sums.copy()
    for window in values:
        sums = np.maximum(sums + jump_evidence(window, common, scale), 0.0)
        most = np.maximum(most, sums)
    return most


@pytest.mark.parametrize("count", [4, 5, 12, 40])
def test_normal_innovations_raise_no_jump(count: int) -> None:
    random = np.random.default_rng(count)
    # 10 000 windows are eleven hours of a radar; the bound is nine million.
    assert cumulated(random.normal(size=(10_000, count))).max() < JUMP_THRESHOLD


def test_a_third_of_the_aircraft_turning_is_no_jump() -> None:
    random = np.random.default_rng(1)
    values = random.normal(size=(3000, 15))
    values[:, :5] += np.array([6.0, 6.0, 6.0, -6.0, -6.0])
    assert cumulated(values).max() < JUMP_THRESHOLD


def test_noise_of_twice_the_configured_one_is_no_jump_once_measured() -> None:
    random = np.random.default_rng(2)
    values = 2.0 * random.normal(size=(10_000, 12))
    assert cumulated(values, scale=4.0).max() < JUMP_THRESHOLD


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_jump_of_three_sigmas_is_found_in_one_scan_of_fifteen_aircraft(sign: float) -> None:
    random = np.random.default_rng(3)
    found = [jump_evidence(sign * 3.0 + random.normal(size=15), 0.0, 1.0).max() for _ in range(200)]
    assert np.mean(np.array(found) > JUMP_THRESHOLD) > 0.9
    up, down = jump_evidence(sign * 3.0 + random.normal(size=15), 0.0, 1.0).max(axis=1)
    assert (up > down) == (sign > 0.0)


def test_errors_within_the_bias_uncertainty_are_no_jump_however_long() -> None:
    random = np.random.default_rng(4)
    values = 2.0 + random.normal(size=(3000, 20))
    assert cumulated(values, common=1.0).max() < JUMP_THRESHOLD
    assert cumulated(values[:3]).max() > JUMP_THRESHOLD


def test_no_radar_is_tested_for_eight_scans_after_a_jump() -> None:
    """Tracks disturbed by a jump would be another one."""
    tests, sums = JumpTests(np.array([0]), np.array([4.0]), tests=True), HealthSums.empty(1, 1)
    sums.last_plot[0] = 0.0
    assert tests.find(0.0, sums) == -1
    found = {}
    for end_s in (100.0, 104.0, 131.0, 132.0):
        sums.values[0, :, :15], sums.tested[0], sums.commons[0] = 5.0, 15, 15
        found[end_s] = tests.find(end_s, sums), int(tests.counts[0]), tests.held_s
    assert found == {
        100.0: (0, 1, 132.0), 104.0: (-1, 1, 132.0), 131.0: (-1, 1, 132.0), 132.0: (0, 2, 164.0),
    }  # fmt: skip


def test_the_scale_converges_to_the_variance_despite_outliers() -> None:
    random = np.random.default_rng(5)
    scale, weight = 1.0, 50.0
    for _ in range(400):
        errors = 1.5 * random.normal(size=50)
        errors[:1] = 50.0
        weight = min(weight + len(errors), 4000.0)
        clipped = float(np.minimum(errors**2 / scale, CLIP).sum())
        scale = scale_after(scale, clipped, len(errors), weight)
    assert np.sqrt(scale) == pytest.approx(1.5, rel=0.06)


def test_the_reference_of_the_scale_is_the_mean_of_clipped_normal_numbers() -> None:
    x = np.linspace(-8.0, 8.0, 160_001)
    density = np.exp(-0.5 * x**2) / np.sqrt(2.0 * np.pi)
    mean = np.trapezoid(np.minimum(x**2, CLIP) * density, x)
    assert mean == pytest.approx(CLIPPED_MEAN, abs=1e-6)


def test_the_noise_excludes_the_uncertainty_of_the_tracks() -> None:
    # S = N + W with N = 900 m², W configured = 1600 m², true 6400 m².
    assert noise_ratio((900.0 + 6400.0) / 2500.0, 1600.0 / 2500.0) == pytest.approx(2.0)
    assert np.isnan(noise_ratio(0.1, 0.5))
    assert np.isnan(noise_ratio(1.0, 0.1))
    # Configured far too small, it is a small fraction of the expected and most of the measured
    # variance.
    assert noise_ratio((900.0 + 1600.0) / 1000.0, 0.1) == pytest.approx(4.0)


def test_a_site_error_is_distinguished_from_offsets_and_a_gain() -> None:
    random = np.random.default_rng(6)
    count, sigma_m, sigma_rad = 5000, 50.0, 0.001
    range_m, azimuth = random.uniform(2e4, 2e5, count), random.uniform(-1.0, 2.5, count)
    shift = np.array([130.0, -220.0])
    away = np.column_stack([np.sin(azimuth), np.cos(azimuth)])
    right = np.column_stack([np.cos(azimuth), -np.sin(azimuth)])
    rows = [
        np.column_stack([np.ones(count), np.zeros(count), range_m / GAIN_SCALE_M, -away]) / sigma_m,
        np.column_stack(
            [np.zeros(count), np.ones(count), np.zeros(count), -right / range_m[:, None]]
        ) / sigma_rad,
    ]  # fmt: skip
    # The truth by geometry, not by the design above.
    plots = range_m[:, None] * away
    seen = plots - shift
    e_range = np.hypot(*seen.T) - range_m + 80.0 + 0.0004 * range_m
    e_azimuth = np.arctan2(seen[:, 0], seen[:, 1]) - azimuth + 0.002
    e_range += sigma_m * random.normal(size=count)
    e_azimuth += sigma_rad * random.normal(size=count)
    information = rows[0].T @ rows[0] + rows[1].T @ rows[1]
    vector = rows[0].T @ (e_range / sigma_m) + rows[1].T @ (e_azimuth / sigma_rad)
    upper = information[np.triu_indices(PATTERNS)]
    assert len(upper) == NORMALS
    found, covariance = shift_of_site(upper, vector, 1.0)
    error = found - shift
    assert error @ np.linalg.solve(covariance, error) < 18.0
    assert np.sqrt(np.linalg.eigvalsh(covariance)[-1]) < 20.0
    _, wider = shift_of_site(upper, vector, 4.0)
    np.testing.assert_allclose(wider, 4.0 * covariance)
