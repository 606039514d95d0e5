"""Arrays of the compiled filters, grouped by owner.

Named tuples, because compiled functions accept them directly. All arrays of `Aircraft` belong to
one shard and are changed in place by its kernels (the one exception to frozen states).
"""

import math
from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import INNOVATION_COUNT, LOG_COUNT, READOUT_COUNT
from multiradar.estimation.filters.height._height_kernels import GUESS, VERTICAL_COUNT
from multiradar.estimation.measurement.reported_motion import MOTION_COUNT
from multiradar_compiled.kernels import in_both

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Columns of `Aircraft.recent`.
RECENT_TIME = 0
RECENT_Z0 = 1
RECENT_Z1 = 2
RECENT_HEIGHT = 3
RECENT_KIND = 4
RECENT_EXCESS = 5
RECENT_COUNT = 6

#: Processors fetch cache lines of 64 bytes in pairs.
LINES_BYTES = 128
#: Consecutive slots of one partition: their 8-byte states fill a pair of cache lines, so that two
#: workers do not write to the same pair (false sharing).
LINE_SLOTS = LINES_BYTES // 8

Slots = TypeVar("Slots", int, Integers)

#: Slow states of an aircraft, and columns of `Aircraft.reported`: see `imm._slow_state_kernels`.
SLOW_COUNT = 7
REPORTED_COUNT = 11


# Columns of `Aircraft.delay`: see `_delay_kernels`.
DELAY_MEAN = 0
DELAY_SIGMA = 1
DELAY_BIASES = 2

#: Of rows without reports.
NO_MOTION = np.empty((0, MOTION_COUNT))
#: Of sensors without delays of transponders.
NO_DELAYS = np.empty(0, np.int64)


class Rows(NamedTuple):
    """Measurements in canonical order.

    Attributes
    ----------
    slot : (n,) int64
        Index of the aircraft in `Aircraft`, negative for none (see `_kernels`).
    time : (n,) float64
        Data time, s; non-decreasing for one aircraft.
    kind, sensor : (n,) int64
        Kind of the measurement and index of the sensor.
    z : (n, 2) float64
        Range (m) and azimuth (rad), or east and north (m).
    height : (n,) float64
        Measured height, m, NaN for none.
    seen : (n,) int64
        Row of `Model.sites` and `noises`, and index in `starts`: the index of the sensor, except
        for bearings with a site or noise of their own (`multiradar.tracking.bearings.sources`).
    ground : (n,) int64
        Reported ground status: 1 on the ground, 0 airborne, −1 unknown.
    motion : (n, MOTION_COUNT) float64
        What the aircraft reports about its motion: columns as in `measurement.reported_motion`.
        Without rows where none does.
    """

    slot: Integers
    time: Floats
    kind: Integers
    sensor: Integers
    z: Floats
    height: Floats
    seen: Integers
    ground: Integers
    motion: Floats = NO_MOTION


class Model(NamedTuple):
    """Common to all aircraft: the plane, the sensors, the published biases, the options.

    Attributes
    ----------
    plane : (k,) float64
        Parameters of the system plane.
    sites : (m, l) float64
        Parameters of the sites; east and north (m) first for the kinds on a flat plane.
    noises : (m, 4) float64
        Variances of range (m²), azimuth (rad²), reported position (m² on each axis); height of the
        site (m).
    site_numbers : (m,) int64
        Number of the site of each sensor, equal for sensors on one site.
    starts : (m + 1,) int64
        First column of each sensor in the bias vector.
    parameters : (c,) int64
        Kind of each bias parameter.
    bias : (c,) float64
        Published estimate of the biases.
    bias_covariance : (c, c) float64
        Its covariance.
    factor : (c, c) float64
        Upper triangular Lᵀ with L Lᵀ = `bias_covariance` (Cholesky).
    options : (OPTION_COUNT,) float64
        The options, at the indices named in `_kernels`.
    modes : (j, MODE_COUNT) float64
        Motion models of the filter of interacting modes: columns as in `_mode_scratch_kernels`. One
        row at least.
    delayed : (m,) int64
        Whether the ranges of each sensor include the delay of the transponder, 1 or 0; empty where
        no delay is estimated. With delays the last column of the biases is that of the delay of
        each aircraft, with estimate 0 and variance 1: see `_delay_kernels`.
    """

    plane: Floats
    sites: Floats
    noises: Floats
    site_numbers: Integers
    starts: Integers
    parameters: Integers
    bias: Floats
    bias_covariance: Floats
    factor: Floats
    options: Floats
    modes: Floats
    delayed: Integers = NO_DELAYS


