"""The methods by which tracks are forecast, by name."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple, NoReturn

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import TrajectoryError
from multiradar.runtime.queries.parameters import BUNDLE, FILTER, POLYNOMIAL
from multiradar.runtime.queries.polynomial_forecasts import LastPlots
from multiradar.runtime.trajectories.fans import FanCourse, fan_course
from multiradar.runtime.trajectories.pool import Reading
from multiradar.tracking.forecast.forecast_calibration import ForecastCalibration
from multiradar.tracking.forecast.forecast_scores import Plan
from multiradar.tracking.forecast.regions import gaussian_factor
from multiradar.tracking.outputs import TrackStates

Floats = NDArray[np.float64]


class Known(NamedTuple):
    """What a track is forecast from.

    Attributes
    ----------
    states : TrackStates
        States of the filter, in the system plane.
    place : int
        Which of them the track has.
    calibration : ForecastCalibration
        The motions of the filter.
    bundle : callable
        Returns the bundle of the track, or raises a TrajectoryError.
    plots : callable
        Returns the last plots of the track, None where there are none, or raises a TrajectoryError.
    """

    states: TrackStates
    place: int
    calibration: ForecastCalibration
    bundle: Callable[[], Reading]
    plots: Callable[[], LastPlots | None]


class Course(NamedTuple):
    """Where a track is expected to be.

    Attributes
    ----------
    means : (k, 2) float64
        East and north in the system plane, m.
    covariances : (k, 2, 2) float64
        m².
    factors : (k,) float64
        The region of the probability asked for is {x : (x − m)ᵀ C⁻¹ (x − m) ≤ factor}.
    calibrated : (k,) bool
        Whether earlier forecasts as far ahead have told how large regions must be.
    motion : str
        How the aircraft is taken to move.
    fan : FanCourse, optional
        What members it has, if it has any.
    """

    means: Floats
    covariances: Floats
    factors: Floats
    calibrated: NDArray[np.bool_]
    motion: str
    fan: FanCourse | None = None


#: Forecasts a track at times after its state, s.
Method = Callable[[Known, Floats], Course]
#: The same with regions of a probability, which comes first.
Regional = Callable[[float, Known, Floats], Course]


def by_filter(probability: float, known: Known, ahead_s: Floats) -> Course:
    """Forecast by the motion that has fitted the traffic best, with regions as past errors ask."""
    return by_plan(known, ahead_s, known.calibration.scores.plan(ahead_s, probability))


def by_plan(known: Known, ahead_s: Floats, plan: Plan) -> Course:
    """Forecast by a motion of the filter, with the regions of a plan."""
    found = known.calibration.forecast_by(plan, known.states, known.place, ahead_s)
    return Course(*found, plan.calibrated, known.calibration.family.names[plan.motion])


def by_bundle(probability: float, known: Known, ahead_s: Floats) -> Course:
    """Forecast by the fan of the track's bundle, with regions as past errors ask."""
    time_s = known.states.time_s[known.place] + ahead_s
    return course_of_bundle(known.bundle(), time_s, probability)


def course_of_bundle(reading: Reading, time_s: Floats, probability: float) -> Course:
    """Forecast by the fan of a bundle at ascending data times, s."""
    fan = fan_course(reading, time_s, probability)
    return Course(fan.means, fan.covariances, fan.factors, fan.calibrated, BUNDLE, fan)


def by_polynomial(probability: float, known: Known, ahead_s: Floats) -> Course:
    """Forecast by a polynomial through the last plots, with the regions of a Gaussian.

    Raises
    ------
    TrajectoryError
        If the plots are too few for one.
    """
    plots = known.plots()
    if plots is None:
        raise TrajectoryError("TOO_FEW_PLOTS", "expected plots of the track, was none")
    found = plots.forecast(known.states.time_s[known.place] + ahead_s)
    factors = np.full(len(ahead_s), gaussian_factor(probability))
    return Course(*found, factors, np.zeros(len(ahead_s), np.bool_), POLYNOMIAL)


#: The methods by name; `parameters.METHOD` offers them over HTTP and Zenoh.
METHODS: dict[str, Regional] = {
    FILTER: by_filter,
    BUNDLE: by_bundle,
    POLYNOMIAL: by_polynomial,
}


def method_of(name: str, probability: float) -> Method:
    """Return a method of forecasting, with regions of a probability."""
    return partial(METHODS[name], probability)


def no_bundle() -> NoReturn:
    """Raise the TrajectoryError of a track without bundle."""
    raise TrajectoryError("TRAJECTORIES_OFF", "the track has no bundle of trajectories")


def no_plots() -> None:
    """Tell that a track has no plots."""


def known_of(
    states: TrackStates,
    track_id: int,
    calibration: ForecastCalibration,
    bundle: Callable[[], Reading] = no_bundle,
    plots: Callable[[], LastPlots | None] = no_plots,
) -> Known | None:
    """Return what a track is forecast from, None when the filter has no such track."""
    place = int(np.searchsorted(states.track_id, track_id))
    found = place < len(states) and states.track_id[place] == track_id
    return Known(states, place, calibration, bundle, plots) if found else None
