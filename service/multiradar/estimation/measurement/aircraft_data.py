"""Aircraft-derived data of measurements: what the aircraft reports about its flight."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class AircraftData(NamedTuple):
    """Columns of aircraft-derived data; a missing number is NaN.

    Attributes
    ----------
    magnetic_heading_rad : (n,) float64
        Heading of the nose, clockwise from magnetic north.
    roll_rad : (n,) float64
        Positive with the right wing down.
    track_angle_rad : (n,) float64
        Direction of the motion over ground, clockwise from true north.
    track_angle_rate_rad_per_s : (n,) float64
        Positive in right turns.
    ground_speed_m_s, true_airspeed_m_s, indicated_airspeed_m_s : (n,) float64
        Speeds.
    mach : (n,) float64
        Mach number.
    vertical_rate_m_s : (n,) float64
        Positive in climbs; inertial where reported, else barometric.
    selected_altitude_m : (n,) float64
        Selected altitude.
    """

    magnetic_heading_rad: NDArray[np.float64]
    roll_rad: NDArray[np.float64]
    track_angle_rad: NDArray[np.float64]
    track_angle_rate_rad_per_s: NDArray[np.float64]
    ground_speed_m_s: NDArray[np.float64]
    true_airspeed_m_s: NDArray[np.float64]
    indicated_airspeed_m_s: NDArray[np.float64]
    mach: NDArray[np.float64]
    vertical_rate_m_s: NDArray[np.float64]
    selected_altitude_m: NDArray[np.float64]
