"""Formulas of Nenartovich and Isakov one by one, in the plane and in space, sources that move."""

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import BearingsError
from multiradar.estimation.filters.bearings_only import (
    BearingsState,
    initiate,
    is_observable,
    predict,
    update,
)
from multiradar.estimation.measurement.sights import Sight

Floats = NDArray[np.float64]

SIGMA = 0.003
TARGET = np.array([10e3, 60e3, 9e3])
VELOCITY = np.array([150.0, -80.0, 0.0])


def sight(source: Floats, position: Floats, error: float = 0.0) -> Sight:
    """Azimuth, and in space elevation, of a position from a source."""
    line = position - source
    azimuth = np.asarray(np.arctan2(line[0], line[1]) + error)
    if len(source) == 2:
        return Sight(source, azimuth, SIGMA)
    elevation = np.asarray(np.arctan2(line[2], np.hypot(line[0], line[1])))
    return Sight(source, azimuth, SIGMA, elevation, SIGMA)


def circle(time_s: float, d: int) -> Floats:
    angle = 0.03 * time_s
    return np.array([8e3 * np.sin(angle), 8e3 * np.cos(angle), 3e3])[:d]


def line(time_s: float, d: int) -> Floats:
    return np.array([200.0 * time_s, -5e3, 3e3])[:d]


def known(d: int) -> BearingsState:
    """A prior: 2 km and 50 m/s on each axis."""
    information = np.diag(np.r_[np.full(d, 2e3**-2), np.full(d, 50.0**-2)])
    mean = np.r_[TARGET[:d], VELOCITY[:d]]
    return BearingsState(0.0, information, information @ mean, np.zeros((d, d)))


@pytest.mark.parametrize("d", [2, 3])
def test_each_angle_has_information_of_rank_one(d: int) -> None:
    """(11): an azimuth adds one direction, an elevation another, for any motion of the source."""
    state = known(d)
    for count, time_s in enumerate((0.0, 40.0, 80.0), 1):
        state_now = update(state, sight(circle(time_s, d), TARGET[:d]))
        added = (state_now.information - state.information)[:d, :d]
        # In units of the distance: nothing is added along the line of sight.
        values = np.linalg.eigvalsh(added) * 60e3**2 * SIGMA**2
        assert (values[1:] > 0.5).sum() == d - 1
        assert abs(values[0]) < 1e-9
        assert count <= 3


def test_a_missing_range_does_not_affect_the_estimate() -> None:
    """(11), (12): with C diag(0, σ⁻²) Cᵀ any number may replace the range, also zero."""
    mean, covariance = known(2).estimate()
    source = np.array([-20e3, 5e3])
    seen = sight(source, TARGET[:2], 1e-4)
    h = np.eye(4)[:2]
    turn = np.array(
        [
            [np.sin(seen.azimuth_rad), np.cos(seen.azimuth_rad)],
            [np.cos(seen.azimuth_rad), -np.sin(seen.azimuth_rad)],
        ]
    ).T
    distance = np.linalg.norm(TARGET[:2] - source)
    weight = turn @ np.diag([0.0, (distance * SIGMA) ** -2]) @ turn.T
    left = np.linalg.inv(np.linalg.inv(covariance) + h.T @ weight @ h)
    estimates = []
    for anything_m in (0.0, 1e6):
        measured = turn @ np.array([anything_m, 0.0]) + source
        estimates.append(mean + left @ h.T @ weight @ (measured - h @ mean))
    assert estimates[0] == pytest.approx(estimates[1], abs=1e-6)
    found, updated = update(known(2), seen).estimate()
    # The derivative at the state instead of at the measured angle: 1e-4 of the step.
    step = np.linalg.norm(estimates[0] - mean)
    assert step > 1.0
    assert np.linalg.norm(found - estimates[0]) < 1e-2 * step
    assert updated == pytest.approx(left, rel=1e-3, abs=1.0)


