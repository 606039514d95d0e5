"""Present data of the service: live tracks, history, biases, sensors; read by any thread.

The engine's thread writes (`absorb`), any thread reads. A reader copies rows under a short lock
and converts them to tables outside it.
"""

import threading
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar import wire
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.plot_rows import POINTS_MAX, measurement_rows
from multiradar.runtime.memory.bias_board import BiasBoard, bias_rows_frame
from multiradar.runtime.memory.health_board import HealthBoard
from multiradar.runtime.memory.history import TrackHistory, update_rows_frame, with_spread
from multiradar.runtime.memory.live_tracks import LiveTracks, ages_and_states, sources_of
from multiradar.runtime.memory.past_rows import PastRows
from multiradar.runtime.memory.sensor_board import SensorBoard
from multiradar.runtime.memory.track_tally import TrackTally
from multiradar.runtime.row_ring import RowLog
from multiradar.runtime.trajectories.feed import TrajectoryFeed, required_feed
from multiradar.settings.limits import RuntimeLimits
from multiradar.state import Fields
from multiradar.tracking.columns import rows_of, table_of
from multiradar.tracking.forecast.forecast_calibration import (
    COUNTED,
    ForecastCalibration,
    calibration_for,
)
from multiradar.tracking.lifecycle.transitions import TrackTransitions
from multiradar.tracking.outputs import EngineOutput, TrackStates
from multiradar.tracking.settings import TrackingSettings

States = tuple[TrackStates, SystemPlane]


class TrackWindow(NamedTuple):
    """The last measurements of a live track.

    Attributes
    ----------
    rows : (n,) ndarray of `PLOT_DTYPE`
        The measurements, by ascending time, at least one.
    biases : (k,) ndarray of `BIAS_DTYPE`
        The biases as published at the time of the last update of the track.
    """

    rows: NDArray[np.void]
    biases: NDArray[np.void]


class Picture(NamedTuple):
    """The live tracks at a data time, and how they were updated.

    Attributes
    ----------
    version : int
        Number of the state; it increases with each change.
    data_time_s : float
        The data time, s; 0 before there is any.
    sequence : int
        Number of track updates so far.
    tracks : DataFrame
        As from `Knowledge.tracks`.
    updates : (n,) int64
        Number of updates of each track.
    heard_s : (n, 3) float64
        Time of its last update by each source, s; -inf for none.
    """

    version: int
    data_time_s: float
    sequence: int
    tracks: pl.DataFrame
    updates: NDArray[np.int64]
    heard_s: NDArray[np.float64]


class AirTracks(NamedTuple):
    """The live tracks as the air picture shows them.

    Attributes
    ----------
    version : int
        Number of the state; it increases with each change.
    data_time_s : float or None
        The data time, s; None before there is any.
    rows : (n,) ndarray of `UPDATE_DTYPE`
        The last update of each track by ascending identifier, with its present state.
    age_s : (n,) float64
        Data time since that update.
    heard_s : (n, 3) float64
        Time of the last update by each source, s; -inf for none.
    spread : (n, 5) float64
        `EngineOutput.spread` of the update; NaN for none.
    """

    version: int
    data_time_s: float | None
    rows: NDArray[np.void]
    age_s: NDArray[np.float64]
    heard_s: NDArray[np.float64]
    spread: NDArray[np.float64]


