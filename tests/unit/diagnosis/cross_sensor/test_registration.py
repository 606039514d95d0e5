"""When a fitted factor confirms another registration of a radar."""

import numpy as np
import pytest

from multiradar.diagnosis.cross_sensor.registration import FACTOR_WITHIN, SIGMAS, _is_confirmed
from multiradar.diagnosis.cross_sensor.trimmed_fit import TrimmedFit


@pytest.mark.parametrize(
    ("factor", "sigma", "is_confirmed"),
    [
        (1.0, 0.01, True),
        (1.0 + 0.99 * FACTOR_WITHIN, 0.01, True),
        (1.0 - 0.99 * FACTOR_WITHIN, 0.01, True),
        # Far from 1 however accurate, or too inaccurate however near.
        (1.0 + 1.01 * FACTOR_WITHIN, 0.01, False),
        (1.0 - 1.01 * FACTOR_WITHIN, 0.01, False),
        (1.0, 0.99 / SIGMAS, True),
        (1.0, 1.01 / SIGMAS, False),
    ],
)
def test_a_factor_is_near_1_and_significant(
    factor: float, sigma: float, is_confirmed: bool
) -> None:
    nothing = np.zeros((0, 2))
    fit = TrimmedFit(
        np.array([0, 2]), np.array([5.0, factor]), np.diag([1.0, sigma**2]), nothing,
        nothing[:, 0], nothing[:, 0] > 0.0, scale=1.0,
    )  # fmt: skip
    assert _is_confirmed(fit) is is_confirmed
