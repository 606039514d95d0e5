"""The arrays that the compiled filters work on, bundled by their owner.

Named tuples, because compiled functions take them as they are. All arrays of `Aircraft` belong to
one shard and are changed in place by its kernels (the one exception to frozen states).
"""

from typing import Any, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import INNOVATION_COUNT, LOG_COUNT, READOUT_COUNT
from multiradar.estimation.filters.height._height_kernels import GUESS, VERTICAL_COUNT
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

#: Processors fetch lines of 64 bytes in pairs.
LINES_BYTES = 128
#: So many slots in a row share a partition: states of a number each fill a pair of cache lines,
#: which two workers would take from each other at every plot.
LINE_SLOTS = LINES_BYTES // 8

Slots = TypeVar("Slots", int, Integers)


class Rows(NamedTuple):
    """Measurements in canonical order.

    Attributes
    ----------
    slot : (n,) int64
        Place of the aircraft in `Aircraft`, negative for none (see `_kernels`).
    time : (n,) float64
        Data time, s; never going back for one aircraft.
    kind, sensor : (n,) int64
        Kind of the measurement and index of the sensor.
    z : (n, 2) float64
        Range (m) and azimuth (rad), or east and north (m).
    height : (n,) float64
        Measured height, m, NaN when there is none.
    seen : (n,) int64
        Row of `Model.sites` and `noises`, and place in `starts`: the index of the sensor, but for
        what has a place or a noise of its own (`multiradar.tracking.bearings.sources`).
    """

    slot: Integers
    time: Floats
    kind: Integers
    sensor: Integers
    z: Floats
    height: Floats
    seen: Integers


class Model(NamedTuple):
    """What all aircraft share: the plane, the sensors, the published biases, the options.

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
        Number of the place of each sensor: radars on one site share it.
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
        The options, at the places named in `_kernels`.
    modes : (j, MODE_COUNT) float64
        How an aircraft may move, for the filter of interacting modes: columns as in
        `_mode_scratch_kernels`. One row at least.
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


class Aircraft(NamedTuple):
    """The state of every aircraft of a shard.

    Attributes
    ----------
    mean : (s, 4) float64
        East, north (m) and their rates (m/s); at bias zero for the two-stage filter.
    covariance : (s, 10) float64
        Upper triangle of its covariance.
    sensitivity : (s, 4, c) float64
        Derivative of the mean by the biases; without columns for filters that do not keep it.
    time : (s,) float64
        Data time of the state (a refused measurement moves it too), NaN for an aircraft that has
        not started.
    height : (s,) float64
        Height, m, by those that were heard; NaN when none was.
    vertical : (s, VERTICAL_COUNT) float64
        Rate of climb, covariance of both, and the books of the height: see `_height_kernels`.
    rejections : (s,) int64
        Measurements refused in a row.
    updates : (s,) int64
        Measurements taken since the aircraft started.
    updated : (s,) float64
        Data time of the last measurement that was taken, NaN before the first.
    measured_from : (s,) int64
        The one site (see `Model.site_numbers`) from which the aircraft has been measured, −1 before
        the first measurement, `SEVERAL` after more sites or an initial state from elsewhere.
    fading_nis : (s,) float64
        Fading mean of half the normalised innovation squared: 1 where the motion is as modelled.
    velocity : (s, 2) float64
        Velocity at which time offsets are linearised, m/s east and north; NaN until it is known,
        and where no time offset is estimated.
    joint : (c + 4 s, c + 4 s) float64
        Covariance of the biases and all aircraft, in that order; without rows for filters that do
        not keep it. Only the upper triangle of what has started means anything.
    recent : (s, m, RECENT_COUNT) float64
        Latest plot of each sensor in this epoch: time (s, NaN for none), both components, height
        (m), kind, and by how much its noise was taken for more; without sensors for filters that do
        not keep it.
    mode_probability : (s, j) float64
        Probabilities of the modes of motion, the first NaN until the second plot: then all modes
        are in the one state; without columns for filters without modes, and so the next.
    mode_mean : (s j, 4) float64
        As `mean`, of each mode; the modes of an aircraft follow each other. `mean`, `covariance`
        and `sensitivity` are those of the modes as a whole.
    mode_covariance : (s j, 10) float64
        As `covariance`, of each mode.
    mode_sensitivity : (s j, 4, c) float64
        As `sensitivity`, of each mode.
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
    velocity: Floats
    joint: Floats
    recent: Floats
    mode_probability: Floats
    mode_mean: Floats
    mode_covariance: Floats
    mode_sensitivity: Floats


