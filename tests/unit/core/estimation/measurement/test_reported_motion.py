"""What aircraft report becomes velocities and an acceleration."""

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.estimation.measurement.aircraft_data import AircraftData
from multiradar.estimation.measurement.reported_motion import (
    AIRSPEED,
    AIRSPEED_SIGMA_MPS,
    AIRSPEED_VARIANCE,
    GRAVITY_MPS2,
    INDICATED_SIGMA_MPS,
    LATERAL_REPORTED,
    LATERAL_VARIANCE,
    MOTION_COUNT,
    reported_motion,
)

KNOT_MPS = 1852.0 / 3600.0


def reported(height_m: float = 10_000.0, **columns: float) -> NDArray[np.float64]:
    data = {name: np.array([columns.get(name, np.nan)]) for name in AircraftData._fields}
    row: NDArray[np.float64] = reported_motion(AircraftData(**data), np.array([height_m]))[0]
    return row


def test_without_data_there_are_no_rows() -> None:
    assert reported_motion(None, np.zeros(3)).shape == (0, MOTION_COUNT)


def test_a_true_airspeed_is_taken_as_reported() -> None:
    motion = reported(true_airspeed_m_s=230.0, mach=0.5, indicated_airspeed_m_s=90.0)
    assert motion[AIRSPEED] == 230.0


# Tables of the standard atmosphere: speed of sound 340.29 m/s at sea level, 295.07 m/s from 11 km.
@pytest.mark.parametrize(("height_m", "sound_mps"), [(0.0, 340.29), (11e3, 295.07), (13e3, 295.07)])
def test_a_mach_number_becomes_an_airspeed(height_m: float, sound_mps: float) -> None:
    motion = reported(height_m, mach=0.8)
    assert motion[AIRSPEED] == pytest.approx(0.8 * sound_mps, rel=1e-4)
    assert motion[AIRSPEED_VARIANCE] == AIRSPEED_SIGMA_MPS**2


# At sea level both are equal; 300 kt at 30 000 ft are Mach 0.79.
@pytest.mark.parametrize(
    ("height_m", "airspeed_mps"), [(0.0, 300.0 * KNOT_MPS), (9144.0, 0.79 * 303.17)]
)
def test_an_indicated_airspeed_becomes_a_true_one(height_m: float, airspeed_mps: float) -> None:
    motion = reported(height_m, indicated_airspeed_m_s=300.0 * KNOT_MPS)
    assert motion[AIRSPEED] == pytest.approx(airspeed_mps, rel=2e-3)
    assert motion[AIRSPEED_VARIANCE] == INDICATED_SIGMA_MPS**2


def test_roll_and_track_angle_rate_are_one_acceleration() -> None:
    roll, speed_mps = np.radians(25.0), 200.0
    expected = GRAVITY_MPS2 * np.tan(roll)
    rate = expected / speed_mps
    alone = reported(roll_rad=roll)
    both = reported(roll_rad=roll, track_angle_rate_rad_per_s=rate, ground_speed_m_s=speed_mps)
    assert alone[LATERAL_REPORTED] == pytest.approx(expected)
    assert both[LATERAL_REPORTED] == pytest.approx(expected)
    assert both[LATERAL_VARIANCE] < alone[LATERAL_VARIANCE]


@pytest.mark.parametrize(
    "columns",
    [
        {"roll_rad": 0.5, "track_angle_rate_rad_per_s": -0.03, "ground_speed_m_s": 200.0},
        {"roll_rad": np.radians(75.0)},
        {"track_angle_rate_rad_per_s": 0.03},
    ],
)
def test_an_acceleration_that_contradicts_itself_is_not_used(columns: dict[str, float]) -> None:
    assert np.isnan(reported(**columns)[LATERAL_REPORTED])


# The difference has a sigma of 0.937 m/s² at 200 m/s: the rates are up to 2.81 / 200 rad/s.
@pytest.mark.parametrize(
    ("rate_rad_per_s", "used"),
    [(0.0140, True), (-0.0140, True), (0.0142, False), (-0.0142, False)],
)
def test_roll_and_track_angle_rate_agree_within_three_sigma(
    rate_rad_per_s: float, *, used: bool
) -> None:
    motion = reported(
        roll_rad=0.0, track_angle_rate_rad_per_s=rate_rad_per_s, ground_speed_m_s=200.0
    )
    assert np.isfinite(motion[LATERAL_REPORTED]) == used
