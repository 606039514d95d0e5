"""The fingerprint changes with everything that the output depends on."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import PARAMETER_TIME_OFFSET
from multiradar.runtime.engine import fingerprint
from multiradar.runtime.engine.fingerprint import configuration_fingerprint
from multiradar.tracking.settings import TrackingSettings
from multiradar_compiled.arithmetic_kernels import arithmetic
from support.scenarios.live_scene import sensors

SETTINGS = TrackingSettings()


def test_the_same_configuration_has_the_same_fingerprint() -> None:
    assert configuration_fingerprint(sensors(), SETTINGS) == configuration_fingerprint(
        sensors(), TrackingSettings()
    )


def test_settings_sensors_and_admission_change_it() -> None:
    table = sensors()
    moved = replace(table, latitude_rad=table.latitude_rad + 1e-12)
    known_bias = table.known_bias.copy()
    known_bias[0, PARAMETER_TIME_OFFSET] = 0.25
    found = {
        configuration_fingerprint(table, SETTINGS),
        configuration_fingerprint(replace(table, known_bias=known_bias), SETTINGS),
        configuration_fingerprint(table, replace(SETTINGS, refuse_nis=30.0)),
        configuration_fingerprint(moved, SETTINGS),
        configuration_fingerprint(table, SETTINGS, 1.0),
    }
    assert len(found) == 5


def test_the_rules_change_it(monkeypatch: pytest.MonkeyPatch) -> None:
    before = configuration_fingerprint(sensors(), SETTINGS)
    monkeypatch.setattr(fingerprint, "OUTPUT_RULES", fingerprint.OUTPUT_RULES + 1)
    assert configuration_fingerprint(sensors(), SETTINGS) != before


def test_other_elementary_functions_change_it(monkeypatch: pytest.MonkeyPatch) -> None:
    before = configuration_fingerprint(sensors(), SETTINGS)
    monkeypatch.setattr(fingerprint, "arithmetic", lambda: "another")
    assert configuration_fingerprint(sensors(), SETTINGS) != before


def test_functions_rounded_in_another_way_have_another_digest(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = arithmetic()
    monkeypatch.setattr("multiradar_compiled.arithmetic_kernels._OF_ONE", (_with_one_bit_more,))
    digests = {before, arithmetic.__wrapped__()}
    monkeypatch.setattr("multiradar_compiled.arithmetic_kernels._OF_ONE", (np.sin,))
    assert len(digests | {arithmetic.__wrapped__()}) == 3


def _with_one_bit_more(values: NDArray[np.float64]) -> NDArray[np.float64]:
    sines = np.sin(values)
    sines[1234] = np.nextafter(sines[1234], 2.0)
    return sines