class Work(NamedTuple):
    """Which rows to take, in which order.

    Attributes
    ----------
    partitions : (w,) int64
        The partitions to work through, in this order.
    bounds : (p + 1,) int64
        Where each partition begins in `order`.
    order : (n,) int64
        Indices of rows, grouped by partition, in canonical order within each.
    """

    partitions: Integers
    bounds: Integers
    order: Integers


class Result(NamedTuple):
    """What a step puts out.

    Attributes
    ----------
    information : (p, c, c) float64
        Sum of the information about the biases for each partition; its upper triangle counts.
    vector : (p, c) float64
        Sum of the information vector, for each partition.
    log : (n, LOG_COUNT) float64
        One row a measurement, for filters that fold measurements into the biases one by one.
    outcome : (n,) int64
        What became of each measurement.
    readout : (n, READOUT_COUNT) float64
        State of the aircraft after it: see `_kernels.read_out`.
    innovation : (n, INNOVATION_COUNT) float64
        How it differed from what was expected, NaN in the first column where nothing was compared:
        see `_kernels.INNOVATION_COUNT`.
    """

    information: Floats
    vector: Floats
    log: Floats
    outcome: Integers
    readout: Floats
    innovation: Floats


@in_both
def partition_of(slots: Slots, partitions: int) -> Slots:
    """Return the partition of a slot, or those of many.

    Parameters
    ----------
    slots : int or (n,) int64
        Places in `Aircraft`.
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
    """Return an array that begins where a pair of cache lines does.

    Parameters
    ----------
    shape : int or tuple of int
        Its shape.
    value : float
        What it is filled with.
    dtype : type
        Type of its elements.

    Returns
    -------
    (*shape) ndarray
        The array.

    Notes
    -----
    Partitions deal slots out by whole lines (`tracking.pool`). NumPy's arrays begin anywhere, so
    that nearly every line would hold slots of two workers, which take it from each other.
    """
    size = int(np.prod(shape)) * np.dtype(dtype).itemsize
    room = np.zeros(size + LINES_BYTES, np.uint8)
    start = -room.ctypes.data % LINES_BYTES
    array: NDArray[Any] = room[start : start + size].view(dtype).reshape(shape)
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
) -> Aircraft:
    """Return room for aircraft, none of which has started.

    Parameters
    ----------
    slots : int
        For how many.
    bias_columns : int
        Number of bias parameters that each depends on (0 for filters that drop it).
    joint_columns : int or None
        Number of bias parameters in the joint covariance, None for filters that keep none.
    recent_sensors : int
        Number of sensors whose latest plot of each aircraft is kept.
    modes : int
        Number of modes of motion, 0 for filters without.

    Returns
    -------
    Aircraft
        The arrays.
    """
    joint = 0 if joint_columns is None else joint_columns + 4 * slots
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
        velocity=line_aligned((slots, 2), np.nan),
        joint=line_aligned((joint, joint)),
        recent=line_aligned((slots, recent_sensors, RECENT_COUNT), np.nan),
        mode_probability=line_aligned((slots, modes), np.nan),
        mode_mean=line_aligned((slots * modes, 4)),
        mode_covariance=line_aligned((slots * modes, 10)),
        mode_sensitivity=line_aligned((slots * modes, 4, bias_columns)),
    )


def result_arrays(
    rows: int, partitions: int, bias_columns: int, *, keeps_log: bool = True
) -> Result:
    """Return room for what a step puts out.

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
