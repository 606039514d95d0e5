"""The smoother of interacting models: exact where theory gives it, close with several modes."""

import itertools
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.evaluation.smoothing import multiple_modes, single_mode
from multiradar.evaluation.smoothing.motion_modes import MotionModes, civil_modes
from multiradar.evaluation.smoothing.multiple_modes import ResidualBiases, smooth_modes
from multiradar.evaluation.smoothing.single_mode import PositionMeasurements, chunks, smooth

Floats = NDArray[np.float64]
DENSITY = 5.0
#: Two identical modes, equal to the constant velocity of `smooth`.
ALIKE = MotionModes(np.zeros(2), np.full(2, DENSITY), np.full(2, DENSITY), 50.0, 80.0)
#: Low or high process noise, both straight: a switching linear system.
RESTLESS = MotionModes(np.zeros(2), np.array([0.5, 60.0]), np.array([0.5, 60.0]), 30.0, 20.0)
SIGMA_M = 40.0


def generator(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(seed))


def simulated(
    path: Floats, time_s: NDArray[np.floating[Any]], draw: np.random.Generator, aircraft: int = 0
) -> PositionMeasurements:
    """Return measured positions of one aircraft with errors of `SIGMA_M`."""
    count = len(path)
    noise = np.tile(SIGMA_M**2 * np.eye(2), (count, 1, 1))
    position = path + SIGMA_M * draw.normal(size=(count, 2))
    return PositionMeasurements(
        np.full(count, aircraft), np.asarray(time_s, np.float64), position, noise
    )


def joined(*parts: PositionMeasurements) -> PositionMeasurements:
    return PositionMeasurements(
        np.concatenate([one.aircraft for one in parts]),
        np.concatenate([one.time_s for one in parts]),
        np.concatenate([one.position_m for one in parts]),
        np.concatenate([one.covariance_m2 for one in parts]),
    )


def straight(count: int, seed: int, aircraft: int = 0) -> PositionMeasurements:
    draw = generator(seed)
    time_s = np.cumsum(draw.uniform(0.0, 5.0, count))
    return simulated(np.array([180.0, -90.0]) * time_s[:, None], time_s, draw, aircraft)


@pytest.mark.parametrize(("steps_max", "kept_max"), [(1, 3), (8, 8), (41, 41), (10_000, 120)])
def test_the_bound_of_memory_does_not_change_the_result(
    monkeypatch: pytest.MonkeyPatch, steps_max: int, kept_max: int
) -> None:
    measured = joined(straight(40, 1), straight(7, 2, 1), straight(3, 3, 2))
    expected = smooth_modes(measured, RESTLESS, DENSITY)
    whole, kept = multiple_modes._Chunk._filter, []

    def filtered(chunk: Any, now: Any, first: int, last: int) -> Any:
        kept.append(len(chunk._live) * (last - first))
        return whole(chunk, now, first, last)

    monkeypatch.setattr(multiple_modes._Chunk, "_filter", filtered)
    for module in (single_mode, multiple_modes):
        monkeypatch.setattr(module, "_STEPS_MAX", steps_max)
    found = smooth_modes(measured, RESTLESS, DENSITY)
    assert 0 < max(kept) <= kept_max
    assert found.used.tolist() == expected.used.tolist()
    # Sums over more aircraft are rounded in another order.
    assert found.state == pytest.approx(expected.state, rel=1e-6, abs=1e-4)
    covariance_m2 = expected.position_covariance_m2
    assert found.position_covariance_m2 == pytest.approx(covariance_m2, rel=1e-6, abs=1e-4)


def test_aircraft_smoothed_together_are_few_and_their_padded_steps_bounded() -> None:
    length = np.array([5, 100, 7, 6, 3, 1000])
    found = [one.tolist() for one in chunks(length, 3, 21)]
    assert found == [[4, 0, 3], [2], [1], [5]]
    assert [one.tolist() for one in chunks(length, 2, 1200)] == [[4, 0], [3, 2], [1], [5]]
    assert list(chunks(length[:0], 2, 10)) == []


def test_identical_modes_give_the_single_mode_smoother() -> None:
    measured = joined(straight(40, 1), straight(7, 2, 1), straight(3, 3, 2))
    found, expected = smooth_modes(measured, ALIKE, DENSITY), smooth(measured, DENSITY)
    assert found.state == pytest.approx(expected.state, abs=1e-3)
    assert found.position_covariance_m2 == pytest.approx(
        expected.position_covariance_m2, rel=1e-5, abs=1e-3
    )
    assert found.position_variance_m2 == pytest.approx(expected.position_variance_m2, rel=1e-5)


def test_all_positions_of_one_time_are_used() -> None:
    one = straight(20, 4)
    twice = np.repeat(np.arange(20), 2)
    doubled = one.select(twice)
    found, expected = smooth_modes(doubled, ALIKE, DENSITY), smooth(doubled, DENSITY)
    assert found.state == pytest.approx(expected.state, abs=1e-3)


