"""The arrays of one sequential filter, for the player, the theory and the class."""

from bisect import bisect_right
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError
from multiradar.estimation.array_checks import require_shape
from multiradar.estimation.filters import _kernels as kernels
from multiradar.estimation.filters.arrays import Aircraft, Model, Result, Work, result_arrays
from multiradar.estimation.filters.bank import FilterDefinition, find_filter_for
from multiradar.estimation.filters.height._height_kernels import reset_height
from multiradar.estimation.filters.imm._mode_scratch_kernels import MODE_COUNT
from multiradar.estimation.filters.joint._joint_kernels import insert_aircraft
from multiradar.estimation.filters.two_stage._time_offset_kernels import (
    VELOCITY_SIGMA_MAX,
    has_time_offset,
)
from multiradar.research.sequential._kernels import inform
from multiradar.research.sequential.arrays import Store
from multiradar.research.sequential.sensors import Sensors

Floats = NDArray[np.float64]
UPPER = np.triu_indices(4)

#: Minimum and maximum of each option.
OPTION_BOUNDS = {
    "acceleration_density": (0.0, 1e6),
    "cone_ratio": (0.0, 10.0),
    "refuse_nis": (1.0, np.inf),
    "downweight_nis": (1.0, np.inf),
    "speed_sigma_mps": (1.0, 10_000.0),
    "ci_scale_time_s": (1e-3, 1e6),
}
#: Maximum size of the arrays of a filter; with the joint filter they grow quadratically.
ARRAYS_BYTES_MAX = 2**30


@dataclass(frozen=True, slots=True)
class Options:
    """Options of a filter; by default as in the papers, without gates.

    Attributes
    ----------
    acceleration_density : float
        Spectral density of the white acceleration of an aircraft, m²/s³ on each axis.
    cone_ratio : float
        Minimum ratio of ground range to height above a radar for its plots to be used.
    refuse_nis, downweight_nis : float
        Normalised innovation squared from which a measurement is rejected, or downweighted.
    speed_sigma_mps : float
        Prior standard deviation of each component of the velocity of an aircraft that is
        initiated by a plot, m/s.
    ci_scale_time_s : float
        In the trace minimised by covariance intersection, which adds m² and (m/s)², velocities
        are multiplied by this time, (1.45).

    Raises
    ------
    ConfigurationError
        If one is outside its bounds: those of the settings of the service, extended by zero
        process noise and infinite gates.
    ShapeError
        If one is not a number.
    """

    acceleration_density: float = 0.0
    cone_ratio: float = 0.0
    refuse_nis: float = np.inf
    downweight_nis: float = np.inf
    speed_sigma_mps: float = 300.0
    ci_scale_time_s: float = 10.0

    def __post_init__(self) -> None:
        for name, (least, most) in OPTION_BOUNDS.items():
            value = float(require_shape(getattr(self, name), name, ()))
            if not least <= value <= most:
                raise ConfigurationError(f"{name}: expected {least:g} to {most:g}, was {value:g}")


@dataclass(frozen=True, slots=True)
class Arrangement:
    """A filter with its arrays, ready for updates."""

    definition: FilterDefinition
    model: Model
    store: Store
    aircraft: Aircraft
    result: Result
    work: Work


def arrange(name: str, sensors: Sensors, options: Options, *, slots: int, rows: int) -> Arrangement:
    """Return a filter before its first measurement.

    Parameters
    ----------
    name : str
        Name of the filter.
    sensors : Sensors
        The sensors and the prior of their biases.
    options : Options
        Options of the filter.
    slots : int
        Maximum number of aircraft.
    rows : int
        Maximum number of measurements.

    Returns
    -------
    Arrangement
        Its arrays.

    Raises
    ------
    UnknownFilterError
        If there is no filter of that name.
    ConfigurationError
        If the filter does not support one of the bias parameters, has several motion modes, or its
        arrays would exceed `ARRAYS_BYTES_MAX` with this number of aircraft.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.24): ς and its block before the first measurement;
    sections 1.3 to 1.5 for the state of each filter.
    """
    definition = find_filter_for(name if isinstance(name, str) else repr(name), sensors.parameters)
    if definition.keeps_modes:
        raise ConfigurationError(
            f"expected a filter with a single motion model and a sequential form, was {name}"
        )
    prior = sensors.prior
    count = len(prior.mean)
    most = _slots_max(definition, sensors)
    if slots > most:
        raise ConfigurationError(f"aircraft: expected at most {most} with {name}, was {slots}")
    model = Model(
        plane=sensors.plane,
        sites=sensors.sites,
        noises=sensors.noises,
        site_numbers=sensors.site_numbers,
        starts=sensors.starts,
        parameters=sensors.parameters,
        bias=prior.mean.copy(),
        bias_covariance=prior.covariance.copy(),
        factor=np.zeros((count, count)),
        options=_options(options),
        modes=np.zeros((1, MODE_COUNT)),
    )
    store = Store(prior.sigma, prior.drift.copy(), np.zeros((count, count)))
    inform(model, store)
    return Arrangement(
        definition=definition,
        model=model,
        store=store,
        aircraft=definition.aircraft(slots, count, len(sensors), 1),
        result=result_arrays(rows, 1, count, keeps_log=definition.folds_log),
        work=Work(np.zeros(1, np.int64), np.zeros(2, np.int64), np.arange(rows)),
    )


