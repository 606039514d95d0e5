"""Plots without range: of rank one in the filters of the service, with all biases."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.estimation.filters.bank import FILTERS, Outcome
from multiradar.tracking.modes import mode_table
from support.references.compiled_filters import CompiledFilter, plain_settings
from support.references.measurement_models import EllipsoidPolar
from support.references.reference_filters import (
    JointKalman,
    Linearised,
    MeasurementModel,
    Observation,
    ReferenceFilter,
)
from support.references.reference_modes import Imm
from support.references.reference_runs import bias_prior, play, start_guesses
from support.scenarios.scenes import Scene, make_scene, random_flights, three_radars

Floats = NDArray[np.float64]

ACCELERATION = 0.3
#: Replaces a missing range in the plain forms: its sigma is a thousand times that of the position.
LOST_RANGE_SIGMA_M = 1e7
TAKES = ("two-stage", "imm")


def scene_of(seed: int) -> Scene:
    rng = np.random.default_rng(seed)
    flights = random_flights(rng, 3, 80.0, acceleration_density=ACCELERATION)
    return make_scene(rng, three_radars(), flights)


@dataclass
class RangeLost:
    """Forwards plots, without range for the radars from the second on."""

    inner: ReferenceFilter

    def start(self, aircraft: int, time_s: float, mean: Floats, covariance: Floats) -> None:
        self.inner.start(aircraft, time_s, mean, covariance)

    def observe(self, observation: Observation) -> None:
        self.inner.observe(replace(observation, is_bearing=observation.radar > 0))

    def walk(self, duration_s: float) -> None:
        self.inner.walk(duration_s)

    def end(self, aircraft: int) -> None:
        self.inner.end(aircraft)

    def aircraft(self, aircraft: int) -> tuple[Floats, Floats]:
        return self.inner.aircraft(aircraft)

    def biases(self) -> tuple[Floats, Floats]:
        return self.inner.biases()


@dataclass
class RangeOfNoWorth:
    """A model of plots with a missing range represented by its variance."""

    inner: MeasurementModel

    def linearise(self, observation: Observation, state: Floats) -> Linearised:
        seen = self.inner.linearise(observation, state)
        if not observation.is_bearing:
            return seen
        noise = np.diag([LOST_RANGE_SIGMA_M**2, seen.noise[1, 1]])
        return Linearised(seen.innovation, seen.by_state, seen.by_bias, noise)


def plain(name: str, scene: Scene) -> ReferenceFilter:
    model = RangeOfNoWorth(EllipsoidPolar(scene.plane, scene.sensors))
    if name == "imm":
        modes = mode_table(plain_settings("imm", ACCELERATION))
        return Imm(model, bias_prior(scene), modes)
    return JointKalman(model, bias_prior(scene), ACCELERATION)


@pytest.mark.slow
@pytest.mark.parametrize("name", TAKES)
def test_a_bearing_is_the_limit_of_a_plot_with_growing_range_variance(name: str) -> None:
    """1e-4 of a sigma: (1 km / 1e7 m)² of each plot, over some hundred plots."""
    scene = scene_of(1)
    settings = plain_settings(name, ACCELERATION)
    filters: list[ReferenceFilter] = [
        RangeLost(CompiledFilter(scene, settings)), RangeLost(plain(name, scene)),
    ]  # fmt: skip
    guesses = start_guesses(np.random.default_rng(1), scene)
    count = 0
    for _, observation in play(scene, filters, guesses):
        found, expected = (one.aircraft(observation.aircraft) for one in filters)
        sigmas = np.sqrt(np.diagonal(expected[1]))
        assert found[0] / sigmas == pytest.approx(expected[0] / sigmas, abs=1e-4)
        outer = np.outer(sigmas, sigmas)
        assert found[1] / outer == pytest.approx(expected[1] / outer, abs=1e-4)
        count += observation.radar > 0
    assert count > 30
    found, expected = (one.biases() for one in filters)
    sigmas = np.sqrt(np.diagonal(expected[1]))
    assert found[0] / sigmas == pytest.approx(expected[0] / sigmas, abs=1e-4)
    # Bearings determine the azimuth biases, and not those of the ranges.
    prior = scene.sensors.prior_sigma
    own = scene.sensors.parameter_sensor > 0
    azimuth = own & (scene.sensors.parameter_kind == 1)
    ranges = own & (scene.sensors.parameter_kind == 0)
    sigmas = np.sqrt(np.diagonal(found[1]))
    assert (sigmas[azimuth] < 0.5 * prior[azimuth]).all()
    assert sigmas[ranges] == pytest.approx(prior[ranges], rel=1e-9)


def bearing(scene: Scene, row: int, azimuth_rad: float) -> Observation:
    batch = scene.batch
    return Observation(
        float(batch.time_s[row]), 0, int(batch.sensor[row]), np.array([np.nan, azimuth_rad]),
        float(batch.height_m[row]), is_bearing=True,
    )  # fmt: skip


@pytest.mark.parametrize("name", sorted(FILTERS))
def test_bearings_are_unsupported_in_other_filters(name: str) -> None:
    scene = scene_of(2)
    one = CompiledFilter(scene, plain_settings(name, ACCELERATION))
    row = int(np.argmax(scene.aircraft == 0))
    one.start(0, float(scene.batch.time_s[row]), scene.truth[row], np.eye(4) * 1e6)
    outcome = one.process(bearing(scene, row, float(scene.batch.azimuth_rad[row])))
    assert outcome == (Outcome.UPDATED if name in TAKES else Outcome.UNSUPPORTED)


@pytest.mark.parametrize("name", TAKES)
def test_a_bearing_does_not_initiate_an_aircraft(name: str) -> None:
    scene = scene_of(2)
    one = CompiledFilter(scene, plain_settings(name, ACCELERATION))
    assert one.process(bearing(scene, 0, 1.0)) == Outcome.UNLOCATABLE
    assert np.isnan(one.arrays.time[0])


@pytest.mark.parametrize("name", TAKES)
def test_an_outlier_bearing_is_rejected(name: str) -> None:
    scene = scene_of(2)
    settings = replace(plain_settings(name, ACCELERATION), refuse_nis=25.0)
    one = CompiledFilter(scene, settings)
    row = int(np.argmax(scene.aircraft == 0))
    covariance = np.diag([100.0**2, 100.0**2, 10.0, 10.0])
    one.start(0, float(scene.batch.time_s[row]), scene.truth[row], covariance)
    before = one.aircraft(0)
    astray = bearing(scene, row, float(scene.batch.azimuth_rad[row]) + 0.5)
    assert one.process(astray) == Outcome.REFUSED
    assert one.aircraft(0)[0] == pytest.approx(before[0])
    assert one.process(bearing(scene, row, np.nan)) == Outcome.SINGULAR
