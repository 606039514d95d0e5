"""The heights that sensors hear of an aircraft: in steps, garbled now and then, or not at all."""

import numpy as np
from numpy.typing import NDArray

from multiradar.simulation.scenario.scene import Aircraft, Sensor

Floats = NDArray[np.float64]

#: A garbled Mode C code is off by so many hundreds of feet, up or down.
GARBLED_STEPS = (5, 100)
_STEP_M = 30.48
# Lower than this no code says, m: Mode C begins at -1000 ft.
_LEAST_M = -304.8


def heard_heights(
    sensor: Sensor, aircraft: Aircraft, height_m: Floats, rng: np.random.Generator
) -> Floats:
    """Return what a sensor hears of the height of an aircraft.

    Parameters
    ----------
    sensor : Sensor
        Whether it hears heights, how often, and how often garbled.
    aircraft : Aircraft
        Whether it tells its height, and in which steps.
    height_m : (n,) ndarray
        True heights, m.
    rng : Generator
        For what is not heard, and what is garbled; used for these alone.

    Returns
    -------
    (n,) ndarray
        Heights, m, NaN where none is heard.

    References
    ----------
    ICAO Annex 10, volume IV, 3.1.1.7.12.2 and its appendix: Mode C in steps of 100 ft, from
    -1000 ft. How garbled codes spread is the project's own.
    """
    if "height" not in sensor.heard or not (aircraft.reports_height and aircraft.transponder):
        return np.full(len(height_m), np.nan)
    step = aircraft.height_step_m
    heard = step * np.round(height_m / step) if step > 0.0 else height_m
    if sensor.garbled_height_probability > 0.0:
        least, most = GARBLED_STEPS
        steps = rng.integers(least, most + 1, len(height_m)) * rng.choice([-1, 1], len(height_m))
        garbled = rng.uniform(size=len(height_m)) < sensor.garbled_height_probability
        wrong = heard + _STEP_M * steps
        wrong = np.where(wrong < _LEAST_M, heard - _STEP_M * steps, wrong)
        heard = np.where(garbled, wrong, heard)
    if sensor.height_probability < 1.0:
        heard = np.where(rng.uniform(size=len(height_m)) < sensor.height_probability, heard, np.nan)
    return heard
