"""Gates below the 75th percentile of NIS: the covariance of the biases is still included."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.estimation.filters.bank import Outcome
from support.references.compiled_filters import CompiledFilter, plain_settings
from support.references.reference_runs import START_SIGMA, observations, start_guesses
from support.scenarios.scenes import make_scene, random_flights, three_radars

ACCELERATION = 0.3


@pytest.mark.parametrize("gates", [(1.0, 2.5), (1.0, np.inf), (np.inf, 2.5)])
def test_two_stage_gates_as_the_joint_filter(gates: tuple[float, float]) -> None:
    rng = np.random.default_rng(1)
    flights = random_flights(rng, 4, 60.0, acceleration_density=ACCELERATION)
    scene = make_scene(rng, three_radars(), flights)
    guesses = start_guesses(rng, scene)
    outcomes, biases = [], []
    for name in ("two-stage", "joint"):
        low = replace(
            plain_settings(name, ACCELERATION), downweight_nis=gates[0], refuse_nis=gates[1]
        )
        one = CompiledFilter(scene, low)
        for aircraft, (time_s, mean) in guesses.items():
            one.start(aircraft, time_s, mean, np.diag(START_SIGMA**2))
        outcomes.append([one.process(observation) for observation in observations(scene)])
        biases.append(one.biases())
    assert outcomes[0] == outcomes[1]
    assert (Outcome.REFUSED in outcomes[0]) == np.isfinite(gates[1])
    sigmas = np.sqrt(np.diagonal(biases[1][1]))
    np.testing.assert_allclose(biases[0][0] / sigmas, biases[1][0] / sigmas, rtol=0, atol=1e-6)
