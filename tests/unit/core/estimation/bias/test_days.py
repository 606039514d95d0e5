"""Biases of separate recordings: the information of the start does not count, tests are exact."""

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import kstest

from multiradar.estimation.bias.days import (
    OwnEstimate,
    line,
    merged,
    own_estimate,
    own_information,
    scatter,
    step,
)
from multiradar.estimation.bias.store import BiasState, add_information

Floats = NDArray[np.float64]

SCALE = np.array([500.0, 0.0087, 500.0, 0.0087])
TRUE = np.array([180.0, -0.003, -90.0, 0.002])
ALL = np.arange(4)
#: Chance of a wrong alarm of each statistical test here.
P_MIN = 1e-3
DRAWS = 400


def information_of(random: np.random.Generator) -> Floats:
    """Return that of a day: correlated biases, 100 times better than their priors."""
    rows = random.normal(size=(12, 4)) * 60.0
    rows[:, 1] += rows[:, 3]
    return np.asarray(rows.T @ rows / np.outer(SCALE, SCALE))


def day(start: BiasState, true: Floats, random: np.random.Generator) -> BiasState:
    """Return the end of a day that starts from a state."""
    matrix = information_of(random)
    measured = random.multivariate_normal(true, np.linalg.inv(matrix))
    return add_information(start, matrix, matrix @ measured)


def priors() -> BiasState:
    return BiasState(np.array([20.0, 0.0, 0.0, 0.001]), np.diag(SCALE**2), SCALE)


def days(true: Floats, random: np.random.Generator, *, chained: bool) -> list[OwnEstimate]:
    """Return what each day says alone; ``true`` has a row for each."""
    found, start = [], priors()
    for one in true:
        end = day(start, one, random)
        found.append(own_estimate(own_information(start, end)))
        start = end if chained else priors()
    return found


def test_the_measurements_alone_are_what_was_added() -> None:
    random = np.random.Generator(np.random.PCG64(1))
    matrix = information_of(random)
    end = add_information(priors(), matrix, matrix @ TRUE)
    found = own_estimate(own_information(priors(), end))
    np.testing.assert_allclose(found.value / SCALE, TRUE / SCALE, atol=1e-9)
    np.testing.assert_allclose(found.covariance @ matrix, np.eye(4), atol=1e-6)
    assert found.determined.all()


def test_a_combination_that_no_day_measures_stays_that_of_the_prior() -> None:
    """Two azimuths of which only the difference is known: n days do not know their sum better."""
    scale = np.full(2, 0.0087)
    start = BiasState(np.zeros(2), np.diag(scale**2), scale)
    rows = np.array([[1.0, -1.0]]) / 1e-5
    parts = []
    for _ in range(5):
        end = add_information(start, rows.T @ rows, rows.T @ np.array([300.0]))
        parts.append(own_information(start, end))
        assert not own_estimate(parts[-1]).determined.any()
        # Chained: the next day starts from this one.
        start = end
    common, apart = np.array([1.0, 1.0]), np.array([1.0, -1.0])
    prior = BiasState(np.zeros(2), np.diag(scale**2), scale)
    for state in (start, merged(parts, prior)):
        assert common @ state.covariance @ common == pytest.approx(2.0 * scale[0] ** 2, rel=1e-6)
        assert apart @ state.covariance @ apart == pytest.approx(1e-10 / 5.0, rel=1e-3)
        assert apart @ state.estimate == pytest.approx(300.0 * 1e-5, rel=1e-3)


def test_merged_days_are_one_run_over_all_of_them() -> None:
    random = np.random.Generator(np.random.PCG64(2))
    whole, parts = priors(), []
    for _ in range(4):
        matrix = information_of(random)
        measured = random.multivariate_normal(TRUE, np.linalg.inv(matrix))
        whole = add_information(whole, matrix, matrix @ measured)
        parts.append(
            own_information(priors(), add_information(priors(), matrix, matrix @ measured))
        )
    found = merged(parts, priors())
    np.testing.assert_allclose(found.estimate / SCALE, whole.estimate / SCALE, atol=1e-9)
    np.testing.assert_allclose(found.covariance / whole.covariance, 1.0, rtol=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize("chained", [False, True])
def test_p_values_are_uniform_without_a_change(*, chained: bool) -> None:
    """Also of chained days, whose estimates are not independent."""
    random = np.random.Generator(np.random.PCG64(3))
    found: dict[str, list[float]] = {"step": [], "one": [], "scatter": [], "drift": [], "line": []}
    for _ in range(DRAWS):
        own = days(np.tile(TRUE, (4, 1)), random, chained=chained)
        found["step"].append(step(own[1], own[2], ALL).p_value)
        found["one"].append(step(own[0], own[1], ALL[2:3]).p_value)
        found["scatter"].append(scatter(own, ALL[:2]).p_value)
        fitted = line(
            np.arange(4.0),
            np.array([one.value[0] for one in own]),
            np.array([one.sigma[0] for one in own]),
        )
        found["drift"].append(fitted.drift.p_value)
        found["line"].append(fitted.about.p_value)
    assert {name: kstest(values, "uniform").pvalue > P_MIN for name, values in found.items()} == (
        dict.fromkeys(found, True)
    )


def test_estimates_that_keep_their_start_would_not_pass() -> None:
    """The test above finds the fault that the subtraction prevents."""
    random = np.random.Generator(np.random.PCG64(4))
    p_values = []
    for _ in range(DRAWS):
        start = priors()
        first = day(start, TRUE, random)
        second = day(first, TRUE, random)
        one, two = (OwnEstimate(own.estimate, own.covariance, ALL >= 0) for own in (first, second))
        p_values.append(step(one, two, ALL).p_value)
    assert kstest(p_values, "uniform").pvalue < P_MIN


@pytest.mark.parametrize("chained", [False, True])
def test_a_step_is_found_where_it_is(*, chained: bool) -> None:
    random = np.random.Generator(np.random.PCG64(5))
    true = np.tile(TRUE, (5, 1))
    # About ten standard deviations of a difference of days.
    true[3:, 2] += 60.0
    own = days(true, random, chained=chained)
    p_values = [step(*pair, ALL[2:3]).p_value for pair in pairwise(own)]
    assert np.argmin(p_values) == 2
    assert p_values[2] < 1e-6
    assert scatter(own, ALL[2:3]).p_value < 1e-6
    assert scatter(own, ALL[:1]).p_value > P_MIN


@pytest.mark.slow
def test_a_linear_drift_is_recovered() -> None:
    random = np.random.Generator(np.random.PCG64(6))
    errors = []
    for _ in range(DRAWS):
        true = TRUE + np.outer(np.arange(6.0), [4.0, 0.0, 0.0, 0.0])
        own = days(true, random, chained=False)
        fitted = line(
            np.arange(6.0),
            np.array([one.value[0] for one in own]),
            np.array([one.sigma[0] for one in own]),
        )
        errors.append((fitted.slope - 4.0) / fitted.sigma)
    # 400 draws of a normal variable: its mean, its spread, and its largest.
    assert abs(np.mean(errors)) < 4.0 / np.sqrt(DRAWS)
    assert np.std(errors) == pytest.approx(1.0, abs=4.0 / np.sqrt(2.0 * DRAWS))
    assert np.abs(errors).max() < 4.5
