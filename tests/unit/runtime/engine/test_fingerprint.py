"""The fingerprint changes with everything that the output depends on."""

from dataclasses import replace

import pytest

from multiradar.estimation.measurement.sensors import PARAMETER_TIME_OFFSET
from multiradar.runtime.engine import fingerprint
from multiradar.runtime.engine.fingerprint import configuration_fingerprint
from multiradar.tracking.settings import TrackingSettings
from multiradar_compiled.kernels import compilation_target
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


def test_a_processor_with_fused_multiply_add_changes_it(monkeypatch: pytest.MonkeyPatch) -> None:
    before = configuration_fingerprint(sensors(), SETTINGS)
    monkeypatch.setattr(fingerprint, "compilation_target", lambda: "another")
    assert configuration_fingerprint(sensors(), SETTINGS) != before


def test_the_target_names_machine_processor_and_what_it_can_do() -> None:
    machine, processor, *_ = compilation_target().split(" ")
    assert machine.count("-") >= 2
    assert processor
