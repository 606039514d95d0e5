"""Forecast methods by name."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import TrajectoryError
from multiradar.runtime.queries.parameters import BUNDLE, FILTER, POLYNOMIAL
from multiradar.runtime.queries.polynomial_forecasts import LastPlots
from multiradar.runtime.trajectories.ensemble_paths import EnsemblePath, ensemble_path
from multiradar.runtime.trajectories.pool import Reading
from multiradar.tracking.forecast.forecast_calibration import ForecastCalibration
from multiradar.tracking.forecast.region_sizes import Plan
from multiradar.tracking.forecast.regions import gaussian_factor
from multiradar.tracking.outputs import TrackStates

Floats = NDArray[np.float64]


class Known(NamedTuple):
    """Input of a forecast of a track.

    Attributes
    ----------
    states : TrackStates
        Filter states, in the system plane.
    row : int
        Index of the track's state.
    calibration : ForecastCalibration
        Calibration of the motions of the filter.
    bundle : callable
        Returns the bundle of the track, or raises a TrajectoryError.
    plots : callable
        Returns the last plots of the track, None where there are none, or raises a TrajectoryError.
    """

    states: TrackStates
    row: int
    calibration: ForecastCalibration
    bundle: Callable[[], Reading]
    plots: Callable[[], LastPlots | None]


class PredictedPath(NamedTuple):
    """Predicted path of a track.

    Attributes
    ----------
    means : (k, 2) float64
        East and north in the system plane, m.
    covariances : (k, 2, 2) float64
        m².
    factors : (k,) float64
        The region of the requested probability is {x : (x − m)ᵀ C⁻¹ (x − m) ≤ factor}.
    calibrated : (k,) bool
        Whether the region is calibrated by earlier forecasts of that horizon.
    motion : str
        Name of the motion model.
    ensemble : EnsemblePath, optional
        Ensemble with its members, if any.
    """

    means: Floats
    covariances: Floats
    factors: Floats
    calibrated: NDArray[np.bool_]
    motion: str
    ensemble: EnsemblePath | None = None


#: Forecasts a track at times after its state, s.
Method = Callable[[Known, Floats], PredictedPath]
#: The same with the probability of the regions as first argument.
Regional = Callable[[float, Known, Floats], PredictedPath]


def by_filter(probability: float, known: Known, ahead_s: Floats) -> PredictedPath:
    """Forecast with the best-scoring motion and regions calibrated by past errors."""
    return by_plan(known, ahead_s, known.calibration.scores.plan(ahead_s, probability))


def by_plan(known: Known, ahead_s: Floats, plan: Plan) -> PredictedPath:
    """Forecast with a motion of the filter and the regions of a plan."""
    found = known.calibration.forecast_by(plan, known.states, known.row, ahead_s)
    return PredictedPath(*found, plan.calibrated, known.calibration.family.names[plan.motion])


def by_bundle(probability: float, known: Known, ahead_s: Floats) -> PredictedPath:
    """Forecast with the ensemble of the track's bundle and regions calibrated by past errors."""
    time_s = known.states.time_s[known.row] + ahead_s
    return bundle_path(known.bundle(), time_s, probability)


def bundle_path(reading: Reading, time_s: Floats, probability: float) -> PredictedPath:
    """Forecast with the ensemble of a bundle at ascending data times, s."""
    ensemble = ensemble_path(reading, time_s, probability)
    return PredictedPath(
        ensemble.means,
        ensemble.covariances,
        ensemble.factors,
        ensemble.calibrated,
        BUNDLE,
        ensemble,
    )


def by_polynomial(probability: float, known: Known, ahead_s: Floats) -> PredictedPath:
    """Forecast with a polynomial through the last plots and Gaussian regions.

    Raises
    ------
    TrajectoryError
        If there are too few plots.
    """
    plots = known.plots()
    if plots is None:
        raise TrajectoryError("TOO_FEW_PLOTS", "the track has no plots")
    found = plots.forecast(known.states.time_s[known.row] + ahead_s)
    factors = np.full(len(ahead_s), gaussian_factor(probability))
    return PredictedPath(*found, factors, np.zeros(len(ahead_s), np.bool_), POLYNOMIAL)


#: The methods by name, as in `parameters.METHOD`.
METHODS: dict[str, Regional] = {
    FILTER: by_filter,
    BUNDLE: by_bundle,
    POLYNOMIAL: by_polynomial,
}


def method_of(name: str, probability: float) -> Method:
    """Return a forecast method with regions of a probability."""
    return partial(METHODS[name], probability)


def no_bundle() -> NoReturn:
    """Raise the TrajectoryError of a track without bundle."""
    raise TrajectoryError("TRAJECTORIES_OFF", "the track has no trajectory bundle")


def no_plots() -> None:
    """Return None: the track has no plots."""


def known_of(
    states: TrackStates,
    track_id: int,
    calibration: ForecastCalibration,
    bundle: Callable[[], Reading] = no_bundle,
    plots: Callable[[], LastPlots | None] = no_plots,
) -> Known | None:
    """Return the input of a track's forecast, None when the filter has no such track."""
    row = int(np.searchsorted(states.track_id, track_id))
    found = row < len(states) and states.track_id[row] == track_id
    return Known(states, row, calibration, bundle, plots) if found else None
