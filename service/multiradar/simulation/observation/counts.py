"""Counts of detection opportunities and measurements by sensor."""

import numpy as np

from multiradar.simulation.observation.measurements import NO_AIRCRAFT
from multiradar.simulation.observation.observe import Observation
from multiradar.simulation.scenario.model import Scenario


def counts_by_sensor(scenario: Scenario, observation: Observation) -> dict[str, dict[str, int]]:
    """Count detection opportunities and measurements of each sensor.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    observation : Observation
        Its simulated measurements.

    Returns
    -------
    dict
        By sensor, sorted: `looks` (detection opportunities of aircraft within the coverage),
        `measurements` of them, `missed` opportunities (no detection, or a gap), `outliers` among
        the measurements, `clutter`, and `copies` (measurements received a second time).
    """
    rows = observation.measurements
    count = len(scenario.sensors)
    real = rows.aircraft != NO_AIRCRAFT
    made = np.bincount(rows.sensor[real], minlength=count) - observation.copies
    outliers = np.bincount(rows.sensor[real & rows.outlier], minlength=count)
    clutter = np.bincount(rows.sensor[~real], minlength=count)
    named = sorted((one.identifier, index) for index, one in enumerate(scenario.sensors))
    return {
        name: {
            "looks": int(observation.opportunities[index]),
            "measurements": int(made[index]),
            "missed": int(observation.opportunities[index] - made[index]),
            "outliers": int(outliers[index]),
            "clutter": int(clutter[index]),
            "copies": int(observation.copies[index]),
        }
        for name, index in named
    }
