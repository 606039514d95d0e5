"""Admission of measurements by time: rejects those that are too late or in the future.

The data clock is the greatest time accepted. A row is *late* when it is older than the data clock
by more than the reorder horizon (or older than the end of a flushed stream), and *in the future*
when it is ahead of the data clock by more than the forward jump. One sensor with a wrong clock must
not advance the data clock and make all other sensors late. So the clock jumps only after a run of
consecutive rows with consistent times. The run must contain two sensors, or come from the only
sensor received so far, or span `ALONE_S`.

The result depends only on the sequence of rows, not on the batches.
"""

import json
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError, JournalError
from multiradar.runtime import _kernels as kernels
from multiradar.runtime.admission.arrivals import ArrivalBoard
from multiradar.tracking.input.measurements import MeasurementBatch

ACCEPTED = kernels.ACCEPTED
LATE = kernels.LATE
FUTURE = kernels.FUTURE

FORWARD_JUMP_MAX_S = 600.0
#: Consecutive rows, each within the forward jump of the one before, that move the data clock.
AGREE_ROWS = 5
#: Data time after which a run of one sensor among several moves the data clock, s.
ALONE_S = 60.0


def _unset_clock() -> NDArray[np.float64]:
    return np.array([np.nan, -np.inf, 0.0, 0.0])


def _unset_run() -> NDArray[np.int64]:
    return np.array([0, -1, 0, -1, 0])


@dataclass(slots=True)
class Admission:
    """Accepts or rejects measurements by time; owned by one thread.

    Parameters
    ----------
    horizon_s : float
        Reorder horizon, s; 0 accepts only measurements in time order.
    forward_jump_max_s : float
        Measurements farther ahead of the data clock are in the future, s.
    arrivals : ArrivalBoard, optional
        Counts the delay of each row behind the data clock.
    """

    horizon_s: float
    forward_jump_max_s: float = FORWARD_JUMP_MAX_S
    arrivals: ArrivalBoard | None = None
    _clock: NDArray[np.float64] = field(default_factory=_unset_clock, init=False)
    _run: NDArray[np.int64] = field(default_factory=_unset_run, init=False)

    def __post_init__(self) -> None:
        if not (self.horizon_s >= 0.0 and self.forward_jump_max_s > 0.0):
            raise ConfigurationError(
                "expected a reorder horizon of at least 0 s and a forward jump above 0 s, "
                f"was {self.horizon_s} s and {self.forward_jump_max_s} s"
            )

    @property
    def data_clock_s(self) -> float | None:
        """Greatest time accepted so far; None before the first measurement."""
        clock = float(self._clock[kernels.CLOCK])
        return None if np.isnan(clock) else clock

    @property
    def floor_s(self) -> float:
        """End of the last flushed stream: earlier rows are late; −∞ without."""
        return float(self._clock[kernels.FLOOR])

    def admit(self, batch: MeasurementBatch) -> NDArray[np.int8]:
        """Classify the next rows.

        Parameters
        ----------
        batch : MeasurementBatch
            Measurements in the order of their arrival; times are finite.

        Returns
        -------
        (n,) ndarray of int8
            `ACCEPTED`, `LATE` or `FUTURE` for each row.
        """
        before_s = self.data_clock_s
        code = np.empty(len(batch), np.int8)
        kernels.admit(
            batch.time_s,
            batch.sensor,
            self.horizon_s,
            self.forward_jump_max_s,
            AGREE_ROWS,
            ALONE_S,
            self._clock,
            self._run,
            code,
        )
        if self.arrivals is not None:
            self.arrivals.count(batch, code, before_s)
        return code

    def flush(self) -> None:
        """End the stream: accepted rows are released, so earlier rows are late from now on."""
        if self.data_clock_s is not None:
            self._clock[kernels.FLOOR] = self._clock[kernels.CLOCK]
        self._run[kernels.RUN_COUNT] = 0

    def state(self) -> str:
        """Return the state as JSON, for `restore`."""
        # Hexadecimal floats are exact, and represent NaN and infinity.
        return json.dumps(
            {"clock": [value.hex() for value in self._clock.tolist()], "run": self._run.tolist()}
        )

    def restore(self, state: str) -> None:
        """Continue from a state.

        Raises
        ------
        JournalError
            If the text is not a state of an admission.
        """
        try:
            fields = json.loads(state)
            clock = np.array([float.fromhex(text) for text in fields["clock"]])
            run = np.array(fields["run"], np.int64)
            if clock.shape != self._clock.shape or run.shape != self._run.shape:
                msg = "wrong length"
                raise ValueError(msg)
        except (ValueError, TypeError, KeyError) as error:
            raise JournalError(f"expected the state of an admission, was {state!r}") from error
        self._clock = clock
        self._run = run
