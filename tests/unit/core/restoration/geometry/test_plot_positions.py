"""Plots as points: position on WGS 84, covariance, and selection of plots."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import PlaneError
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_NAMES,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
)
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.restoration.geometry import plot_positions as of_plots
from multiradar.restoration.geometry._plot_position_kernels import locate_polar_plot
from multiradar.restoration.geometry.plot_positions import Plots, plot_positions
from support.kernels import plain
from support.scenarios import live_scene

Floats = NDArray[np.float64]

SENSORS = live_scene.sensors()
NONE = np.zeros((len(SENSORS), len(PARAMETER_NAMES)))
FIRST = SENSORS.ids.index("41-10")
REPORTED = SENSORS.ids.index("adsb")
FOOT = np.radians(50.4), np.radians(14.9)


def seen(sensor: int, east_m: Floats, north_m: Floats, height_m: Floats) -> Plots:
    """Exact plots of a radar, for positions in the plane tangent at `FOOT`."""
    latitude, longitude = SystemPlane(*FOOT).to_geodetic(east_m, north_m)
    site = SENSORS.latitude_rad[sensor], SENSORS.longitude_rad[sensor], SENSORS.height_m[sensor]
    slant, azimuth, _ = slant_range_azimuth(
        (float(site[0]), float(site[1]), float(site[2])), latitude, longitude, height_m
    )
    count = len(east_m)
    return Plots(
        np.arange(count, dtype=np.float64), np.full(count, sensor), np.zeros(count, np.int8),
        np.asarray(slant), np.asarray(azimuth), np.full(count, np.nan), np.full(count, np.nan),
        height_m, np.full(count, np.nan),
    )  # fmt: skip


def reported(height_m: Floats) -> Plots:
    count = len(height_m)
    nothing = np.full(count, np.nan)
    return Plots(
        np.arange(count, dtype=np.float64), np.full(count, REPORTED), np.ones(count, np.int8),
        nothing, nothing, np.full(count, FOOT[0]), np.full(count, FOOT[1]), height_m, nothing,
    )  # fmt: skip


def test_plots_are_located_at_the_aircraft() -> None:
    """East and north of the foot of the last plot to the millimetre, the height as reported."""
    east, north = np.array([-8e3, -3e3, 0.0]), np.array([5e3, 4e3, 0.0])
    height = np.array([9000.0, 9100.0, 9300.0])
    placed = plot_positions(seen(FIRST, east, north, height), SENSORS, NONE)
    assert placed.frame.latitude_rad == pytest.approx(FOOT[0], abs=1e-9)
    assert placed.positions_m == pytest.approx(np.column_stack([east, north, height]), abs=1e-2)


def test_the_kernel_equals_its_plain_form(monkeypatch: pytest.MonkeyPatch) -> None:
    east, north = np.array([-8e3, -3e3, 0.0]), np.array([5e3, 4e3, 0.0])
    plots = seen(FIRST, east, north, np.array([9000.0, 9100.0, 9300.0]))
    compiled = plot_positions(plots, SENSORS, NONE)
    monkeypatch.setattr(of_plots, "locate_polar_plot", plain(locate_polar_plot))
    uncompiled = plot_positions(plots, SENSORS, NONE)
    np.testing.assert_allclose(compiled.positions_m, uncompiled.positions_m, atol=1e-8)
    np.testing.assert_allclose(compiled.covariances_m2, uncompiled.covariances_m2, rtol=1e-9)


def test_plots_are_corrected_for_biases() -> None:
    plots = seen(FIRST, np.zeros(1), np.zeros(1), np.array([9000.0]))
    biases = NONE.copy()
    biases[FIRST, PARAMETER_RANGE_OFFSET] = 120.0
    biases[FIRST, PARAMETER_AZIMUTH_OFFSET] = -0.003
    biases[FIRST, PARAMETER_RANGE_GAIN] = 1e-3
    spoilt = plots._replace(
        range_m=plots.range_m * 1.001 + 120.0, azimuth_rad=plots.azimuth_rad - 0.003
    )
    placed = plot_positions(spoilt, SENSORS, biases)
    assert placed.frame.latitude_rad == pytest.approx(FOOT[0], abs=1e-9)
    assert placed.frame.longitude_rad == pytest.approx(FOOT[1], abs=1e-9)


def test_covariances_equal_those_of_simulated_errors() -> None:
    """4000 plots with errors: each entry within 5 sigma of its Monte Carlo."""
    rng = np.random.default_rng(1)
    count = 4000
    height_sigma = np.sqrt(2.0**2 + (25.0 * 0.3048) ** 2 / 12.0)
    plots = seen(FIRST, np.zeros(count), np.zeros(count), np.full(count, 9001.0))
    drawn = plots._replace(
        range_m=plots.range_m + rng.normal(0.0, SENSORS.range_sigma_m[FIRST], count),
        azimuth_rad=plots.azimuth_rad + rng.normal(0.0, SENSORS.azimuth_sigma_rad[FIRST], count),
        height_m=plots.height_m + rng.normal(0.0, height_sigma, count),
    )
    placed = plot_positions(drawn, SENSORS, NONE)
    found = np.cov(placed.positions_m.T)
    expected = placed.covariances_m2.mean(axis=0)
    sigmas = np.sqrt(np.diag(expected))
    assert np.abs(found - expected) / np.outer(sigmas, sigmas) == pytest.approx(
        0.0, abs=5 * 1.5 / 63
    )
    assert expected[2, 2] == pytest.approx(height_sigma**2)


def test_heights_on_steps_of_100_feet_have_the_error_of_the_step() -> None:
    steps = np.array([300.0, 301.0, 305.0]) * 30.48
    coarse = plot_positions(reported(steps), SENSORS, NONE)
    fine = plot_positions(reported(steps + 7.62), SENSORS, NONE)
    assert coarse.covariances_m2[0, 2, 2] == pytest.approx(4.0 + 30.48**2 / 12.0)
    assert fine.covariances_m2[0, 2, 2] == pytest.approx(4.0 + 7.62**2 / 12.0)
    sigma = SENSORS.position_sigma_m[REPORTED]
    assert coarse.covariances_m2[0, 0, 0] == pytest.approx(sigma**2)


def test_a_report_has_its_own_accuracy_or_that_of_its_sensor() -> None:
    plots = reported(np.full(3, 9000.0))._replace(position_sigma_m=np.array([4.0, np.nan, 250.0]))
    placed = plot_positions(plots, SENSORS, NONE)
    expected = np.array([4.0, SENSORS.position_sigma_m[REPORTED], 250.0]) ** 2
    np.testing.assert_allclose(placed.covariances_m2[:, 0, 0], expected)
    np.testing.assert_allclose(placed.covariances_m2[:, 1, 1], expected)


def test_heights_of_one_kind_are_used_and_plots_without_height_are_not() -> None:
    by_radar = seen(FIRST, np.zeros(3), np.zeros(3), np.array([9000.0, np.nan, 9000.0]))
    two = Plots(
        *(np.concatenate(pair) for pair in zip(by_radar, reported(np.full(2, 8000.0)), strict=True))
    )
    placed = plot_positions(two, SENSORS, NONE)
    assert placed.positions_m[:, 2].tolist() == [9000.0, 9000.0]
    three = Plots(
        *(np.concatenate(pair) for pair in zip(by_radar, reported(np.full(3, 8000.0)), strict=True))
    )
    assert plot_positions(three, SENSORS, NONE).positions_m[:, 2].tolist() == [8000.0] * 3


def test_plots_in_the_cone_of_silence_are_omitted() -> None:
    """Overhead azimuths are unreliable: the cone of silence starts at 45° of elevation."""
    site = SENSORS.latitude_rad[FIRST], SENSORS.longitude_rad[FIRST]
    east, north = (float(one) for one in SystemPlane(*FOOT).to_plane(*site))
    plots = seen(
        FIRST, np.array([east + 1e3, 0.0]), np.array([north, 0.0]), np.array([9000.0, 9000.0])
    )
    assert plot_positions(plots, SENSORS, NONE).time_s.tolist() == [1.0]


def test_without_located_plots_an_error_is_raised() -> None:
    nothing = seen(FIRST, np.zeros(2), np.zeros(2), np.full(2, np.nan))
    impossible = seen(FIRST, np.zeros(2), np.zeros(2), np.full(2, 9000.0))._replace(
        range_m=np.full(2, 10.0)
    )
    for plots in (nothing, impossible):
        with pytest.raises(PlaneError) as error:
            plot_positions(plots, SENSORS, NONE)
        assert error.value.code == "TOO_FEW_POINTS"
