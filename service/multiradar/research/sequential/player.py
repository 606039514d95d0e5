"""Runs the measurements of a scenario through one filter, one measurement per epoch."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ConfigurationError
from multiradar.estimation.array_checks import ascending_times, require_shape
from multiradar.estimation.filters.bank import Outcome
from multiradar.research.sequential._player_kernels import play_rows
from multiradar.research.sequential.arrangement import Arrangement, Options, arrange, initiate
from multiradar.research.sequential.arrays import Record
from multiradar.research.sequential.plots import Form, Plots, Starts, filter_rows
from multiradar.research.sequential.sensors import Sensors

Floats = NDArray[np.float64]

_PLAIN = Options()


def play(
    name: str,
    sensors: Sensors,
    plots: Plots,
    starts: Starts,
    times_s: ArrayLike,
    *,
    form: Form = "polar",
    walk_s: float = 1.0,
    options: Options = _PLAIN,
) -> Record:
    """Run plots through a filter and record its estimates at given times.

    Parameters
    ----------
    name : str
        `joint`, `two-stage`, `blom`, `blom-macro` or `ci`.
    sensors : Sensors
        The sensors and the prior of their biases.
    plots : Plots
        The measurements.
    starts : Starts
        Initial states of the aircraft.
    times_s : (t,) array_like
        Recording times, ascending; plots after the last are not used.
    form : {"polar", "linearised"}
        Treatment of plots of flat radars.
    walk_s : float
        Step of the bias walk, counted from the earliest start, s.
    options : Options
        Process noise and gates; by default neither.

    Returns
    -------
    Record
        Aircraft, predicted to each of the times, and biases; and the number of plots by outcome, as
        `record.outcomes[Outcome.SINGULAR]`.

    Raises
    ------
    UnknownFilterError
        If there is no filter of that name.
    ConfigurationError
        If the form is unknown, or the step of the bias walk is not positive.
    ShapeError
        If a plot is of an aircraft without a start, or of an unknown sensor.
    TimeOrderError
        If the times go back, or an aircraft is measured or recorded before its start.

    Notes
    -----
    An epoch is one measurement, applied to the biases at once; for the macro-filter it is the
    simultaneous plots of one aircraft. The kernels are those of the service.

    References
    ----------
    IMM UrO RAN report (2016), sections 1.2 to 1.5.
    """
    times = record_times(times_s, starts)
    rows = filter_rows(plots, sensors, starts, form)
    one = prepared(name, sensors, starts, options, len(plots))
    count = len(sensors.prior.mean)
    record = empty_record(len(times), len(starts), count)
    played = int(np.searchsorted(plots.time_s, times[-1:].max(initial=-np.inf), "right"))
    play_rows(
        one.definition.method, walk_start(starts, walk_s), walk_s, times, one.work, rows,
        one.model, one.aircraft, one.result, one.store, record,
    )  # fmt: skip
    record.outcomes[:] = np.bincount(one.result.outcome[:played], minlength=len(Outcome))
    return record


def prepared(
    name: str, sensors: Sensors, starts: Starts, options: Options, rows: int
) -> Arrangement:
    """Return a filter with all aircraft initiated, for a given number of rows.

    Parameters
    ----------
    name : str
        `joint`, `two-stage`, `blom`, `blom-macro` or `ci`.
    sensors : Sensors
        The sensors and the prior of their biases.
    starts : Starts
        The aircraft; the number of each is its slot.
    options : Options
        Process noise and gates.
    rows : int
        Maximum number of plots.

    Returns
    -------
    Arrangement
        The arrays of the filter, before the first plot.

    Raises
    ------
    UnknownFilterError
        If there is no filter of that name.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.24): the state before the first measurement.
    """
    one = arrange(name, sensors, options, slots=len(starts), rows=rows)
    for slot in range(len(starts)):
        initiate(one, slot, starts.time_s[slot], starts.mean[slot], starts.covariance[slot])
    return one


def empty_record(times: int, aircraft: int, biases: int) -> Record:
    """Return empty arrays for the estimates of a filter.

    Parameters
    ----------
    times, aircraft, biases : int
        Numbers t, s and c.

    Returns
    -------
    Record
        Arrays of NaN, and outcomes of zero.
    """
    return Record(
        mean=np.full((times, aircraft, 4), np.nan),
        covariance=np.full((times, aircraft, 4, 4), np.nan),
        bias=np.full((times, biases), np.nan),
        bias_covariance=np.full((times, biases, biases), np.nan),
        outcomes=np.zeros(len(Outcome), np.int64),
    )


def record_times(times_s: ArrayLike, starts: Starts) -> Floats:
    """Return checked recording times, at which all aircraft are known.

    Parameters
    ----------
    times_s : (t,) array_like
        Times, ascending, s.
    starts : Starts
        The aircraft.

    Returns
    -------
    (t,) float64
        The same times, s.

    Raises
    ------
    ShapeError
        If they are not one-dimensional.
    TimeOrderError
        If they go back, one is not finite, or the first is before a start.
    """
    return ascending_times(times_s, "output time", float(starts.time_s.max(initial=-np.inf)))


def walk_start(starts: Starts, walk_s: float) -> float:
    """Return the start time of the bias walk.

    Parameters
    ----------
    starts : Starts
        The aircraft.
    walk_s : float
        Step of the bias walk, s.

    Returns
    -------
    float
        The earliest start, s; +inf where there is none.

    Raises
    ------
    ConfigurationError
        If the step is not above 0, or not finite.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.6), discretised in steps; the start time is the
    project's own.
    """
    walk_s = float(require_shape(walk_s, "interval of the random walk", ()))
    if not 0.0 < walk_s < np.inf:
        raise ConfigurationError(
            f"interval of the random walk: expected more than 0 s, was {walk_s}"
        )
    return float(starts.time_s.min(initial=np.inf))
