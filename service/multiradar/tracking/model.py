"""Sensors, settings and published biases as arrays for the compiled filters."""

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.bias.estimator import column_starts
from multiradar.estimation.bias.store import BiasState, symmetric_root, widened
from multiradar.estimation.filters import _kernels as kernels
from multiradar.estimation.filters.arrays import NO_DELAYS, Model
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.estimation.measurement.sites import numbers_of_sites
from multiradar.geodesy._kernels import site_parameters
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.tracking.modes import mode_table
from multiradar.tracking.settings import NOMINAL_INTERVAL_S, VELOCITY_FRAME, TrackingSettings

# Kind of the column of the delay, among those of the bias parameters.
NO_PARAMETER = -1


def filter_model(
    sensors: SensorTable, settings: TrackingSettings, plane: SystemPlane, biases: BiasState
) -> Model:
    """Build the model of the first epoch; see `with_biases` for later ones.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    settings : TrackingSettings
        The settings of the tracker.
    plane : SystemPlane
        The system plane.
    biases : BiasState
        The published biases.

    Returns
    -------
    Model
        The model.
    """
    parameters = np.array(plane.parameters)
    sites = [
        site_parameters(parameters, latitude, longitude, height)
        for latitude, longitude, height in zip(
            np.nan_to_num(sensors.latitude_rad),
            np.nan_to_num(sensors.longitude_rad),
            np.nan_to_num(sensors.height_m),
            strict=True,
        )
    ]
    noises = np.column_stack(
        [
            sensors.range_sigma_m**2,
            sensors.azimuth_sigma_rad**2,
            sensors.position_sigma_m**2,
            np.nan_to_num(sensors.height_m),
        ]
    )
    # The column of the delay of each aircraft is no parameter of a sensor.
    own = np.full(int(sensors.delayed.any()), NO_PARAMETER)
    fixed = Model(
        plane=parameters,
        sites=np.array(sites),
        noises=np.ascontiguousarray(noises),
        site_numbers=numbers_of_sites(sensors),
        starts=column_starts(sensors),
        parameters=np.append(sensors.parameter_kind.astype(np.int64), own),
        bias=np.empty(0),
        bias_covariance=np.empty((0, 0)),
        factor=np.empty((0, 0)),
        options=_options(settings),
        modes=mode_table(settings),
        delayed=sensors.delayed.astype(np.int64) if sensors.delayed.any() else NO_DELAYS,
    )
    fixed.options[kernels.DELAY_VARIANCE] = sensors.delay_sigma_m**2
    return with_biases(fixed, biases)


def bias_columns(sensors: SensorTable) -> int:
    """Return the number of columns of the biases in a model.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.

    Returns
    -------
    int
        That of the bias parameters, and one for the delay of each aircraft where it is estimated.
    """
    return len(sensors.parameter_kind) + int(sensors.delayed.any())


def with_biases(model: Model, biases: BiasState) -> Model:
    """Return the model with newly published biases; other arrays are shared.

    Parameters
    ----------
    model : Model
        The model of the previous epoch.
    biases : BiasState
        The biases to publish.

    Returns
    -------
    Model
        The model of the next epoch.
    """
    scaled = biases.covariance / np.outer(biases.scale, biases.scale)
    factor = symmetric_root(scaled) * biases.scale
    columns = len(biases.estimate) + int(len(model.delayed) > 0)
    return model._replace(
        bias=np.append(biases.estimate, np.zeros(columns - len(biases.estimate))),
        bias_covariance=widened(biases.covariance, columns, 1.0),
        factor=widened(factor, columns, 1.0),
    )


def _options(settings: TrackingSettings) -> NDArray[np.float64]:
    options = np.empty(kernels.OPTION_COUNT)
    options[kernels.ACCELERATION_DENSITY] = settings.acceleration_density
    options[kernels.SPEED_SIGMA] = settings.speed_sigma_mps
    options[kernels.DOWNWEIGHT_NIS] = settings.downweight_nis
    options[kernels.REJECT_NIS] = settings.refuse_nis
    options[kernels.REJECTIONS_MAX] = settings.refusals_max
    options[kernels.CONE_RATIO] = settings.cone_ratio
    options[kernels.ASSUMED_HEIGHT] = settings.assumed_height_m
    options[kernels.ASSUMED_HEIGHT_SIGMA] = settings.assumed_height_sigma_m
    options[kernels.FADING_NIS_GAIN] = settings.surprise_gain
    options[kernels.FADING_NIS_FLOOR] = settings.surprise_floor
    options[kernels.MANOEUVRE_FACTOR_MAX] = settings.manoeuvre_factor_max
    options[kernels.EXACT_HEIGHTS] = settings.exact_heights
    options[kernels.SCALE_TIME] = settings.ci_scale_time_s
    options[kernels.VELOCITY_FRAME] = settings.motion == VELOCITY_FRAME
    options[kernels.DENSITY_ALONG] = settings.longitudinal_acceleration_mps2**2 * NOMINAL_INTERVAL_S
    options[kernels.DENSITY_OF_COURSE] = settings.turn_rate_rad_per_s**2 * NOMINAL_INTERVAL_S
    options[kernels.MODES_NIS_FLOOR] = settings.imm_surprise_floor
    options[kernels.MODES_NIS_DENSITY] = settings.imm_surprise_density
    options[kernels.SPEED_MAX] = settings.speed_max_mps
    return options
