"""How often the sensors of a scene looked, and what came of it."""

import numpy as np

from multiradar.simulation.observation.measurements import NO_AIRCRAFT
from multiradar.simulation.observation.observation import Observation
from multiradar.simulation.scenario.scene import Scene


def counts_by_sensor(scene: Scene, observation: Observation) -> dict[str, dict[str, int]]:
    """Count looks and measurements of each sensor.

    Parameters
    ----------
    scene : Scene
        The scene.
    observation : Observation
        What came of it.

    Returns
    -------
    dict
        By sensor, sorted: `looks` at aircraft within the coverage, `measurements` of them,
        `missed` looks (no detection, or a gap), `outliers` among the measurements, `clutter`, and
        `copies` of measurements that came a second time.
    """
    rows = observation.measurements
    count = len(scene.sensors)
    real = rows.aircraft != NO_AIRCRAFT
    made = np.bincount(rows.sensor[real], minlength=count) - observation.copies
    outliers = np.bincount(rows.sensor[real & rows.outlier], minlength=count)
    clutter = np.bincount(rows.sensor[~real], minlength=count)
    named = sorted((one.identifier, index) for index, one in enumerate(scene.sensors))
    return {
        name: {
            "looks": int(observation.looks[index]),
            "measurements": int(made[index]),
            "missed": int(observation.looks[index] - made[index]),
            "outliers": int(outliers[index]),
            "clutter": int(clutter[index]),
            "copies": int(observation.copies[index]),
        }
        for name, index in named
    }
