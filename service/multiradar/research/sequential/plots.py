"""Measurements of a scenario and initial states of its aircraft, as input of the player."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ConfigurationError, ShapeError, TimeOrderError
from multiradar.estimation.array_checks import finite_array, require_shape
from multiradar.estimation.filters.arrays import Rows
from multiradar.estimation.gaussian import require_covariance
from multiradar.estimation.measurement.kinds import KIND_FLAT_POLAR, KIND_FLAT_POSITION, KIND_RADAR
from multiradar.estimation.measurement.linearised import cartesian_plot
from multiradar.research.sequential.sensors import Sensors

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Treatment of a flat plot: range and azimuth, or a linearised position, (1.11).
Form = Literal["polar", "linearised"]
FORMS: tuple[Form, ...] = ("polar", "linearised")


@dataclass(frozen=True, slots=True)
class Plots:
    """Measurements in order of processing; a sensor measures an aircraft once at a time.

    Parameters
    ----------
    time_s : (n,) array_like
        Times, never going back.
    aircraft, sensor : (n,) array_like of int
        Measured aircraft, counted from 0, and measuring sensor.
    value : (n, 2) array_like
        Range (m) and azimuth (rad); east and north (m) for sensors that report positions.
    height_m : (n,) array_like, optional
        Heights above the ellipsoid, NaN if unknown; by default all unknown. Only plots of radars on
        WGS 84 need them, because a slant range without height gives no position.

    Raises
    ------
    ShapeError
        If the columns differ in length or are not finite, or a sensor measures an aircraft twice at
        one time.
    TimeOrderError
        If a time goes back.
    """

    time_s: Floats
    aircraft: Integers
    sensor: Integers
    value: Floats
    height_m: Floats

    def __init__(
        self,
        time_s: ArrayLike,
        aircraft: ArrayLike,
        sensor: ArrayLike,
        value: ArrayLike,
        height_m: ArrayLike | None = None,
    ) -> None:
        times = finite_array(time_s, "plot times", (None,))
        back = np.flatnonzero(np.diff(times) < 0.0)
        if len(back):
            row = int(back[0])
            raise TimeOrderError("plot", float(times[row + 1]), float(times[row]))
        count = len(times)
        values = finite_array(value, "plot values", (count, 2))
        heights = np.full(count, np.nan) if height_m is None else height_m
        heights = require_shape(heights, "plot heights", (count,)).copy()
        if np.isinf(heights).any():
            raise ShapeError("plot heights", "finite numbers or NaN", heights.shape)
        aircraft_rows, sensor_rows = (
            _indices(column, count, f"plot {what}")
            for column, what in ((aircraft, "aircraft"), (sensor, "sensors"))
        )
        _require_once_at_a_time(times, aircraft_rows, sensor_rows)
        object.__setattr__(self, "time_s", times)
        object.__setattr__(self, "aircraft", aircraft_rows)
        object.__setattr__(self, "sensor", sensor_rows)
        object.__setattr__(self, "value", values)
        object.__setattr__(self, "height_m", heights)

    def __len__(self) -> int:
        return len(self.time_s)


@dataclass(frozen=True, slots=True)
class Starts:
    """Initial states of the aircraft.

    Parameters
    ----------
    time_s : (s,) array_like
        Times of the states.
    mean : (s, 4) array_like
        East, north (m) and their rates (m/s).
    covariance : (s, 4, 4) array_like
        Covariances of their errors.

    Raises
    ------
    ShapeError
        If the shapes do not match, or there are non-finite numbers.
    CovarianceError
        If a covariance is not symmetric or not positive definite.
    """

    time_s: Floats
    mean: Floats
    covariance: Floats

    def __init__(self, time_s: ArrayLike, mean: ArrayLike, covariance: ArrayLike) -> None:
        times = finite_array(time_s, "start times", (None,))
        means = finite_array(mean, "start states", (len(times), 4))
        matrices = require_shape(covariance, "start covariances", (len(times), 4, 4))
        require_covariance(matrices, "start covariances")
        object.__setattr__(self, "time_s", times)
        object.__setattr__(self, "mean", means)
        object.__setattr__(self, "covariance", matrices)

    def __len__(self) -> int:
        return len(self.time_s)


def filter_rows(plots: Plots, sensors: Sensors, starts: Starts, form: Form) -> Rows:
    """Return the plots as rows of the kernels.

    Parameters
    ----------
    plots : Plots
        The measurements.
    sensors : Sensors
        The sensors.
    starts : Starts
        The aircraft.
    form : {"polar", "linearised"}
        Treatment of plots of flat radars.

    Returns
    -------
    Rows
        The rows.

    Raises
    ------
    ConfigurationError
        If the form is unknown.
    ShapeError
        If a plot is of an aircraft without a start, or of an unknown sensor, or one of a radar on
        WGS 84 has no height.
    TimeOrderError
        If an aircraft is measured before its start.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.10) and (1.11).
    """
    if form not in FORMS:
        raise ConfigurationError(f"form: expected one of {', '.join(FORMS)}, was {form!r}")
    for values, known, what in (
        (plots.aircraft, len(starts), "plot aircraft"),
        (plots.sensor, len(sensors), "plot sensors"),
    ):
        if len(values) and not int(values.max()) < known:
            raise ShapeError(what, f"indices below {known}", (int(values.max()),))
    early = np.flatnonzero(plots.time_s < starts.time_s[plots.aircraft])
    if len(early):
        row = int(early[0])
        start_s = float(starts.time_s[plots.aircraft[row]])
        raise TimeOrderError("plot of an aircraft", float(plots.time_s[row]), start_s)
    kind = sensors.kind[plots.sensor]
    if np.isnan(plots.height_m[kind == KIND_RADAR]).any():
        what = "plot heights"
        raise ShapeError(what, "a height for every plot of a WGS 84 radar", plots.height_m.shape)
    value = plots.value.copy()
    if form == "linearised":
        flat = kind == KIND_FLAT_POLAR
        sites = sensors.sites[plots.sensor[flat], :2]
        value[flat] = cartesian_plot(sites, *plots.value[flat].T)
        # A negative range is not a position on the other side of the radar.
        value[flat & (plots.value[:, 0] < 0.0)] = np.nan
        kind = np.where(flat, KIND_FLAT_POSITION, kind)
    unknown = np.full(len(kind), -1, np.int64)
    return Rows(
        plots.aircraft, plots.time_s, kind, plots.sensor, value, plots.height_m, plots.sensor,
        unknown,
    )  # fmt: skip


# An epoch holds one plot of each sensor.
def _require_once_at_a_time(times: Floats, aircraft: Integers, sensors: Integers) -> None:
    order = np.lexsort((sensors, aircraft, times))
    same = [np.diff(column[order]) == 0 for column in (times, aircraft, sensors)]
    twice = np.flatnonzero(np.logical_and.reduce(same))
    if len(twice):
        row = int(order[twice[0]])
        what = f"plots of aircraft {aircraft[row]} at {times[row]} s"
        raise ShapeError(what, "at most one plot per sensor at any time", times.shape)


def _indices(values: ArrayLike, count: int, what: str) -> Integers:
    try:
        array = np.asarray(values)
    except ValueError as error:
        raise ShapeError(what, f"({count},) integers", (), "rows of unequal length") from error
    if array.shape != (count,) or not np.issubdtype(array.dtype, np.integer):
        found = f"of shape {array.shape} and type {array.dtype}"
        raise ShapeError(what, f"({count},) integers", array.shape, found)
    if count and int(array.min()) < 0:
        raise ShapeError(what, "indices of 0 or more", array.shape)
    return array.astype(np.int64)