class Aircraft(NamedTuple):
    """The state of every aircraft of a shard.

    Attributes
    ----------
    mean : (s, 4) float64
        East, north (m) and their rates (m/s); at bias zero for the two-stage filter.
    covariance : (s, 10) float64
        Upper triangle of its covariance.
    sensitivity : (s, 4, c) float64
        Derivative of the mean by the biases; without columns for filters that do not use it.
    time : (s,) float64
        Data time of the state (rejected measurements advance it too), NaN for an aircraft that has
        not been initiated.
    height : (s,) float64
        Height, m, estimated from the reported heights; NaN without any.
    vertical : (s, VERTICAL_COUNT) float64
        Rate of climb, covariance of both, and bookkeeping of the height: see `_height_kernels`.
    rejections : (s,) int64
        Consecutive rejected measurements.
    updates : (s,) int64
        Measurements accepted since the aircraft was initiated.
    updated : (s,) float64
        Data time of the last accepted measurement, NaN before the first.
    measured_from : (s,) int64
        The one site (see `Model.site_numbers`) from which the aircraft has been measured, −1 before
        the first measurement, `SEVERAL` after more sites or an initial state from elsewhere.
    fading_nis : (s,) float64
        Fading mean of NIS/2: 1 where the motion follows the model.
    on_ground : (s,) int64
        Ground status as of the last accepted measurement: see `_ground_kernels`.
    velocity : (s, 2) float64
        Velocity at which time offsets are linearised, m/s east and north; NaN until it is known,
        and where no time offset is estimated.
    joint : (c + 4 s, c + 4 s) float64
        Covariance of the biases and all aircraft, in that order; without rows for filters that do
        not use it. Only the upper triangle of initiated aircraft is defined.
    recent : (s, m, RECENT_COUNT) float64
        Latest plot of each sensor in this epoch: time (s, NaN for none), both components, height
        (m), kind, and the factor of its noise; without sensors for filters that do not use it.
    mode_probability : (s, j) float64
        Probabilities of the modes of motion. The first is NaN before the second plot, while all
        modes are in the single state. Without columns for filters without modes, as the following.
    mode_mean : (s j, 4) float64
        As `mean`, of each mode; the modes of an aircraft are consecutive rows. `mean`, `covariance`
        and `sensitivity` are those of the mixture of the modes.
    mode_covariance : (s j, 10) float64
        As `covariance`, of each mode.
    mode_sensitivity : (s j, 4, c) float64
        As `sensitivity`, of each mode.
    slow : (s, SLOW_COUNT) float64
        Slow states of an aircraft that reports its motion: wind, magnetic variation and others, see
        `imm._slow_state_kernels`. The first is NaN before the first report. Without columns for
        filters without modes, as the following.
    slow_covariance : (s, SLOW_COUNT, SLOW_COUNT) float64
        Its covariance. `covariance` includes its effect, `mode_covariance` holds for known slow
        states.
    slow_sensitivity : (s j, 4, SLOW_COUNT) float64
        Derivative of `mode_mean` by the slow states.
    reported : (s, REPORTED_COUNT) float64
        The last report, and its bookkeeping.
    delay : (s, DELAY_BIASES + c) float64
        Delay of the transponder, m: its estimate at bias zero, its standard deviation given the
        biases (0 before the first measurement), and its sensitivity to them; see `_delay_kernels`.
        Without columns where no delay is estimated.
    """

    mean: Floats
    covariance: Floats
    sensitivity: Floats
    time: Floats
    height: Floats
    vertical: Floats
    rejections: Integers
    updates: Integers
    updated: Floats
    measured_from: Integers
    fading_nis: Floats
    on_ground: Integers
    velocity: Floats
    joint: Floats
    recent: Floats
    mode_probability: Floats
    mode_mean: Floats
    mode_covariance: Floats
    mode_sensitivity: Floats
    slow: Floats
    slow_covariance: Floats
    slow_sensitivity: Floats
    reported: Floats
    delay: Floats


class Sight(NamedTuple):
    """One measurement, with the height at which its aircraft is taken to be.

    Attributes
    ----------
    kind : int
        Kind of the measurement.
    z0, z1 : float
        Range (m) and azimuth (rad), or east and north (m).
    height, height_variance : float
        Height (m) and its variance (m²).
    """

    kind: int
    z0: float
    z1: float
    height: float
    height_variance: float


class BiasSums(NamedTuple):
    """Sums about the biases of a partition, written by its rows, and their scratch.

    Attributes
    ----------
    Y : (c, c) float64
        Information matrix.
    y : (c,) float64
        Information vector.
    U, R : (2, c) float64
        Scratch: sensitivity of a measurement to all biases, and S⁻¹ U.
    """

    Y: Floats
    y: Floats
    U: Floats
    R: Floats


class Work(NamedTuple):
    """Which rows to process, in which order.

    Attributes
    ----------
    partitions : (w,) int64
        The partitions to process, in this order.
    bounds : (p + 1,) int64
        Where each partition begins in `order`.
    order : (n,) int64
        Indices of rows, grouped by partition, in canonical order within each.
    """

    partitions: Integers
    bounds: Integers
    order: Integers


class Result(NamedTuple):
    """Output of a step.

    Attributes
    ----------
    information : (p, c, c) float64
        Sum of the information about the biases for each partition; its upper triangle is used.
    vector : (p, c) float64
        Sum of the information vector, for each partition.
    log : (n, LOG_COUNT) float64
        One row per measurement, for filters that update the biases measurement by measurement.
    outcome : (n,) int64
        Outcome of each measurement.
    readout : (n, READOUT_COUNT) float64
        State of the aircraft after it: see `_kernels.read_out`.
    innovation : (n, INNOVATION_COUNT) float64
        Innovation of each measurement, NaN in the first column without a comparison: see
        `_kernels.INNOVATION_COUNT`.
    """

    information: Floats
    vector: Floats
    log: Floats
    outcome: Integers
    readout: Floats
    innovation: Floats


