"""Plots agree with positions by others within the errors that biases and noise have."""

from typing import Any

import numpy as np
import pytest

from multiradar.diagnosis.cross_sensor.agreement import polar_agreement, position_agreement
from multiradar.diagnosis.cross_sensor.references import Pairs
from multiradar.diagnosis.plots import Floats, located
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation

SITE = (0.87, 0.26, 300.0)
COUNT = 20
RANGE_M, AZIMUTH_RAD = np.linspace(50e3, 90e3, COUNT), np.linspace(0.3, 1.0, COUNT)
POSITION_M = located(SITE, RANGE_M, AZIMUTH_RAD, np.full(COUNT, 9000.0))
_ROWS = np.arange(COUNT)
PAIRS = Pairs(_ROWS, 0 * _ROWS, _ROWS, POSITION_M, np.zeros((COUNT, 3)))


def _polar(range_m: Any, azimuth_deg: Any, **how: bool) -> float:
    """Return the share of plots that agree with such errors of range and azimuth."""
    measured = RANGE_M + range_m, AZIMUTH_RAD + np.radians(azimuth_deg)
    return polar_agreement(measured, SITE, PAIRS, compared=COUNT, **how).share


# A minority has another error.
def _of_some(error: float) -> Floats:
    return np.where(_ROWS < 8, error, 0.0)


@pytest.mark.parametrize(
    ("share", "expected"),
    [
        # Five prior standard deviations.
        (_polar(2480.0, 0.0), 1.0),
        (_polar(2520.0, 0.0), 0.0),
        (_polar(-2480.0, 0.0), 1.0),
        (_polar(-2520.0, 0.0), 0.0),
        (_polar(0.0, 2.49), 1.0),
        (_polar(0.0, -2.51), 0.0),
        (_polar(0.0, 140.0), 0.0),
        (_polar(0.0, 140.0, any_rotation=True), 1.0),
        (_polar(2520.0, 140.0, any_rotation=True), 0.0),
        # Equal errors.
        (_polar(300.0 + _of_some(960.0), 0.0), 1.0),
        (_polar(300.0 + _of_some(1040.0), 0.0), 0.6),
        (_polar(0.0, 0.3 + _of_some(0.59)), 1.0),
        (_polar(0.0, 0.3 + _of_some(0.61)), 0.6),
        (_polar(0.0, 180.3 + _of_some(0.59), any_rotation=True), 1.0),
        (_polar(0.0, 180.3 + _of_some(0.61), any_rotation=True), 0.6),
    ],
)
def test_polar_plots_agree_up_to_their_bounds(share: float, expected: float) -> None:
    assert share == pytest.approx(expected)


def _reported(north_m: Any, **how: float) -> float:
    latitude, longitude, _ = ecef_to_geodetic(POSITION_M)
    moved = np.column_stack([np.zeros(COUNT), np.broadcast_to(north_m, COUNT), np.zeros(COUNT)])
    there = POSITION_M + np.einsum("kij,ki->kj", enu_rotation(latitude, longitude), moved)
    return position_agreement(there, PAIRS, compared=COUNT, **how).share


@pytest.mark.parametrize(
    ("share", "expected"),
    [
        (_reported(2990.0), 1.0),
        (_reported(3010.0), 0.0),
        (_reported(-490.0, within_m=500.0), 1.0),
        (_reported(-510.0, within_m=500.0), 0.0),
        (_reported(_of_some(1490.0)), 1.0),
        (_reported(_of_some(1510.0)), 0.6),
    ],
)
def test_reported_positions_agree_up_to_their_bounds(share: float, expected: float) -> None:
    assert share == pytest.approx(expected)
