"""Bearings only: rank-one information, the limit of the paper, observability."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import chi2

from multiradar.errors import BearingsError, MotionParameterError, ShapeError, TimeOrderError
from multiradar.estimation.filters.bearings_only import (
    BearingsState,
    _linear_rows,
    initiate,
    is_observable,
    predict,
    update,
)
from multiradar.estimation.measurement.sights import Sight
from support.references.constant_velocity import process_noise, transition

Floats = NDArray[np.float64]

SIGMA = 0.003
POSITION = np.array([10e3, 60e3])
VELOCITY = np.array([150.0, -80.0])
SOURCES = np.array([[0.0, 0.0], [40e3, 5e3], [-20e3, 10e3]])


def seen(source: Floats, position: Floats, error: Floats | float = 0.0) -> Sight:
    line = position - source
    return Sight(source, np.arctan2(line[..., 0], line[..., 1]) + error, SIGMA)


def straight(count: int, error: float = 0.0) -> tuple[list[Sight], list[float]]:
    """Alternating sights of the sources, a second apart, of a straight flight."""
    times = [float(t) for t in range(-count + 1, 1)]
    sights = [
        seen(SOURCES[place % 3], POSITION + t * VELOCITY, error) for place, t in enumerate(times)
    ]
    return sights, times


def known(time_s: float = 0.0) -> BearingsState:
    sights, times = straight(9)
    return predict(initiate(sights, times, 300.0), time_s, 0.5)


def test_exact_angles_give_the_trajectory() -> None:
    """The prior of the velocity, 10 km/s, shifts it by some 1e-4 m/s."""
    sights, times = straight(12)
    mean, _ = initiate(sights, times, 1e4).estimate()
    assert mean[:2] == pytest.approx(POSITION, abs=1.0)
    assert mean[2:] == pytest.approx(VELOCITY, abs=0.5)


def test_an_update_is_the_limit_of_growing_range_variance() -> None:
    """(6) with the variance of the range going to infinity; rank one of (11)."""
    state = known()
    mean, covariance = state.estimate()
    sight = seen(SOURCES[1], POSITION, 0.004)
    found, left = update(state, sight).estimate()
    line = mean[:2] - SOURCES[1]
    distance = np.linalg.norm(line)
    angle = np.arctan2(line[0], line[1])
    turn = np.array([[np.sin(angle), np.cos(angle)], [np.cos(angle), -np.sin(angle)]])
    h = np.eye(4)[:2]
    # No information along the line; across it the angle times the distance.
    noise = turn.T @ np.diag([1e7**2, (distance * SIGMA) ** 2]) @ turn
    gain = covariance @ h.T @ np.linalg.inv(h @ covariance @ h.T + noise)
    (residual,), _, _ = sight.residuals(mean[:2])
    across = turn.T @ np.array([12345.0, distance * residual])
    assert found == pytest.approx(mean + gain @ across, rel=1e-6, abs=1e-4)
    assert left == pytest.approx(covariance - gain @ h @ covariance, rel=1e-6, abs=1e-3)
    added = update(state, sight).information - state.information
    assert np.linalg.matrix_rank(added, tol=1e-6 * np.abs(added).max()) == 1


def test_prediction_equals_that_of_covariances() -> None:
    state = known()
    mean, covariance = state.estimate()
    moved = predict(state, 7.0, 0.8)
    found, predicted = moved.estimate()
    move = transition(np.array([7.0]))[0]
    assert found == pytest.approx(move @ mean, rel=1e-9)
    expected = move @ covariance @ move.T + process_noise(np.array([7.0]), 0.8)[0]
    assert predicted == pytest.approx(expected, rel=1e-8)


def test_a_singular_information_remains_singular_in_prediction() -> None:
    """A singular Y: one line of sight, predicted without its inverse."""
    across = np.array([0.6, -0.8, 0.0, 0.0])
    information = np.outer(across, across) / 100.0
    state = BearingsState(0.0, information, np.zeros(4), np.zeros((2, 2)))
    moved = predict(state, 3.0, 0.5)
    assert np.linalg.matrix_rank(moved.information, tol=1e-12) == 1
    with pytest.raises(BearingsError, match="determine a state") as error:
        moved.estimate()
    assert error.value.code == "NOT_OBSERVABLE"


def test_ranges_and_angles_mix_in_one_track() -> None:
    """A range reduces the error along its line: the trace falls below its variance there."""
    state = known()
    line = POSITION - SOURCES[0]
    distance = np.linalg.norm(line)
    ranged = Sight(
        SOURCES[0], np.arctan2(line[0], line[1]), SIGMA,
        range_m=np.asarray(distance), range_sigma_m=20.0,
    )  # fmt: skip
    _, sigmas, _ = _linear_rows(ranged)
    assert sigmas == pytest.approx([SIGMA, 20.0 / distance])
    _, before = state.estimate()
    _, after = update(state, ranged).estimate()
    along = line / distance
    assert along @ before[:2, :2] @ along > 100.0**2
    assert along @ after[:2, :2] @ along < 20.0**2
    alone = initiate([ranged], [0.0], 300.0)
    mean, _ = alone.estimate()
    assert mean[:2] == pytest.approx(POSITION, abs=1e-3)
    assert mean[2:] == pytest.approx([0.0, 0.0], abs=1e-6)
    assert alone.lines_cross
    across = np.array([along[1], -along[0]])
    weights = [1.0 / SIGMA**2, (distance / 20.0) ** 2]
    expected = weights[0] * np.outer(across, across) + weights[1] * np.outer(along, along)
    assert alone.crossing == pytest.approx(expected, rel=1e-6)


def test_parallel_lines_are_not_observable() -> None:
    beside = [seen(np.array([0.0, y]), np.array([0.0, 90e3])) for y in (0.0, 10e3, 20e3)]
    far = [seen(np.array([x, 0.0]), np.array([0.0, 90e6])) for x in (0.0, 10e3, 20e3)]
    for sights in (beside, far, beside[:1]):
        with pytest.raises(BearingsError) as error:
            initiate(sights, np.zeros(len(sights)), 300.0)
        assert error.value.code == "NOT_OBSERVABLE"


#: Isotropic: information across a line gives none along it.
PRIOR = np.diag([3e3**2, 3e3**2, 30.0**2, 30.0**2])


def predicted_and_updated(
    sources: Floats, path: Floats, prior: Floats, times: Floats
) -> tuple[Floats, BearingsState]:
    """P_{n/0} of (7), and the state after alternating sights; motion without noise."""
    velocity = (path[-1] - path[0]) / (times[-1] - times[0])
    start: Floats = np.concatenate([path[0], velocity])
    information = np.asarray(np.linalg.inv(prior), np.float64)
    state = BearingsState(
        float(times[0]), information, np.dot(information, start), np.zeros((2, 2))
    )
    for row, time in enumerate(times.tolist()):
        sight = seen(sources[row % len(sources)], path[row])
        state = update(predict(state, time, 0.0), sight)
    move = transition(times[-1:] - times[0])[0]
    return np.asarray(move @ prior @ move.T), state


def test_updates_improve_predictions_only_where_lines_intersect() -> None:
    """(8) holds of any sights; P_{n/0} − P_n is regular under condition (10), and not without."""
    times = np.arange(0.0, 45.0, 5.0)
    crossing = POSITION + times[:, None] * VELOCITY
    # Away from one source along its line: all lines of sight are one.
    along = POSITION * (1.0 + 0.004 * times[:, None])
    for sources, path, regular in ((SOURCES, crossing, True), (SOURCES[:1], along, False)):
        before, state = predicted_and_updated(sources, path, PRIOR, times)
        covariance = np.linalg.inv(state.information)
        sigmas = np.sqrt(np.diagonal(before))
        gained = np.linalg.eigvalsh((before - covariance) / np.outer(sigmas, sigmas))
        assert gained[0] > -1e-9
        # Two sources determine all four components, one line the two across it.
        assert (gained > 1e-4).sum() == (4 if regular else 2)
        assert bool(state.lines_cross) == regular
        if not regular:
            line = POSITION / np.linalg.norm(POSITION)
            kept = line @ covariance[:2, :2] @ line
            assert kept == pytest.approx(line @ before[:2, :2] @ line, rel=1e-9)


def test_information_may_be_added_without_prediction_at_known_velocity() -> None:
    """(9) of the paper: with a velocity known to 1e-6 m/s it equals the recursion; else not."""
    times = np.arange(0.0, 45.0, 5.0)
    path = POSITION + times[:, None] * VELOCITY
    ratios = []
    for sigma in (1e-6, 40.0):
        prior = np.diag([3e3**2, 2e3**2, sigma**2, sigma**2])
        before, state = predicted_and_updated(SOURCES, path, prior, times)
        added = np.linalg.inv(before)
        for row in range(len(times)):
            line = path[row] - SOURCES[row % 3]
            distance = np.linalg.norm(line)
            normal = np.array([line[1], -line[0]]) / distance
            added[:2, :2] += np.outer(normal, normal) / (distance * SIGMA) ** 2
        of_paper, found = np.linalg.inv(added), np.linalg.inv(state.information)
        ratios.append(np.trace(of_paper[:2, :2]) / np.trace(found[:2, :2]))
    # 1e-3: the filter linearises at the estimate, which has no errors here.
    assert ratios[0] == pytest.approx(1.0, abs=1e-3)
    assert ratios[1] < 0.8


def test_lines_intersecting_behind_a_source_are_rejected() -> None:
    apart = [
        Sight(np.array([-10e3, 0.0]), np.array(-0.3), SIGMA),
        Sight(np.array([10e3, 0.0]), np.array(0.3), SIGMA),
    ]
    with pytest.raises(BearingsError) as error:
        initiate(apart, [0.0, 0.0], 300.0)
    assert error.value.code == "BEHIND_SOURCE"


def test_a_single_source_initiates_no_track() -> None:
    """Its line rotates, but any distance with a matching speed is possible."""
    times = np.arange(0.0, 60.0, 5.0)
    sights = [seen(SOURCES[0], POSITION + t * VELOCITY) for t in times]
    with pytest.raises(BearingsError) as error:
        initiate(sights, times, 300.0)
    assert error.value.code == "NOT_OBSERVABLE"


def test_a_lost_distance_is_not_observable() -> None:
    """Ten minutes with one source: (10) still holds, the distance is no longer observable."""
    state = known()
    assert is_observable(state, SOURCES[0])
    path = POSITION.copy()
    for t in np.arange(10.0, 601.0, 10.0):
        path = POSITION + t * 0.05 * VELOCITY
        state = update(predict(state, float(t), 5.0), seen(SOURCES[0], path))
    assert state.lines_cross
    assert not is_observable(state, SOURCES[0])


def test_angles_in_space_locate_in_space() -> None:
    position = np.array([10e3, 60e3, 8e3])
    sights = []
    for source in ([0.0, 0.0, 0.0], [40e3, 5e3, 200.0]):
        east, north, up = position - np.array(source)
        azimuth, elevation = np.arctan2(east, north), np.arctan2(up, np.hypot(east, north))
        sights.append(Sight(np.array(source), azimuth, SIGMA, elevation, SIGMA))
    mean, covariance = initiate(sights, [0.0, 0.0], 300.0).estimate()
    assert mean[:3] == pytest.approx(position, abs=1e-3)
    assert (np.linalg.eigvalsh(covariance) > 0.0).all()
    flat = [Sight(sight.source_m, sight.azimuth_rad, SIGMA) for sight in sights]
    with pytest.raises(BearingsError):
        initiate(flat, [0.0, 0.0], 300.0)


def test_bearings_only_filter_is_consistent() -> None:
    """NEES of 300 runs at the end of 40 s, three alternating sources: within its 99.9 % band."""
    rng = np.random.default_rng(1)
    runs, density = 300, 0.2
    state = np.tile(np.r_[POSITION, VELOCITY], (runs, 1))
    root = np.linalg.cholesky(process_noise(np.array([1.0]), density)[0])
    move = transition(np.array([1.0]))[0]
    sights = []
    for t in range(40):
        if t:
            state = state @ move.T + rng.standard_normal((runs, 4)) @ root.T
        error = SIGMA * rng.standard_normal(runs)
        sights.append(seen(SOURCES[t % 3], state[:, :2], error))
    found = initiate(sights[:6], np.arange(6.0), 300.0)
    for t in range(6, 40):
        found = update(predict(found, float(t), density), sights[t])
    mean, covariance = found.estimate()
    miss = mean - state
    nees = float((miss * np.linalg.solve(covariance, miss[..., None])[..., 0]).sum())
    low, high = chi2.ppf([0.0005, 0.9995], 4 * runs)
    assert low < nees < high


def test_invalid_times_and_settings_are_rejected() -> None:
    sights, times = straight(6)
    with pytest.raises(TimeOrderError):
        initiate(sights, times[::-1], 300.0)
    with pytest.raises(TimeOrderError):
        predict(known(), -1.0, 0.5)
    with pytest.raises(MotionParameterError):
        initiate(sights, times, 0.0)
    with pytest.raises(MotionParameterError):
        predict(known(), 1.0, -0.5)
    with pytest.raises(ShapeError):
        initiate(sights, times[:-1], 300.0)
    with pytest.raises(ShapeError):
        initiate([], [], 300.0)
    space = Sight(np.zeros(3), np.array(0.1), SIGMA)
    with pytest.raises(ShapeError):
        update(known(), space)
    with pytest.raises(ShapeError):
        initiate([sights[0], space], [0.0, 0.0], 300.0)