class Knowledge:
    """Live tracks, history, biases and sensors of the service.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    tracking : TrackingSettings
        Settings of the tracker; coasting and forecasts use them.
    limits : RuntimeLimits
        Bounds of rings and answers.
    """

    STATE: ClassVar[Fields] = {
        "_live": LiveTracks,
        "calibration": ForecastCalibration,
        "_biases": BiasBoard,
        "_board": SensorBoard,
        "_healths": HealthBoard,
        "_tally": TrackTally,
        "past": PastRows,
        "_data_time_s": float | None,
        "_updates": int,
    }

    def __init__(
        self, sensors: SensorTable, tracking: TrackingSettings, limits: RuntimeLimits
    ) -> None:
        self.sensors = sensors
        self.tracking = tracking
        self.limits = limits
        #: Bundles of the live tracks; None where they are disabled.
        self.trajectories: TrajectoryFeed | None = None
        #: Time since the last measurement of any sensor, s, or None, and whether data have ceased.
        self.silence: Callable[[], tuple[float | None, bool]] = lambda: (None, False)
        #: The neighbouring regions, as in `Regions` of the schemas; None for a service without.
        self.regions: Callable[[], dict[str, Any]] | None = None
        self._lock = threading.Lock()
        self._states: Callable[[], States] | None = None
        self._data_time_s: float | None = None
        self._frame, self._frame_version, self._version = pl.DataFrame(), -1, 0
        #: What is retained of past times.
        self.past: PastRows
        self.clear()

    # ---------------------------------------------------------------- readers

    def tracks(self) -> pl.DataFrame:
        """Return the live tracks by ascending identifier.

        Returns
        -------
        DataFrame
            Columns of `tracks.parquet`, one row for each track (its latest update), and `age_s`:
            data time since that update. A track older than `coast_after_s` is coasting. With data
            in real time `reception_age_s` is the age by reception, and once they have ceased all
            tracks are stale.
        """
        with self._lock:
            version = self._version
            if self._frame_version == version:
                return self._received(self._frame)
            rows, data_time_s = self._live.all(), self._data_time_s
        frame = self._aged(rows, data_time_s)
        with self._lock:
            self._frame, self._frame_version = frame, version
        return self._received(frame)

    @property
    def data_time_s(self) -> float | None:
        """The data time, s; None before there is any."""
        with self._lock:
            return self._data_time_s

    def picture(self, version: int) -> Picture | None:
        """Return the live tracks and how they were updated; None if the version is the present one.

        Parameters
        ----------
        version : int
            That of the last picture; -1 for none.
        """
        with self._lock:
            if version == self._version:
                return None
            rows, heard = self._live.all(), self._live.heard()
            data_time_s, updates, version = self._data_time_s, self._updates, self._version
        frame = self._aged(rows, data_time_s)
        return Picture(version, data_time_s or 0.0, updates, frame, *heard)

    @property
    def version(self) -> int:
        """Number of the state; it increases with each change."""
        with self._lock:
            return self._version

    def air_tracks(self) -> AirTracks:
        """Return the live tracks as the air picture shows them."""
        with self._lock:
            rows, spread = self._live.all(), self._live.spread()
            heard_s = self._live.heard()[1]
            data_time_s, version = self._data_time_s, self._version
        age_s, rows["state"] = ages_and_states(
            rows, data_time_s or 0.0, self.tracking.coast_after_s
        )
        return AirTracks(version, data_time_s, rows, age_s, heard_s, spread)

    def track(self, track_id: int) -> dict[str, Any] | None:
        """Return a live track as one row of `tracks`, or None."""
        with self._lock:
            row, data_time_s = self._live.get(track_id), self._data_time_s
        if row is None:
            return None
        return self._received(self._aged(row, data_time_s)).row(0, named=True)

    def live_rows(self) -> tuple[NDArray[np.void], float | None]:
        """Return the last updates of the live tracks, rows of `UPDATE_DTYPE`, and the data time."""
        with self._lock:
            return self._live.all(), self._data_time_s

    def states(self) -> States | None:
        """Return the states of the filter and their plane; None before there are any."""
        return None if self._states is None else self._states()

    def window(self, track_id: int) -> TrackWindow | None:
        """Return the last measurements of a live track.

        Returns
        -------
        TrackWindow or None
            None when there is no such live track, or its measurements are no longer retained.
        """
        with self._lock:
            live = self._live.get(track_id)
            if live is None:
                return None
            # Bias estimates after the last measurement have no effect.
            biases = self._biases.at(float(live["time_s"][0]))
            rows = self.past.plots.read(track_id, None, POINTS_MAX)
        return TrackWindow(rows, biases) if len(rows) else None

    def plots_after(self, after: int | None, limit: int) -> tuple[NDArray[np.void], int, int]:
        """Return the measurements of all updates after a number; see `TrackHistory.after`."""
        return self.past.plots.after(after, limit)

    def biases_at(self, time_s: float) -> NDArray[np.void]:
        """Return the bias estimates that were the latest at a time, rows of `BIAS_DTYPE`."""
        with self._lock:
            return self._biases.at(time_s)

    @property
    def healths(self) -> HealthBoard:
        """The health of the radars at the ends of epochs."""
        return self._healths

    def latest_biases(self) -> NDArray[np.void]:
        """Return the latest bias estimate of each parameter, rows of `BIAS_DTYPE`."""
        with self._lock:
            return self._biases.latest()

    def history(
        self, track_id: int, since_s: float | None, limit: int, until_s: float | None = None
    ) -> pl.DataFrame:
        """Return updates of a track, live or dropped, as rows of `tracks.parquet`."""
        rows = _rows_of_track(self.past.updates, track_id, since_s, limit, until_s)
        return update_rows_frame(rows, self.sensors)

    def transitions(
        self, track_id: int, since_s: float | None, limit: int, until_s: float | None = None
    ) -> pl.DataFrame:
        """Return transitions of a track, live or dropped, as rows of `transitions.parquet`."""
        rows = _rows_of_track(self.past.transitions, track_id, since_s, limit, until_s)
        return wire.transitions_frame(table_of(TrackTransitions, rows))

    def bias_history(
        self, sensor_id: str, since_s: float | None, limit: int, until_s: float | None = None
    ) -> pl.DataFrame:
        """Return bias estimates of a sensor by epoch, as rows of `biases.parquet`."""
        with self._lock:
            rows = self._biases.history(sensor_id, since_s, limit, until_s)
        return bias_rows_frame(rows, self.sensors)

    def sensor_records(self) -> list[dict[str, Any]]:
        """Return the sensors by identifier, with their updates, health and latest biases."""
        with self._lock:
            records = self._board.records(self._data_time_s)
            rows = self._biases.latest()
        biases = bias_rows_frame(rows, self.sensors).to_dicts()
        for record in records:
            record["biases"] = [bias for bias in biases if bias["sensor_id"] == record["id"]]
        return records

    def saturated(self) -> list[str]:
        """Return the sensors that could lately initiate no more tracks."""
        with self._lock:
            return self._board.saturated(self._data_time_s)

    def counts(self) -> dict[str, Any]:
        """Return data time, counts of tracks, forecasts, last update, last epoch and alarms."""
        silence_s = self.silence()[0] or 0.0
        with self._lock:
            held, counted = self.calibration.held
            ages_s = self._board.ages_s(self._data_time_s)
            return {
                "data_time_s": self._data_time_s,
                "tracks": len(self._live),
                **self._tally.counts(),
                "output_sequence": self._updates,
                "epoch": self._biases.epoch,
                "sensor_alarms": self._board.alarms(),
                "sensor_ages_s": {
                    one: round(age_s + silence_s, 2) for one, age_s in ages_s.items()
                },
                "forecast_probability": COUNTED,
                "forecasts_counted": counted,
                "forecasts_held": held,
            }

    def trajectory_feed(self) -> TrajectoryFeed:
        """Return the bundles, or raise TrajectoryError where they are disabled."""
        return required_feed(self.trajectories)

    # ---------------------------------------------------------------- the engine's thread

    def absorb(self, output: EngineOutput, data_time_s: float | None) -> None:
        """Add output of the engine.

        Parameters
        ----------
        output : EngineOutput
            Output of one call.
        data_time_s : float or None
            Greatest data time of the engine's input; None before the first measurement.
        """
        rows = rows_of(output.updates)
        with self._lock:
            if data_time_s is not None:
                self._data_time_s = data_time_s
                self._board.note_saturated(output.saturated, data_time_s)
            if len(rows):
                self.past.updates.append(with_spread(rows, output.spread))
                self._live.update(rows, output.spread)
                self._board.count(rows)
                self._updates = int(rows["sequence"][-1])
            self.past.plots.append(measurement_rows(output))
            self._biases.append(output.biases)
            self._board.update_health(output.health)
            self._healths.append(output.health)
            self.past.samples.append(output.samples)
            if len(output.transitions):
                self.past.transitions.append(rows_of(output.transitions))
            self.calibration.observe(output)
            self._live.remove(output.ended.track_id)
            self._tally.update(output)
            self._version += 1

    def set_back(self) -> None:
        """Expect earlier times: the data time was set back, and all tracks were terminated."""
        with self._lock:
            assert self._data_time_s is not None, "the output of the step has its time"
            self.past.set_back(self._data_time_s)
            self._board.set_back(self._data_time_s)
            self._version += 1

    @property
    def logs(self) -> dict[str, RowLog]:
        """The histories, by name."""
        return {
            "history": self.past.updates,
            "transitions": self.past.transitions,
            "plots": self.past.plots,
            "biases": self._biases.ring,
            "states": self.past.samples,
        }

    def restored(self) -> None:
        """Note that the state was replaced."""
        with self._lock:
            self._version += 1

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        with self._lock:
            self.sensors = sensors
            self._live.sources = sources_of(sensors)
            self._biases.use(sensors)
            self._board.use(sensors)
            self._version += 1

    def attach(self, states: Callable[[], States]) -> None:
        """Set the source of the filter states, in their plane."""
        self._states = states

    def clear(self) -> None:
        """Discard everything: the journal is replayed from the start."""
        with self._lock:
            limits = self.limits
            self._live = LiveTracks(sources_of(self.sensors))
            self.calibration = calibration_for(self.tracking)
            self._biases = BiasBoard(self.sensors, limits.bias_history_rows_max)
            self._board = SensorBoard(self.sensors)
            self._healths = HealthBoard()
            self.past = PastRows(limits, self._biases, self._healths)
            self._data_time_s = None
            self._updates = 0
            self._version += 1
            self._tally = TrackTally()
            self._frame_version = -1

    # ---------------------------------------------------------------- inside

    def _received(self, frame: pl.DataFrame) -> pl.DataFrame:
        """Set the ages by reception, and mark the tracks as stale once data have ceased."""
        silence_s, has_ceased = self.silence()
        if silence_s is None:
            return frame
        added = [(pl.col("age_s") + silence_s).alias("reception_age_s")]
        if has_ceased:
            added.append(pl.lit("stale", frame.schema["state"]).alias("state"))
        return frame.with_columns(added)

    def _aged(self, rows: NDArray[np.void], data_time_s: float | None) -> pl.DataFrame:
        age_s, rows["state"] = ages_and_states(
            rows, data_time_s or 0.0, self.tracking.coast_after_s
        )
        frame = update_rows_frame(rows, self.sensors)
        return frame.with_columns(
            pl.Series("age_s", age_s, pl.Float64), reception_age_s=pl.lit(None, pl.Float64)
        )


def _rows_of_track(
    held: TrackHistory, track_id: int, since_s: float | None, limit: int, until_s: float | None
) -> NDArray[np.void]:
    if until_s is None:
        return held.read(track_id, since_s, limit)
    return held.read_until(track_id, since_s, until_s, limit)
