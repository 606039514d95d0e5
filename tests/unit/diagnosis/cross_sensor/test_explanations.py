"""Hypotheses tested for a sensor: not those that its values exclude."""

from collections.abc import Collection
from types import SimpleNamespace
from typing import cast

import numpy as np
import pytest

from multiradar.diagnosis.cross_sensor import explanations
from multiradar.diagnosis.cross_sensor.clocks import LATE_MIN_S
from multiradar.diagnosis.cross_sensor.comparison import Comparison
from multiradar.diagnosis.cross_sensor.explanations import _clocks, _within_a_circle
from multiradar.diagnosis.cross_sensor.hypotheses import AZIMUTH_UNITS, MIRRORED
from multiradar.diagnosis.plots import Plots


def plots(azimuth: np.ndarray) -> Plots:
    """Plots of which only ranges and azimuths are known."""
    nothing = np.full(len(azimuth), np.nan)
    return Plots(
        np.arange(float(len(azimuth))), np.full(len(azimuth), 1e5), azimuth, nothing, nothing,
        nothing, np.full((len(azimuth), 3), -1, np.int64),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("circle", "possible"),
    [
        (
            2.0 * np.pi,
            {
                "radians",
                "milliradians",
                "gradians",
                "mils",
                "0.1°",
                "0.01°",
                "4096",
                "8192",
                "16 384",
                "65 536",
            },
        ),
        (
            400.0,
            {
                "milliradians",
                "gradians",
                "mils",
                "0.1°",
                "0.01°",
                "4096",
                "8192",
                "16 384",
                "65 536",
            },
        ),
        (2000.0 * np.pi, {"milliradians", "mils", "0.01°", "8192", "16 384", "65 536"}),
        (6400.0, {"mils", "0.01°", "8192", "16 384", "65 536"}),
        (65_536.0, {"65 536"}),
    ],
)
def test_a_unit_in_which_azimuths_go_beyond_a_circle_is_not_tried(
    circle: float, possible: set[str]
) -> None:
    """Regression: mils (6400 to a circle) were mistaken for milliradians."""
    seen = plots(np.linspace(0.0, circle, 1000, endpoint=False))
    units = (
        "radians",
        "revolutions",
        "milliradians",
        "gradians",
        "mils",
        "0.1°",
        "0.01°",
        "4096",
        "8192",
        "16 384",
        "65 536",
    )
    found = {
        unit
        for unit, reading in zip(units, AZIMUTH_UNITS, strict=True)
        if _within_a_circle(reading, seen)
    }
    assert found == possible
    assert _within_a_circle(MIRRORED, seen)


def test_clock_errors_of_half_hours_are_tried_up_to_a_day(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []

    def overlaps(_number: int, _trusted: Collection[int], late_s: float) -> bool:
        tried.append(late_s)
        return False

    # Small enough to be neglected.
    monkeypatch.setattr(explanations, "_along", lambda *_: 0.5 * LATE_MIN_S)
    comparison = cast("Comparison", SimpleNamespace(overlaps=overlaps))
    assert list(_clocks(comparison, 0, (1,))) == []
    assert sorted(tried) == [1800.0 * step for step in range(-48, 49) if step]
