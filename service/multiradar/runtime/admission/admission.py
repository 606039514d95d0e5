"""Which measurements are taken, by their time: neither too late nor from the future.

The data clock is the greatest time accepted. A row is *late* when it is older than the data clock
by more than the reorder horizon (or older than the end of a stream that was flushed), and *from the
future* when it is ahead of the data clock by more than the forward jump. One sensor with a wrong
clock must not carry the data clock away and make everybody else late, so the clock jumps only when
several rows in a row agree, and not on the word of one sensor among several: a run of such rows
counts when it holds two sensors, or when only that sensor was ever heard, or when it lasts long.

The decisions depend on the sequence of rows alone, not on how they are cut into batches.
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
#: So many rows in a row, each within the forward jump of the one before, move the data clock.
AGREE_ROWS = 5
#: A run of one sensor among several is believed after this much data time without any other.
ALONE_S = 60.0


def _unset_clock() -> NDArray[np.float64]:
    return np.array([np.nan, -np.inf, 0.0, 0.0])


def _unset_run() -> NDArray[np.int64]:
    return np.array([0, -1, 0, -1, 0])


@dataclass(slots=True)
class Admission:
    """Decides by time which measurements are taken; owned by one thread.

    Parameters
    ----------
    horizon_s : float
        Reorder horizon, s; 0 takes only what is in order.
    forward_jump_max_s : float
        What is farther ahead of the data clock is from the future, s.
    arrivals : ArrivalBoard, optional
        Is told how far behind the data clock each row is.
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
        """End of the last stream that was flushed, which nothing may come before; −∞ without."""
        return float(self._clock[kernels.FLOOR])

    def admit(self, batch: MeasurementBatch) -> NDArray[np.int8]:
        """Decide about the next rows.

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
        """End the stream: what was accepted is released, so nothing may come before it any more."""
        if self.data_clock_s is not None:
            self._clock[kernels.FLOOR] = self._clock[kernels.CLOCK]
        self._run[kernels.RUN_COUNT] = 0

    def state(self) -> str:
        """Return the state as JSON, for `restore`."""
        # Floats as hexadecimal text: exact, and NaN and infinity have a form.
        return json.dumps(
            {"clock": [value.hex() for value in self._clock.tolist()], "run": self._run.tolist()}
        )

    def restore(self, state: str) -> None:
        """Continue from a state.

        Raises
        ------
        JournalError
            If the text is no state of an admission.
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
