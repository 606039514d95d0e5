"""Admission of measurements by time: rejects those that are too late or in the future.

The *data clock* is the time that the measurements have reached. A row is *late* when it is older
than the data clock by more than the reorder horizon (or older than the end of a flushed stream).
No sensor with a wrong clock may advance the data clock and so make all other sensors late.

A row ahead of the data clock by at most half of the reorder horizon (or the tolerance of its
sensor) advances it; of three or more sensors, none advances it farther than that beyond the others,
whose times a drifting clock would otherwise leave behind step by step. Of two sensors none is more
right; with times of reception, one that comes ever earlier after the times that it reports, and is
ahead of the other and of the clock of the machine, advances nothing. A row farther ahead is a gap
in the measurements, or a clock that is fast:

- With times of reception, all sensors heard in real time vote, and so does the clock of the
  machine: a row that most of them have not reached is *in the future* and rejected, one that most
  have reached advances the data clock.
- Otherwise the row is accepted, but does not advance the data clock: it waits until a second sensor
  is as far, or for a time without rows of others; live, also until the sensor has been heard as
  often as its vote requires. Rows of others near the data clock contradict it;
  after `CONTRADICTED_MAX` contradictions in succession the rows of the sensor are rejected.
- A row ahead by more than the forward jump is rejected, unless several agree in succession. The run
  must contain two sensors, or come from the only sensor received so far, or span `ALONE_S`.

A sensor that delivers more rows than it can (`multiradar.estimation.measurement.plot_rates`) has
failed, or somebody sends in its name: the rows beyond are rejected. They are counted in data time,
in which a replay is not faster than its recording, by the generic cell rate algorithm (ITU-T
I.371).

Without times of reception the result depends only on the sequence of rows, not on the batches. With
them it is in the journal: the accepted rows of each entry, and the data clock after it.
"""

import json
from dataclasses import dataclass, field
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError, JournalError
from multiradar.estimation.measurement.plot_rates import plot_paces
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission import _admission_kernels as kernels
from multiradar.runtime.admission.arrivals import ArrivalBoard
from multiradar.tracking.input.measurements import MeasurementBatch

ACCEPTED = kernels.ACCEPTED
LATE = kernels.LATE
FUTURE = kernels.FUTURE
EXCESS = kernels.EXCESS

FORWARD_JUMP_MAX_S = 600.0
#: Consecutive rows, each within the forward jump of the one before, that move the data clock.
AGREE_ROWS = 5
#: Data time after which a run of one sensor among several moves the data clock, s.
ALONE_S = 60.0
#: Likewise for a run within the forward jump, in reorder horizons.
ALONE_HORIZONS = 2.0
#: Lead of a row that advances the data clock, in reorder horizons: sensors on time keep the rest.
TOLERANCE_HORIZONS = 0.5
#: A sensor has a clock alarm after so many rows in succession that are late or in the future.
ALARM_ROWS = 3
#: A sensor has a storm alarm from this fraction of the burst on that it may have.
STORM_SHARE = 0.5
#: Numbers in the state of an older version.
_OLD_CLOCK, _OLD_RUN = (4, 5), (5, 6)
_MALFORMED = (ValueError, TypeError, KeyError, IndexError)


def data_clock_of(state: str) -> float:
    """Return the data clock of a state of an admission, s; −∞ where it was not set."""
    clock_s = float.fromhex(json.loads(state)["clock"][kernels.CLOCK])
    return -np.inf if np.isnan(clock_s) else clock_s


