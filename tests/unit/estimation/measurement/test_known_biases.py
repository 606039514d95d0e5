"""Known biases are corrected by the bias model: measured minus true."""

import numpy as np

from multiradar.estimation.measurement.known_biases import Measured, without_known_biases
from multiradar.estimation.measurement.sensors import PARAMETER_TIME_OFFSET
from support.references.linearised import bias_matrix

KNOWN = np.array([[250.0, -0.02, 0.001, 0.5]])
SLANT, AZIMUTH, TIME = 9e4, 1.25, 100.0


def test_correction_inverts_the_measurement_model() -> None:
    offsets = KNOWN[0].copy()
    offsets[PARAMETER_TIME_OFFSET] = 0.0  # Has no effect on a plot without rates.
    entered = bias_matrix(range(4), SLANT, 0.0, 0.0) @ offsets
    measured = Measured(
        np.array([TIME + 0.5]), np.array([SLANT + entered[0]]), np.array([AZIMUTH + entered[1]])
    )
    true = without_known_biases(measured, KNOWN)
    np.testing.assert_allclose(true.time_s, [TIME])
    np.testing.assert_allclose(true.range_m, [SLANT])
    np.testing.assert_allclose(true.azimuth_rad, [AZIMUTH])


def test_azimuths_are_wrapped_and_missing_values_remain_missing() -> None:
    measured = Measured(np.zeros(2), np.array([1e5, np.nan]), np.array([2 * np.pi - 0.01, np.nan]))
    true = without_known_biases(measured, np.repeat(KNOWN, 2, axis=0))
    np.testing.assert_allclose(true.azimuth_rad, [0.01, np.nan])
    assert np.isnan(true.range_m[1])


def test_without_known_biases_no_bit_changes() -> None:
    rng = np.random.Generator(np.random.PCG64(3))
    measured = Measured(*rng.uniform(0.0, 6.0, (3, 50)))
    for before, after in zip(
        measured, without_known_biases(measured, np.zeros((50, 4))), strict=True
    ):
        assert before.tolist() == after.tolist()
