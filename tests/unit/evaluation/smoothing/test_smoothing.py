"""The smoother is the least-squares trajectory, and rejects outliers at any position in it."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.evaluation.smoothing.plot_positions import (
    Radar,
    locate_plots,
    noise_on_plane,
    without_biases,
)
from multiradar.evaluation.smoothing.single_mode import PositionMeasurements, smooth
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane

Floats = NDArray[np.float64]
DENSITY = 5.0
SITE = (np.radians(46.4), np.radians(6.1), 1677.0)


def drawn(*lengths: int, seed: int = 2) -> PositionMeasurements:
    """Return aircraft with given numbers of positions, 30 to 200 m off their straight paths."""
    draw = np.random.Generator(np.random.PCG64(seed))
    aircraft = np.repeat(np.arange(len(lengths)), lengths)
    count = len(aircraft)
    times = np.concatenate([np.cumsum(draw.uniform(0.0, 4.0, one)) for one in lengths])
    path = np.array([200.0, -60.0]) * times[:, None]
    root = draw.uniform(-100.0, 100.0, (count, 2, 2)) + 30.0 * np.eye(2)
    noise = root @ root.transpose(0, 2, 1) + 900.0 * np.eye(2)
    error = np.einsum("nij,nj->ni", np.linalg.cholesky(noise), draw.normal(size=(count, 2)))
    return PositionMeasurements(aircraft, times, path + error, noise)


def least_squares(one: PositionMeasurements) -> tuple[Floats, Floats]:
    """Return states and covariance of one aircraft by one dense system of normal equations."""
    count = len(one)
    information, right = np.zeros((4 * count, 4 * count)), np.zeros(4 * count)
    information[2:4, 2:4] += np.eye(2) / 300.0**2
    for row in range(count):
        at = slice(4 * row, 4 * row + 2)
        weight = np.linalg.inv(one.covariance_m2[row])
        information[at, at] += weight
        right[at] += weight @ one.position_m[row]
    for row, step in enumerate(np.diff(one.time_s)):
        motion = np.eye(4) + np.eye(4, k=2) * step
        noise = DENSITY * np.kron(
            np.array([[step**3 / 3.0, step**2 / 2.0], [step**2 / 2.0, step]]), np.eye(2)
        )
        link = np.zeros((4, 4 * count))
        link[:, 4 * row : 4 * row + 4] = -motion
        link[:, 4 * row + 4 : 4 * row + 8] = np.eye(4)
        information += link.T @ np.linalg.solve(noise, link)
    covariance: Floats = np.linalg.inv(information).astype(np.float64)
    return (covariance @ right).reshape(count, 4), covariance


def test_it_is_the_least_squares_trajectory_of_each_aircraft() -> None:
    measured = drawn(12, 7, 30)
    found = smooth(measured, DENSITY)
    assert found.used.all()
    for aircraft in range(3):
        rows = np.flatnonzero(measured.aircraft == aircraft)
        state, covariance = least_squares(measured.select(rows))
        assert found.state[rows] == pytest.approx(state, abs=1e-3)
        variance = np.diag(covariance).reshape(-1, 4)[:, :2].sum(axis=1)
        assert found.position_variance_m2[rows] == pytest.approx(variance, rel=1e-5)


def test_a_thousand_steps_of_uneven_noise_stay_a_covariance() -> None:
    # Without symmetrisation, rounding errors grew without bound.
    found = smooth(drawn(1000, 1000, seed=5), 30.0)
    assert np.all(found.position_variance_m2 > 0.0)
    assert found.position_variance_m2.max() < 1e5


@pytest.mark.parametrize("where", [0, 1, 15, 28, 29])
def test_an_outlier_at_any_position_is_rejected(where: int) -> None:
    clean = drawn(30)
    position = clean.position_m.copy()
    position[where] += [9000.0, -4000.0]
    found = smooth(
        PositionMeasurements(clean.aircraft, clean.time_s, position, clean.covariance_m2), DENSITY
    )
    assert np.flatnonzero(~found.used).tolist() == [where]
    rest = np.arange(30) != where
    without = smooth(clean.select(np.flatnonzero(rest)), DENSITY)
    assert found.state[rest] == pytest.approx(without.state, abs=1e-9)
    assert np.isnan(found.state[where]).all()


def test_a_plot_is_located_where_it_was_measured() -> None:
    draw = np.random.Generator(np.random.PCG64(4))
    latitude, longitude = (
        SITE[0] + draw.uniform(-0.05, 0.05, 200),
        SITE[1] + draw.uniform(-0.05, 0.05, 200),
    )
    height = draw.uniform(500.0, 12_000.0, 200)
    slant, azimuth, elevation = slant_range_azimuth(SITE, latitude, longitude, height)
    found = locate_plots(SITE, slant, azimuth, height)
    level = np.abs(np.sin(elevation)) < 0.9
    assert level.sum() > 190
    assert found.usable[level].all()
    assert found.latitude_rad[level] == pytest.approx(latitude[level], abs=1e-8)
    assert found.longitude_rad[level] == pytest.approx(longitude[level], abs=1e-8)


def test_a_plot_without_height_or_overhead_has_no_position() -> None:
    found = locate_plots(
        SITE, np.array([5e4, 9000.0, 5e4]), np.zeros(3), np.array([np.nan, 10_600.0, 9000.0])
    )
    assert found.usable.tolist() == [False, False, True]


def test_the_noise_of_a_plot_is_wide_across_the_beam() -> None:
    plane = SystemPlane(SITE[0], SITE[1])
    radar = Radar(SITE, 40.0, np.radians(0.1))
    noise = noise_on_plane(plane, radar, np.array([[0.0, 1e5]]), np.array([1.004e5]))
    assert noise[0] == pytest.approx(
        np.array([[(1e5 * np.radians(0.1)) ** 2, 0.0], [0.0, (40.0 * 1.004) ** 2]]), abs=1e-6
    )


def test_biases_are_measured_minus_true() -> None:
    one = np.ones(1)
    found = without_biases(
        100_300.0 * one, 45.5 * one, 10.2 * one,
        {"range_offset_m": 200.0 * one, "range_gain": 0.001 * one, "azimuth_offset_deg": 0.5 * one,
         "time_offset_s": 0.2 * one},
    )  # fmt: skip
    assert [value[0] for value in found] == pytest.approx([100_000.0, 45.0, 10.0])
