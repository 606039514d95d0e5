"""The same plots through other packages, one object per aircraft, without biases.

FilterPy and Stone Soup take one plot after the other, as their users write it: a prediction to the
time of the plot, a correction by range and azimuth. Both get range, azimuth and their derivatives
from the function that also serves ours; Stone Soup, as it is, takes derivatives by differences, and
is run both ways.
"""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from time import perf_counter
from typing import Any

import numpy as np
from filterpy.kalman import ExtendedKalmanFilter
from numpy.typing import NDArray
from stonesoup.base import Property
from stonesoup.models.measurement.nonlinear import NonLinearGaussianMeasurement
from stonesoup.models.transition.linear import (
    CombinedLinearGaussianTransitionModel,
    ConstantVelocity,
)
from stonesoup.predictor.kalman import ExtendedKalmanPredictor
from stonesoup.types.angle import Bearing
from stonesoup.types.array import CovarianceMatrix, StateVector, StateVectors
from stonesoup.types.detection import Detection
from stonesoup.types.hypothesis import SingleHypothesis
from stonesoup.types.state import GaussianState
from stonesoup.updater.kalman import ExtendedKalmanUpdater

from benchmark.scenes.load import Load
from multiradar.estimation.filters.arrays import Rows
from multiradar.geodesy._kernels import predict_polar, site_parameters
from support.references.constant_velocity import process_noise, transition

Floats = NDArray[np.float64]
#: Range, azimuth, and their derivatives by east and north, seen from a radar.
Polar = Callable[[int, float, float], tuple[float, ...]]

#: A plot costs tens or hundreds of microseconds there: this number of aircraft is enough.
FILTERPY_AIRCRAFT, STONE_SOUP_AIRCRAFT = 60, 15
FILTERPY, STONE_SOUP = "FilterPy's extended Kalman filter", "Stone Soup's extended Kalman filter"
STONE_SOUP_EXACT = f"{STONE_SOUP} with exact derivatives"
RANGE_SIGMA_M, AZIMUTH_SIGMA_RAD = 40.0, 0.001
ACCELERATION_DENSITY = 4.0
#: Indices of east, north and their rates in the states of Stone Soup, which pair each axis.
_PAIRED = np.ix_([0, 2, 1, 3], [0, 2, 1, 3])


def filterpy_nanoseconds(load: Load) -> float:
    """Time FilterPy over the plots of a few aircraft of a load."""
    return run_filterpy(peer_plots(load, FILTERPY_AIRCRAFT)).nanoseconds


def stone_soup_nanoseconds(load: Load) -> float:
    """Time Stone Soup, as it is, over the plots of a few aircraft of a load."""
    return run_stone_soup_default(peer_plots(load, STONE_SOUP_AIRCRAFT)).nanoseconds


@dataclass(frozen=True)
class PeerPlots:
    """Plots of several aircraft and their initial states.

    Attributes
    ----------
    rows : Rows
        The plots in the order of their times.
    polar : callable
        What a radar sees of a place.
    mean, covariance : (s, 4), (4, 4) float64
        Prior of each aircraft at `start_s`: east, north (m) and their rates (m/s).
    """

    rows: Rows
    polar: Polar
    mean: Floats
    covariance: Floats
    start_s: float = 0.0


@dataclass(frozen=True)
class PeerRun:
    """Result of a filter: states (n, 4) and covariances (n, 4, 4) after each plot; CPU time."""

    mean: Floats
    covariance: Floats
    nanoseconds: float


def peer_plots(load: Load, aircraft: int) -> PeerPlots:
    """Return the plots of the first aircraft of a load, with wide priors at initial states."""
    plane = load.plane.parameters
    sites = [
        site_parameters(plane, latitude, longitude, height)
        for latitude, longitude, height in zip(
            load.sensors.latitude_rad, load.sensors.longitude_rad, load.sensors.height_m,
            strict=True,
        )
    ]  # fmt: skip
    height = float(load.rows.height[0])

    def polar(radar: int, east: float, north: float) -> tuple[float, ...]:
        return predict_polar(plane, sites[radar], east, north, height)[:6]

    rows = load.rows
    chosen = np.flatnonzero(rows.slot < aircraft)
    aircraft = min(aircraft, len(load.position))
    few = Rows(
        rows.slot[chosen], rows.time[chosen], rows.kind[chosen], rows.sensor[chosen],
        rows.z[chosen], rows.height[chosen], rows.seen[chosen],
        rows.ground[chosen],
    )  # fmt: skip
    start = np.hstack([load.position[:aircraft], np.zeros((aircraft, 2))])
    return PeerPlots(few, polar, start, np.diag([1e6, 1e6, 1e5, 1e5]))


