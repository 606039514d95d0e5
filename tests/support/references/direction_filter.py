"""A compiled filter with one aircraft, for single rows."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias.estimator import BiasEstimator
from multiradar.estimation.filters._kernels import SEVERAL
from multiradar.estimation.filters.arrays import Aircraft, Model
from multiradar.estimation.filters.bank import FILTERS, FilterDefinition
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.model import filter_model
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.moving_scene import PLANE

Floats = NDArray[np.float64]


def model_of(sensors: SensorTable, settings: TrackingSettings) -> Model:
    """What all aircraft share, the biases as they are beforehand."""
    book = BiasEstimator(sensors, FILTERS[settings.filter_name])
    return filter_model(sensors, settings, PLANE, book.state)


def one_aircraft(
    definition: FilterDefinition, model: Model, sensors: int, mean: Floats, covariance: Floats
) -> Aircraft:
    """One aircraft at time 0, measured from everywhere before."""
    aircraft = definition.aircraft(1, len(model.bias), sensors, len(model.modes))
    aircraft.mean[0] = mean
    aircraft.covariance[0] = covariance[np.triu_indices(4)]
    aircraft.time[0] = 0.0
    aircraft.updates[0] = 5
    aircraft.updated[0] = 0.0
    aircraft.measured_from[0] = SEVERAL
    return aircraft