def initiate(
    one: Arrangement, aircraft: int, time_s: float, mean: Floats, covariance: Floats
) -> None:
    """Initiate an aircraft with a state that does not come from the sensors.

    Parameters
    ----------
    one : Arrangement
        Changed in place.
    aircraft : int
        Its slot.
    time_s : float
        Time of the state, s.
    mean : (4,) float64
        East, north (m) and their rates (m/s).
    covariance : (4, 4) float64
        Covariance of its error, independent of the biases.

    Notes
    -----
    Where a time offset is estimated and the velocity is accurate enough, time offsets are
    linearised at it. Otherwise the aircraft is reinitialised once its plots have determined the
    velocity, without the given state.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.24), with zeros between the aircraft and all others: the
    condition after (1.36).
    """
    arrays = one.aircraft
    arrays.mean[aircraft] = mean
    arrays.covariance[aircraft] = covariance[UPPER]
    arrays.sensitivity[aircraft] = 0.0
    arrays.time[aircraft] = time_s
    arrays.updated[aircraft] = np.nan
    reset_height(aircraft, arrays.height, arrays.vertical)
    arrays.rejections[aircraft], arrays.updates[aircraft] = 0, 0
    arrays.fading_nis[aircraft] = 1.0
    timed = one.definition.estimates_time_offsets and has_time_offset(one.model.parameters)
    known = covariance[2, 2] + covariance[3, 3] < VELOCITY_SIGMA_MAX**2
    arrays.velocity[aircraft] = mean[2:] if timed and known else np.nan
    # Every plot may contribute to the bias estimate, including the first one.
    arrays.measured_from[aircraft] = kernels.SEVERAL
    if one.definition.corrects_biases:
        insert_aircraft(arrays, len(one.model.bias), aircraft)


# Maximum number of aircraft within `ARRAYS_BYTES_MAX`.
def _slots_max(definition: FilterDefinition, sensors: Sensors) -> int:
    biases = len(sensors.prior.mean)

    def size(slots: int) -> int:
        joint = biases + 4 * slots if definition.corrects_biases else 0
        # State, covariance, sensitivity, latest plots and status; then the output.
        each = 4 + 10 + 4 * biases + kernels.LOG_COUNT * len(sensors) + 10 + 20
        return 8 * (joint * joint + slots * each)

    return bisect_right(range(ARRAYS_BYTES_MAX), ARRAYS_BYTES_MAX, key=size) - 1


def _options(options: Options) -> Floats:
    values = np.zeros(kernels.OPTION_COUNT)
    values[kernels.ACCELERATION_DENSITY] = options.acceleration_density
    values[kernels.SPEED_SIGMA] = options.speed_sigma_mps
    values[kernels.SCALE_TIME] = options.ci_scale_time_s
    values[kernels.CONE_RATIO] = options.cone_ratio
    values[kernels.EXACT_HEIGHTS] = 1.0
    values[kernels.DOWNWEIGHT_NIS] = options.downweight_nis
    values[kernels.REJECT_NIS] = options.refuse_nis
    values[kernels.REJECTIONS_MAX] = np.inf
    values[kernels.FADING_NIS_FLOOR] = 1.0
    values[kernels.MANOEUVRE_FACTOR_MAX] = 1.0
    return values
