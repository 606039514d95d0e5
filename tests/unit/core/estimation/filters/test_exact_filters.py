"""The two-stage and the joint filter on the scenario of the report, section 1.6, by plot."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from multiradar.estimation.gaussian import normalised_squared
from multiradar.research.sequential.arrangement import Options
from multiradar.research.sequential.arrays import Record
from multiradar.research.sequential.player import play
from multiradar.research.sequential.plots import Form, Plots, Starts
from multiradar.research.sequential.sensors import BiasPrior, Sensors, flat_radars
from multiradar.research.studies.bias_estimation.runs import DRIFT_DENSITY
from multiradar.simulation.flat import FlatPlots, flat_plots
from multiradar.simulation.scenario.file import builtin_scenario
from support.bands import tails

START_SIGMA = np.array([1000.0, 1000.0, 300.0, 300.0])
PRIOR = np.array([500.0, np.radians(0.3)] * 3)
DRIFT = np.array([1.0, np.radians(0.02)] * 3)
EXACT = ("joint", "two-stage")


def report_plots(seed: int, duration_s: float, *, drift: bool) -> FlatPlots:
    scene = replace(
        builtin_scenario("report-1-6-drift" if drift else "report-1-6"), duration_s=duration_s
    )
    if drift:
        traffic = tuple(replace(one, acceleration_density=DRIFT_DENSITY) for one in scene.traffic)
        scene = replace(scene, traffic=traffic)
    return flat_plots(scene, np.random.default_rng(seed))


def inputs(
    truth: FlatPlots, seed: int, kept: np.ndarray, *, drift: bool
) -> tuple[Sensors, Plots, Starts]:
    """Inputs of a filter: the plots that are kept, and initial states of the aircraft."""
    rng = np.random.default_rng(seed)
    prior = BiasPrior(np.zeros(6), np.diag(PRIOR**2), DRIFT if drift else None)
    sensors = flat_radars(truth.site_m, 15.0, np.radians(0.05), prior)
    values = np.column_stack([truth.range_m, truth.azimuth_rad])
    plots = Plots(truth.time_s[kept], truth.aircraft[kept], truth.radar[kept], values[kept])
    count = truth.states.shape[1]
    means = truth.states[0] + START_SIGMA * rng.normal(size=(count, 4))
    starts = Starts(np.zeros(count), means, np.tile(np.diag(START_SIGMA**2), (count, 1, 1)))
    return sensors, plots, starts


@pytest.mark.slow
@pytest.mark.parametrize("form", ["linearised", "polar"])
def test_two_stage_equals_joint_at_every_second_of_the_report(form: Form) -> None:
    """45 000 plots minus one in ten: 1e-6 m, and 1e-9 of the variances."""
    truth = report_plots(1, 1000.0, drift=False)
    kept = np.random.default_rng(2).uniform(size=len(truth)) < 0.9
    sensors, plots, starts = inputs(truth, 1, kept, drift=False)
    times = np.arange(1.0, 1001.0)
    joint, two_stage = (play(name, sensors, plots, starts, times, form=form) for name in EXACT)
    np.testing.assert_allclose(two_stage.mean, joint.mean, rtol=0, atol=1e-6)
    assert_equal_covariances(two_stage.covariance, joint.covariance)
    assert_equal_covariances(two_stage.bias_covariance, joint.bias_covariance)
    sigmas = np.sqrt(np.einsum("tcc->tc", joint.bias_covariance))
    np.testing.assert_allclose(two_stage.bias / sigmas, joint.bias / sigmas, rtol=0, atol=1e-8)
    assert (np.linalg.eigvalsh(joint.covariance[-1]) > 0.0).all()


def assert_equal_covariances(found: np.ndarray, expected: np.ndarray) -> None:
    """To 1e-9 of the variances."""
    sigmas = np.sqrt(np.einsum("...cc->...c", expected))
    scale = sigmas[..., :, None] * sigmas[..., None, :]
    np.testing.assert_allclose(found / scale, expected / scale, rtol=0, atol=1e-9)


@pytest.mark.slow
@pytest.mark.slow
def test_with_drift_two_stage_equals_joint_and_both_are_consistent() -> None:
    """1 m/√s and 0.02 °/√s, adjusted each second: RMS within 1 %, NEES in its band.

    The band is of 99.9 % for all four means together.
    """
    runs, times = 12, np.arange(10.0, 301.0, 10.0)
    options = Options(acceleration_density=DRIFT_DENSITY)
    squares = dict.fromkeys(EXACT, 0.0)
    aircraft: dict[str, list[np.ndarray]] = {name: [] for name in EXACT}
    biases: dict[str, list[np.ndarray]] = {name: [] for name in EXACT}
    for seed in range(runs):
        truth = report_plots(seed, 300.0, drift=True)
        sensors, plots, starts = inputs(truth, seed, np.full(len(truth), True), drift=True)
        for name in EXACT:
            record = play(name, sensors, plots, starts, times, options=options)
            error = record.mean - truth.states[times.astype(int)]
            squares[name] += float(np.sum(error[5:, :, :2] ** 2))
            aircraft[name].append(normalised_squared(error, record.covariance)[:, 0])
            biases[name].append(bias_nees(truth, record, times))
    assert abs(np.sqrt(squares["two-stage"] / squares["joint"]) - 1.0) < 0.01
    for name in EXACT:
        assert_in_band(np.array(aircraft[name])[:, -1], 4, checks=4)
        assert_in_band(np.array(biases[name])[:, -1], 6, checks=4)


def bias_nees(truth: FlatPlots, record: Record, times: np.ndarray) -> np.ndarray:
    actual = truth.biases[times.astype(int), :, :2].reshape(len(times), 6)
    return normalised_squared(record.bias - actual, record.bias_covariance)


def assert_in_band(values: np.ndarray, size: int, *, checks: int) -> None:
    low, high = chi2.ppf(tails(checks), size * len(values)) / len(values)
    assert low < np.mean(values) < high, (np.mean(values), low, high)
