"""Unobservable biases are named, observable ones are not."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.estimation.bias.observability import unobservable_combinations
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    SensorTable,
)
from support.scenarios.scenes import PRIOR_SIGMA, sensor_table, three_radars

OFFSETS = (PARAMETER_RANGE_OFFSET, PARAMETER_AZIMUTH_OFFSET)


def table(count: int, kinds: tuple[int, ...] = OFFSETS, drift: float = 0.0) -> SensorTable:
    drifts = {kind: drift * PRIOR_SIGMA[kind] for kind in kinds}
    biases = dict.fromkeys(kinds, 0.0)
    return sensor_table(
        [replace(radar, biases=biases, drifts=drifts) for radar in three_radars()[:count]]
    )


def covariance_after(sensors: SensorTable, measured: np.ndarray) -> np.ndarray:
    """Posterior covariance after measuring each row of `measured` (in prior sigmas) to 0.01."""
    information = np.eye(len(sensors.prior_sigma)) + 1e4 * measured.T @ measured
    return np.linalg.inv(information) * np.outer(sensors.prior_sigma, sensors.prior_sigma)


def names(sensors: SensorTable, measured: list[list[float]]) -> list[str]:
    matrix = np.array(measured).reshape(len(measured), len(sensors.prior_sigma))
    covariance = covariance_after(sensors, matrix)
    return [one.name for one in unobservable_combinations(sensors, covariance)]


def test_without_measurements_every_parameter_is_unobservable() -> None:
    sensors = table(2)
    found = unobservable_combinations(sensors, np.diag(sensors.prior_sigma**2))
    assert [one.name for one in found] == [
        "range offset of A", "azimuth offset of A", "range offset of B", "azimuth offset of B",
    ]  # fmt: skip
    assert [one.prior_ratio for one in found] == pytest.approx([1.0] * 4)
    np.testing.assert_allclose([one.weights for one in found], np.eye(4))


def test_observable_biases_are_not_listed() -> None:
    assert names(table(2), np.eye(4).tolist()) == []
    assert names(table(1), [[1.0, 0.0]]) == ["azimuth offset of A"]


@pytest.mark.parametrize(
    ("kind", "sentence"),
    [
        (
            PARAMETER_RANGE_OFFSET,
            "range offsets of A, B and C together (a common offset of all ranges)",
        ),
        (PARAMETER_AZIMUTH_OFFSET, "azimuth offsets of A, B and C together (a common rotation)"),
        (PARAMETER_RANGE_GAIN, "range gains of A, B and C together (a common scale)"),
    ],
)
@pytest.mark.fault(11)
def test_differences_leave_the_common_part_unobservable(kind: int, sentence: str) -> None:
    sensors = table(3, (kind,))
    covariance = covariance_after(sensors, np.array([[1.0, -1.0, 0.0], [0.0, 1.0, -1.0]]))
    (found,) = unobservable_combinations(sensors, covariance)
    assert found.name == sentence
    np.testing.assert_allclose(found.weights, 1.0, rtol=1e-6)
    assert found.prior_ratio == pytest.approx(1.0, abs=1e-3)
    # The sigma of each single parameter is reduced.
    assert np.sqrt(covariance[0, 0]) < 0.6 * sensors.prior_sigma[0]


def test_a_common_azimuth_offset_is_found_with_different_priors() -> None:
    sensors = table(2, (PARAMETER_AZIMUTH_OFFSET,))
    sensors = replace(sensors, prior_sigma=sensors.prior_sigma * np.array([1.0, 2.0]))
    assert names(sensors, [[1.0, -2.0]]) == [
        "azimuth offsets of A and B together (a common rotation)"
    ]


def test_two_common_parts_are_separated() -> None:
    assert sorted(names(table(2), [[1.0, 0.0, -1.0, 0.0], [0.0, 1.0, 0.0, -1.0]])) == [
        "azimuth offsets of A and B together (a common rotation)",
        "range offsets of A and B together (a common offset of all ranges)",
    ]


def test_correlated_parameters_of_one_sensor_are_named_with_their_sign() -> None:
    sensors = table(1, (PARAMETER_RANGE_OFFSET, PARAMETER_RANGE_GAIN))
    assert names(sensors, [[1.0, 1.0]]) == ["range offset and range gain of A, with opposite signs"]
    assert names(sensors, [[1.0, -1.0]]) == ["range offset and range gain of A, together"]


def test_other_combinations_are_named_by_their_weights() -> None:
    assert names(
        table(2), np.array([[1, 0, 0, 1], [0, 1, 0, 0], [0, 0, 1, 0]], float).tolist()
    ) == ["the combination +1.00 range offset of A, -1.00 azimuth offset of B (in prior sigmas)"]


def test_drift_without_measurements_is_compared_with_drifted_priors() -> None:
    """A measured bias that drifted since is compared with the drift of an unmeasured one."""
    sensors = table(1, drift=0.1)
    walked = np.diag(sensors.prior_sigma**2 + sensors.drift**2 * 1000.0)
    assert len(unobservable_combinations(sensors, walked, 1000.0)) == 2
    # Measured once, and drifting for 200 s since: still better than without a measurement.
    measured = np.diag(sensors.drift**2 * 200.0)
    assert np.sqrt(measured[0, 0]) > sensors.prior_sigma[0]
    assert unobservable_combinations(sensors, measured, 1000.0) == ()


def test_without_biases_nothing_is_unobservable() -> None:
    assert unobservable_combinations(table(1, ()), np.zeros((0, 0))) == ()