def exact(one: PositionMeasurements, modes: MotionModes) -> tuple[Floats, Floats]:
    """Return means and covariances of positions over all sequences of modes, by least squares."""
    count = len(one)
    steps = np.diff(one.time_s)
    transitions = modes.transition_probabilities(steps)
    weights, means, covariances = [], [], []
    for path in itertools.product(range(len(modes)), repeat=count):
        # The mode at a position is that of the interval before it; the first has none.
        probability = 0.5
        information, right = np.zeros((4 * count, 4 * count)), np.zeros(4 * count)
        information[2:4, 2:4] += np.eye(2) / 300.0**2
        constant = 0.0
        for row in range(count):
            at = slice(4 * row, 4 * row + 2)
            weight = np.linalg.inv(one.covariance_m2[row])
            information[at, at] += weight
            right[at] += weight @ one.position_m[row]
            constant += one.position_m[row] @ weight @ one.position_m[row]
        volume = 0.0
        for row, step in enumerate(steps):
            probability *= transitions[row, path[row], path[row + 1]]
            density = float(modes.along[path[row + 1]])
            motion = np.eye(4) + np.eye(4, k=2) * step
            noise = density * np.kron(
                np.array([[step**3 / 3.0, step**2 / 2.0], [step**2 / 2.0, step]]), np.eye(2)
            )
            link = np.zeros((4, 4 * count))
            link[:, 4 * row : 4 * row + 4] = -motion
            link[:, 4 * row + 4 : 4 * row + 8] = np.eye(4)
            information += link.T @ np.linalg.solve(noise, link)
            volume += np.linalg.slogdet(noise)[1]
        covariance = np.linalg.inv(information)
        mean = covariance @ right
        fit = -0.5 * (constant - right @ mean + volume + np.linalg.slogdet(information)[1])
        weights.append(np.log(probability) + fit)
        means.append(mean.reshape(count, 4)[:, :2])
        covariances.append(
            [covariance[4 * row : 4 * row + 2, 4 * row : 4 * row + 2] for row in range(count)]
        )
    share = np.exp(np.array(weights) - max(weights))
    share /= share.sum()
    middle = np.einsum("s,snm->nm", share, np.array(means))
    apart = np.array(means) - middle
    spread = np.einsum("s,snij->nij", share, np.array(covariances))
    return middle, spread + np.einsum("s,sni,snj->nij", share, apart, apart)


@pytest.mark.slow
def test_it_is_close_to_the_mixture_over_all_sequences_of_modes() -> None:
    """Two modes and seven positions make 128 sequences; the smoother carries two states."""
    off, of_one, ratio = [], [], []
    for seed in range(8):
        draw = generator(seed)
        restless = np.where(np.arange(7) > 3, 17.0, 1.5)[:, None]
        velocity = np.array([200.0, 0.0]) + np.cumsum(restless * draw.normal(size=(7, 2)), axis=0)
        one = simulated(np.cumsum(5.0 * velocity, axis=0), np.arange(7) * 5.0, draw)
        found, (middle, spread) = smooth_modes(one, RESTLESS, 1e4), exact(one, RESTLESS)
        sigma = np.sqrt(np.trace(spread, axis1=1, axis2=2))
        off.append(np.hypot(*(found.state[:, :2] - middle).T) / sigma)
        ratio.append(found.position_variance_m2 / sigma**2)
        alone = (smooth(one, float(density)).state[:, :2] for density in RESTLESS.along)
        of_one.append([np.hypot(*(state - middle).T) / sigma for state in alone])
    assert np.max(off) < 0.3
    assert np.sqrt(np.mean(np.square(off))) < 0.08
    assert np.mean(ratio) == pytest.approx(1.0, abs=0.03)
    # With one of the modes alone the error is larger.
    assert np.sqrt(np.nanmean(np.square(of_one), axis=(0, 2))).min() > 0.15


def manoeuvring(seed: int) -> tuple[PositionMeasurements, Floats]:
    """Return an aircraft on straight legs and turns at 200 m/s, every 5 s, and its true path."""
    draw = generator(seed)
    course, position = draw.uniform(0.0, 6.0), np.zeros(2)
    paths: list[Floats] = []
    while len(paths) < 240:
        bank = np.radians(draw.choice([-1.0, 1.0]) * draw.uniform(12.0, 28.0))
        rate = 9.81 * np.tan(bank) / 200.0
        for turning, steps in ((0.0, draw.integers(10, 30)), (rate, draw.integers(5, 15))):
            for _ in range(int(steps) * 10):
                course += turning * 0.5
                position = position + 100.0 * np.array([np.sin(course), np.cos(course)])
                paths.append(position)
    path = np.array(paths)[9::10]
    time_s = 5.0 * np.arange(len(path))
    return simulated(path, time_s, draw), path


