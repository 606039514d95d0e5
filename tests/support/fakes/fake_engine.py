"""A deterministic fake engine without estimation, for tests of the live pipeline."""

from collections.abc import Callable
from typing import ClassVar

import numpy as np

from multiradar.estimation.bias.observability import UnobservableBias
from multiradar.estimation.measurement.sensor_changes import SensorChange
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.state import Fields
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import (
    NO_OUTPUT,
    STATE_CONFIRMED,
    BiasRecords,
    EndedTracks,
    EngineOutput,
    TrackStates,
    TrackUpdates,
)

EPOCH_S = 4.0


class EngineCrashError(Exception):
    """Failure of the fake engine."""


class FakeEngine:
    """Every measurement updates the track of its number, in the order of arrival.

    Parameters
    ----------
    crash : callable, optional
        Called with each batch; may raise.
    """

    STATE: ClassVar[Fields] = {"_sequence": int, "_epoch": int | None, "_last_s": dict[int, float]}

    def __init__(self, crash: Callable[[MeasurementBatch], None] | None = None) -> None:
        self._crash = crash
        self._sequence = 0
        self._epoch: int | None = None
        self._last_s: dict[int, float] = {}
        self.closed = False

    @property
    def plane(self) -> SystemPlane:
        """A plane in the middle of Europe."""
        return SystemPlane(np.radians(50.0), np.radians(15.0))

    @property
    def counts(self) -> dict[str, int]:
        """Number of updates."""
        return {"UPDATED": self._sequence}

    def push(self, batch: MeasurementBatch, _clock_s: float | None = None) -> EngineOutput:
        """Convert each measurement to an update, and each new epoch to a bias record."""
        if self._crash is not None:
            self._crash(batch)
        biases: list[tuple[int, float]] = []
        for time_s in batch.time_s.tolist():
            epoch = int(time_s // EPOCH_S)
            if self._epoch is not None and epoch > self._epoch:
                biases.append((self._epoch, (self._epoch + 1) * EPOCH_S))
            self._epoch = max(self._epoch or epoch, epoch)
        self._last_s.update(
            zip((batch.track_number + 1).tolist(), batch.time_s.tolist(), strict=True)
        )
        return EngineOutput(self._updates(batch), _records(biases), _nothing_ended())

    @property
    def waiting_from(self) -> int:
        """Nothing is buffered."""
        return self._sequence

    def complete(self) -> EngineOutput:
        """No epoch is complete before the next one."""
        return NO_OUTPUT

    def flush(self) -> EngineOutput:
        """End the epoch."""
        biases = [] if self._epoch is None else [(self._epoch, (self._epoch + 1) * EPOCH_S)]
        self._epoch = None
        return EngineOutput(
            self._updates(MeasurementBatch.empty()), _records(biases), _nothing_ended()
        )

    def change_sensors(self, sensors: SensorTable, change: SensorChange) -> EngineOutput:
        """End the epoch."""
        return self.flush()

    def restart(self) -> EngineOutput:
        """End the epoch; it has no time of its own."""
        return self.flush()

    def tracks(self) -> TrackStates:
        """All tracks ever seen, 1 km apart, flying north at 100 m/s."""
        tracks = np.array(sorted(self._last_s), np.int64)
        count = len(tracks)
        mean = np.zeros((count, 4))
        mean[:, 0] = tracks * 1000.0
        mean[:, 3] = 100.0
        covariance = np.zeros((count, 4, 4))
        covariance[:] = np.diag([100.0, 400.0, 1.0, 4.0])
        return TrackStates(
            track_id=tracks,
            time_s=np.array([self._last_s[track] for track in tracks.tolist()]),
            mean=mean,
            covariance=covariance,
            height_m=np.full(count, np.nan),
        )

    def unobservable_biases(self) -> tuple[UnobservableBias, ...]:
        """Nothing is known to be unobservable."""
        return ()

    def close(self) -> None:
        """Record that it was closed."""
        self.closed = True

    def _updates(self, batch: MeasurementBatch) -> TrackUpdates:
        count = len(batch)
        first = self._sequence + 1
        self._sequence += count
        return TrackUpdates(
            sequence=np.arange(first, first + count),
            time_s=batch.time_s,
            track_id=batch.track_number + 1,
            sensor=batch.sensor,
            track_number=batch.track_number,
            mode_s_address=batch.mode_s_address,
            mode_3a=batch.mode_3a,
            latitude_rad=np.full(count, 0.8),
            longitude_rad=np.full(count, 0.2),
            height_m=batch.height_m,
            speed_mps=np.full(count, 100.0),
            heading_rad=np.zeros(count),
            position_sigma_m=np.full(count, 22.0),
            velocity_sigma_mps=np.full(count, 2.0),
            state=np.full(count, STATE_CONFIRMED, np.int8),
            turn_right_probability=np.full(count, 0.25),
            turn_left_probability=np.full(count, 0.125),
            speed_change_probability=np.full(count, 0.5),
            vertical_rate_mps=np.full(count, -2.5),
            height_sigma_m=np.where(np.isnan(batch.height_m), np.nan, 3.0),
            adsb_implausible=np.zeros(count, np.bool_),
            callsign=batch.callsign,
            measured_mode_s_address=batch.mode_s_address,
            on_ground=np.full(count, -1, np.int8),
        )


def _records(epochs: list[tuple[int, float]]) -> BiasRecords:
    count = len(epochs)
    return BiasRecords(
        epoch=np.array([epoch for epoch, _ in epochs], np.int64),
        time_s=np.array([time_s for _, time_s in epochs], np.float64),
        sensor=np.zeros(count, np.int32),
        parameter=np.zeros(count, np.int8),
        estimate=np.array([epoch % 1000 for epoch, _ in epochs], np.float64),
        sigma=np.ones(count),
    )


def _nothing_ended() -> EndedTracks:
    return EndedTracks.concatenate([])
