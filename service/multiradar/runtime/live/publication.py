"""The read side: what is known now, what was, and the events that tell of changes.

The engine's thread writes (`publish`), any thread reads. A reader copies what it needs under a
short lock and turns it into tables in its own time.
"""

import threading
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.limits import RuntimeLimits
from multiradar.runtime.live.live_diagnosis import LiveDiagnosis
from multiradar.runtime.live.output_feed import OutputReader
from multiradar.runtime.memory.bias_board import BiasBoard, bias_rows_frame
from multiradar.runtime.memory.history import TrackHistory
from multiradar.runtime.memory.live_tracks import LiveTracks, ages_and_states
from multiradar.runtime.memory.reject_board import RejectBoard
from multiradar.runtime.memory.sensor_board import SensorBoard
from multiradar.runtime.memory.track_tally import TrackTally
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.encounters import Sky, encounters, no_encounters
from multiradar.runtime.queries.forecast_methods import FILTER, known_of, method_of
from multiradar.runtime.queries.forecasts import (
    PROBABILITY_DEFAULT,
    checked_probability,
    forecast_from,
    forecast_steps,
)
from multiradar.runtime.queries.manoeuvre_planes import plane_of_track
from multiradar.runtime.queries.observabilities import observability_of_track
from multiradar.runtime.queries.polynomial_forecasts import last_plots
from multiradar.runtime.queries.track_windows import PLOT_DTYPE, POINTS_MAX, Told, plot_rows
from multiradar.runtime.stream.events import Subscription
from multiradar.runtime.stream.output_events import OutputEvents
from multiradar.runtime.trajectories.document import trajectories_of
from multiradar.runtime.trajectories.feed import TrajectoryFeed, required_feed
from multiradar.tracking.columns import row_type, rows_of, table_of
from multiradar.tracking.forecast.forecast_calibration import calibration_for
from multiradar.tracking.forecast.polynomial_forecast import WINDOW_S
from multiradar.tracking.outputs import EngineOutput, TrackStates, TrackTransitions, TrackUpdates
from multiradar.tracking.settings import TrackingSettings


