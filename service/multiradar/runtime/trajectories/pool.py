"""The trajectory bundles of tracks, updated by one or more threads."""

import logging
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from multiradar.errors import CovarianceError, MultiradarError, ShapeError, TimeOrderError
from multiradar.estimation.measurement.kinds import KIND_BEARING
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks._scratch import Scratch, scratch
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
from multiradar.runtime.trajectories.waiting import NextPlots
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


class _Pushed(NamedTuple):
    # The bundle of a track after its plots, None after a bug; the outcomes of the plots; the bugs,
    # and the restarts of the bundles that they have cost.
    track_id: int
    kept: _Kept | None
    outcomes: list[str]
    bugs: list[Exception]
    restarts: int


class BundlePool:
    """Bundles by track; each thread has scratch memory that it uses for any bundle; one owner.

    The result does not depend on the number of threads.

    Parameters
    ----------
    locator : PlotLocator
        Computes positions of plots.
    settings : BundleSettings
        Settings of the bundles.
    workers : int
        Threads, including that of the owner.
    """

    def __init__(self, locator: PlotLocator, settings: BundleSettings, workers: int = 1) -> None:
        self._locator, self._settings = locator, settings
        self._scratches = [scratch(settings) for _ in range(workers)]
        self._executor = ThreadPoolExecutor(workers, "bundles")
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
        self._merge(self._pushed(track_id, (plot,), published, self._scratches[0]))

    def push_all(self, batches: Sequence[NextPlots]) -> None:
        """Update bundles of different tracks, concurrently; errors are counted, never raised.

        Parameters
        ----------
        batches : sequence of NextPlots
            Plots of different tracks, each in order.
        """
        for one in batches:
            if one.restart:
                self.drop(one.track_id)
        pushed: list[_Pushed | None] = [None] * len(batches)
        # Shared by the threads: taking the next one is atomic under the interpreter lock.
        following = iter(enumerate(batches))
        tasks = [
            self._executor.submit(self._work, following, pushed, memory)
            for memory in self._scratches[1 : len(batches)]
        ]
        self._work(following, pushed, self._scratches[0])
        for task in tasks:
            task.result()
        for done in pushed:
            if done is not None:
                self._merge(done)

    def close(self) -> None:
        """Stop the threads."""
        self._executor.shutdown()

    def sample(self, sampled: Sampled) -> None:
        """Evaluate due forecasts, and forecast a few tracks.

        Parameters
        ----------
        sampled : Sampled
            The completed epoch; each bundle has all its plots up to its end, and no later ones.
        """
        for track_id in sorted(self._scores.tracks & self._kept.keys()):
            self._evaluate(track_id, self._kept[track_id].bundle, sampled.time_s)
        self._scores.settle()
        fresh = sorted(one for one, kept in self._kept.items() if kept.fresh and len(kept.bundle))
        for track_id in self._scores.chosen(fresh, sampled.epoch, self._since):
            try:
                self._scores.make(track_id, self._kept[track_id].bundle)
            except Exception as error:
                _log.error("forecast for track %d failed", track_id, exc_info=error)
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
            _log.error("forecast evaluation for track %d failed", track_id, exc_info=error)
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

    def _work(
        self, following: Iterator[tuple[int, NextPlots]], pushed: list[_Pushed | None],
        memory: Scratch,
    ) -> None:  # fmt: skip
        for number, (track_id, _, plots, published) in following:
            pushed[number] = self._pushed(track_id, plots, published, memory)

    # Runs in any thread: changes the bundle of the track only.
    def _pushed(
        self, track_id: int, plots: Iterable[np.void], published: Published, memory: Scratch
    ) -> _Pushed:
        kept, restarts = self._kept.get(track_id), 0
        outcomes: list[str] = []
        bugs: list[Exception] = []
        if kept is not None:
            kept.bundle.use(memory)
        for plot in plots:
            if kept is None:
                kept = _Kept(Bundle(self._settings, memory))
            try:
                outcomes.append(self._push_plot(kept, plot, published))
            except Exception as error:
                outcomes.append(FAILED)
                bugs.append(error)
                restarts, kept = restarts + kept.bundle.restarts, None
        return _Pushed(track_id, kept, outcomes, bugs, restarts)

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
        kept.height_m = float(plot["track_height_m"])
        return ACCEPTED

    def _merge(self, pushed: _Pushed) -> None:
        track_id, kept, outcomes, bugs, restarts = pushed
        self.outcomes.update(outcomes)
        self._since += outcomes.count(ACCEPTED)
        for error in bugs:
            _log.error("reinitialising the bundle for track %d", track_id, exc_info=error)
            self._scores.discard(track_id)
        self._restarts += restarts
        if kept is not None:
            self._kept[track_id] = kept
        else:
            self._kept.pop(track_id, None)


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