@in_both
def partition_of(slots: Slots, partitions: int) -> Slots:
    """Return the partition of one or many slots.

    Parameters
    ----------
    slots : int or (n,) int64
        Indices in `Aircraft`.
    partitions : int
        How many partitions there are.

    Returns
    -------
    int or (n,) int64
        Number of the partition.
    """
    return slots // LINE_SLOTS % partitions


def line_aligned(
    shape: int | tuple[int, ...], value: float = 0.0, dtype: type = np.float64
) -> NDArray[Any]:
    """Return an array aligned to a pair of cache lines.

    Parameters
    ----------
    shape : int or tuple of int
        Its shape.
    value : float
        Initial value of all elements.
    dtype : type
        Type of its elements.

    Returns
    -------
    (*shape) ndarray
        The array.

    Notes
    -----
    Partitions assign slots by whole lines (`tracking.pool`). Without alignment nearly every line
    would hold slots of two workers (false sharing).
    """
    cells = math.prod(shape) if isinstance(shape, tuple) else shape
    size = cells * np.dtype(dtype).itemsize
    memory = np.zeros(size + LINES_BYTES, np.uint8)
    start = -memory.ctypes.data % LINES_BYTES
    array: NDArray[Any] = memory[start : start + size].view(dtype).reshape(shape)
    if value != 0.0:
        array[...] = value
    return array


def aircraft_arrays(
    slots: int,
    bias_columns: int,
    *,
    joint_columns: int | None = None,
    recent_sensors: int = 0,
    modes: int = 0,
    delays: bool = False,
) -> Aircraft:
    """Return arrays for aircraft, none of them initiated.

    Parameters
    ----------
    slots : int
        Number of aircraft.
    bias_columns : int
        Number of bias parameters in the sensitivity (0 for filters without).
    joint_columns : int or None
        Number of bias parameters in the joint covariance, None for filters without.
    recent_sensors : int
        Number of sensors whose latest plot of each aircraft is stored.
    modes : int
        Number of modes of motion, 0 for filters without.
    delays : bool
        Whether delays of transponders are estimated.

    Returns
    -------
    Aircraft
        The arrays.
    """
    joint = 0 if joint_columns is None else joint_columns + 4 * slots
    slow = SLOW_COUNT if modes else 0
    vertical = line_aligned((slots, VERTICAL_COUNT))
    vertical[:, GUESS] = np.nan
    return Aircraft(
        mean=line_aligned((slots, 4)),
        covariance=line_aligned((slots, 10)),
        sensitivity=line_aligned((slots, 4, bias_columns)),
        time=line_aligned(slots, np.nan),
        height=line_aligned(slots, np.nan),
        vertical=vertical,
        rejections=line_aligned(slots, 0, np.int64),
        updates=line_aligned(slots, 0, np.int64),
        updated=line_aligned(slots, np.nan),
        measured_from=line_aligned(slots, -1, np.int64),
        fading_nis=line_aligned(slots, 1.0),
        on_ground=line_aligned(slots, -1, np.int64),
        velocity=line_aligned((slots, 2), np.nan),
        joint=line_aligned((joint, joint)),
        recent=line_aligned((slots, recent_sensors, RECENT_COUNT), np.nan),
        mode_probability=line_aligned((slots, modes), np.nan),
        mode_mean=line_aligned((slots * modes, 4)),
        mode_covariance=line_aligned((slots * modes, 10)),
        mode_sensitivity=line_aligned((slots * modes, 4, bias_columns)),
        slow=line_aligned((slots, slow), np.nan),
        slow_covariance=line_aligned((slots, slow, slow)),
        slow_sensitivity=line_aligned((slots * modes, 4, slow)),
        reported=line_aligned((slots, REPORTED_COUNT if modes else 0), np.nan),
        delay=line_aligned((slots, DELAY_BIASES + bias_columns if delays else 0)),
    )


def result_arrays(
    rows: int, partitions: int, bias_columns: int, *, keeps_log: bool = True
) -> Result:
    """Return arrays for the output of a step.

    Parameters
    ----------
    rows : int
        Number of measurements.
    partitions : int
        Number of partitions.
    bias_columns : int
        Number of bias parameters.
    keeps_log : bool
        Whether the filter logs measurements.

    Returns
    -------
    Result
        The arrays, zero.
    """
    return Result(
        information=line_aligned((partitions, bias_columns, bias_columns)),
        vector=line_aligned((partitions, bias_columns)),
        log=line_aligned((rows if keeps_log else 0, LOG_COUNT)),
        outcome=line_aligned(rows, 0, np.int64),
        readout=line_aligned((rows, READOUT_COUNT)),
        innovation=line_aligned((rows, INNOVATION_COUNT)),
    )
