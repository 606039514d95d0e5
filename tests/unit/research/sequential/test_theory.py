"""The covariance by (1.26) is what errors really are, whatever the gains."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.stats import chi2

from multiradar.errors import PriorError, ShapeError
from multiradar.research.sequential.arrangement import Options
from multiradar.research.sequential.player import play
from multiradar.research.sequential.plots import FORMS, Form, Plots, Starts
from multiradar.research.sequential.sensors import BiasPrior, flat_radars
from multiradar.research.sequential.theory import Theory, true_covariance
from support.references.constant_velocity import transition
from support.references.sequential_runs import NAMES, SmallScene, small_scene
from support.scenarios.report_scene import BIASES

TIMES = [0.0, 5.0, 12.0, 20.0]
# So near the truth that the measurements are linear to a hundredth of their noise.
NEAR = np.array([30.0, 30.0, 3.0, 3.0])
NEAR_BIASES = np.tile([30.0, np.radians(0.02)], 3)


def theory(name: str, scene: SmallScene, **changed: object) -> Theory:
    arguments: dict[str, Any] = {"options": Options()} | changed
    return true_covariance(
        name, scene.sensors, scene.plots, scene.starts, TIMES, truth=scene.truth, **arguments
    )


def correlations(covariance: np.ndarray, like: np.ndarray) -> np.ndarray:
    sigma = np.sqrt(np.diagonal(like, axis1=-2, axis2=-1))
    return np.asarray(covariance / (sigma[..., :, None] * sigma[..., None, :]))


@pytest.mark.parametrize("form", FORMS)
@pytest.mark.parametrize(("name", "drift"), [("joint", 0.0), ("joint", 1.0), ("two-stage", 0.0)])
def test_an_exact_filter_reports_its_true_covariance(name: str, drift: float, form: str) -> None:
    """To 1e-9, with missing plots, process noise and (joint) drift: Joseph's formula agrees."""
    scene = small_scene(1, drift=drift)
    found = theory(name, scene, form=form, options=Options(acceleration_density=0.3))
    for true, reported in (
        (found.aircraft, found.reported.covariance),
        (found.biases, found.reported.bias_covariance),
    ):
        np.testing.assert_allclose(
            correlations(true, reported), correlations(reported, reported), rtol=0, atol=1e-9
        )


@pytest.mark.parametrize("form", FORMS)
def test_with_time_offsets_the_two_stage_filter_reports_its_true_covariance(form: Form) -> None:
    """Time offsets are linearised at the given velocity, from the start.

    To 1e-6: the estimates move a little while the gain is probed, and the linearisation with them.
    """
    plain = small_scene(1, start_sigma=NEAR, bias_sigma=NEAR_BIASES)
    radars = plain.sensors.sites[:, :2]
    sigma = np.tile([30.0, np.radians(0.02), 0.2], len(radars))
    prior = BiasPrior(np.zeros(len(sigma)), np.diag(sigma**2))
    sensors = flat_radars(radars, 15.0, np.radians(0.05), prior, parameters=(0, 1, 3))
    found = theory("two-stage", replace(plain, sensors=sensors), form=form)
    for true, reported in (
        (found.aircraft, found.reported.covariance),
        (found.biases, found.reported.bias_covariance),
    ):
        np.testing.assert_allclose(
            correlations(true, reported), correlations(reported, reported), rtol=0, atol=1e-6
        )
    learnt = np.sqrt(np.diagonal(found.biases[-1])) / sigma
    # A common time offset is unobservable, differences between radars are observable.
    assert learnt[2::3].max() < 0.9


