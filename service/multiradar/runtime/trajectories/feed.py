"""Trajectory bundles in a running service: queued by the engine's thread, updated by another.

The engine's thread only assigns plots to bundles. The bundles, which cost far more, are owned by
another thread, which updates them in rounds of plots of different tracks, alone or with further
threads; the kernels release the interpreter lock. While the journal is replayed the engine waits
when the queue is full; afterwards it never waits, and plots that have waited too long are skipped.
"""

import logging
import math
import threading
from typing import Any

from multiradar.errors import TrajectoryError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.trajectories.fair_lock import FairLock
from multiradar.runtime.trajectories.options import TrajectoryOptions
from multiradar.runtime.trajectories.plots import PlotLocator
from multiradar.runtime.trajectories.pool import ACCEPTED, BundlePool, Reading, warm_up
from multiradar.runtime.trajectories.roster import DropBundle, Order, PushPlots, Roster, Sampled
from multiradar.runtime.trajectories.waiting import NextPlots, WaitingPlots
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings

_log = logging.getLogger(__name__)

#: Maximum plots of a round for each thread: about 15 ms, for which readers wait.
ROUND_PLOTS = 16


class TrajectoryFeed:
    """Bundles of the tracks of a service; every method may be called from any thread.

    Parameters
    ----------
    options : TrajectoryOptions
        Bounds and rules.
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker.
    """

    def __init__(
        self, options: TrajectoryOptions, sensors: SensorTable, tracking: TrackingSettings
    ) -> None:
        locator = self._locator = PlotLocator(sensors, tracking)
        self._sensors = sensors
        #: The plane of the bundles.
        self.plane: SystemPlane = locator.plane
        self._options = options
        self._roster = Roster(options.aircraft_max, sensors)
        self._waiting = WaitingPlots(options.plots_waiting_max)
        self._pool = BundlePool(locator, options.bundle, options.workers)
        # Guards the roster and the queue.
        self._changed = threading.Condition()
        # Guards the pool; held while one round is processed.
        self._using = FairLock()
        # Data time of the newest plot that was queued.
        self._reached_s = -math.inf
        # Plots popped from the queue and not yet processed by their bundle.
        self._in_hand = 0
        self._busy = False
        self._closed = False
        self._failure: str | None = None
        self._patient = True
        self._thread = threading.Thread(target=self._run, name="trajectories", daemon=True)

    def start(self) -> None:
        """Compile or load the kernels, then start the thread."""
        warm_up(self._locator, self._options.bundle, self._sensors)
        self._thread.start()

    def go_live(self) -> None:
        """End the replay: from now on `put` never blocks."""
        with self._changed:
            self._patient = False

    def stop(self) -> None:
        """Stop the thread; queued plots are discarded."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if self._thread.ident is not None:
            self._thread.join()
        self._pool.close()

    def put(self, output: EngineOutput) -> None:
        """Queue output of the engine, in order; a failure here does not affect the engine."""
        with self._changed:
            if self._failure is not None:
                return
            try:
                for order in self._roster.push(output):
                    self._put(order)
                if not self._patient:
                    self._waiting.skip_before(self._reached_s - self._options.lag_max_s)
            except Exception as error:
                self._fail(error)
            self._changed.notify_all()

    def restart(self) -> None:
        """Start over: the output is repeated from the start, and what is known is skipped."""
        with self._changed:
            self._roster.restart()

    def set_back(self) -> None:
        """Expect earlier times: all tracks were terminated."""
        with self._changed:
            self._reached_s = -math.inf
            self._roster.set_back()

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places.

        Fewer are those of the start of a replay, whose plots are skipped.
        """
        if len(sensors) < len(self._sensors):
            return
        self._sensors = sensors
        with self._changed:
            self._roster.use(sensors)
        with self._using:
            self._locator.use(sensors)

    def settle(self, timeout_s: float | None = None) -> bool:
        """Wait until the queue is processed; return whether it was in time.

        Raises
        ------
        TrajectoryError
            If the thread has stopped with plots in the queue: `FAILED`.
        """

        def settled() -> bool:
            return not (len(self._waiting) or self._busy)

        with self._changed:
            self._changed.wait_for(lambda: self._closed or settled(), timeout_s)
            if self._closed and not settled():
                reason = "the trajectory service has stopped; see the log"
                raise TrajectoryError("FAILED", self._failure or reason)
            return settled()

    def read(self, track_id: int) -> Reading:
        """Return the bundle of a track, a copy.

        Parameters
        ----------
        track_id : int
            A live track.

        Returns
        -------
        Reading
            Its present state, without plots that are still queued.

        Raises
        ------
        TrajectoryError
            If the track has none: `NOT_CONFIRMED`, `NO_ROOM`, or `TOO_FEW_PLOTS` when no plot was
            processed yet.
        """
        with self._changed:
            if self._failure is not None:
                raise TrajectoryError("FAILED", self._failure)
            has, is_queued = self._roster.has(track_id), self._roster.is_queued(track_id)
        if is_queued:
            most = self._options.aircraft_max
            reason = (
                f"track {track_id} is queued: the maximum of {most} tracks with trajectories has "
                "been reached"
            )
            raise TrajectoryError("NO_ROOM", reason)
        if not has:
            raise TrajectoryError("NOT_CONFIRMED", f"track {track_id} is not confirmed yet")
        with self._using:
            reading = self._pool.read(track_id)
        if reading is None:
            raise TrajectoryError(
                "TOO_FEW_PLOTS", f"no plot of track {track_id} has been processed yet"
            )
        return reading

    def tracks(self) -> list[int]:
        """Return the tracks that have trajectories."""
        with self._using:
            return self._pool.tracks

    def counts(self) -> dict[str, Any]:
        """Return the number of bundles, and plots by outcome."""
        with self._changed:
            held, waiting = self._roster.held, self._roster.waiting
            plots_waiting = self._waiting.count + self._in_hand
            lost, late = self._waiting.lost, self._waiting.late
            lag_s = max(self._reached_s - self._waiting.oldest_s, 0.0)
        with self._using:
            outcomes, restarts = dict(self._pool.outcomes), self._pool.restarts
        missed, processed = lost + late, sum(outcomes.values())
        return {
            "aircraft_max": self._options.aircraft_max,
            "aircraft": held,
            "aircraft_waiting": waiting,
            "plots_waiting": plots_waiting,
            "plots_lost": lost,
            "plots_late": late,
            "late_share": missed / (missed + processed) if missed else 0.0,
            "lag_s": lag_s,
            "plots_taken": outcomes.pop(ACCEPTED, 0),
            "plots_refused": dict(sorted(outcomes.items())),
            "restarts": restarts,
            "failure": self._failure,
        }

    # ---------------------------------------------------------------- inside

    def _put(self, order: Order) -> None:
        while self._patient and not self._closed and not self._waiting.fits(order):
            self._changed.notify_all()
            self._changed.wait()
        self._waiting.put(order)
        if isinstance(order, PushPlots):
            self._reached_s = max(self._reached_s, float(order.plots["time_s"][-1]))

    def _run(self) -> None:
        try:
            while (following := self._next()) is not None:
                self._process(following)
        except Exception as error:
            with self._changed:
                self._fail(error)
                self._changed.notify_all()

    # A bug stops the bundles, not the tracker.
    def _fail(self, error: Exception) -> None:
        _log.error("trajectory service stopped", exc_info=error)
        self._failure = f"the trajectory service has stopped: {error!r}"
        self._closed = True

    def _next(self) -> list[NextPlots] | DropBundle | Sampled | None:
        with self._changed:
            self._busy, self._in_hand = False, 0
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._closed or len(self._waiting))
            if self._closed:
                return None
            following = self._waiting.pop(ROUND_PLOTS * self._options.workers)
            self._busy = following is not None
            if isinstance(following, list):
                self._in_hand = sum(len(one.plots) for one in following)
            self._changed.notify_all()
            return following

    def _process(self, following: list[NextPlots] | DropBundle | Sampled) -> None:
        with self._using:
            if isinstance(following, list):
                self._pool.push_all(following)
            elif isinstance(following, Sampled):
                self._pool.sample(following)
            else:
                self._pool.drop(following.track_id)


def required_feed(feed: TrajectoryFeed | None) -> TrajectoryFeed:
    """Return the bundles of a service, or raise TrajectoryError where they are disabled."""
    if feed is None:
        reason = "trajectories are disabled: trajectories.aircraft_max is 0"
        raise TrajectoryError("TRAJECTORIES_OFF", reason)
    return feed
