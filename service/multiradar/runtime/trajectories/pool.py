"""The bundles of all tracks that have one: the dear half, plot by plot."""

import logging
from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from multiradar.errors import CovarianceError, MultiradarError, ShapeError, TimeOrderError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.restoration.bundle.bundle import Bundle
from multiradar.restoration.control_tracks._scratch import scratch
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.runtime.trajectories.fan_scores import NOTHING_LEARNT, FanScores
from multiradar.runtime.trajectories.plots import (
    PLOT_DTYPE,
    PlotPlaces,
    Published,
    Unplaced,
    known_beforehand,
)
from multiradar.runtime.trajectories.roster import Sampled
from multiradar.tracking.forecast.forecast_scores import Learnt
from multiradar.tracking.input.measurements import KIND_BEARING

_log = logging.getLogger(__name__)

TAKEN = "TAKEN"
#: Why a bundle refuses a plot, by the error with which it does; `REFUSED` for any other.
REFUSALS: dict[type[MultiradarError], str] = {
    TimeOrderError: "TIME_NOT_ASCENDING",
    ShapeError: "NOT_FINITE",
    CovarianceError: "NO_COVARIANCE",
}
REFUSED = "REFUSED"
#: A mistake of ours: the bundle begins anew.
FAILED = "FAILED"
#: So many plots start a bundle and let it take a few.
_WARM_PLOTS = 6


class Reading(NamedTuple):
    """What is read of the bundle of a track.

    Attributes
    ----------
    bundle : Bundle
        A copy, for the reader alone.
    plots : int
        Plots that it has taken.
    height_m : float
        Height of the last of them, m; NaN where neither it nor its track told one.
    learnt : Learnt
        What forecasts of bundles have taught until then.
    """

    bundle: Bundle
    plots: int
    height_m: float
    learnt: Learnt = NOTHING_LEARNT


@dataclass(slots=True)
class _Kept:
    bundle: Bundle
    plots: int = 0
    height_m: float = np.nan
    # Whether it has taken a plot since the last sample.
    fresh: bool = False


class BundlePool:
    """Bundles by track, with memory to work in that all of them share; one owner.

    Parameters
    ----------
    places : PlotPlaces
        Lays plots on the plane.
    settings : BundleSettings
        Rules of the bundles.
    """

    def __init__(self, places: PlotPlaces, settings: BundleSettings) -> None:
        self._places, self._settings = places, settings
        self._scratch = scratch(settings)
        self._kept: dict[int, _Kept] = {}
        self._restarts = 0
        self._fans = FanScores()
        # Plots that were taken since the last sample.
        self._since = 0
        #: Plots by what became of them: `TAKEN`, an `Unplaced`, or why a bundle refused them.
        self.outcomes: Counter[str] = Counter()

    def __len__(self) -> int:
        return len(self._kept)

    @property
    def restarts(self) -> int:
        """How often a bundle began anew, those of tracks that have ended included."""
        return self._restarts + sum(one.bundle.restarts for one in self._kept.values())

    def take(self, track_id: int, plot: np.void, published: Published) -> None:
        """Take a plot; whatever is wrong with it is counted, never raised.

        Parameters
        ----------
        track_id : int
            Whose it is; a track without a bundle gets one.
        plot : row of `PLOT_DTYPE`
            The plot.
        published : Published
            The biases as they were published when it came.
        """
        kept = self._kept.get(track_id)
        if kept is None:
            kept = self._kept[track_id] = _Kept(Bundle(self._settings, self._scratch))
        try:
            self.outcomes[self._taken(kept, plot, published)] += 1
        except Exception as error:
            _log.error("the bundle of track %d begins anew", track_id, exc_info=error)
            self.outcomes[FAILED] += 1
            self._fans.forget(track_id)
            self.let_go(track_id)

    def sample(self, sampled: Sampled) -> None:
        """Learn from forecasts whose time has come, and forecast a few tracks.

        Parameters
        ----------
        sampled : Sampled
            The epoch that has ended; each bundle has taken all its plots up to there, none from
            later on.
        """
        for track_id in sorted(self._kept):
            self._judge(track_id, self._kept[track_id].bundle, sampled.time_s)
        self._fans.settle()
        fresh = sorted(one for one, kept in self._kept.items() if kept.fresh and len(kept.bundle))
        for track_id in self._fans.chosen(fresh, sampled.epoch, self._since):
            try:
                self._fans.make(track_id, self._kept[track_id].bundle)
            except Exception as error:
                _log.error("track %d is not forecast", track_id, exc_info=error)
        self._since = 0
        for kept in self._kept.values():
            kept.fresh = False

    def let_go(self, track_id: int) -> None:
        """Let the bundle of a track go, if there is one."""
        kept = self._kept.pop(track_id, None)
        if kept is not None:
            self._restarts += kept.bundle.restarts
            self._judge(track_id, kept.bundle, None)
            self._fans.forget(track_id)

    # A mistake of ours costs what is learnt of one track, and nothing else.
    def _judge(self, track_id: int, bundle: Bundle, time_s: float | None) -> None:
        try:
            self._fans.judge(track_id, bundle, time_s)
        except Exception as error:
            _log.error("forecasts of track %d are not judged", track_id, exc_info=error)
            self._fans.forget(track_id)

    def read(self, track_id: int) -> Reading | None:
        """Return the bundle of a track as it is now; None where there is none yet."""
        kept = self._kept.get(track_id)
        if kept is None:
            return None
        return Reading(kept.bundle.copy(), kept.plots, kept.height_m, self._fans.learnt)

    def _taken(self, kept: _Kept, plot: np.void, published: Published) -> str:
        placed = self._places.place(plot, published)
        if isinstance(placed, Unplaced):
            return placed
        try:
            kept.bundle.push(float(plot["time_s"]), *placed)
        except MultiradarError as error:
            return REFUSALS.get(type(error), REFUSED)
        kept.plots += 1
        kept.fresh = True
        self._since += 1
        kept.height_m = float(plot["track_height_m"])
        return TAKEN


def warm_up(places: PlotPlaces, settings: BundleSettings, sensors: SensorTable) -> None:
    """Have the kernels compiled or loaded, with plots of an aircraft that nobody else sees."""
    places_told = np.flatnonzero(sensors.kinds != KIND_BEARING)
    if not len(places_told):
        return
    plots = np.zeros(_WARM_PLOTS, PLOT_DTYPE)
    plots["time_s"] = 10.0 * np.arange(_WARM_PLOTS)
    plots["sensor"], plots["kind"] = places_told[0], sensors.kinds[places_told[0]]
    flown_m = 200.0 * plots["time_s"]
    # A radar tells of it by the one, what reports itself by the other.
    plots["range_m"] = 5e4 + flown_m
    plots["latitude_rad"], plots["longitude_rad"] = places.plane.to_geodetic(0.0 * flown_m, flown_m)
    plots["height_m"] = 9000.0
    pool, published = BundlePool(places, settings), known_beforehand(sensors)
    for plot in plots:
        pool.take(1, plot, published)
    pool.sample(Sampled(0, float(plots["time_s"][-1])))
    reading = pool.read(1)
    if reading is not None and len(reading.bundle):
        reading.bundle.estimate()
