"""What the live pipeline asks of the estimation engine."""

from typing import Protocol

from multiradar.geodesy.system_plane import SystemPlane
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import EngineOutput, TrackStates


class TrackingEngine(Protocol):
    """Estimates tracks and biases; owned by one thread at a time.

    Its output is a function of the sequence of measurements alone, however they are cut into
    batches.
    """

    @property
    def plane(self) -> SystemPlane:
        """The plane of the states of `tracks`."""
        ...

    @property
    def counts(self) -> dict[str, int]:
        """What became of the measurements so far, by outcome."""
        ...

    @property
    def waiting_from(self) -> int:
        """Place, by arrival from 0, of the first measurement that the output may still speak of."""
        ...

    def push(self, batch: MeasurementBatch) -> EngineOutput:
        """Take admitted measurements, in the order of their arrival."""
        ...

    def flush(self) -> EngineOutput:
        """Release what waits to be put in order and close the epoch: the end of a stream."""
        ...

    def tracks(self) -> TrackStates:
        """Return the live tracks."""
        ...

    def close(self) -> None:
        """Let threads and memory go."""
        ...