def run_filterpy(plots: PeerPlots) -> PeerRun:
    """Process all plots with FilterPy."""
    rows = plots.rows
    filters: list[ExtendedKalmanFilter] = []
    for mean in plots.mean:
        one = ExtendedKalmanFilter(dim_x=4, dim_z=2)
        one.x, one.P = mean.copy(), plots.covariance.copy()
        filters.append(one)
    noise = np.diag([RANGE_SIGMA_M**2, AZIMUTH_SIGMA_RAD**2])
    last = [plots.start_s] * len(filters)
    means, covariances = [], []
    begin = perf_counter()
    for slot, time, sensor, z in zip(rows.slot, rows.time, rows.sensor, rows.z, strict=True):
        one = filters[slot]
        interval, last[slot] = time - last[slot], time
        one.F, one.Q = transition(interval), process_noise(interval, ACCELERATION_DENSITY)
        one.predict()
        seen = plots.polar(sensor, one.x[0], one.x[1])
        jacobian = np.array([[seen[2], seen[3], 0.0, 0.0], [seen[4], seen[5], 0.0, 0.0]])
        one.update(
            z, lambda _, j=jacobian: j, lambda _, s=seen: np.array(s[:2]), R=noise,
            residual=_residual,
        )  # fmt: skip
        means.append(one.x)
        covariances.append(one.P)
    spent = perf_counter() - begin
    return PeerRun(np.array(means), np.array(covariances), spent / len(means) * 1e9)


def run_stone_soup(plots: PeerPlots) -> PeerRun:
    """Process all plots with Stone Soup and analytical derivatives."""
    return _run_stone_soup(plots, [ExactPlotModel(*given) for given in _models(plots)])


def run_stone_soup_default(plots: PeerPlots) -> PeerRun:
    """Process all plots with unmodified Stone Soup: numerical derivatives."""
    return _run_stone_soup(plots, [PlotModel(*given) for given in _models(plots)])


def _models(plots: PeerPlots) -> list[tuple[object, ...]]:
    noise = CovarianceMatrix(np.diag([RANGE_SIGMA_M**2, AZIMUTH_SIGMA_RAD**2]))
    radars = range(int(plots.rows.sensor.max()) + 1)
    return [(4, (0, 2), noise, plots.polar, radar) for radar in radars]


# Its states are east, its rate, north, its rate.
def _run_stone_soup(plots: PeerPlots, models: "list[PlotModel]") -> PeerRun:
    rows, epoch = plots.rows, datetime(2026, 1, 1, tzinfo=UTC)
    axis = ConstantVelocity(ACCELERATION_DENSITY)
    predictor = ExtendedKalmanPredictor(CombinedLinearGaussianTransitionModel([axis, axis]))
    updater = ExtendedKalmanUpdater(None)
    # Its times are calendar times with a resolution of 1 µs.
    start = epoch + timedelta(seconds=plots.start_s)
    states = [
        GaussianState(mean[[0, 2, 1, 3]], plots.covariance[_PAIRED], start) for mean in plots.mean
    ]
    found = []
    begin = perf_counter()
    for slot, time, sensor, z in zip(rows.slot, rows.time, rows.sensor, rows.z, strict=True):
        model, at = models[sensor], epoch + timedelta(seconds=time)
        plot = Detection(StateVector([z[0], Bearing(z[1])]), at, measurement_model=model)
        prediction = predictor.predict(states[slot], timestamp=at)
        states[slot] = updater.update(SingleHypothesis(prediction, plot))
        found.append(states[slot])
    spent = perf_counter() - begin
    mean = np.array([np.asarray(one.state_vector, np.float64)[[0, 2, 1, 3], 0] for one in found])
    covariance = np.array([np.asarray(one.covar, np.float64)[_PAIRED] for one in found])
    return PeerRun(mean, covariance, spent / len(found) * 1e9)


class PlotModel(NonLinearGaussianMeasurement):  # type: ignore[misc]  # Stone Soup has no types.
    """Range and azimuth from a radar; Stone Soup computes numerical derivatives."""

    polar: Polar = Property(doc="What a radar sees of a place")
    radar: int = Property(doc="Which radar")

    @property
    def ndim_meas(self) -> int:
        return 2

    def function(self, state: Any, noise: object = False, **_given: object) -> StateVectors:
        """Return range and azimuth of one state, or of several side by side."""
        if noise is not False:
            raise ValueError(f"noise: expected none, was {noise!r}")
        seen = [self.seen(column) for column in np.asarray(state.state_vector).T]
        made = StateVector if len(seen) == 1 else StateVectors
        return made([[one[0] for one in seen], [Bearing(one[1]) for one in seen]])

    def seen(self, state: Floats) -> tuple[float, ...]:
        """Return range, azimuth and their derivatives."""
        return self.polar(self.radar, float(state[0]), float(state[2]))


class ExactPlotModel(PlotModel):
    """The same with derivatives in closed form."""

    def jacobian(self, state: Any, **_given: object) -> Floats:
        """Return the derivatives by east, its rate, north, its rate."""
        seen = self.seen(np.asarray(state.state_vector)[:, 0])
        return np.array([[seen[2], 0.0, seen[3], 0.0], [seen[4], 0.0, seen[5], 0.0]])


def _residual(seen: Floats, expected: Floats) -> Floats:
    difference = seen - expected
    difference[1] = (difference[1] + np.pi) % (2.0 * np.pi) - np.pi
    return difference