@pytest.mark.parametrize("name", NAMES)
def test_both_forms_have_one_theory(name: str) -> None:
    """At the truth a place is a change of the coordinates of range and azimuth.

    To rounding; the macro-filter reads its stack where the first plots of it have led, which for a
    place is linear to the fourth digit, and CI finds its weight to 1e-6 of a flat trace.
    """
    scene = small_scene(2)
    polar, linearised = (theory(name, scene, form=form).covariance for form in FORMS)
    np.testing.assert_allclose(
        correlations(linearised, polar),
        correlations(polar, polar),
        rtol=0,
        atol={"blom-macro": 3e-4, "ci": 1e-3}.get(name, 1e-8),
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", ["blom", "blom-macro", "ci"])
def test_a_monte_carlo_has_the_covariance_of_the_theory(name: str) -> None:
    """400 runs of a nearly linear scene: each sum of squares in its 99.99 % band."""
    runs = 400
    one = small_scene(3, missing=0.0, start_sigma=NEAR, bias_sigma=NEAR_BIASES)
    found = theory(name, one)
    squares = np.zeros((3, 4))
    biases = np.zeros(6)
    rng = np.random.default_rng(30)
    noise = np.array([15.0, np.radians(0.05)])
    clean = one.plots.value.copy()
    line = one.truth[:, :2] - one.sensors.sites[one.plots.sensor]
    clean[:] = np.column_stack([np.hypot(*line.T), np.arctan2(*line.T)])
    clean += BIASES.reshape(-1, 2)[one.plots.sensor]
    end = np.array([one.state(aircraft, 20.0) for aircraft in range(3)])
    for _ in range(runs):
        again = small_scene_with(one, rng, clean + noise * rng.normal(size=clean.shape))
        record = play(name, again.sensors, again.plots, again.starts, [20.0])
        squares += (record.mean[0] - end) ** 2
        biases += (record.bias[0] - BIASES) ** 2
    low, high = chi2.ppf([5e-5, 1 - 5e-5], runs) / runs
    shares = [
        squares / runs / np.diagonal(found.aircraft[-1], axis1=-2, axis2=-1),
        biases / runs / np.diagonal(found.biases[-1]),
    ]
    for share in shares:
        assert share.min() > low
        assert share.max() < high
    if name != "ci":
        # The covariance of the filter itself is too small.
        reported = np.diagonal(found.reported.covariance[-1], axis1=-2, axis2=-1)
        assert (np.diagonal(found.aircraft[-1], axis1=-2, axis2=-1) / reported).max() > 1.5


def small_scene_with(one: SmallScene, rng: np.random.Generator, value: np.ndarray) -> SmallScene:
    """The same scene with other noise and other first guesses."""
    starts = Starts(
        one.starts.time_s,
        one.states + NEAR * rng.normal(size=one.states.shape),
        one.starts.covariance,
    )
    prior = BiasPrior(
        BIASES + NEAR_BIASES * rng.normal(size=len(BIASES)), one.sensors.prior.covariance
    )
    plots = Plots(one.plots.time_s, one.plots.aircraft, one.plots.sensor, value)
    return replace(one, starts=starts, sensors=replace(one.sensors, prior=prior), plots=plots)


def test_covariance_intersection_reports_no_less_than_the_truth() -> None:
    """(1.46), for aircraft and biases at all times, with drift."""
    found = theory("ci", small_scene(4, drift=1.0))
    for true, reported in (
        (found.aircraft, found.reported.covariance),
        (found.biases, found.reported.bias_covariance),
    ):
        slack = correlations(reported - true, reported)
        assert np.linalg.eigvalsh(slack).min() > -1e-9


def test_drift_that_the_filter_does_not_know_makes_the_truth_worse() -> None:
    scene = small_scene(5)
    known = theory("joint", scene)
    wrong = theory("joint", scene, true_drift=np.tile([1.0, np.radians(0.02)], 3))
    np.testing.assert_array_equal(wrong.reported.bias_covariance, known.reported.bias_covariance)
    growth = np.diagonal(wrong.biases[-1]) / np.diagonal(known.biases[-1])
    assert growth.min() > 1.0
    assert growth.max() > 10.0
    np.testing.assert_array_equal(wrong.covariance[0], known.covariance[0])


def test_the_transition_leads_from_the_errors_before_to_those_of_now() -> None:
    """Without any noise but that of plots an optimal filter has F Σ(s) Φᵀ = Σ(t).

    The gain is read off differences of states of 1e5 m: six digits.
    """
    scene = small_scene(6)
    found = theory("joint", scene)
    for t in range(1, len(TIMES)):
        moved = np.eye(found.covariance.shape[-1])
        for aircraft in range(3):
            own = slice(4 * aircraft, 4 * aircraft + 4)
            moved[own, own] = transition(TIMES[t] - TIMES[t - 1])
        carried = found.transition[t] @ found.covariance[t - 1] @ moved.T
        np.testing.assert_allclose(
            correlations(carried, found.covariance[t]),
            correlations(found.covariance[t], found.covariance[t]),
            rtol=0,
            atol=1e-6,
        )


def test_a_truth_of_another_shape_is_rejected() -> None:
    scene = small_scene(7)
    with pytest.raises(ShapeError, match="true states"):
        theory("joint", SmallScene(scene.sensors, scene.plots, scene.starts, scene.truth[1:],
                                   scene.states))  # fmt: skip
    with pytest.raises(ShapeError, match="true drift"):
        theory("joint", scene, true_drift=[1.0])
    with pytest.raises(PriorError, match="noise of at least 0"):
        theory("joint", scene, true_density=-1.0)
