"""The trajectory bundles of tracks, updated plot by plot."""

import logging
from collections import Counter
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from multiradar.errors import CovarianceError, MultiradarError, ShapeError, TimeOrderError
from multiradar.estimation.measurement.kinds import KIND_BEARING
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks._scratch import scratch
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.runtime.trajectories.ensemble_scores import UNCALIBRATED, EnsembleScores
from multiradar.runtime.trajectories.plots import (
    PLOT_DTYPE,
    NotLocated,
    PlotLocator,
    Published,
    prior_biases,
)
from multiradar.runtime.trajectories.roster import Sampled
from multiradar.tracking.forecast.region_sizes import RegionSizes

_log = logging.getLogger(__name__)

ACCEPTED = "TAKEN"
#: Reasons why a bundle rejects a plot, by error; `OTHER_REASON` for any other.
REJECT_REASONS: dict[type[MultiradarError], str] = {
    TimeOrderError: "TIME_NOT_ASCENDING",
    ShapeError: "NOT_FINITE",
    CovarianceError: "NO_COVARIANCE",
}
OTHER_REASON = "REFUSED"
#: A bug: the bundle is reinitialised.
FAILED = "FAILED"
#: Enough plots to initialise a bundle and update it.
_WARM_PLOTS = 6


class Reading(NamedTuple):
    """A copy of the bundle of a track.

    Attributes
    ----------
    bundle : Bundle
        A copy, owned by the reader.
    plots : int
        Number of plots accepted.
    height_m : float
        Height of the track at the last of them, m; NaN if unknown.
    sizes : RegionSizes
        Calibration of ensemble forecasts at that time.
    """

    bundle: Bundle
    plots: int
    height_m: float
    sizes: RegionSizes = UNCALIBRATED


@dataclass(slots=True)
class _Kept:
    bundle: Bundle
    plots: int = 0
    height_m: float = np.nan
    # Whether it has accepted a plot since the last sample.
    fresh: bool = False


class BundlePool:
    """Bundles by track with shared scratch memory; one owner.

    Parameters
    ----------
    locator : PlotLocator
        Computes positions of plots.
    settings : BundleSettings
        Settings of the bundles.
    """

    def __init__(self, locator: PlotLocator, settings: BundleSettings) -> None:
        self._locator, self._settings = locator, settings
        self._scratch = scratch(settings)
        self._kept: dict[int, _Kept] = {}
        self._restarts = 0
        self._scores = EnsembleScores()
        # Plots accepted since the last sample.
        self._since = 0
        #: Plots by outcome: `ACCEPTED`, a `NotLocated`, or the reason of rejection.
        self.outcomes: Counter[str] = Counter()

    def __len__(self) -> int:
        return len(self._kept)

    @property
    def restarts(self) -> int:
        """Number of reinitialised bundles, including those of terminated tracks."""
        return self._restarts + sum(one.bundle.restarts for one in self._kept.values())

    def push(self, track_id: int, plot: np.void, published: Published) -> None:
        """Update a bundle with a plot; errors are counted, never raised.

        Parameters
        ----------
        track_id : int
            The track; its bundle is created at the first plot.
        plot : row of `PLOT_DTYPE`
            The plot.
        published : Published
            The biases published at its time.
        """
        kept = self._kept.get(track_id)
        if kept is None:
            kept = self._kept[track_id] = _Kept(Bundle(self._settings, self._scratch))
        try:
            self.outcomes[self._push_plot(kept, plot, published)] += 1
        except Exception as error:
            _log.error("reinitialising the bundle of track %d", track_id, exc_info=error)
            self.outcomes[FAILED] += 1
            self._scores.discard(track_id)
            self.drop(track_id)

    def sample(self, sampled: Sampled) -> None:
        """Evaluate due forecasts, and forecast a few tracks.

        Parameters
        ----------
        sampled : Sampled
            The completed epoch; each bundle has all its plots up to its end, and no later ones.
        """
        for track_id in sorted(self._kept):
            self._evaluate(track_id, self._kept[track_id].bundle, sampled.time_s)
        self._scores.settle()
        fresh = sorted(one for one, kept in self._kept.items() if kept.fresh and len(kept.bundle))
        for track_id in self._scores.chosen(fresh, sampled.epoch, self._since):
            try:
                self._scores.make(track_id, self._kept[track_id].bundle)
            except Exception as error:
                _log.error("forecast of track %d failed", track_id, exc_info=error)
        self._since = 0
        for kept in self._kept.values():
            kept.fresh = False

    def drop(self, track_id: int) -> None:
        """Drop the bundle of a track, if there is one."""
        kept = self._kept.pop(track_id, None)
        if kept is not None:
            self._restarts += kept.bundle.restarts
            self._evaluate(track_id, kept.bundle, None)
            self._scores.discard(track_id)

    # A bug affects the calibration of one track only.
    def _evaluate(self, track_id: int, bundle: Bundle, time_s: float | None) -> None:
        try:
            self._scores.evaluate(track_id, bundle, time_s)
        except Exception as error:
            _log.error("evaluation of forecasts of track %d failed", track_id, exc_info=error)
            self._scores.discard(track_id)

    @property
    def tracks(self) -> list[int]:
        """The tracks that have trajectories."""
        return [track for track, kept in self._kept.items() if len(kept.bundle)]

    def read(self, track_id: int) -> Reading | None:
        """Return a copy of the bundle of a track; None where there is none yet."""
        kept = self._kept.get(track_id)
        if kept is None:
            return None
        return Reading(kept.bundle.copy(), kept.plots, kept.height_m, self._scores.sizes)

    def _push_plot(self, kept: _Kept, plot: np.void, published: Published) -> str:
        placed = self._locator.locate(plot, published)
        if isinstance(placed, NotLocated):
            return placed
        try:
            kept.bundle.push(float(plot["time_s"]), *placed)
        except MultiradarError as error:
            return REJECT_REASONS.get(type(error), OTHER_REASON)
        kept.plots += 1
        kept.fresh = True
        self._since += 1
        kept.height_m = float(plot["track_height_m"])
        return ACCEPTED


def warm_up(locator: PlotLocator, settings: BundleSettings, sensors: SensorTable) -> None:
    """Compile or load the kernels with plots of a synthetic aircraft."""
    located = np.flatnonzero(sensors.kinds != KIND_BEARING)
    if not len(located):
        return
    plots = np.zeros(_WARM_PLOTS, PLOT_DTYPE)
    plots["time_s"] = 10.0 * np.arange(_WARM_PLOTS)
    plots["sensor"], plots["kind"] = located[0], sensors.kinds[located[0]]
    flown_m = 200.0 * plots["time_s"]
    # A radar measures range, ADS-B reports the position: both are set.
    plots["range_m"] = 5e4 + flown_m
    plots["latitude_rad"], plots["longitude_rad"] = locator.plane.to_geodetic(
        0.0 * flown_m, flown_m
    )
    plots["height_m"], plots["position_sigma_m"] = 9000.0, np.nan
    pool, published = BundlePool(locator, settings), prior_biases(sensors)
    for plot in plots:
        pool.push(1, plot, published)
    pool.sample(Sampled(0, float(plots["time_s"][-1])))
    reading = pool.read(1)
    if reading is not None and len(reading.bundle):
        reading.bundle.estimate()