@dataclass(slots=True)
class Admission:
    """Accepts or rejects measurements by time; owned by one thread.

    Parameters
    ----------
    horizon_s : float
        Reorder horizon, s; 0 accepts only measurements in time order.
    sensors : int
        Number of sensors.
    forward_jump_max_s : float
        Measurements farther ahead of the data clock are in the future, s.
    arrivals : ArrivalBoard, optional
        Counts the delay of each row behind the data clock.
    paces : (m, 2) float64, optional
        Least mean interval of the rows of each sensor, and the time by which they may be ahead of
        the data time at that interval, s; unbounded by default.
    tolerances_s : (m,) float64, optional
        Lead over the data clock up to which the rows of each sensor advance it, s, at most the
        horizon; NaN and by default half of the horizon.

    Attributes
    ----------
    clock_s : (n,) float64
        Data clock before each row of the last batch; NaN where it was not set.
    """

    horizon_s: float
    sensors: int
    forward_jump_max_s: float = FORWARD_JUMP_MAX_S
    arrivals: ArrivalBoard | None = None
    paces: NDArray[np.float64] | None = None
    tolerances_s: NDArray[np.float64] | None = None
    clock_s: NDArray[np.float64] = field(default_factory=lambda: np.empty(0), init=False)
    _bounds: NDArray[np.float64] = field(init=False)
    _clock: NDArray[np.float64] = field(init=False)
    _run: NDArray[np.int64] = field(init=False)
    _standing: NDArray[np.int64] = field(init=False)
    _lead: NDArray[np.float64] = field(init=False)
    _heard: NDArray[np.float64] = field(init=False)
    _tolerance: NDArray[np.float64] = field(init=False)
    _pace: NDArray[np.float64] = field(init=False)
    _due: NDArray[np.float64] = field(init=False)

    @classmethod
    def for_sensors(
        cls,
        sensors: SensorTable,
        horizon_s: float,
        forward_jump_max_s: float = FORWARD_JUMP_MAX_S,
        *,
        arrivals: ArrivalBoard | None = None,
        state: str = "",
    ) -> Self:
        """Return the admission of sensors, with the paces and tolerances of each.

        It continues from a state, if one is given; raises as `restore`.
        """
        made = cls(
            horizon_s,
            len(sensors),
            forward_jump_max_s,
            arrivals,
            plot_paces(sensors),
            sensors.clock_tolerance_s,
        )
        if state:
            made.restore(state)
        return made

    def __post_init__(self) -> None:
        if not (self.horizon_s >= 0.0 and self.forward_jump_max_s > 0.0):
            raise ConfigurationError(
                "expected a reorder horizon of at least 0 s and a forward jump above 0 s, "
                f"was {self.horizon_s} s and {self.forward_jump_max_s} s"
            )
        self._bounds = np.array(
            [
                self.horizon_s, self.tolerance_s, self.forward_jump_max_s, AGREE_ROWS, ALONE_S,
                ALONE_HORIZONS * self.horizon_s,
            ]
        )  # fmt: skip
        self._clock = np.array([np.nan, -np.inf, 0.0, 0.0, -np.inf, -np.inf, -np.inf])
        self._run = np.array([0, -1, 0, -1, 0, 0, -1, -1])
        self._standing = np.zeros((self.sensors, 3), np.int64)
        self._lead = np.zeros(self.sensors)
        self._heard = np.zeros((self.sensors, kernels.HEARD_MAX + 1, 2))
        given = np.full(self.sensors, np.nan) if self.tolerances_s is None else self.tolerances_s
        self._tolerance = np.where(np.isnan(given), self.tolerance_s, given)
        self._pace = np.tile([0.0, np.inf], (self.sensors, 1)) if self.paces is None else self.paces
        self._due = np.full(self.sensors, -np.inf)

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        new = Admission.for_sensors(sensors, self.horizon_s, self.forward_jump_max_s)
        kept = min(self.sensors, new.sensors)
        # The counts last: other threads read what they refer to.
        for name in ("_due", "_lead", "_heard", "_standing"):
            getattr(new, name)[:kept] = getattr(self, name)[:kept]
            setattr(self, name, getattr(new, name))
        self.sensors, self._tolerance, self._pace = new.sensors, new._tolerance, new._pace

    @property
    def tolerance_s(self) -> float:
        """Lead of a row that advances the data clock, s, where the sensor has none of its own."""
        return TOLERANCE_HORIZONS * self.horizon_s

    def tolerance_of(self, sensor: int) -> float:
        """Return the lead of a row of a sensor that advances the data clock, s."""
        return float(self._tolerance[sensor])

    @property
    def data_clock_s(self) -> float | None:
        """The data clock; None before the first measurement that set it."""
        clock = float(self._clock[kernels.CLOCK])
        return None if np.isnan(clock) else clock

    @property
    def released_to_s(self) -> float:
        """The data clock; −∞ before the first measurement that set it."""
        return -np.inf if self.data_clock_s is None else self.data_clock_s

    @property
    def floor_s(self) -> float:
        """End of the last flushed stream: earlier rows are late; −∞ without."""
        return float(self._clock[kernels.FLOOR])

    def admit(self, batch: MeasurementBatch, received_s: float | None = None) -> NDArray[np.int8]:
        """Classify the next rows.

        Parameters
        ----------
        batch : MeasurementBatch
            Measurements in the order of their arrival; times are finite.
        received_s : float, optional
            Time of their reception, UTC, s, of a clock that is never set back.

        Returns
        -------
        (n,) ndarray of int8
            `ACCEPTED`, `LATE`, `FUTURE` or `EXCESS` for each row.
        """
        code = np.empty(len(batch), np.int8)
        self.clock_s = np.empty(len(batch))
        kernels.admit(
            batch.time_s,
            batch.sensor,
            np.nan if received_s is None else received_s,
            self._bounds,
            self._tolerance,
            self._pace,
            self._due,
            self._clock,
            self._run,
            self._standing,
            self._lead,
            self._heard,
            code,
            self.clock_s,
        )
        if self.arrivals is not None:
            self.arrivals.count(batch, code, self.clock_s)
        return code

    def flush(self) -> None:
        """End the stream: accepted rows are released, so earlier rows are late from now on."""
        if np.isfinite(self._clock[kernels.NEWEST]):
            self._clock[kernels.CLOCK] = self._clock[kernels.FLOOR] = self._clock[kernels.NEWEST]
            self._clock[[kernels.AHEAD, kernels.OTHERS]] = self._clock[kernels.CLOCK]
        self._run[kernels.RUN_COUNT] = 0

    def set_clock(self, time_s: float) -> None:
        """Set the data clock to a time, s, as an operator says.

        Earlier measurements, up to the horizon, are accepted again after a step back.
        """
        if time_s < self.released_to_s:
            self._clock[kernels.FLOOR] = self._clock[kernels.NEWEST] = -np.inf
            self._due[:] = -np.inf
        self._clock[[kernels.CLOCK, kernels.AHEAD, kernels.OTHERS]] = time_s
        self._clock[kernels.NEWEST] = max(self._clock[kernels.NEWEST], time_s)
        self._run[kernels.RUN_COUNT] = 0
        self._standing[:, [kernels.CONTRADICTED, kernels.OFF]] = 0

    def hear(
        self, time_s: NDArray[np.float64], sensor: NDArray[np.int32], received_s: float
    ) -> None:
        """Compare the times of rows that are not admitted with others, and their reception, s."""
        kernels.hear(
            time_s, sensor, received_s, self._tolerance, self._clock, self._standing, self._lead,
            self._heard,
        )  # fmt: skip

    def leads_s(self, now_s: float) -> dict[int, float]:
        """Return the sensors heard in real time, by number.

        Parameters
        ----------
        now_s : float
            The present time of the clock that the reception is timed by, s.

        Returns
        -------
        dict
            By how much the times of each are ahead of those of their reception, s.
        """
        found = {}
        for sensor in np.flatnonzero(self._standing[:, kernels.SAMPLES] >= kernels.HEARD_MIN):
            count = min(int(self._standing[sensor, kernels.SAMPLES]), kernels.HEARD_MAX)
            heard = self._heard[sensor, :count]
            lead_s, received_s = heard[:, kernels.LEAD], heard[:, kernels.RECEIVED]
            steady = np.ptp(lead_s) <= self.tolerance_s
            if steady and now_s - received_s.max() <= kernels.HEARD_FOR_S:
                found[int(sensor)] = float(np.median(lead_s))
        return found

    def clock_leads(self) -> dict[int, float]:
        """Return the sensors whose clock is wrong by what the others say.

        Returns
        -------
        dict
            By number of the sensor, how far its last row was ahead of the data clock, s; negative
            if it was behind. Only sensors of which the last `ALARM_ROWS` rows were off.
        """
        off = np.flatnonzero(self._standing[:, kernels.OFF] >= ALARM_ROWS)
        leads = {int(sensor): float(self._lead[sensor]) for sensor in off}
        return {sensor: lead for sensor, lead in leads.items() if np.isfinite(lead)}

    def storms(self) -> list[int]:
        """Return the sensors that at present deliver more rows than they can, by number."""
        clock_s = self.released_to_s
        if not np.isfinite(clock_s):
            return []
        ahead_s, burst_s = self._due - clock_s, self._pace[:, kernels.BURST]
        # Of different lengths while another thread adds a sensor.
        both = min(len(ahead_s), len(burst_s))
        return np.flatnonzero(ahead_s[:both] > STORM_SHARE * burst_s[:both]).tolist()

    def rate_per_s(self, sensor: int) -> float:
        """Return the greatest mean rate of the rows of a sensor, 1/s of data time."""
        return 1.0 / float(self._pace[sensor, kernels.INTERVAL])

    def use_clock_of(self, state: str) -> None:
        """Continue with the data clock of a state, which may be of other sensors.

        Raises
        ------
        JournalError
            If the text is not a state of an admission.
        """
        try:
            self._clock = _clock_of(json.loads(state))
        except _MALFORMED as error:
            raise _not_a_state(state) from error
        self._run[kernels.RUN_COUNT] = 0
        # Rows counted at a clock that was farther.
        self._due = np.minimum(self._due, self.released_to_s + self._pace[:, kernels.BURST])

    def state(self) -> str:
        """Return the state as JSON, for `restore`."""
        # Hexadecimal floats are exact, and represent NaN and infinity.
        state = {
            "clock": [value.hex() for value in self._clock.tolist()],
            "run": self._run.tolist(),
        }
        contradicted = np.flatnonzero(self._standing[:, kernels.CONTRADICTED])
        if len(contradicted):
            state["contradicted"] = [
                [sensor, int(self._standing[sensor, kernels.CONTRADICTED])]
                for sensor in contradicted.tolist()
            ]
        # Those due before the data clock are as if they had no rows.
        ahead = np.flatnonzero(self._due > self._clock[kernels.CLOCK])
        if len(ahead):
            state["due"] = [[sensor, float(self._due[sensor]).hex()] for sensor in ahead.tolist()]
        return json.dumps(state)

    def restore(self, state: str) -> None:
        """Continue from a state.

        Raises
        ------
        JournalError
            If the text is not a state of an admission.
        """
        try:
            fields = json.loads(state)
            clock = _clock_of(fields)
            run = [int(value) for value in fields["run"]]
            if len(run) in _OLD_RUN:
                run += [0, -1, -1][_OLD_RUN.index(len(run)) :]
            if len(run) != len(self._run):
                msg = "wrong length"
                raise ValueError(msg)
            # What was heard stays: without it, no sensor would be heard for a while.
            standing = np.zeros_like(self._standing)
            standing[:, kernels.SAMPLES] = self._standing[:, kernels.SAMPLES]
            for sensor, count in fields.get("contradicted", []):
                standing[sensor, kernels.CONTRADICTED] = count
            due = np.full(self.sensors, -np.inf)
            for sensor, text in fields.get("due", []):
                due[sensor] = float.fromhex(text)
        except _MALFORMED as error:
            raise _not_a_state(state) from error
        self._clock = clock
        self._run = np.array(run, np.int64)
        self._standing = standing
        self._due = due


def _clock_of(fields: dict[str, Any]) -> NDArray[np.float64]:
    clock = [float.fromhex(text) for text in fields["clock"]]
    reached_s = -np.inf if np.isnan(clock[0]) else clock[0]
    if len(clock) == _OLD_CLOCK[0]:
        # Of a version in which every accepted row advanced the data clock.
        clock.append(reached_s)
    if len(clock) == _OLD_CLOCK[1]:
        # Of a version in which one sensor alone could advance it.
        clock += [reached_s, reached_s]
    if len(clock) != _OLD_CLOCK[1] + 2:
        msg = "wrong length"
        raise ValueError(msg)
    return np.array(clock)


def _not_a_state(state: str) -> JournalError:
    return JournalError(f"expected an admission state, was {state!r}")
