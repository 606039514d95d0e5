"""What aircraft report about their motion, as input of the filters: velocities and acceleration.

An aircraft reports its heading, speeds and roll (Mode S registers 5,0 and 6,0, ADS-B). The filters
use three quantities: the velocity through the air, the velocity over ground, and the acceleration
across the velocity. Errors that persist (wind, magnetic variation, the temperature) are slow states
of the filter; the sigmas here are those of the rest.
"""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.aircraft_data import AircraftData

Floats = NDArray[np.float64]

# Columns: magnetic heading, rad; true airspeed, m/s, and its variance; true track angle, rad;
# ground speed, m/s; acceleration across the velocity, m/s², right positive, and its variance;
# vertical rate, m/s.
HEADING = 0
AIRSPEED = 1
AIRSPEED_VARIANCE = 2
TRACK_ANGLE = 3
GROUND_SPEED = 4
LATERAL_REPORTED = 5
LATERAL_VARIANCE = 6
CLIMB = 7
MOTION_COUNT = 8

GRAVITY_MPS2 = 9.80665
#: International Standard Atmosphere (ICAO Doc 7488): temperature (K), pressure (Pa) and lapse rate
#: (K/m) at sea level, height (m) and temperature (K) of the tropopause, gas constant (J/(kg K)).
TEMPERATURE_K, PRESSURE_PA, LAPSE_K_PER_M = 288.15, 101_325.0, 0.0065
TROPOPAUSE_M, COLD_K, GAS_CONSTANT = 11_000.0, 216.65, 287.05287
#: Ratio of the specific heats of air.
HEAT_RATIO = 1.4
#: Sigma of airspeeds, m/s, beside a constant factor: as reported or from the Mach number (which has
#: steps of 0.004), and from the indicated airspeed. Gusts are part of them.
AIRSPEED_SIGMA_MPS = 1.5
INDICATED_SIGMA_MPS = 2.5
#: Sigma of the roll: short movements, without effect on the path, and calibration, rad.
ROLL_SIGMA_RAD = np.radians(2.0)
#: Sigma of the track angle rate, rad/s; it is differentiated in the aircraft.
RATE_SIGMA_RAD_PER_S = np.radians(0.25)
#: Roll and track angle rate that differ by more than so many sigmas are both not used.
AGREEMENT = 3.0
#: Steepest roll used, rad.
ROLL_MAX_RAD = np.radians(60.0)


def reported_motion(data: AircraftData | None, height_m: Floats) -> Floats:
    """Return what aircraft report about their motion.

    Parameters
    ----------
    data : AircraftData or None
        The data as reported, None for none.
    height_m : (n,) float64
        Heights of the same rows, NaN where unknown.

    Returns
    -------
    (n, MOTION_COUNT) float64
        A missing number is NaN; (0, MOTION_COUNT) where nothing is reported.

    Notes
    -----
    The true airspeed comes from the Mach number with the temperature of the standard atmosphere, or
    from the indicated airspeed with its pressure, where it is not reported itself. The temperature
    differs by up to 20 K: 4 % of the airspeed, a slow state.

    References
    ----------
    Anderson, J. D., "Introduction to Flight", McGraw-Hill 2012, chapters 3 (standard atmosphere)
    and 4 (airspeed from pressures). Registers 5,0 and 6,0: ICAO Doc 9871.
    """
    if data is None:
        return np.empty((0, MOTION_COUNT))
    motion = np.full((len(height_m), MOTION_COUNT), np.nan)
    motion[:, HEADING] = data.magnetic_heading_rad
    motion[:, TRACK_ANGLE] = data.track_angle_rad
    motion[:, GROUND_SPEED] = data.ground_speed_m_s
    motion[:, CLIMB] = data.vertical_rate_m_s
    motion[:, AIRSPEED], sigma = _true_airspeed(data, height_m)
    motion[:, AIRSPEED_VARIANCE] = sigma**2
    motion[:, LATERAL_REPORTED], motion[:, LATERAL_VARIANCE] = _lateral(data)
    return motion


def _true_airspeed(data: AircraftData, height_m: Floats) -> tuple[Floats, Floats]:
    """Return the true airspeed as reported, by Mach number or by indicated airspeed; its sigma."""
    temperature = np.maximum(TEMPERATURE_K - LAPSE_K_PER_M * height_m, COLD_K)
    power = GRAVITY_MPS2 / (GAS_CONSTANT * LAPSE_K_PER_M)
    pressure = PRESSURE_PA * (temperature / TEMPERATURE_K) ** power
    above = np.maximum(height_m - TROPOPAUSE_M, 0.0)
    pressure *= np.exp(-GRAVITY_MPS2 * above / (GAS_CONSTANT * COLD_K))
    sound = np.sqrt(HEAT_RATIO * GAS_CONSTANT * temperature)
    sound_below = np.sqrt(HEAT_RATIO * GAS_CONSTANT * TEMPERATURE_K)
    ratio = (data.indicated_airspeed_m_s / sound_below) ** 2
    impact = PRESSURE_PA * ((1.0 + 0.2 * ratio) ** 3.5 - 1.0)
    mach = np.sqrt(5.0 * ((impact / pressure + 1.0) ** (1.0 / 3.5) - 1.0))
    by_mach = np.where(np.isnan(data.mach), mach, data.mach) * sound
    direct = ~np.isnan(data.true_airspeed_m_s)
    coarse = ~direct & np.isnan(data.mach)
    return (
        np.where(direct, data.true_airspeed_m_s, by_mach),
        np.where(coarse, INDICATED_SIGMA_MPS, AIRSPEED_SIGMA_MPS),
    )


def _lateral(data: AircraftData) -> tuple[Floats, Floats]:
    """Return the acceleration across the velocity by roll and track angle rate, and its variance.

    g tan(roll) is the acceleration of a coordinated turn, whatever the speed; the track angle rate
    times the speed is the same. Where both are reported they are averaged if they agree.
    """
    speed = np.where(np.isnan(data.ground_speed_m_s), data.true_airspeed_m_s, data.ground_speed_m_s)
    roll = np.where(np.abs(data.roll_rad) <= ROLL_MAX_RAD, data.roll_rad, np.nan)
    one = GRAVITY_MPS2 * np.tan(roll)
    one_variance = (GRAVITY_MPS2 * ROLL_SIGMA_RAD / np.cos(roll) ** 2) ** 2
    other = data.track_angle_rate_rad_per_s * speed
    other_variance = (RATE_SIGMA_RAD_PER_S * speed) ** 2
    total = one_variance + other_variance
    both = (one * other_variance + other * one_variance) / total
    agree = (one - other) ** 2 <= AGREEMENT**2 * total
    pair = ~np.isnan(one) & ~np.isnan(other)
    lateral = np.where(np.isnan(one), other, one)
    variance = np.where(np.isnan(one), other_variance, one_variance)
    lateral = np.where(pair, np.where(agree, both, np.nan), lateral)
    return lateral, np.where(pair, one_variance * other_variance / total, variance)
