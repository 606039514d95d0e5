"""Checks of aircraft-derived data of one report: physical bounds, consistency of its values.

Values that come together are dropped together: a register whose content contradicts itself is
garbled, or is another register. Which of two registers is wrong when they contradict each other is
unknown: both are dropped.

==================  =========  =====================================================================
reason              drops      condition
==================  =========  =====================================================================
`out_of_range`      motion,    a value beyond `BOUNDS`
                    air,
                    altitude
`wind`              motion     ground speed and true airspeed differ by more than a wind explains
`roll_and_rate`     these two  the track angle rate is not that of a turn with this roll
`airspeed_and_mach` air        the indicated airspeed is not that of this Mach number at this height
`true_and_mach`     motion,    the true airspeed is not that of this Mach number at any temperature
                    air        of the atmosphere
`track_and_heading` motion,    their difference is more than wind and magnetic variation explain
                    air
==================  =========  =====================================================================

*motion*: roll, track angle and its rate, ground speed, true airspeed (register 5,0); *air*:
magnetic heading, indicated airspeed, Mach number, vertical rate (register 6,0).
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.aircraft_data import quantities as q
from multiradar_converters.aircraft_data.quantities import Numbers

Flags = NDArray[np.bool_]

MOTION = (q.ROLL, q.TRACK_ANGLE, q.TRACK_ANGLE_RATE, q.GROUND_SPEED, q.TRUE_AIRSPEED)
AIR = (q.MAGNETIC_HEADING, q.INDICATED_AIRSPEED, q.MACH, q.VERTICAL_RATE)
ALTITUDE = (q.SELECTED_ALTITUDE,)
TURN = (q.ROLL, q.TRACK_ANGLE_RATE)

#: Physical bounds: any aircraft below 20 km and Mach 3.
BOUNDS: dict[int, tuple[float, float]] = {
    q.ROLL: (-75.0, 75.0),
    q.TRACK_ANGLE_RATE: (-20.0, 20.0),
    q.GROUND_SPEED: (0.0, 1000.0),
    q.TRUE_AIRSPEED: (0.0, 900.0),
    q.INDICATED_AIRSPEED: (0.0, 450.0),
    q.MACH: (0.0, 3.0),
    q.VERTICAL_RATE: (-100.0, 100.0),
    q.SELECTED_ALTITUDE: (-400.0, 20_000.0),
}

#: Strongest wind: jet streams reach 110 m/s, storms near the ground 50 m/s.
WIND_MAX_M_S = 130.0
WIND_SURFACE_M_S = 60.0
WIND_PER_HEIGHT_PER_S = 0.01
#: Airspeeds below this are not reliable (Doc 9871: valid from 30 to 60 kt on), and turns not
#: coordinated.
AIRBORNE_MIN_M_S = 60.0
#: Instrument and position error of the airspeed, steps of the Mach number, error of the height.
AIRSPEED_ERROR_M_S = 12.0
AIRSPEED_ERROR_FRACTION = 0.05
#: Of the speed of sound: temperatures of 50 K off the standard atmosphere.
SOUND_ERROR_FRACTION = 0.12
#: The rate lags behind the roll, and the filters of their sources differ.
RATE_ERROR_DEG_PER_S = 1.0
RATE_ERROR_FRACTION = 0.6
#: Variation outside the polar regions; where it is known from a recording, its error and change.
VARIATION_MAX_DEG = 40.0
VARIATION_ERROR_DEG = 12.0

_GRAVITY_M_S2 = 9.80665
_SOUND_M_S = 340.294
_GAMMA_GAS = 1.4 * 287.05287


class Finding(NamedTuple):
    """Reports whose values are dropped: the reason, and the values."""

    reason: str
    quantities: tuple[int, ...]
    where: Flags


def findings(values: Numbers, height_m: Numbers, variation_deg: float = np.nan) -> list[Finding]:
    """Check the values of each report against each other.

    Parameters
    ----------
    values : float64[n, 10]
        Columns of `QUANTITIES`.
    height_m : float64[n]
        Pressure altitude, m; NaN for none.
    variation_deg : float
        Magnetic variation, positive to the east; NaN if unknown.

    Returns
    -------
    list of Finding
        A report may be in several.
    """
    found = [
        Finding("out_of_range", _together(k), _outside(values[:, k], *bounds))
        for k, bounds in BOUNDS.items()
    ]
    ground, true = values[:, q.GROUND_SPEED], values[:, q.TRUE_AIRSPEED]
    indicated, mach = values[:, q.INDICATED_AIRSPEED], values[:, q.MACH]
    flies = true >= AIRBORNE_MIN_M_S
    wind = wind_max_m_s(height_m)
    found.append(Finding("wind", MOTION, flies & (np.abs(ground - true) > wind)))
    expected = turn_rate_deg_per_s(values[:, q.ROLL], true)
    rate = values[:, q.TRACK_ANGLE_RATE]
    largest = np.fmax(np.abs(rate), np.abs(expected))
    within = RATE_ERROR_DEG_PER_S + RATE_ERROR_FRACTION * largest
    found.append(Finding("roll_and_rate", TURN, flies & (np.abs(rate - expected) > within)))
    calibrated = calibrated_airspeed_m_s(mach, height_m)
    within = AIRSPEED_ERROR_M_S + AIRSPEED_ERROR_FRACTION * calibrated
    fast = np.fmax(indicated, calibrated) >= AIRBORNE_MIN_M_S
    found.append(
        Finding("airspeed_and_mach", AIR, fast & (np.abs(indicated - calibrated) > within))
    )
    by_mach = mach * speed_of_sound_m_s(height_m)
    within = AIRSPEED_ERROR_M_S + SOUND_ERROR_FRACTION * by_mach
    fast = np.fmax(true, by_mach) >= AIRBORNE_MIN_M_S
    found.append(Finding("true_and_mach", MOTION + AIR, fast & (np.abs(true - by_mach) > within)))
    air = np.where(np.isnan(true), by_mach, true)
    found.append(
        Finding("track_and_heading", MOTION + AIR, _crossed(values, air, wind, variation_deg))
    )
    return [one for one in found if one.where.any()]


def turn_rate_deg_per_s(roll_deg: Numbers, speed_m_s: Numbers) -> Numbers:
    """Return the rate of turn of coordinated flight with a roll, degree/s."""
    with np.errstate(divide="ignore", invalid="ignore"):
        rate = _GRAVITY_M_S2 * np.tan(np.radians(roll_deg)) / speed_m_s
    return np.where(speed_m_s > 0.0, np.degrees(rate), np.nan)


def speed_of_sound_m_s(height_m: Numbers) -> Numbers:
    """Return the speed of sound of the standard atmosphere, m/s; at sea level without height."""
    height = np.nan_to_num(height_m)
    temperature = np.where(height < 11_000.0, 288.15 - 0.0065 * height, 216.65)
    return np.sqrt(_GAMMA_GAS * temperature)


def calibrated_airspeed_m_s(mach: Numbers, height_m: Numbers) -> Numbers:
    """Return the calibrated airspeed of a Mach number, m/s; NaN without height.

    The impact pressure of the Mach number at the pressure of the standard atmosphere, as airspeed
    at sea level (subsonic: isentropic compression of air, ratio of specific heats 1.4).
    """
    tropospheric = np.maximum(1.0 - 2.25577e-5 * np.minimum(height_m, 11_000.0), 0.0) ** 5.25588
    pressure = tropospheric * np.exp(-np.maximum(height_m - 11_000.0, 0.0) / 6341.6)
    impact = pressure * ((1.0 + 0.2 * mach * mach) ** 3.5 - 1.0)
    return _SOUND_M_S * np.sqrt(5.0 * ((impact + 1.0) ** (2.0 / 7.0) - 1.0))


def wind_max_m_s(height_m: Numbers) -> Numbers:
    """Return the strongest wind at a height, m/s; that of jet streams without height."""
    wind = np.fmin(WIND_SURFACE_M_S + WIND_PER_HEIGHT_PER_S * height_m, WIND_MAX_M_S)
    return np.where(np.isnan(height_m), WIND_MAX_M_S, wind)


def drift_max_deg(ground_m_s: Numbers, air_m_s: Numbers, wind_m_s: Numbers) -> Numbers:
    """Return the largest angle between track and heading with winds up to a speed."""
    with np.errstate(divide="ignore", invalid="ignore"):
        cosine = (ground_m_s**2 + air_m_s**2 - wind_m_s**2) / (2.0 * ground_m_s * air_m_s)
    return np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))


def wrapped_deg(angle_deg: Numbers) -> Numbers:
    """Return angles from -180 to less than 180 degrees."""
    return (angle_deg + 180.0) % 360.0 - 180.0


def _crossed(values: Numbers, air_m_s: Numbers, wind_m_s: Numbers, variation_deg: float) -> Flags:
    ground = values[:, q.GROUND_SPEED]
    known = not np.isnan(variation_deg)
    apart = values[:, q.TRACK_ANGLE] - values[:, q.MAGNETIC_HEADING]
    apart = np.abs(wrapped_deg(apart - (variation_deg if known else 0.0)))
    allowance = VARIATION_ERROR_DEG if known else VARIATION_MAX_DEG
    flies = np.fmin(air_m_s, ground) >= AIRBORNE_MIN_M_S
    crossed: Flags = flies & (apart > drift_max_deg(ground, air_m_s, wind_m_s) + allowance)
    return crossed


def drop(values: Numbers, found: list[Finding]) -> Numbers:
    """Return the values without those of findings."""
    kept = values.copy()
    for one in found:
        q.blank(kept, one.where, one.quantities)
    return kept


def _outside(column: Numbers, least: float, most: float) -> Flags:
    outside: Flags = (column < least) | (column > most)
    return outside


def _together(quantity: int) -> tuple[int, ...]:
    return next(group for group in (MOTION, AIR, ALTITUDE) if quantity in group)