class Publication:
    """What the service knows, for any thread to read.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker; coasting and forecasts use them.
    limits : RuntimeLimits
        Bounds of rings and pages.
    """

    def __init__(
        self, sensors: SensorTable, tracking: TrackingSettings, limits: RuntimeLimits
    ) -> None:
        self._sensors = sensors
        self._tracking = tracking
        self._limits = limits
        self._lock = threading.Lock()
        self._events = OutputEvents(sensors, limits)
        self._states: Callable[[], tuple[TrackStates, SystemPlane]] | None = None
        self._status: Callable[[], dict[str, Any]] = dict
        self._edges: dict[str, Callable[[], dict[str, Any]]] = {}
        self.diagnosis = LiveDiagnosis(sensors)
        self._feeds: list[OutputReader] = [self.diagnosis]
        self._trajectories: TrajectoryFeed | None = None
        self._data_time_s: float | None = None
        self._frame, self._frame_version = pl.DataFrame(), -1
        #: What was refused, by reason.
        self.refusals = RejectBoard(sensors, limits.rejects_kept_max)
        self._begin()

    # ---------------------------------------------------------------- readers

    @property
    def page_rows_max(self) -> int:
        """Rows of one page of a history; who pages bounds the pages, or rows would go unseen."""
        return self._limits.page_rows_max

    def tracks(self) -> pl.DataFrame:
        """Return the live tracks by ascending identifier.

        Returns
        -------
        DataFrame
            Columns of `tracks.parquet`, one row for each track (its latest update), and `age_s`:
            data time since that update. A track older than `coast_after_s` is coasting.
        """
        with self._lock:
            version = self._version
            if self._frame_version == version:
                return self._frame
            rows, data_time_s = self._live.all(), self._data_time_s
        frame = self._honest(rows, data_time_s)
        with self._lock:
            self._frame, self._frame_version = frame, version
        return frame

    def track(self, track_id: int) -> dict[str, Any] | None:
        """Return a live track as one row of `tracks`, or None."""
        with self._lock:
            row, data_time_s = self._live.get(track_id), self._data_time_s
        return None if row is None else self._honest(row, data_time_s).row(0, named=True)

    def history(self, track_id: int, since_s: float | None, limit: int) -> pl.DataFrame:
        """Return updates of a track, live or ended, oldest first.

        Parameters
        ----------
        track_id : int
            The track.
        since_s : float or None
            A data time: the first updates from then on. None: the last updates.
        limit : int
            Number of rows at most: fewer mean that there are no more.

        Returns
        -------
        DataFrame
            Columns of `tracks.parquet`; empty when nothing is kept of the track.
        """
        rows = self._history.read(track_id, since_s, limit)
        return wire.tracks_frame(table_of(TrackUpdates, rows), self._sensors)

    def transitions(self, track_id: int, since_s: float | None, limit: int) -> pl.DataFrame:
        """Return the steps in the life of a track, live or ended, oldest first.

        Parameters
        ----------
        track_id : int
            The track.
        since_s : float or None
            A data time: the first steps from then on. None: the last steps.
        limit : int
            Number of rows at most: fewer mean that there are no more.

        Returns
        -------
        DataFrame
            Columns of `transitions.parquet`; empty when nothing is kept of the track.
        """
        rows = self._transitions.read(track_id, since_s, limit)
        return wire.transitions_frame(table_of(TrackTransitions, rows))

    def forecast(
        self,
        track_id: int,
        horizon_s: float,
        step_s: float,
        probability: float = PROBABILITY_DEFAULT,
        by: str = FILTER,
    ) -> list[dict[str, Any]] | None:
        """Return where a live track is expected to be, from the data time of now on.

        Parameters
        ----------
        track_id : int
            The track.
        horizon_s, step_s : float
            How far, and in what steps, s. The first point is at the data time of now.
        probability, by : float, str
            Of the regions; one of `forecast_methods.METHODS`.

        Returns
        -------
        list of dict or None
            Fields of `ForecastPoint` of the schemas, none beyond the system plane.
            None when there is no such live track.

        Raises
        ------
        ForecastError
            If an argument is out of its bounds, or the points are too many.
        TrajectoryError
            If the track has no bundle, or too few plots, for the method; `code` says why.
        """
        steps = forecast_steps(horizon_s, step_s, self._limits.forecast_steps_max)
        method = method_of(by, checked_probability(probability))
        track = self.track(track_id)
        if track is None or self._states is None:
            return None
        states, plane = self._states()
        known = known_of(
            states, track_id, self._calibration,
            lambda: required_feed(self._trajectories).read(track_id),
            lambda: self._judged(partial(last_plots, plane), track_id, WINDOW_S),
        )  # fmt: skip
        return None if known is None else forecast_from(known, track, plane, steps, method)

    def encounters(self, query: EncounterQuery) -> dict[str, Any]:
        """Return which live tracks are expected to come near each other.

        Parameters
        ----------
        query : EncounterQuery
            What is asked for.

        Returns
        -------
        dict
            The fields of `multiradar_schemas.products.encounter.Encounters`.
        """
        if self._states is None:
            return no_encounters(query)
        states, plane = self._states()
        with self._lock:
            rows, now_s = self._live.all(), self._data_time_s
        if now_s is None:
            return no_encounters(query)
        return encounters(Sky(now_s, rows, states), query, plane, self._tracking, self._calibration)

    def manoeuvre_plane(self, track_id: int, window_s: float) -> dict[str, Any] | None:
        """Return the plane through the last plots of a live track.

        Parameters
        ----------
        track_id : int
            The track.
        window_s : float
            Plots so long before its last one are used, s.

        Returns
        -------
        dict or None
            The fields of `ManoeuvrePlane` of the schemas; None when there is
            no such live track.

        Raises
        ------
        PlaneError
            If the plots determine no plane.
        """
        return self._judged(plane_of_track, track_id, window_s)

    def observability(self, track_id: int, window_s: float) -> dict[str, Any] | None:
        """Return whether the last measurements of a live track say where it is.

        Parameters
        ----------
        track_id : int
            The track.
        window_s : float
            Measurements so long before its last one are looked at, s.

        Returns
        -------
        dict or None
            The fields of `Observability` of the schemas; None when there is no
            such live track, or its measurements are not kept any more.
        """
        return self._judged(observability_of_track, track_id, window_s)

    def trajectories(self, track_id: int, points: int, step_s: int) -> dict[str, Any] | None:
        """Return how a live track flew, by its bundle of trajectories.

        Parameters
        ----------
        track_id : int
            The track.
        points : int
            Points of each path at most, the last ones.
        step_s : int
            Whole seconds between them.

        Returns
        -------
        dict or None
            The fields of `Trajectories` of the schemas; None when there is no such
            live track.

        Raises
        ------
        TrajectoryError
            If there are no trajectories of it; `code` says why.
        """
        track = self.track(track_id)
        if track is None:
            return None
        feed = required_feed(self._trajectories)
        told = trajectories_of(track_id, feed.read(track_id), feed.plane, points, step_s)
        return {**told, "state": track["state"], "age_s": track["age_s"]}

    def sensors(self) -> list[dict[str, Any]]:
        """Return the sensors by identifier, with their number of updates and the time of the last.

        Returns
        -------
        list of dict
            `id`, `kind` (radar, position or bearing), site, standard deviations, `updates`,
            `last_update_s`, `age_s`, `health` (a row of `health.parquet`; radars have one from the
            end of the first epoch on), `biases` as in `bias`, `diagnoses`. What it has not is None.
        """
        with self._lock:
            records = self._board.records(self._data_time_s)
            rows = self._biases.latest()
        biases = bias_rows_frame(rows, self._sensors).to_dicts()
        for record in records:
            record["biases"] = [bias for bias in biases if bias["sensor_id"] == record["id"]]
            record["diagnoses"] = self.diagnosis.of(record["id"])
        return records

    def bias(self, sensor_id: str) -> list[dict[str, Any]]:
        """Return the latest estimate of each bias parameter of a sensor.

        Returns
        -------
        list of dict
            `time_s`, `sensor_id`, `parameter`, `estimate`, `sigma`, `epoch`: rows of
            `biases.parquet`. Empty before the first epoch ended, or when there is no such sensor.
        """
        with self._lock:
            rows = self._biases.latest(sensor_id)
        return bias_rows_frame(rows, self._sensors).to_dicts()

    def bias_history(self, sensor_id: str, since_s: float | None, limit: int) -> pl.DataFrame:
        """Return bias estimates of a sensor by epoch, oldest first.

        Parameters
        ----------
        sensor_id : str
            The sensor.
        since_s : float or None
            A data time: the first rows from then on. None: the last rows.
        limit : int
            Number of rows at most: fewer mean that there are no more.

        Returns
        -------
        DataFrame
            Columns of `biases.parquet`.
        """
        with self._lock:
            rows = self._biases.history(sensor_id, since_s, limit)
        return bias_rows_frame(rows, self._sensors)

    def status(self) -> dict[str, Any]:
        """Return counts, sequences, data time, alarms, hash of the output and version."""
        with self._lock:
            known: dict[str, Any] = {
                "data_time_s": self._data_time_s,
                "tracks": len(self._live),
                **self._tally.counts(),
                "output_sequence": self._updates,
                "event_sequence": self._events.ring.head,
                "subscribers": self._events.ring.subscriber_count,
                "epoch": self._biases.epoch,
                "sensor_alarms": self._board.alarms(),
            }
        return {
            **self._status(),
            **known,
            "rejected_by_code": self.refusals.counts,
            "duplicates_by_sensor": self.refusals.duplicates_by_sensor,
            "diagnoses": self.diagnosis.records(),
            **{name: counts() for name, counts in self._edges.items()},
        }

    def count_edge(self, name: str, counts: Callable[[], dict[str, Any]]) -> None:
        """Have the status tell, under a name of its own, what an edge of the service counts.

        Before the start: readers do not expect the parts of the status to change.
        """
        self._edges[name] = counts

    def keep(self, trajectories: TrajectoryFeed) -> None:
        """Have bundles of trajectories made of the output, and told of. Before the start."""
        self._trajectories = trajectories
        self.feed(trajectories)
        self.count_edge("trajectories", trajectories.counts)

    def feed(self, feed: OutputReader) -> None:
        """Have all output of the engine handed to a reader, too. Before the start."""
        self._feeds.append(feed)

    def live_ids(self) -> NDArray[np.int64]:
        """Return the identifiers of the live tracks, ascending."""
        with self._lock:
            rows = self._live.all()
        return np.ascontiguousarray(rows["track_id"])

    def subscribe(self, after: int | None, depth: int) -> Subscription:
        """Enter the stream of events.

        Parameters
        ----------
        after : int or None
            The last event that the reader has; None: from now on.
        depth : int
            A reader that lies farther behind gets a gap notice instead of the oldest events.
        """
        return self._events.ring.subscribe(after, depth)

    # ---------------------------------------------------------------- the engine's thread

    def publish(self, output: EngineOutput, data_time_s: float | None) -> None:
        """Take what the engine put out.

        Parameters
        ----------
        output : EngineOutput
            Output of one call.
        data_time_s : float or None
            Greatest data time handed to the engine; None before the first measurement.
        """
        rows = rows_of(output.updates)
        with self._lock:
            if data_time_s is not None:
                self._data_time_s = data_time_s
            if len(rows):
                self._history.append(rows)
                self._live.update(rows)
                self._board.count(rows)
                self._updates = int(rows["sequence"][-1])
            if len(output.plots):
                self._plots.append(plot_rows(output))
            self._biases.append(output.biases)
            self._board.hear(output.health)
            if len(output.transitions):
                self._transitions.append(rows_of(output.transitions))
            self._calibration.take(output)
            self._live.end(output.ended.track_id)
            self._tally.take(output)
            self._version += 1
        self._events.publish(output)
        for feed in self._feeds:
            feed.put(output)

    def attach(
        self,
        states: Callable[[], tuple[TrackStates, SystemPlane]],
        status: Callable[[], dict[str, Any]],
    ) -> None:
        """Name where the states of the filter, in their plane, and the counters come from."""
        self._states = states
        self._status = status

    def restart(self) -> None:
        """Forget everything: the journal is about to be played again from its beginning."""
        with self._lock:
            self._begin()
        self.refusals.clear()
        self._events.restart()
        for feed in self._feeds:
            feed.restart()

    # ---------------------------------------------------------------- inside

    def _judged(self, judge: Callable[..., Told], track_id: int, window_s: float) -> Told | None:
        with self._lock:
            live = self._live.get(track_id)
            if live is None:
                return None
            # What is learnt of the biases after the last measurement changes nothing.
            biases = self._biases.at(float(live["time_s"][0]))
            rows = self._plots.read(track_id, None, POINTS_MAX)
        return judge(rows, window_s, biases, self._sensors) if len(rows) else None

    def _begin(self) -> None:
        self._history = TrackHistory(self._limits.history_rows_max)
        self._transitions = TrackHistory(
            self._limits.transition_rows_max, row_type(TrackTransitions)
        )
        self._plots = TrackHistory(self._limits.plot_rows_max, PLOT_DTYPE)
        self._live = LiveTracks()
        self._calibration = calibration_for(self._tracking)
        self._biases = BiasBoard(self._sensors, self._limits.bias_history_rows_max)
        self._board = SensorBoard(self._sensors)
        self._data_time_s = None
        self._updates = self._version = 0
        self._tally = TrackTally()
        self._frame_version = -1

    def _honest(self, rows: NDArray[np.void], data_time_s: float | None) -> pl.DataFrame:
        age_s, rows["state"] = ages_and_states(
            rows, data_time_s or 0.0, self._tracking.coast_after_s
        )
        frame = wire.tracks_frame(table_of(TrackUpdates, rows), self._sensors)
        return frame.with_columns(pl.Series("age_s", age_s, pl.Float64))
