"""Measurements of a scenario on WGS 84 are geometry plus the configured errors, nothing else."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from multiradar.errors import ConfigurationError
from multiradar.simulation.observation.measurements import NO_AIRCRAFT
from multiradar.simulation.observation.observe import Observation, observe
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.model import Aircraft, Bias, Leg, Scenario, Sensor, Traffic
from support.references.oracle import topocentric

DEGREE = float(np.radians(1.0))
CENTRE = (56.8 * DEGREE, 60.6 * DEGREE)
EXACT = Sensor("", "radar", range_sigma_m=1e-9, azimuth_sigma_rad=1e-15, position_sigma_m=1e-9)
EAST = replace(
    EXACT, identifier="east", east_m=150e3, north_m=-40e3, height_m=700.0, rotation_period_s=4.0
)
WEST = replace(
    EXACT, identifier="west", east_m=-90e3, north_m=20e3, height_m=120.0, rotation_period_s=9.0
)
ADSB = replace(EXACT, identifier="adsb", kind="adsb", interval_s=2.0)
CLIMBING = Aircraft(
    7, 30e3, 90e3, 6000.0, 220.0, 200.0 * DEGREE, legs=(Leg(120.0, DEGREE, 0.2, 8.0),)
)


def _scenario(
    *sensors: Sensor, aircraft: tuple[Aircraft, ...] = (CLIMBING,), duration_s: float = 300.0
) -> Scenario:
    return Scenario("test", 3, duration_s, "wgs84", CENTRE, aircraft, (), sensors)


def _plots_of(scenario: Scenario, seed: int = 1) -> Observation:
    return observe(scenario, np.random.default_rng(seed))


@pytest.mark.parametrize("radar", [EAST, WEST])
def test_plots_without_noise_agree_with_proj(radar: Sensor) -> None:
    seen = _plots_of(_scenario(radar))
    rows = seen.measurements
    latitude, longitude = seen.plane.to_geodetic(radar.east_m, radar.north_m)
    site = (float(np.degrees(latitude)), float(np.degrees(longitude)), radar.height_m)
    east, north, up = topocentric(
        site,
        np.degrees(rows.true_latitude_rad),
        np.degrees(rows.true_longitude_rad),
        rows.true_height_m,
    )
    assert len(rows) == pytest.approx(300.0 / (radar.rotation_period_s or 1.0), abs=1.0)
    np.testing.assert_allclose(rows.range_m, np.sqrt(east**2 + north**2 + up**2), atol=1e-5)
    aside = np.angle(np.exp(1j * (rows.azimuth_rad - np.arctan2(east, north))))
    np.testing.assert_allclose(aside * rows.range_m, 0.0, rtol=0, atol=1e-5)
    np.testing.assert_array_equal(rows.height_m, rows.true_height_m)
    assert np.all(np.diff(rows.true_height_m[rows.time_s < 120.0]) > 0.0)


def test_the_truth_moves_with_its_speed_and_heading() -> None:
    rows = _plots_of(_scenario(replace(ADSB, interval_s=0.5))).measurements
    here = np.degrees([rows.true_latitude_rad, rows.true_longitude_rad])
    for row in (10, 300, 500):
        site = (here[0, row], here[1, row], rows.true_height_m[row])
        east, north, _ = topocentric(
            site, here[0, row + 1], here[1, row + 1], rows.true_height_m[row + 1]
        )
        middle = np.mean(rows.true_speed_mps[row : row + 2])
        assert np.hypot(east, north) / 0.5 == pytest.approx(middle, abs=0.01)
        heading = np.mean(rows.true_heading_rad[row : row + 2])
        assert np.arctan2(east, north) % (2 * np.pi) == pytest.approx(heading, abs=1e-4)


def test_adsb_reports_the_true_position_of_equipped_aircraft() -> None:
    fixed = replace(CLIMBING, track_number=8, reports_position=False)
    rows = _plots_of(_scenario(ADSB, EAST, aircraft=(CLIMBING, fixed))).measurements
    reports = np.isfinite(rows.latitude_rad)
    assert set(rows.aircraft[reports]) == {0}
    assert set(rows.aircraft[~reports]) == {0, 1}
    miss = (rows.latitude_rad - rows.true_latitude_rad)[reports]
    np.testing.assert_allclose(miss * 6.4e6, 0.0, atol=1e-6)
    np.testing.assert_allclose(np.diff(rows.time_s[reports]), 2.0, rtol=0, atol=1e-9)


def test_position_errors_are_isotropic_in_true_metres() -> None:
    scenario = _scenario(replace(ADSB, position_sigma_m=50.0, interval_s=0.1), duration_s=400.0)
    rows = _plots_of(scenario).measurements
    north = (rows.latitude_rad - rows.true_latitude_rad) * 6.39e6
    east = (rows.longitude_rad - rows.true_longitude_rad) * 6.39e6
    east = east * np.cos(rows.true_latitude_rad)
    # 4000 values: a standard error of 1.1 %.
    assert north.std() == pytest.approx(50.0, rel=0.04)
    assert east.std() == pytest.approx(50.0, rel=0.04)
    assert abs(np.corrcoef(east, north)[0, 1]) < 0.06


def test_biases_are_measured_minus_true_on_the_ellipsoid_too() -> None:
    offsets = (Bias(250.0), Bias(-0.3 * DEGREE), Bias(0.001), Bias())
    clean = _plots_of(_scenario(EAST)).measurements
    biased = _plots_of(_scenario(replace(EAST, biases=offsets))).measurements
    np.testing.assert_allclose(biased.range_m, clean.range_m * 1.001 + 250.0, atol=1e-6)
    np.testing.assert_allclose(biased.azimuth_rad, clean.azimuth_rad - 0.3 * DEGREE, atol=1e-12)
    late = replace(EAST, biases=(Bias(), Bias(), Bias(), Bias(0.4)))
    stamped = _plots_of(_scenario(late)).measurements
    np.testing.assert_allclose(stamped.time_s, clean.time_s + 0.4, atol=1e-12)
    np.testing.assert_array_equal(stamped.range_m, clean.range_m)
    # The truth of a row is that at the time stamp.
    assert np.all(np.abs(stamped.true_latitude_rad - clean.true_latitude_rad) > 1e-8)


def test_a_bias_jumps_at_the_configured_time() -> None:
    jumping = replace(EAST, biases=(Bias(100.0, jump=150.0, jump_s=120.5), *(Bias(),) * 3))
    still, seen = _plots_of(_scenario(EAST)), _plots_of(_scenario(jumping))
    values = seen.biases.values[:, 0, 0]
    np.testing.assert_array_equal(values, np.where(seen.biases.time_s >= 120.5, 250.0, 100.0))
    off = seen.measurements.range_m - still.measurements.range_m
    time_s = seen.measurements.time_s
    np.testing.assert_allclose(off[time_s < 120.0], 100.0, atol=1e-6)
    np.testing.assert_allclose(off[time_s > 121.0], 250.0, atol=1e-6)


def test_detections_gaps_and_outliers_have_the_configured_rates() -> None:
    rng = np.random.default_rng(0)
    many = tuple(
        replace(CLIMBING, track_number=one, east_m=float(rng.uniform(-8e4, 8e4)))
        for one in range(1, 41)
    )
    radar = replace(EAST, detection_probability=0.8, outlier_probability=0.05,
                    gaps_s=((50.0, 100.0),), rotation_period_s=4.0)  # fmt: skip
    scenario = _scenario(radar, aircraft=many)
    seen = _plots_of(scenario)
    rows, outside = seen.measurements, 40 * 250.0 / 4.0
    assert len(rows) == pytest.approx(0.8 * outside, rel=0.04)
    assert seen.opportunities[0] == pytest.approx(40 * 75, rel=0.02)
    assert not np.any((rows.time_s >= 50.0) & (rows.time_s < 100.0))
    assert rows.outlier.mean() == pytest.approx(0.05, abs=0.015)
    clean = _plots_of(
        _scenario(replace(radar, outlier_probability=0.0), aircraft=many)
    ).measurements
    np.testing.assert_array_equal(rows.time_s, clean.time_s)
    away = np.abs(rows.range_m - clean.range_m)
    assert np.all(away[rows.outlier] > 1999.0)
    np.testing.assert_array_equal(away[~rows.outlier], 0.0)


def test_an_antenna_passes_all_aircraft_in_the_order_of_their_azimuths() -> None:
    many = tuple(
        replace(CLIMBING, track_number=one + 1, north_m=90e3 - 20e3 * one, legs=())
        for one in range(6)
    )
    rows = _plots_of(_scenario(EAST, aircraft=many)).measurements
    turns = rows.time_s / 4.0 - rows.azimuth_rad / (2.0 * np.pi)
    phase = np.mod(turns - turns[0] + 0.5, 1.0) - 0.5
    np.testing.assert_allclose(phase, 0.0, rtol=0, atol=1e-3)


def test_aircraft_outside_the_coverage_are_not_detected() -> None:
    low = replace(CLIMBING, north_m=110e3, height_m=300.0, legs=())
    near = replace(EAST, range_max_m=170e3)
    steep = replace(EXACT, east_m=29e3, north_m=60e3, elevation_max_rad=20 * DEGREE)
    far = _plots_of(_scenario(near, steep)).measurements
    assert np.nanmax(far.range_m) <= 170e3
    up = far.true_height_m / far.range_m
    assert np.max(up[far.sensor == 1]) <= np.sin(20 * DEGREE) + 0.01
    assert (
        len(_plots_of(_scenario(replace(EAST, horizon=False), aircraft=(low,))).measurements) > 70
    )
    hidden = _plots_of(_scenario(replace(EAST, horizon=True), aircraft=(low,)))
    # 4.12 (√700 + √300) km is 180 km.
    assert len(hidden.measurements) < 60
    assert np.max(hidden.measurements.range_m) == pytest.approx(180.4e3, rel=0.03)
    assert hidden.opportunities[0] == len(hidden.measurements)


def test_heights_are_quantised_or_missing() -> None:
    coarse = replace(CLIMBING, height_step_m=7.62)
    rows = _plots_of(_scenario(EAST, aircraft=(coarse,))).measurements
    steps = rows.height_m / 7.62
    np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
    assert np.max(np.abs(rows.height_m - rows.true_height_m)) == pytest.approx(3.81, abs=0.5)
    for scenario in (
        _scenario(replace(EAST, received=frozenset({"mode_3a"}))),
        _scenario(EAST, aircraft=(replace(CLIMBING, reports_height=False),)),
    ):
        assert np.all(np.isnan(_plots_of(scenario).measurements.height_m))


def test_clutter_has_no_aircraft() -> None:
    rows = _plots_of(_scenario(replace(EAST, clutter_per_turn=4.0, range_max_m=300e3))).measurements
    clutter = rows.aircraft == NO_AIRCRAFT
    assert np.count_nonzero(clutter) == pytest.approx(300, rel=0.2)
    assert np.all(np.isnan(rows.height_m[clutter]) & np.isnan(rows.true_latitude_rad[clutter]))
    # Uniform over the area, within 200 km: a quarter of it lies in the inner half of the radius.
    assert np.max(rows.range_m[clutter]) < 200e3
    assert np.mean(rows.range_m[clutter] < 100e3) == pytest.approx(0.25, abs=0.09)


def test_a_seed_is_reproducible_and_sensors_are_independent() -> None:
    noisy = replace(EAST, range_sigma_m=40.0, detection_probability=0.7)
    first, second = (
        _plots_of(_scenario(noisy)).measurements,
        _plots_of(_scenario(noisy)).measurements,
    )
    np.testing.assert_array_equal(first.range_m, second.range_m)
    assert not np.any(
        _plots_of(_scenario(noisy), 2).measurements.range_m[:30] == first.range_m[:30]
    )
    both = _plots_of(_scenario(noisy, WEST)).measurements
    np.testing.assert_array_equal(both.range_m[both.sensor == 0], first.range_m)
    faster = _plots_of(_scenario(replace(noisy, rotation_period_s=3.0), WEST)).measurements
    np.testing.assert_array_equal(
        both.range_m[both.sensor == 1], faster.range_m[faster.sensor == 1]
    )


def test_aircraft_are_measured_during_their_flight_and_rows_are_sorted() -> None:
    many = tuple(
        replace(CLIMBING, track_number=one + 1, start_s=20.0 * one, end_s=20.0 * one + 150.0)
        for one in range(10)
    )
    unborn = replace(CLIMBING, track_number=99, start_s=400.0)
    rows = _plots_of(_scenario(EAST, WEST, ADSB, aircraft=(*many, unborn))).measurements
    for index, aircraft in enumerate(many):
        own = rows.time_s[rows.aircraft == index]
        assert own.min() > aircraft.start_s
        assert own.max() <= min(aircraft.end_s, 300.0)
    assert 10 not in rows.aircraft
    keys = list(zip(rows.time_s, rows.sensor, rows.aircraft, strict=True))
    assert all(before <= after for before, after in pairwise(keys))


def test_a_flat_scenario_is_placed_on_the_ellipsoid_at_its_centre() -> None:
    scenario = replace(builtin_scenario("report-1-6"), duration_s=10.0)
    seen = _plots_of(scenario)
    assert len(seen.measurements) == 450
    east, north = seen.plane.to_plane(
        seen.measurements.true_latitude_rad, seen.measurements.true_longitude_rad
    )
    one = seen.measurements.aircraft == 0
    start = np.array([seen.aircraft[0].east_m, seen.aircraft[0].north_m])
    distance = np.hypot(*(np.stack([east, north], axis=-1)[one] - start).T)
    expected = seen.aircraft[0].speed_mps * seen.measurements.time_s[one]
    np.testing.assert_allclose(distance, expected, rtol=0, atol=1e-3)


@pytest.mark.slow
def test_a_scenario_too_large_for_memory_is_rejected_first() -> None:
    anywhere = (0.0, 1e5)
    traffic = Traffic(20_000, anywhere, anywhere, (9e3, 9e3), (200.0, 200.0), (0.0, 1.0))
    scenario = replace(_scenario(EAST), traffic=(traffic,), duration_s=86_400.0)
    with pytest.raises(
        ConfigurationError, match="expected at most 20000000 measurements, found ab"
    ):
        _plots_of(scenario)
