"""Registers of aircraft: what they would report of their true flight, with noise and faults."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.simulation.paths import Path
from multiradar.simulation.scenario.reported_data import (
    REGISTER_NAMES,
    Atmosphere,
    RegisterReports,
)
from multiradar_converters.aircraft_data.plausibility import calibrated_airspeed_m_s
from multiradar_converters.aircraft_data.registers import (
    ABSENT,
    BDS_4_0,
    BDS_5_0,
    BDS_6_0,
    encoded,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Random errors of the values, independent from report to report, 1 sigma. Of the size found in
#: registers of airliners (howto/aircraft-data.md), before the rounding to the steps of registers.
SIGMA = {
    "roll": 0.3,
    "track_angle": 0.1,
    "ground_speed": 0.5,
    "track_angle_rate": 0.1,
    "true_airspeed": 0.5,
    "magnetic_heading": 0.15,
    "indicated_airspeed": 0.3,
    "mach": 0.001,
    "barometric_rate": 0.3,
    "inertial_rate": 0.1,
}
#: Errors of an aircraft that do not change: installation of the heading reference, degrees, and
#: position error of the static port, as a fraction of the airspeed.
HEADING_OFFSET_SIGMA_DEG = 0.5
AIRSPEED_OFFSET_SIGMA = 0.005

_GRAVITY_M_S2 = 9.80665
_GAS = 1.4 * 287.05287
_LEVEL_M = 30.48
# Rates are differences over this time; a selected altitude is reached after this time.
_STEP_S, _AHEAD_S = 0.5, 60.0


class Avionics(NamedTuple):
    """Constant errors and faults of an aircraft; the times of faults are infinite for none."""

    heading_offset_deg: float
    airspeed_factor: float
    roll_sign: float
    stale_from_s: float
    stuck_from_s: float


def avionics(
    reports: RegisterReports, life_s: tuple[float, float], rng: np.random.Generator
) -> Avionics:
    """Draw the errors of an aircraft.

    Parameters
    ----------
    reports : RegisterReports
        Fractions of faulty aircraft, factor of the noise.
    life_s : (start, end)
        Its flight; faults begin within its first half.
    rng : Generator
        The same for all sensors, so that they receive the same errors.

    Returns
    -------
    Avionics
        Its errors.

    References
    ----------
    The project's own.
    """
    offset, factor = rng.normal(size=2) * reports.noise_scale
    stale, sign, stuck, begin = rng.uniform(size=4)
    begin_s = life_s[0] + 0.5 * begin * (life_s[1] - life_s[0])
    return Avionics(
        HEADING_OFFSET_SIGMA_DEG * float(offset),
        1.0 + AIRSPEED_OFFSET_SIGMA * float(factor),
        -1.0 if sign < reports.sign_share else 1.0,
        float(begin_s) if stale < reports.stale_share else np.inf,
        float(begin_s) if stuck < reports.stuck_share else np.inf,
    )


def received_registers(
    reports: RegisterReports,
    air: Atmosphere,
    flown: tuple[SystemPlane, Path, Avionics],
    time_s: Floats,
    rng: np.random.Generator,
) -> Integers:
    """Return the registers received with the measurements of an aircraft by a sensor.

    Parameters
    ----------
    reports : RegisterReports
        What the sensor receives.
    air : Atmosphere
        Wind, temperature, magnetic variation.
    flown : (SystemPlane, Path, Avionics)
        The aircraft.
    time_s : (n,) float64
        True times of the measurements, ascending.
    rng : Generator
        For noise and faults.

    Returns
    -------
    (n, 3) int64
        Contents, −1 for a register that was not received.

    References
    ----------
    ICAO Doc 9871, second edition, tables A-2-64, A-2-80 and A-2-96, for the registers. The
    atmosphere and the faults are the project's own.
    """
    plane, path, errors = flown
    count = len(time_s)
    found = np.full((count, len(REGISTER_NAMES)), ABSENT, np.int64)
    draws = rng.uniform(size=(3 + len(REGISTER_NAMES), count))
    read_s = np.clip(time_s - reports.age_max_s * draws[0], path.start_s, None)
    values = _flight(plane, path, air, errors, read_s)
    noise = rng.normal(size=(len(SIGMA), count)) * reports.noise_scale
    for (name, sigma), one in zip(SIGMA.items(), noise, strict=True):
        values[name] = values[name] + sigma * one
    for name in ("ground_speed", "true_airspeed", "indicated_airspeed", "mach"):
        values[name] = np.maximum(values[name], 0.0)
    for name in ("track_angle", "magnetic_heading"):
        values[name] = (values[name] + 180.0) % 360.0 - 180.0
    stuck = np.flatnonzero(time_s >= errors.stuck_from_s)
    values["magnetic_heading"][stuck] = values["magnetic_heading"][stuck[:1]]
    for register in (BDS_4_0, BDS_5_0, BDS_6_0):
        found[:, register] = encoded(values, register)
    stale = np.flatnonzero(time_s >= errors.stale_from_s)
    found[stale] = found[stale[:1]]
    swapped = draws[1] < reports.swap_probability
    found[swapped] = found[swapped][:, [BDS_4_0, BDS_6_0, BDS_5_0]]
    for register, name in enumerate(REGISTER_NAMES):
        lost = draws[3 + register] >= reports.probability
        found[lost | (name not in reports.registers), register] = ABSENT
    return found


def _flight(
    plane: SystemPlane, path: Path, air: Atmosphere, errors: Avionics, time_s: Floats
) -> dict[str, Floats]:
    """Return the true values with the constant errors of the aircraft, in units of registers."""
    before, after = time_s - 0.5 * _STEP_S, time_s + 0.5 * _STEP_S
    speed, course, airspeed, nose, height = _motion(plane, path, air, time_s)
    first, last = (_motion(plane, path, air, at) for at in (before, after))
    course_rate, nose_rate = (
        (np.mod(one - other + np.pi, 2.0 * np.pi) - np.pi) / _STEP_S
        for one, other in ((last[1], first[1]), (last[3], first[3]))
    )
    climb = (last[4] - first[4]) / _STEP_S
    temperature = np.maximum(288.15 - 0.0065 * height, 216.65) + air.temperature_offset_k
    mach = airspeed * errors.airspeed_factor / np.sqrt(_GAS * temperature)
    selected = np.round(path.height(np.minimum(time_s + _AHEAD_S, path.end_s)) / _LEVEL_M)
    altitude = np.clip(selected * _LEVEL_M, 0.0, None)
    return {
        "panel_altitude": altitude,
        "managed_altitude": np.full(len(time_s), np.nan),
        "roll": errors.roll_sign * np.degrees(np.arctan(airspeed * nose_rate / _GRAVITY_M_S2)),
        "track_angle": np.degrees(course),
        "ground_speed": speed,
        "track_angle_rate": np.degrees(course_rate),
        "true_airspeed": airspeed * errors.airspeed_factor,
        "magnetic_heading": np.degrees(nose - air.magnetic_variation_rad)
        + errors.heading_offset_deg,
        "indicated_airspeed": calibrated_airspeed_m_s(mach, np.maximum(height, 0.0)),
        "mach": mach,
        "barometric_rate": climb,
        "inertial_rate": climb,
    }


def _motion(
    plane: SystemPlane, path: Path, air: Atmosphere, time_s: Floats
) -> tuple[Floats, Floats, Floats, Floats, Floats]:
    """Return ground speed, course, airspeed, heading (true) and height."""
    east, north, east_rate, north_rate = path.states(time_s).T
    height = path.height(time_s)
    speed, course = plane.ground_velocity(east, north, east_rate, north_rate, height)
    blowing = air.wind_speed_mps + air.wind_shear_per_s * height + air.wind_gradient_per_s * east
    blowing = np.maximum(blowing, 0.0)
    origin = air.wind_from_rad + air.wind_veer_rad_per_m * height
    # The wind blows from its direction.
    through_east = speed * np.sin(course) + blowing * np.sin(origin)
    through_north = speed * np.cos(course) + blowing * np.cos(origin)
    airspeed = np.hypot(through_east, through_north)
    return speed, course, airspeed, np.arctan2(through_east, through_north), height
