"""Sensor health over time."""

import numpy as np
import pytest

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.tracking.health.sensor_health import SensorHealth
from multiradar.tracking.settings import TrackingSettings
from support.scenarios import live_scene


def test_sites_are_estimated_once_in_every_30_s(monkeypatch: pytest.MonkeyPatch) -> None:
    plane = SystemPlane(np.radians(50.0), np.radians(15.0))
    health = SensorHealth(live_scene.sensors(), TrackingSettings(), plane, bounds_bias_errors=True)
    estimated, shifts = [], health._shifts

    def watched() -> object:
        estimated.append(end_s)
        return shifts()

    monkeypatch.setattr(health, "_shifts", watched)
    for end_s in (8.0, 12.0, 29.9, 30.0, 34.0, 59.9, 60.0, 150.0, 151.0):
        health._shifts_now(end_s)
    assert estimated == [8.0, 30.0, 60.0, 150.0]