def test_manoeuvres_are_followed_better_than_by_one_noise_and_consistently() -> None:
    flown = [manoeuvring(seed) for seed in range(8)]
    one = joined(
        *(replace_aircraft(measured, number) for number, (measured, _) in enumerate(flown))
    )
    path = np.concatenate([true for _, true in flown])
    found = smooth_modes(one, civil_modes(), 30.0)
    error = found.state[:, :2] - path
    best = min(
        np.sqrt(np.nanmean(np.sum((smooth(one, density).state[:, :2] - path) ** 2, axis=1)))
        for density in (3.0, 10.0, 30.0)
    )
    assert found.used.all()
    assert np.sqrt(np.mean(np.sum(error**2, axis=1))) < 0.85 * best
    weighed = np.linalg.solve(found.position_covariance_m2, error[..., None])[..., 0]
    # 8 flights of some 300 correlated positions: the band of 60 independent ones.
    assert 0.7 < np.mean(np.sum(error * weighed, axis=1)) / 2.0 < 1.35


def replace_aircraft(one: PositionMeasurements, number: int) -> PositionMeasurements:
    return replace(one, aircraft=np.full(len(one), number))


def test_residual_biases_are_in_the_covariance() -> None:
    """With identical modes, states are affine in the biases: the covariance grows by V Σ Vᵀ."""
    one = straight(30, 8)
    draw = generator(9)
    sensitivity = np.zeros((30, 2, 2))
    sensitivity[::2, :, 0] = [0.6, 0.8]
    sensitivity[1::2, :, 1] = draw.normal(size=(15, 2))
    covariance = np.array([[900.0, 200.0], [200.0, 400.0]])
    left = ResidualBiases(sensitivity, covariance)
    found, without = smooth_modes(one, ALIKE, DENSITY, left), smooth_modes(one, ALIKE, DENSITY)
    assert found.state == pytest.approx(without.state, abs=1e-6)
    columns = []
    for bias in np.eye(2):
        moved = replace(one, position_m=one.position_m - sensitivity @ bias)
        columns.append((smooth_modes(moved, ALIKE, DENSITY).state - without.state)[:, :2])
    slope = np.stack(columns, axis=-1)
    expected = without.position_covariance_m2 + slope @ covariance @ slope.swapaxes(1, 2)
    assert found.position_covariance_m2 == pytest.approx(expected, rel=1e-5, abs=1e-3)


@pytest.mark.parametrize("where", [0, 1, 15, 28, 29])
def test_an_outlier_at_any_position_is_rejected(where: int) -> None:
    clean = straight(30, 10)
    position = clean.position_m.copy()
    position[where] += [9000.0, -4000.0]
    found = smooth_modes(replace(clean, position_m=position), civil_modes(), 30.0)
    assert np.flatnonzero(~found.used).tolist() == [where]
    rest = np.flatnonzero(np.arange(30) != where)
    without = smooth_modes(clean.select(rest), civil_modes(), 30.0)
    assert found.state[rest] == pytest.approx(without.state, abs=1e-6)
    assert np.isnan(found.state[where]).all()


def test_an_aircraft_is_smoothed_independently_of_others() -> None:
    parts = [replace_aircraft(manoeuvring(number)[0], number) for number in range(3)]
    short = replace_aircraft(straight(9, 20), 3)
    together = smooth_modes(joined(*parts, short), civil_modes(), 30.0)
    alone = smooth_modes(parts[1], civil_modes(), 30.0)
    first = len(parts[0])
    assert together.state[first : first + len(parts[1])] == pytest.approx(alone.state, abs=1e-6)


def test_transition_probabilities_compose_over_time() -> None:
    modes = civil_modes()
    whole, first, rest = (
        modes.transition_probabilities(np.array([step])) for step in (7.0, 2.5, 4.5)
    )
    assert whole.sum(axis=2) == pytest.approx(1.0)
    assert whole.min() > 0.0
    assert first @ rest == pytest.approx(whole)
    assert modes.transition_probabilities(np.zeros(1))[0] == pytest.approx(np.eye(len(modes)))


def test_a_turn_to_the_right_is_clockwise_on_its_circle() -> None:
    modes = civil_modes()
    velocity = np.zeros((1, len(modes), 2))
    velocity[..., 1] = 150.0
    motion = modes.motion(np.array([20.0]), velocity, np.zeros((1, len(modes))))
    state = motion[0] @ np.array([0.0, 0.0, 0.0, 150.0])
    radius = 150.0**2 / modes.lateral_mps2[1]
    angle = 20.0 * 150.0 / radius
    expected = [radius * (1.0 - np.cos(angle)), radius * np.sin(angle)]
    assert state[1, :2] == pytest.approx(expected)
    assert state[2, :2] == pytest.approx([-expected[0], expected[1]])
    assert state[0, :2] == pytest.approx([0.0, 3000.0])


def test_noise_lies_along_and_across_the_velocity() -> None:
    modes = civil_modes()
    velocity = np.zeros((1, len(modes), 2))
    velocity[..., 0] = 200.0
    noise = modes.noise(np.array([4.0]), velocity, np.zeros(1))[0]
    assert noise[-1, 2:, 2:] == pytest.approx(np.diag([80.0, 0.04]))
    assert noise[5, :2, :2] == pytest.approx(np.diag([0.01, 8.0]) * 64.0 / 3.0)
    still = modes.noise(np.array([4.0]), 0.0 * velocity, np.ones(1))[0]
    assert still[-1, 2:, 2:] == pytest.approx(4.0 * (1.0 + 10.005) * np.eye(2))
