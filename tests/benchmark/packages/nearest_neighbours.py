"""Stone Soup with global nearest neighbours on a cut of the crowded airspace.

Every plot is compared with every track, in Python, so the cut is small: the aircraft next to the
middle, as close to each other as in the whole scene, for a few turns of the radars.
"""

from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import groupby
from time import process_time

import numpy as np
import polars as pl
from stonesoup.dataassociator.neighbour import GNNWith2DAssignment
from stonesoup.hypothesiser.distance import DistanceHypothesiser
from stonesoup.measures import Mahalanobis
from stonesoup.models.transition.linear import (
    CombinedLinearGaussianTransitionModel,
    ConstantVelocity,
)
from stonesoup.predictor.kalman import ExtendedKalmanPredictor
from stonesoup.types.angle import Bearing
from stonesoup.types.array import CovarianceMatrix, StateVector
from stonesoup.types.detection import Detection
from stonesoup.types.state import GaussianState
from stonesoup.types.track import Track
from stonesoup.updater.kalman import ExtendedKalmanUpdater

from benchmark.packages.peers import ExactPlotModel
from benchmark.scenes import airspace
from benchmark.scenes.sky import START_S, sites
from multiradar.geodesy._kernels import predict_polar, site_parameters
from multiradar.geodesy.system_plane import SystemPlane

#: Number of aircraft and duration of the extract.
AIRCRAFT, SECONDS = 40, 12.0
#: Time window of plots of one radar that are assigned together, as in multiradar.
WINDOW_S = 0.5
#: Gate in sigmas; and process noise, m²/s³.
DISTANCE_MAX, ACCELERATION_DENSITY = 5.0, 4.0
#: Initial standard deviations of a track, m and m/s.
POSITION_SIGMA_M, VELOCITY_SIGMA_MPS = 100.0, 10.0


@dataclass(frozen=True)
class Cut:
    """Result of Stone Soup: number of plots associated with the track of their aircraft."""

    aircraft: int
    plots: int
    right: int
    seconds: float


def run(aircraft: int, quick: bool = False) -> Cut:
    """Track an extract of the scenario with this number of aircraft.

    Parameters
    ----------
    aircraft : int
        Of the whole scene.
    quick : bool
        A smaller cut.
    """
    flights = airspace.make_flights(aircraft)
    everyone = np.arange(aircraft)
    distance = np.hypot(*flights.at(everyone, np.zeros(aircraft)))
    chosen = np.sort(np.argsort(distance)[: AIRCRAFT // 4 if quick else AIRCRAFT])
    rows = int(aircraft * len(sites()) * SECONDS / airspace.TURN_S)
    plots = airspace.make_recording(rows, aircraft)
    plots = plots.filter(
        pl.col("track_number").is_in((chosen + 1).tolist()),
        pl.col("time_s") < START_S + (SECONDS / 3.0 if quick else SECONDS),
    )
    scans = _scans(plots)
    tracks = {number: _begin(flights, number) for number in chosen.tolist()}
    names = {id(track): number for number, track in tracks.items()}
    axis = ConstantVelocity(ACCELERATION_DENSITY)
    predictor = ExtendedKalmanPredictor(CombinedLinearGaussianTransitionModel([axis, axis]))
    updater = ExtendedKalmanUpdater(None)
    associator = GNNWith2DAssignment(
        DistanceHypothesiser(predictor, updater, Mahalanobis(), missed_distance=DISTANCE_MAX)
    )
    right = 0
    begin = process_time()
    for scan in scans:
        latest = max(plot.timestamp for plot in scan)
        found = associator.associate(set(tracks.values()), scan, latest)
        for track, hypothesis in found.items():
            if hypothesis:
                track.append(updater.update(hypothesis))
                right += hypothesis.measurement.metadata["aircraft"] == names[id(track)]
    return Cut(len(chosen), len(plots), right, process_time() - begin)


# The plots of each radar in each window, in the order of the windows.
def _scans(plots: pl.DataFrame) -> list[set[Detection]]:
    named = {name: index for index, (name, *_) in enumerate(sites())}
    polar = [_polar_of(index) for index in range(len(named))]
    noise = CovarianceMatrix(
        np.diag([airspace.RANGE_SIGMA_M**2, np.radians(airspace.AZIMUTH_SIGMA_DEG) ** 2])
    )

    def detection(row: dict[str, float], radar: int) -> Detection:
        height = row["height_m"]
        return Detection(
            StateVector(
                [
                    row["range_m"] - airspace.RANGE_BIASES_M[radar],
                    Bearing(np.radians(row["azimuth_deg"] - airspace.AZIMUTH_BIASES_DEG[radar])),
                ]
            ),
            _calendar(row["time_s"] - START_S),
            measurement_model=ExactPlotModel(
                4, (0, 2), noise, lambda one, east, north: polar[one](east, north, height), radar
            ),
            metadata={"aircraft": row["track_number"] - 1},
        )

    rows = [
        (int((row["time_s"] - START_S) / WINDOW_S), named[row["sensor_id"]], row)
        for row in plots.iter_rows(named=True)
    ]
    rows.sort(key=lambda one: one[:2])
    return [
        {detection(row, radar) for _, radar, row in scan}
        for _, scan in groupby(rows, key=lambda one: one[:2])
    ]


def _plane() -> SystemPlane:
    latitude, longitude = (np.radians([site[place] for site in sites()]) for place in (1, 2))
    return SystemPlane.for_sensors(latitude, longitude)


def _polar_of(radar: int) -> Callable[[float, float, float], tuple[float, ...]]:
    plane = _plane().parameters
    _, latitude, longitude, height = sites()[radar]
    site = site_parameters(plane, np.radians(latitude), np.radians(longitude), float(height))
    return lambda east, north, level: predict_polar(plane, site, east, north, level)[:6]


# East, its rate, north, its rate: the true initial state.
def _begin(flights: airspace.Flights, number: int) -> Track:
    east, north = _plane().to_plane(*flights.geodetic(np.full(2, number), np.array([0.0, 1.0])))
    mean = StateVector([east[0], east[1] - east[0], north[0], north[1] - north[0]])
    variances = np.tile([POSITION_SIGMA_M**2, VELOCITY_SIGMA_MPS**2], 2)
    return Track([GaussianState(mean, CovarianceMatrix(np.diag(variances)), _calendar(0.0))])


def _calendar(seconds: float) -> datetime:
    return datetime(2026, 1, 1, tzinfo=UTC) + timedelta(seconds=seconds)