def test_angles_in_space_improve_the_prediction_where_lines_intersect() -> None:
    """(7), (8): P(n/0) − P(n) is never negative, and positive for the position where (10) holds."""
    for moving, crosses in ((circle, True), (lambda _t, n: circle(0.0, n), False)):
        state = known(3)
        # It hovers, so that angles are linearised on the one line.
        state = replace(state, vector=state.information @ np.r_[TARGET, np.zeros(3)])
        prior = state
        for time_s in (0.0, 20.0, 40.0, 60.0):
            state, prior = predict(state, time_s, 0.0), predict(prior, time_s, 0.0)
            # A fixed target, so that the line from a fixed source is constant.
            state = update(state, sight(moving(time_s, 3), TARGET))
        gained = prior.estimate()[1] - state.estimate()[1]
        scale = np.sqrt(np.diag(prior.estimate()[1]))
        scaled = gained / np.outer(scale, scale)
        assert np.linalg.eigvalsh(scaled)[0] > -1e-9
        # Along one line nothing is gained.
        least = np.linalg.eigvalsh(scaled[:3, :3])[0]
        assert least > 0.01 if crosses else least < 1e-6
        assert bool(state.lines_cross) is crosses


def test_condition_10_is_the_sum_of_the_products_of_all_pairs_of_lines() -> None:
    """Σ |x_i × x_j|² is the determinant of Σ n nᵀ, so that both are zero together."""
    state = known(2)
    sights = [sight(circle(time_s, 2), TARGET[:2]) for time_s in (0.0, 30.0, 60.0, 90.0)]
    for one in sights:
        state = update(state, one)
    lines = [np.array([np.sin(one.azimuth_rad), np.cos(one.azimuth_rad)]) for one in sights]
    products = sum(
        (one[0] * other[1] - one[1] * other[0]) ** 2 for one, other in combinations(lines, 2)
    )
    assert np.linalg.det(state.crossing) == pytest.approx(products / SIGMA**4, rel=1e-9)
    assert state.lines_cross


def test_condition_10_in_space_requires_two_nonparallel_lines() -> None:
    """One line leaves its own direction undetermined; a second one at an angle γ determines it."""
    here = np.zeros(3)
    once = update(known(3), sight(here, TARGET))
    # The root of rounding, against 333 of a line across.
    assert once.crossing_strength == pytest.approx(0.0, abs=1e-4)
    along = TARGET / np.linalg.norm(TARGET)
    twice = update(once, sight(-20e3 * along, TARGET))
    assert not twice.lines_cross
    aside = np.array([0.0, 0.0, 4e3])
    crossed = update(once, sight(aside, TARGET))
    angle = np.arccos(along @ (TARGET - aside) / np.linalg.norm(TARGET - aside))
    # Of two lines the least eigenvalue of Σ n nᵀ/σ² is (1 − cos γ)/σ², as in the plane.
    expected = np.sqrt(1.0 - np.cos(angle)) / SIGMA
    assert crossed.crossing_strength == pytest.approx(expected, rel=0.02)
    assert crossed.lines_cross


def flight(path: Callable[[float, int], Floats], d: int) -> tuple[list[Sight], Floats]:
    """Three minutes of a moving source and a target in straight flight, errors in all angles."""
    rng = np.random.default_rng(2)
    times = np.arange(-180.0, 1.0, 3.0)
    sights = []
    for t in times.tolist():
        one = sight(path(t, d), TARGET[:d] + t * VELOCITY[:d], SIGMA * rng.standard_normal())
        if one.elevation_rad is not None:
            noisy = one.elevation_rad + SIGMA * rng.standard_normal()
            one = Sight(one.source_m, one.azimuth_rad, SIGMA, np.asarray(noisy), SIGMA)
        sights.append(one)
    return sights, times


@pytest.mark.parametrize("d", [2, 3])
def test_one_moving_source_alone_observes_a_straight_target_it_out_manoeuvres(d: int) -> None:
    state = initiate(*flight(circle, d), 300.0)
    mean, covariance = state.estimate()
    assert is_observable(state, circle(0.0, d))
    miss = mean[:d] - TARGET[:d]
    # χ² of two or three degrees of freedom: one in ten thousand is above.
    assert miss @ np.linalg.solve(covariance[:d, :d], miss) < 22.0


@pytest.mark.parametrize("d", [2, 3])
def test_a_source_in_straight_flight_does_not_observe_the_distance(d: int) -> None:
    """Any distance with a matching speed is possible, also zero."""
    with pytest.raises(BearingsError, match="do not determine a state"):
        initiate(*flight(line, d), 300.0)
