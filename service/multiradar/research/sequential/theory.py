"""The true error covariance of a filter, by the Joseph form with its actual gains."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import PriorError
from multiradar.estimation.array_checks import finite_array
from multiradar.research.sequential._theory_kernels import propagate
from multiradar.research.sequential.arrangement import Arrangement, Options
from multiradar.research.sequential.arrays import (
    Epoch,
    Record,
    Saved,
    TheoryRecord,
    TheoryScratch,
    Truth,
)
from multiradar.research.sequential.player import empty_record, prepared, record_times, walk_start
from multiradar.research.sequential.plots import Form, Plots, Starts, filter_rows
from multiradar.research.sequential.sensors import Sensors

Floats = NDArray[np.float64]

_PLAIN = Options()


@dataclass(frozen=True, slots=True)
class Theory:
    """True and reported error covariances of a filter.

    Attributes
    ----------
    covariance : (t, n, n) float64
        True covariance of the stacked error (1.8): four components of each aircraft, then all
        bias parameters.
    transition : (t, n, n) float64
        F: the contribution of the error at the previous time (at first: at the starts) to the
        present error; the rest is independent.
    reported : Record
        Estimates of the filter itself, linearised at the truth.
    """

    covariance: Floats
    transition: Floats
    reported: Record

    @property
    def aircraft(self) -> Floats:
        """True covariances of the aircraft, (t, s, 4, 4)."""
        slots = self.reported.mean.shape[1]
        blocks = [self.covariance[:, 4 * k : 4 * k + 4, 4 * k : 4 * k + 4] for k in range(slots)]
        return np.stack(blocks, axis=1)

    @property
    def biases(self) -> Floats:
        """True covariance of the biases, (t, c, c)."""
        first = 4 * self.reported.mean.shape[1]
        return self.covariance[:, first:, first:]


def true_covariance(
    name: str,
    sensors: Sensors,
    plots: Plots,
    starts: Starts,
    times_s: ArrayLike,
    *,
    truth: ArrayLike,
    form: Form = "polar",
    walk_s: float = 1.0,
    options: Options = _PLAIN,
    true_density: float | None = None,
    true_drift: ArrayLike | None = None,
) -> Theory:
    """Return the error covariance of a filter by (1.26), with its actual gains.

    Parameters
    ----------
    name, sensors, starts, times_s, form, walk_s, options
        See `multiradar.research.sequential.player.play`. The priors are assumed to be true.
    plots : Plots
        Times, aircraft and sensors of the plots; the values are not used.
    truth : (n, 4) array_like
        True state of the aircraft of each plot at its time.
    true_density : float, optional
        Spectral density of the true acceleration, m²/s³; by default that of the filter.
    true_drift : (c,) array_like, optional
        True drift of the biases after one second; by default that of the filter.

    Returns
    -------
    Theory
        True and reported covariances.

    Raises
    ------
    UnknownFilterError, ConfigurationError, ShapeError, TimeOrderError
        See `play`; `ShapeError` also if the truth or the drift have another shape.
    PriorError
        If the true density or a true drift is negative.

    Notes
    -----
    The filter is linearised at the truth: the result is exact for a linear filter and of first
    order for any other. The effect of linearising at wrong estimates is not included; a Monte
    Carlo simulation shows it.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.25), (1.26) and (1.27); the noise term of (1.26) is
    K D W Dᵀ Kᵀ.
    """
    times = record_times(times_s, starts)
    states = finite_array(truth, "true states", (len(plots), 4))
    known = sensors.prior.drift
    drift = finite_array(known if true_drift is None else true_drift, "true drift", known.shape)
    density = options.acceleration_density if true_density is None else true_density
    if not (density >= 0.0 and (drift >= 0.0).all()):
        raise PriorError(f"truth: expected noise of at least 0, was {density} and {drift.tolist()}")
    rows = filter_rows(plots, sensors, starts, form)
    one = prepared(name, sensors, starts, options, len(plots))
    one.model.bias[:] = 0.0
    _linearise_lateness(one, plots, states)
    twin = one.definition.aircraft(len(starts), len(drift), len(sensors), 1)
    covariance = _first_covariance(sensors, starts)
    epoch = _epoch(len(sensors), covariance.shape[0], len(drift))
    written = TheoryRecord(
        np.empty((len(times), *covariance.shape)),
        np.empty((len(times), *covariance.shape)),
        empty_record(len(times), len(starts), len(drift)),
    )
    propagate(
        one.definition.method, walk_start(starts, walk_s), walk_s, times,
        Truth(states, density, drift), one.work, rows, one.model, one.aircraft, one.result,
        one.store, TheoryScratch(twin, _saved(one), epoch), covariance, written,
    )  # fmt: skip
    return Theory(*written)


def _first_covariance(sensors: Sensors, starts: Starts) -> Floats:
    first = 4 * len(starts)
    size = first + len(sensors.prior.mean)
    covariance = np.zeros((size, size))
    for slot, block in enumerate(starts.covariance):
        covariance[4 * slot : 4 * slot + 4, 4 * slot : 4 * slot + 4] = block
    covariance[first:, first:] = sensors.prior.covariance
    return covariance


# Time offsets are linearised at the initial velocity; here at the true one, like all else.
def _linearise_lateness(one: Arrangement, plots: Plots, states: Floats) -> None:
    slots, rows = np.unique(plots.aircraft, return_index=True)
    known = ~np.isnan(one.aircraft.velocity[slots, 0])
    one.aircraft.velocity[slots[known]] = states[rows[known], 2:]


def _saved(one: Arrangement) -> Saved:
    return Saved(*(np.zeros_like(one.model.bias_covariance) for _ in range(3)))


def _epoch(sensors: int, size: int, biases: int) -> Epoch:
    # A sensor measures an aircraft at most once in an epoch.
    return Epoch(
        value=np.zeros((sensors, 2)),
        probe=np.zeros((sensors, 2)),
        by_position=np.zeros((sensors, 2, 2)),
        by_bias=np.zeros((sensors, 2, biases)),
        noise=np.zeros((sensors, 3)),
        gain=np.zeros((2 * sensors, size)),
        spread=np.zeros((2 * sensors, size)),
        half=np.zeros((2 * sensors, size)),
    )
