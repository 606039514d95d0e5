"""Calibration of forecasts: regions hold their probability on unseen traffic."""

from functools import cache

import numpy as np
import pytest

from multiradar.estimation.gaussian import normalised_squared
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.paths import fly
from multiradar.simulation.scenario.model import Leg
from multiradar.tracking.forecast.forecast_calibration import (
    EAGER_SAMPLES,
    WAITING_MAX,
    ForecastCalibration,
    calibration_for,
)
from multiradar.tracking.forecast.region_sizes import HORIZONS_S, MEMORY
from multiradar.tracking.forecast.state_samples import Sampling
from multiradar.tracking.outputs import EngineOutput, StateSample
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.scenes import Flight, Scene, flier, make_scene, three_radars

pytestmark = pytest.mark.slow

DURATION_S = 1200.0
SETTINGS = {name: TrackingSettings(filter_name=name) for name in ("two-stage", "imm")}
#: Horizons with enough data from a quarter of an hour of twelve aircraft.
SCORED_S = HORIZONS_S[:3]


def _flights(*, turning: bool) -> list[Flight]:
    rng = np.random.Generator(np.random.PCG64(3))
    flights = []
    for _ in range(12):
        legs: list[Leg] = []
        while turning and sum(leg.duration_s for leg in legs) < DURATION_S:
            rate = float(np.radians(rng.uniform(1.0, 3.0)) * rng.choice([-1.0, 1.0]))
            legs += [Leg(rng.uniform(20.0, 60.0)), Leg(rng.uniform(20.0, 60.0), rate)]
        heading, place = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-60e3, 60e3, 2)
        velocity = 120.0 * np.sin(heading), 120.0 * np.cos(heading)
        flights.append(Flight(0.0, DURATION_S, (*place, *velocity), 8e3, legs=tuple(legs)))
    return flights


@cache
def _scene(*, turning: bool) -> Scene:
    rng = np.random.Generator(np.random.PCG64(5))
    return make_scene(rng, three_radars(), _flights(turning=turning))


@cache
def _outputs(
    name: str, rows: int, sampling: Sampling, *, turning: bool = True
) -> tuple[EngineOutput, ...]:
    scene = _scene(turning=turning)
    engine = Engine(scene.sensors, SETTINGS[name], sampling=sampling)
    count = len(scene.batch)
    cuts = [slice(first, min(first + rows, count)) for first in range(0, count, rows)]
    return (*(engine.push(scene.batch.select(cut)) for cut in cuts), engine.flush())


def _taught(outputs: tuple[EngineOutput, ...], name: str) -> ForecastCalibration:
    calibration = calibration_for(SETTINGS[name])
    for output in outputs:
        calibration.observe(output)
    return calibration


@pytest.mark.parametrize("name", ["two-stage", "imm"])
def test_the_calibration_is_independent_of_batches_and_of_the_sampling(name: str) -> None:
    all_at_once = _taught(_outputs(name, 10**6, Sampling.ALL), name)
    whole = all_at_once.scores
    for rows, sampling in ((37, Sampling.DRAWN), (500, Sampling.ALL)):
        divided = _taught(_outputs(name, rows, sampling), name)
        found = divided.scores
        assert divided.held == all_at_once.held
        assert found.motion == whole.motion
        np.testing.assert_array_equal(found.heard, whole.heard)
        plans = [one.plan(HORIZONS_S, 0.9) for one in (found, whole)]
        np.testing.assert_array_equal(plans[0].factor, plans[1].factor)
    assert whole.heard[0] > 0.4 * MEMORY


def test_the_samples_of_an_engine_are_independent_of_batches() -> None:
    samples = [
        [sample for output in _outputs("imm", rows, Sampling.ALL) for sample in output.samples]
        for rows in (37, 10**6)
    ]
    assert [one.epoch for one in samples[0]] == [one.epoch for one in samples[1]]
    assert len(samples[0]) == pytest.approx(DURATION_S / 8.0, abs=2)
    for one, other in zip(*samples, strict=True):
        np.testing.assert_array_equal(one.states.track_id, other.states.track_id)
        np.testing.assert_array_equal(one.states.mean, other.states.mean)
        np.testing.assert_array_equal(one.states.covariance, other.states.covariance)
        assert (one.states.time_s < one.time_s).all()
    outputs = _outputs("imm", 500, Sampling.NONE)
    assert sum(len(output.updates) for output in outputs) > 0
    assert all(not output.samples for output in outputs)


@pytest.mark.parametrize("name", ["two-stage", "imm"])
@pytest.mark.parametrize("turning", [False, True])
def test_regions_contain_aircraft_with_their_probability(name: str, turning: bool) -> None:
    """White noise alone: 99.9 % inside in straight flight, 45 % a minute ahead in turns."""
    paths = [
        fly(flier(number, one), DURATION_S, np.random.Generator(np.random.PCG64(0)))
        for number, one in enumerate(_flights(turning=turning), start=1)
    ]
    number: dict[int, int] = {}
    calibration, inside = calibration_for(SETTINGS[name]), []
    for output in _outputs(name, 500, Sampling.ALL, turning=turning):
        updates = output.updates
        number |= dict(zip(updates.track_id.tolist(), updates.track_number.tolist(), strict=True))
        for part in calibration.parts(output):
            sample = part.sample
            if sample is None or not 180.0 < sample.time_s < DURATION_S - 60.0:
                continue
            plan = calibration.scores.plan(SCORED_S, 0.95)
            for place, track in enumerate(sample.states.track_id.tolist()):
                means, covariances, factors = calibration.forecast_by(
                    plan, sample.states, place, SCORED_S
                )
                there = paths[number[track] - 1].position(sample.states.time_s[place] + SCORED_S)
                inside.append(normalised_squared(there - means, covariances) <= factors)
    share = np.mean(inside, axis=0)
    # 1400 forecasts; those of one turn are correlated, and 100 turns determine 95 % to 3 %.
    assert (share > 0.90).all()
    assert (share < 0.995).all()
    # What the service reports of them, by later estimates instead of the truth.
    held, counted = calibration.held
    assert counted > 500
    assert 0.90 < held / counted < 0.99


def test_turning_and_straight_traffic_select_their_motion_models() -> None:
    for name in SETTINGS:
        motions = []
        for turning in (False, True):
            outputs = _outputs(name, 500, Sampling.ALL, turning=turning)
            calibration = _taught(outputs, name)
            motions.append(calibration.family.names[calibration.scores.motion])
        assert motions[0] == "straight"
        assert motions[1].startswith(("walk-300", "walk-100", "modes"))


def test_memory_is_bounded_also_without_any_later_updates() -> None:
    calibration = calibration_for(SETTINGS["two-stage"])
    (sample, *_), nothing = (
        [one for output in _outputs("two-stage", 500, Sampling.ALL) for one in output.samples],
        _outputs("two-stage", 500, Sampling.NONE)[0],
    )
    for epoch in range(0, 2 * EAGER_SAMPLES, 2):
        time_s = epoch * 4.0
        states = sample.states
        states.time_s[:] = time_s - 1.0
        later = StateSample(epoch, time_s, states)
        calibration.observe(EngineOutput(nothing.updates.concatenate([]), nothing.biases,
                                      nothing.ended, samples=(later,)))  # fmt: skip
        assert calibration.waiting <= WAITING_MAX
    assert calibration.waiting > 0.9 * WAITING_MAX
    assert not calibration.scores.heard.any()
