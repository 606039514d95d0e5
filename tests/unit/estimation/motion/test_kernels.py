"""The compiled motion equals its plain form."""

from collections.abc import Callable

import numpy as np
import pytest

from multiradar.estimation.motion._kernels import predict_motion
from multiradar.estimation.motion.constant_velocity import process_noise, transition
from support.kernels import plain

UPPER = np.triu_indices(4)


@pytest.mark.parametrize("form", [predict_motion, plain(predict_motion)])
@pytest.mark.parametrize("interval_s", [0.0, 0.004, 4.9, 55.0])
def test_prediction_is_that_of_the_matrices(form: Callable[..., None], interval_s: float) -> None:
    rng = np.random.default_rng(4)
    root = rng.normal(size=(4, 4)) * np.array([[300.0], [200.0], [20.0], [30.0]])
    covariance, mean = root @ root.T, rng.normal(size=4) * 100.0
    sensitivity = rng.normal(size=(4, 5))
    step = transition(interval_s)
    expected = step @ covariance @ step.T + process_noise(interval_s, 0.7)
    moved, packed, tied = mean.copy(), covariance[UPPER].copy(), sensitivity.copy()
    form(moved, packed, tied, interval_s, 0.7)
    np.testing.assert_allclose(moved, step @ mean, rtol=1e-12)
    np.testing.assert_allclose(packed, expected[UPPER], rtol=1e-12)
    np.testing.assert_allclose(tied, step @ sensitivity, rtol=1e-12)
