"""Interface of the estimation engine to the live pipeline."""

from typing import ClassVar, Protocol

from multiradar.estimation.bias.observability import UnobservableBias
from multiradar.estimation.measurement.sensor_changes import SensorChange
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.state import Fields
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import EngineOutput, TrackStates


class TrackingEngine(Protocol):
    """Estimates tracks and biases; owned by one thread at a time.

    Its output depends only on the sequence of measurements, not on the batches.

    Attributes
    ----------
    STATE : mapping
        All that its later output depends on: see `multiradar.state`.
    """

    STATE: ClassVar[Fields]

    @property
    def plane(self) -> SystemPlane:
        """The plane of the states of `tracks`."""
        ...

    @property
    def counts(self) -> dict[str, int]:
        """Measurements so far by outcome."""
        ...

    @property
    def waiting_from(self) -> int:
        """Number, by arrival from 0, of the first measurement that later output may refer to."""
        ...

    def push(self, batch: MeasurementBatch, clock_s: float | None = None) -> EngineOutput:
        """Process admitted measurements, in the order of arrival, and release up to a data clock.

        Without one, the greatest time so far is the data clock.
        """
        ...

    def complete(self) -> EngineOutput:
        """Do what the next measurements would have to wait for, after the output of the last ones.

        Called after each `push` or not: all outputs together are the same.
        """
        ...

    def flush(self) -> EngineOutput:
        """Empty the reorder buffer and close the epoch: the end of a stream."""
        ...

    def restart(self) -> EngineOutput:
        """Terminate all tracks, and accept earlier times: the data clock was set back."""
        ...

    def change_sensors(self, sensors: SensorTable, change: SensorChange) -> EngineOutput:
        """Continue with other sensors: those so far at their places, new ones after them."""
        ...

    def tracks(self) -> TrackStates:
        """Return the live tracks."""
        ...

    def unobservable_biases(self) -> tuple[UnobservableBias, ...]:
        """Return the combinations of biases that are not observable so far."""
        ...

    def close(self) -> None:
        """Release threads and memory."""
        ...
