"""Heights of aircraft as received by sensors: quantised, sometimes garbled or missing."""

import numpy as np
from numpy.typing import NDArray

from multiradar.simulation.scenario.model import Aircraft, Sensor

Floats = NDArray[np.float64]

#: Error of a garbled Mode C code in hundreds of feet, up or down.
GARBLED_STEPS = (5, 100)
_STEP_M = 30.48
# Lowest Mode C height, m: -1000 ft.
_LEAST_M = -304.8


def received_heights(
    sensor: Sensor, aircraft: Aircraft, height_m: Floats, rng: np.random.Generator
) -> Floats:
    """Return the heights of an aircraft as received by a sensor.

    Parameters
    ----------
    sensor : Sensor
        Whether it receives heights, with which probability, and how often garbled.
    aircraft : Aircraft
        Whether it reports its height, and in which steps.
    height_m : (n,) ndarray
        True heights, m.
    rng : Generator
        For missing and garbled heights only.

    Returns
    -------
    (n,) ndarray
        Heights, m, NaN where none is received.

    References
    ----------
    ICAO Annex 10, volume IV, 3.1.1.7.12.2 and its appendix: Mode C in steps of 100 ft, from
    -1000 ft. The distribution of garbled codes is the project's own.
    """
    if "height" not in sensor.received or not (aircraft.reports_height and aircraft.transponder):
        return np.full(len(height_m), np.nan)
    step = aircraft.height_step_m
    received = step * np.round(height_m / step) if step > 0.0 else height_m
    if sensor.garbled_height_probability > 0.0:
        least, most = GARBLED_STEPS
        steps = rng.integers(least, most + 1, len(height_m)) * rng.choice([-1, 1], len(height_m))
        garbled = rng.uniform(size=len(height_m)) < sensor.garbled_height_probability
        wrong = received + _STEP_M * steps
        wrong = np.where(wrong < _LEAST_M, received - _STEP_M * steps, wrong)
        received = np.where(garbled, wrong, received)
    if sensor.height_probability < 1.0:
        received = np.where(
            rng.uniform(size=len(height_m)) < sensor.height_probability, received, np.nan
        )
    return received
