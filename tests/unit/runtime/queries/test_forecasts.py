"""Forecasts are in true metres east and north at the aircraft, also far from the centre."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.queries.forecast_methods import PredictedPath, known_of
from multiradar.runtime.queries.forecasts import ahead_of, forecast_points
from multiradar.tracking.forecast.forecast_calibration import calibration_for
from multiradar.tracking.outputs import TrackStates
from multiradar.tracking.settings import TrackingSettings
from support.references.straight_forecast import forecast

Floats = NDArray[np.float64]

PLANE = SystemPlane(np.radians(50.0), np.radians(15.0))
STILL = TrackingSettings(filter_name="two-stage", acceleration_density=0.0)
MOVING = TrackingSettings(filter_name="two-stage", acceleration_density=1.0)
TRACK: dict[str, Any] = {
    "track_id": 7,
    "time_s": 100.0,
    "age_s": 0.0,
    "height_m": None,
    "state": "confirmed",
}


def _states(east_m: float, north_m: float, deviation: list[float]) -> TrackStates:
    # Uncertain along one direction of the plane only.
    covariance = np.zeros((1, 4, 4))
    covariance[0, :2, :2] = np.outer(deviation, deviation)
    return TrackStates(
        track_id=np.array([7]),
        time_s=np.array([100.0]),
        mean=np.array([[east_m, north_m, 0.0, 0.0]]),
        covariance=covariance,
        height_m=np.array([np.nan]),
    )


def _points(
    states: TrackStates, track: dict[str, Any], steps_s: Floats, settings: TrackingSettings
) -> list[dict[str, Any]]:
    ahead_s = ahead_of(states, 0, track, steps_s)
    density = settings.acceleration_density
    means, covariances = forecast(states.mean[0], states.covariance[0], density, ahead_s)
    known = np.ones(len(ahead_s), np.bool_)
    course = PredictedPath(
        means[:, :2], covariances[:, :2, :2], np.full(len(known), 4.0), known, "any"
    )
    return forecast_points(course, states.time_s[0] + ahead_s, track, PLANE)


@pytest.mark.parametrize("deviation", [[100.0, 0.0], [0.0, 100.0], [70.0, -70.0]])
def test_the_covariance_is_in_true_metres_far_from_the_centre(deviation: list[float]) -> None:
    """1 200 km from the centre the plane shrinks distances by 2 % and turns north by 11°."""
    east_m, north_m = 900e3, 800e3
    points = _points(_states(east_m, north_m, deviation), TRACK, np.array([0.0]), STILL)
    here = PLANE.to_geodetic(east_m, north_m)
    there = PLANE.to_geodetic(east_m + deviation[0], north_m + deviation[1])
    length_m, azimuth_rad, _ = slant_range_azimuth(
        (float(here[0]), float(here[1]), 0.0), there[0], there[1], 0.0
    )
    east, north = length_m * np.sin(azimuth_rad), length_m * np.cos(azimuth_rad)
    found = points[0]
    # 100 m along the Earth against its tangent: parts in 1e5.
    tolerance = 1e-3 * float(length_m) ** 2
    assert found["covariance_east_m2"] == pytest.approx(east**2, abs=tolerance)
    assert found["covariance_north_m2"] == pytest.approx(north**2, abs=tolerance)
    assert found["covariance_east_north_m2"] == pytest.approx(east * north, abs=tolerance)
    assert found["position_sigma_m"] == pytest.approx(length_m, rel=1e-3)
    # Of a factor of 4, along the deviation.
    assert found["region_major_m"] == pytest.approx(2.0 * length_m, rel=1e-3)
    turned_deg = found["region_azimuth_deg"] - np.degrees(azimuth_rad)
    assert np.sin(np.radians(turned_deg)) == pytest.approx(0.0, abs=1e-3)
    assert length_m > 100.5 or deviation != [100.0, 0.0]


def test_a_track_that_the_filter_does_not_know_has_no_forecast() -> None:
    states = _states(0.0, 0.0, [1.0, 1.0])
    calibration = calibration_for(STILL)
    found = [known_of(states, track_id, calibration) for track_id in (6, 7, 8)]
    assert [one is not None for one in found] == [False, True, False]


def test_a_state_newer_than_the_data_time_is_not_extrapolated_back() -> None:
    states = _states(0.0, 0.0, [1.0, 1.0])
    track = {**TRACK, "time_s": 90.0, "age_s": 5.0}
    points = _points(states, track, np.array([0.0, 10.0]), MOVING)
    assert [point["time_s"] for point in points] == [100.0, 110.0]


def test_a_forecast_ends_where_the_track_leaves_the_plane() -> None:
    # The plane ends 60° from its centre, 5 517 km of plane: 20 km on, at 1 km/s.
    states = _states(5_490e3, 0.0, [1.0, 1.0])
    states.mean[0, 2] = 1000.0
    points = _points(states, TRACK, np.arange(100.0), MOVING)
    assert 1 < len(points) < 100
    assert [point["time_s"] for point in points] == [100.0 + step for step in range(len(points))]


def test_a_track_outside_the_plane_has_no_points() -> None:
    points = _points(_states(6e6, 0.0, [1.0, 1.0]), TRACK, np.arange(3.0), MOVING)
    assert points == []


def test_the_covariance_is_scaled_at_the_height_of_the_aircraft() -> None:
    """Verticals spread: 10 km up, 100 m on the ground are 100 × (1 + 10/6378) m."""
    states, now = _states(0.0, 0.0, [100.0, 0.0]), np.array([0.0])
    low = _points(states, TRACK, now, STILL)
    high = _points(states, {**TRACK, "height_m": 10e3}, now, STILL)
    ratio = high[0]["position_sigma_m"] / low[0]["position_sigma_m"]
    assert ratio == pytest.approx(1.0 + 10.0 / 6388.0, abs=1e-5)
