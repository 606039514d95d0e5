"""Bundles in a running service: fed by the engine's thread, made by one of their own.

The engine's thread only says which plots belong to which bundle. The bundles themselves, a
thousand times dearer, are made by a thread that owns them; its kernels let other threads run.
While the journal is played the engine waits when too many plots wait; afterwards it never does.
"""

import logging
import threading
from typing import Any

from multiradar.errors import TrajectoryError
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.trajectories.options import TrajectoryOptions
from multiradar.runtime.trajectories.plots import PlotPlaces
from multiradar.runtime.trajectories.pool import TAKEN, BundlePool, Reading, warm_up
from multiradar.runtime.trajectories.roster import LetGo, Order, Roster, Sampled
from multiradar.runtime.trajectories.waiting import Next, WaitingPlots
from multiradar.tracking.outputs import EngineOutput
from multiradar.tracking.settings import TrackingSettings

_log = logging.getLogger(__name__)


class TrajectoryFeed:
    """Bundles of the tracks of a service; every method may be called from any thread.

    Parameters
    ----------
    options : TrajectoryOptions
        Bounds and rules.
    sensors : SensorTable
        Who measures.
    tracking : TrackingSettings
        Settings of the tracker.
    """

    def __init__(
        self, options: TrajectoryOptions, sensors: SensorTable, tracking: TrackingSettings
    ) -> None:
        places = self._places = PlotPlaces(sensors, tracking)
        self._sensors = sensors
        #: The plane that bundles are on.
        self.plane: SystemPlane = places.plane
        self._options = options
        self._roster = Roster(options.aircraft_max, sensors)
        self._waiting = WaitingPlots(options.plots_waiting_max)
        self._pool = BundlePool(places, options.bundle)
        # Guards the roster and what waits.
        self._changed = threading.Condition()
        # Guards the pool; held while one plot is taken.
        self._using = threading.Lock()
        # Plots that were taken from those that wait, and not yet by their bundle.
        self._in_hand = 0
        self._busy = False
        self._closed = False
        self._failure: str | None = None
        self._patient = True
        self._thread = threading.Thread(target=self._run, name="trajectories", daemon=True)

    def start(self) -> None:
        """Make bundles from now on; their kernels are compiled or loaded before."""
        warm_up(self._places, self._options.bundle, self._sensors)
        self._thread.start()

    def begin(self) -> None:
        """Never make the engine wait from now on: the journal was played."""
        with self._changed:
            self._patient = False

    def stop(self) -> None:
        """Take nothing more; what waits is left."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        if self._thread.ident is not None:
            self._thread.join()

    def put(self, output: EngineOutput) -> None:
        """Take output of the engine, in order; what goes wrong here is no matter of the engine."""
        with self._changed:
            if self._failure is not None:
                return
            try:
                for order in self._roster.take(output):
                    self._put(order)
            except Exception as error:
                self._fail(error)
            self._changed.notify_all()

    def restart(self) -> None:
        """Expect output again from the beginning: what was taken is the same and is passed over."""

    def settle(self, timeout_s: float | None = None) -> bool:
        """Wait until nothing waits any more; tell whether that came true in time.

        Raises
        ------
        TrajectoryError
            If no bundles are made any more, and something waits: `FAILED`.
        """

        def settled() -> bool:
            return not (len(self._waiting) or self._busy)

        with self._changed:
            self._changed.wait_for(lambda: self._closed or settled(), timeout_s)
            if self._closed and not settled():
                reason = "expected bundles that are made, was a service that has stopped"
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
            As it is now: plots may wait that it has not taken yet.

        Raises
        ------
        TrajectoryError
            If the track has none: `NOT_CONFIRMED`, `NO_ROOM`, or `TOO_FEW_PLOTS` when none of its
            plots was taken yet.
        """
        with self._changed:
            if self._failure is not None:
                raise TrajectoryError("FAILED", self._failure)
            has, waits = self._roster.has(track_id), self._roster.waits(track_id)
        if waits:
            most = self._options.aircraft_max
            reason = f"track {track_id} waits for room: {most} tracks at most have trajectories"
            raise TrajectoryError("NO_ROOM", reason)
        if not has:
            raise TrajectoryError("NOT_CONFIRMED", f"track {track_id} is not confirmed yet")
        with self._using:
            reading = self._pool.read(track_id)
        if reading is None:
            raise TrajectoryError("TOO_FEW_PLOTS", f"no plot of track {track_id} was taken yet")
        return reading

    def counts(self) -> dict[str, Any]:
        """Return how many bundles there are and what became of plots."""
        with self._changed:
            held, waiting = self._roster.held, self._roster.waiting
            plots_waiting = self._waiting.count + self._in_hand
            lost = self._waiting.lost
        with self._using:
            outcomes, restarts = dict(self._pool.outcomes), self._pool.restarts
        return {
            "aircraft_max": self._options.aircraft_max,
            "aircraft": held,
            "aircraft_waiting": waiting,
            "plots_waiting": plots_waiting,
            "plots_lost": lost,
            "plots_taken": outcomes.pop(TAKEN, 0),
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

    def _run(self) -> None:
        try:
            while (following := self._next()) is not None:
                self._take(following)
        except Exception as error:
            with self._changed:
                self._fail(error)
                self._changed.notify_all()

    # A mistake of ours ends the bundles, and leaves the tracker alone.
    def _fail(self, error: Exception) -> None:
        _log.error("no trajectories are made any more", exc_info=error)
        self._failure = f"trajectories are not made any more: {error!r}"
        self._closed = True

    def _next(self) -> Next | LetGo | Sampled | None:
        with self._changed:
            self._busy, self._in_hand = False, 0
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._closed or len(self._waiting))
            if self._closed:
                return None
            following = self._waiting.take()
            self._busy = following is not None
            self._in_hand = len(following.plots) if isinstance(following, Next) else 0
            self._changed.notify_all()
            return following

    def _let_go(self, track_id: int) -> None:
        with self._using:
            self._pool.let_go(track_id)

    def _take(self, following: Next | LetGo | Sampled) -> None:
        if isinstance(following, Sampled):
            with self._using:
                self._pool.sample(following)
            return
        if isinstance(following, LetGo) or following.anew:
            self._let_go(following.track_id)
        if isinstance(following, LetGo):
            return
        for plot in following.plots:
            # The service may stop meanwhile.
            if self._closed:
                return
            with self._using:
                self._pool.take(following.track_id, plot, following.published)
            self._in_hand -= 1


def required_feed(feed: TrajectoryFeed | None) -> TrajectoryFeed:
    """Return the bundles of a service, or raise TrajectoryError where it makes none."""
    if feed is None:
        reason = "trajectories.aircraft_max is 0: this service makes no trajectories"
        raise TrajectoryError("TRAJECTORIES_OFF", reason)
    return feed
