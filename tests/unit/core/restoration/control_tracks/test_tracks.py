"""Control, geometric and measurement tracks, and their errors."""

import numpy as np
import pytest

from multiradar.errors import (
    CovarianceError,
    MotionParameterError,
    ShapeError,
    TimeOrderError,
)
from multiradar.restoration.control_tracks.tracks import (
    ControlTrack,
    GeometricTrack,
    measurement_track,
    whole_seconds,
)
from support.references.mean_distance import mean_distance
from support.scenarios.flown import state_by_series

#: Decelerates from 100 to 20 m/s in a right turn, and accelerates again in a left one.
BEGIN_S, SWITCH_S = 5.0, 45.5
SLOWEST = ControlTrack(
    np.array([3e3, -1e3, 101.0, 0.4]), np.array([BEGIN_S, SWITCH_S]),
    np.array([3.0, -1.5]), np.array([-2.0, 1.9]),
)  # fmt: skip


def test_a_track_through_minimum_speed_equals_the_equations() -> None:
    """Each whole second against (2.1) with forty digits; required is 1e-9 of the distance."""
    grid = whole_seconds(BEGIN_S, 90.0)
    found = SLOWEST.geometric(grid)
    (u, w), (v, z) = SLOWEST.lateral_mps2, SLOWEST.longitudinal_mps2
    middle = state_by_series(SLOWEST.start, u, v, SWITCH_S - BEGIN_S)
    assert middle[2] == pytest.approx(20.0)
    for place in (0, 20, 40, 41, 60, 85):
        time = float(grid[place])
        exact = (
            state_by_series(SLOWEST.start, u, v, time - BEGIN_S)
            if time < SWITCH_S
            else state_by_series(middle, w, z, time - SWITCH_S)
        )
        # A flight of some 4 km; coordinates of 3 km round to 1e-12.
        assert np.hypot(*(found.position_m[place] - exact[:2])) < 4e-9
        assert found.speed_mps[place] == pytest.approx(exact[2], rel=1e-13)
        assert found.heading_rad[place] == pytest.approx(exact[3], rel=1e-13)


def test_a_track_is_extrapolated_before_its_start() -> None:
    before = SLOWEST.geometric([BEGIN_S - 10.0])
    state = np.array([*before.position_m[0], before.speed_mps[0], before.heading_rad[0]])
    again = ControlTrack(
        state, np.array([BEGIN_S - 10.0]), SLOWEST.lateral_mps2[:1], SLOWEST.longitudinal_mps2[:1]
    ).geometric([BEGIN_S])
    assert before.speed_mps[0] == pytest.approx(121.0)
    assert again.position_m[0] == pytest.approx(SLOWEST.start[:2], abs=1e-8)


def test_a_track_below_minimum_speed_is_rejected() -> None:
    alone = ControlTrack(SLOWEST.start, np.array([0.0]), np.array([0.0]), np.array([-2.0]))
    with pytest.raises(MotionParameterError, match="expected at least 10 m/s"):
        alone.geometric([60.0])


def test_the_grid_is_of_whole_seconds() -> None:
    assert whole_seconds(4.2, 8.9).tolist() == [5.0, 6.0, 7.0, 8.0]
    assert whole_seconds(3.0, 5.0).tolist() == [3.0, 4.0, 5.0]
    assert whole_seconds(4.2, 4.8).tolist() == []


def test_the_distance_of_tracks_is_the_mean_distance() -> None:
    times = np.arange(3.0)
    one = GeometricTrack(times, np.zeros((3, 2)), np.ones(3), np.zeros(3))
    other = GeometricTrack(
        times, np.array([[3.0, 4.0], [0.0, 0.0], [-8.0, 6.0]]), np.ones(3), np.zeros(3)
    )
    assert mean_distance(one, other) == pytest.approx(5.0)
    later = GeometricTrack(times + 1.0, other.position_m, np.ones(3), np.zeros(3))
    with pytest.raises(ShapeError, match="one grid of times"):
        mean_distance(one, later)


def test_times_of_a_geometric_track_ascend() -> None:
    with pytest.raises(TimeOrderError, match=r"expected a time of 20.0 s or later, was 19.0 s"):
        SLOWEST.geometric([10.0, 20.0, 19.0])


def test_invalid_measurement_tracks_are_rejected() -> None:
    places, noise, radar = np.zeros((3, 2)), np.tile(np.eye(2), (3, 1, 1)), [1, 1, 2]
    times = [0.0, 1.0, 1.0]
    assert len(measurement_track(times, places, noise, radar)) == 3
    with pytest.raises(TimeOrderError, match=r"expected a time of 1.0 s or later, was 0.5 s"):
        measurement_track([0.0, 1.0, 0.5], places, noise, radar)
    with pytest.raises(ShapeError, match="plot positions"):
        measurement_track(times, places[:2], noise, radar)
    with pytest.raises(ShapeError, match="plot times"):
        measurement_track([0.0, np.inf, 2.0], places, noise, radar)
    with pytest.raises(CovarianceError, match="plot covariances"):
        measurement_track(times, places, -noise, radar)
    with pytest.raises(ShapeError, match="plot radars"):
        measurement_track(times, places, noise, [1, 2])
