"""An epoch is divided if the drift of the biases is not small relative to their sigma."""

import numpy as np
import pytest

from multiradar.estimation.bias.drift_steps import (
    DRIFT_SHARE_MAX,
    DRIFT_STEPS_MAX,
    drift_steps,
)
from multiradar.estimation.bias.store import BiasState

SCALE = np.array([500.0, 0.005])


def known_to(*sigma: float) -> BiasState:
    return BiasState(np.zeros(2), np.diag(np.square(sigma)), SCALE)


def test_without_drift_an_epoch_is_one_step() -> None:
    assert drift_steps(known_to(1e-6, 1e-12), np.zeros(2), 4.0) == 1


@pytest.mark.parametrize(
    ("sigma_m", "expected"), [(20.0, 1), (4.01, 1), (3.9, 2), (2.0, 4), (1.0, 16), (0.1, 16)]
)
def test_the_number_of_steps_limits_the_drift(sigma_m: float, expected: int) -> None:
    # 1 m after a second, 2 m after an epoch of four: half of 4 m, a quarter of the variance.
    steps = drift_steps(known_to(sigma_m, 0.001), np.array([1.0, 0.0]), 4.0)
    assert steps == expected
    assert steps == DRIFT_STEPS_MAX or 4.0 / steps <= DRIFT_SHARE_MAX * sigma_m**2


def test_a_well_known_difference_of_uncertain_biases_needs_steps() -> None:
    rates = np.array([1.0, 1.0])
    scale = np.full(2, 500.0)
    common = np.full((2, 2), 300.0**2)
    apart = BiasState(np.zeros(2), common + np.diag([1.0, 1.0]), scale)
    assert drift_steps(apart, rates, 4.0) == DRIFT_STEPS_MAX
    alone = BiasState(np.zeros(2), np.diag(np.diagonal(apart.covariance)), scale)
    assert drift_steps(alone, rates, 4.0) == 1
