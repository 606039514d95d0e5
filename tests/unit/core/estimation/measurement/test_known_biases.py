"""Known biases are corrected by the bias model: measured minus true."""

import numpy as np

from multiradar.estimation.measurement.known_biases import (
    Measured,
    polar_without_biases,
    position_without_biases,
    reports_without_frames,
    without_known_biases,
)
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_SINE,
    PARAMETER_FRAME_EAST,
    PARAMETER_FRAME_ROTATION,
    PARAMETER_NAMES,
    PARAMETER_TIME_OFFSET,
)
from multiradar.wire import sensor_table
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile
from support.references.linearised import bias_matrix

KNOWN = np.zeros((1, len(PARAMETER_NAMES)))
KNOWN[0, :4] = 250.0, -0.02, 0.001, 0.5
SLANT, AZIMUTH, TIME = 9e4, 1.25, 100.0


def test_correction_inverts_the_measurement_model() -> None:
    offsets = KNOWN[0].copy()
    offsets[PARAMETER_TIME_OFFSET] = 0.0  # Has no effect on a plot without rates.
    entered = bias_matrix(range(len(offsets)), SLANT, 0.0, 0.0) @ offsets
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
        measured, without_known_biases(measured, np.zeros((50, len(PARAMETER_NAMES)))), strict=True
    ):
        assert before.tolist() == after.tolist()


def test_eccentricity_and_shift_act_at_the_true_azimuth() -> None:
    """Corrected to the first order of the shift, exactly for the eccentricity."""
    known = np.zeros((40, len(PARAMETER_NAMES)))
    known[:, PARAMETER_AZIMUTH_SINE : PARAMETER_FRAME_EAST + 2] = 0.01, -0.005, 40.0, -25.0
    azimuth = np.linspace(0.0, 2.0 * np.pi, 40, endpoint=False)
    sine, cosine = np.sin(azimuth), np.cos(azimuth)
    measured_m = SLANT + 40.0 * sine - 25.0 * cosine
    measured = azimuth + 0.01 * sine - 0.005 * cosine + (40.0 * cosine + 25.0 * sine) / SLANT
    range_m, azimuth_rad = polar_without_biases(measured_m, measured, known)
    np.testing.assert_allclose(range_m, SLANT, atol=0.01)
    np.testing.assert_allclose(np.sin(azimuth_rad - azimuth), 0.0, rtol=0, atol=1e-6)


def test_a_bearing_is_corrected_whatever_the_others_of_its_batch_are() -> None:
    """Regression: without a range it was lost beside any row with eccentricity or shift."""
    known = np.zeros((3, len(PARAMETER_NAMES)))
    known[0, PARAMETER_AZIMUTH_SINE] = 0.01
    known[1, PARAMETER_FRAME_EAST : PARAMETER_FRAME_EAST + 2] = 40.0, -25.0
    measured_rad = np.array([AZIMUTH + 0.01 * np.sin(AZIMUTH), AZIMUTH, AZIMUTH])
    range_m, azimuth_rad = polar_without_biases(np.full(3, np.nan), measured_rad, known)
    # The effect of the shift is unknown without a range.
    np.testing.assert_allclose(azimuth_rad, AZIMUTH, rtol=0, atol=1e-6)
    assert np.isnan(range_m).all()
    np.testing.assert_array_equal(
        azimuth_rad[2:], polar_without_biases(range_m[2:], measured_rad[2:], known[2:])[1]
    )


def test_a_frame_is_shifted_and_turned_back() -> None:
    """Turned clockwise by 0.3 rad, what is to the north is measured to the north-east."""
    known = np.zeros((1, len(PARAMETER_NAMES)))
    known[0, PARAMETER_FRAME_EAST:] = 30.0, -10.0, 0.3
    assert len(PARAMETER_NAMES) - 1 == PARAMETER_FRAME_ROTATION
    measured = np.array([1e4 * np.sin(0.3) + 30.0]), np.array([1e4 * np.cos(0.3) - 10.0])
    true = position_without_biases(*measured, known)
    np.testing.assert_allclose(true, [[0.0], [1e4]], atol=1e-9)


def test_a_frame_reaches_across_the_antimeridian() -> None:
    site = Sensor(id="m", kind="mlat", latitude_deg=-17.0, longitude_deg=179.9, height_m=0.0)
    table = sensor_table(SensorsFile(sensor=(site,)))
    known = np.zeros((1, len(PARAMETER_NAMES)))
    known[0, PARAMETER_FRAME_EAST] = 200.0
    reported_deg = np.array([179.95, -179.95, -179.0, 179.0, 0.0])
    of_it = np.zeros(len(reported_deg), np.int64)
    latitude = np.radians(np.full(len(reported_deg), -17.0))
    _, longitude = reports_without_frames(latitude, np.radians(reported_deg), of_it, table, known)
    moved_deg = reported_deg - np.degrees(longitude)
    # 200 m of parallel; beyond the reach of the frame nothing changes.
    of_200_m = np.degrees(200.0 / (6_378_137.0 * np.cos(np.radians(17.0))))
    np.testing.assert_allclose(moved_deg[:4], of_200_m, rtol=5e-3)
    assert moved_deg[4] == 0.0
