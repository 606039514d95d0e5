"""The fingerprint changes with everything that the output depends on."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.estimation.measurement.sensors import PARAMETER_TIME_OFFSET
from multiradar.runtime.engine import fingerprint
from multiradar.runtime.engine.fingerprint import (
    configuration_fingerprint,
    configuration_text,
    differences,
)
from multiradar.tracking.settings import TrackingSettings
from multiradar_compiled.arithmetic_kernels import arithmetic
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile
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


def _radar(name: str, **changed: object) -> Sensor:
    given = {
        "id": name, "kind": "radar", "latitude_deg": 47.0, "longitude_deg": 8.0, "height_m": 500.0,
        "range_sigma_m": 50.0, "azimuth_sigma_deg": 0.08, "rotation_period_s": 5.0,
    }  # fmt: skip
    return Sensor.model_validate(given | changed)


def test_each_difference_is_named_with_both_values(monkeypatch: pytest.MonkeyPatch) -> None:
    before = SensorsFile(sensor=(_radar("a"), _radar("b"), _radar("d")))
    now = SensorsFile(sensor=(_radar("b", latitude_deg=47.5, enabled=False), _radar("c")))
    text = configuration_text(before, SETTINGS)
    assert differences(text, text) == differences("", text) == differences(text, "") == ""
    assert differences(text, configuration_text(now, SETTINGS)) == (
        "sensor a; sensor d; no sensor c; latitude_deg of b 47.0, now 47.5; "
        "enabled of b not given, now false"
    )
    other = replace(SETTINGS, filter_name="ci", epoch_s=2.0)
    assert differences(text, configuration_text(before, other)) == (
        "--filter imm, now ci; epoch_s 4.0, now 2.0"
    )
    many = differences(text, configuration_text(SensorsFile(sensor=(_radar("x"),)), other))
    assert many.endswith("; sensor a; sensor b; sensor d; 1 more differences")
    monkeypatch.setattr(fingerprint, "OUTPUT_RULES", 7)
    monkeypatch.setattr(fingerprint, "arithmetic", lambda: "another")
    assert differences(text, configuration_text(before, SETTINGS)) == (
        "an earlier or later version (rules 13, now 7); a different kind of processor"
    )
