"""Diagnosis of sensors in the running service, from the last measurements.

Measurements are gathered over a window of data time. At the second check after its end, when the
engine has processed the last of them, a separate thread diagnoses them, and the next window starts.
The end of a stream ends the window at once: no measurements follow that would end it.
No other thread waits for it, and no output depends on it. Its thread pauses between pieces, so that
it uses a fraction of a core and leaves the rest to the engine; a stop abandons it. Findings hold as
in `HeldFindings`.
"""

import json
import logging
import math
import threading
from collections.abc import Callable, Sequence
from dataclasses import fields
from typing import Any

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.clock import Clock, SystemClock
from multiradar.diagnosis.evidence import ROWS_MAX, Evidence
from multiradar.diagnosis.findings import diagnose
from multiradar.diagnosis.held_findings import HeldFindings
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.live.threads import SystemThreads, Thread, Threads
from multiradar.storage.entries import RejectedRow
from multiradar.tracking.outputs import EngineOutput
from multiradar_schemas.reject import UNKNOWN_SOURCE, RejectCode

_log = logging.getLogger(__name__)

#: A window ends when one of its sources spans this data time, s, or a radar has `ROWS_MAX` plots.
WINDOW_S = 60.0
#: ... or so many records of an unknown source were rejected.
UNKNOWN_MAX = 100
#: At the end of a stream, a window that spans less is discarded, unless it is the only one, s.
REMAINDER_MIN_S = 30.0
#: Interval between checks for the end of the window, s of the machine.
PERIOD_S = 5.0
#: Fraction of the time in which a diagnosis runs: one of 105 sensors takes 50 s of CPU time for
#: each minute of data, which delayed the output of the engine on two cores.
BUSY_SHARE = 0.25
#: It pauses after pieces of this duration, for at most so long, s.
PIECE_S, PAUSE_MAX_S = 0.02, 2.0
#: Codes that need more than a window: a radar without aircraft in coverage sends nothing,
#: and an airport may close at night. A sensor that ends before the others is silent, which its
#: alarm says until it sends again.
_OF_LONGER_TIMES = ("no_measurements", "times_jump", "ends_early", "starts_late", "pause")
#: Columns of a table of sensors with a row for each bias parameter; the first is its sensor.
_OF_PARAMETERS = ("parameter_sensor", "parameter_kind", "prior_mean", "prior_sigma", "drift")


class _StoppedError(Exception):
    # The service stops, which does not wait for a diagnosis.
    pass


class LiveDiagnosis:
    """Diagnoses incoming measurements; every method may be called from any thread.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    data_time : callable, optional
        Returns the data time, s, from which the findings of a window hold; None before any.
    period_s : float
        Interval between checks for the end of a window, s.
    threads : Threads, optional
        Starts its thread; one of the system by default.
    clock : Clock, optional
        Times its pieces.
    """

    def __init__(
        self, sensors: SensorTable, data_time: Callable[[], float | None] = lambda: None,
        period_s: float = PERIOD_S, threads: Threads | None = None, clock: Clock | None = None,
    ) -> None:  # fmt: skip
        self._threads = threads or SystemThreads()
        self._clock = clock or SystemClock()
        # When its thread continued after the last pause; None outside of it.
        self._continued_s: float | None = None
        self._sensors = sensors
        self._data_time = data_time
        self._period_s = period_s
        self._lock = threading.Lock()
        self._evidence = self._opened(sensors)
        self._held = HeldFindings()
        self._is_ended = False
        # Whether no window of the stream was diagnosed; ends of streams, and those diagnosed.
        self._is_first = True
        self._ends = self._ends_diagnosed = 0
        self._is_stopping = False
        self._waking = self._threads.event()
        self._thread: Thread | None = None

    def start(self) -> None:
        """Start the thread."""
        self._thread = self._threads.start(self._run, "diagnosis")

    def stop(self) -> None:
        """Stop, and abandon a diagnosis; may be called twice, and without a start."""
        with self._lock:
            self._is_stopping, waking = True, self._waking
        waking.set()
        if self._thread is not None:
            self._thread.join()

    def record(self, frame: pl.DataFrame, rejects: Sequence[RejectedRow]) -> None:
        """Record measurements as received, and their rejected rows."""
        if self._thread is None:
            return
        with self._lock:
            self._evidence.record_rows(frame)
            for row in rejects:
                self._evidence.reject(_sensor_of(row), row.code)

    def put(self, output: EngineOutput) -> None:
        """Record output of the engine."""
        if self._thread is None:
            return
        with self._lock:
            self._evidence.record_output(output)

    def end_stream(self) -> None:
        """Diagnose the measurements of an unfinished window at once: the stream has ended."""
        if self._thread is None:
            return
        with self._lock:
            self._ends += 1
            waking = self._waking
        waking.set()

    @property
    def is_pending(self) -> bool:
        """Whether the diagnosis of a stream that has ended is not complete."""
        with self._lock:
            return self._ends > self._ends_diagnosed

    def restart(self) -> None:
        """Start over without findings: the engine restarts."""
        with self._lock:
            self._evidence = self._opened(self._sensors)
            self._held.clear()

    def use(self, sensors: SensorTable) -> None:
        """Start over with other sensors, without findings about those that changed."""
        with self._lock:
            names = {*self._sensors.ids, *sensors.ids} if sensors is not self._sensors else set()
            changed = {
                name
                for name in names
                if not _is_alike(_described(self._sensors, name), _described(sensors, name))
            }
            self._held.discard(changed, self._data_time_s())
            self._sensors, self._evidence = sensors, self._opened(sensors)

    def set_back(self) -> None:
        """Start over: earlier times follow."""
        with self._lock:
            self._evidence = self._opened(self._sensors)

    def records(self, at_s: float | None = None) -> list[dict[str, str]]:
        """Return the findings that hold, or held at a past data time, s."""
        with self._lock:
            found = self._held.at(at_s)
        return [one.document() for one in found]

    def check(self) -> bool:
        """Diagnose if the stream, or at the check before the window, had ended; return whether."""
        with self._lock:
            ends = self._ends
        try:
            return self._check(ends > self._ends_diagnosed)
        except _StoppedError:
            return False
        finally:
            with self._lock:
                self._ends_diagnosed = ends

    def _check(self, is_last: bool) -> bool:
        with self._lock:
            evidence = self._evidence
            was_ended, self._is_ended = self._is_ended, _is_over(evidence)
            is_due = was_ended and self._is_ended
            if is_last:
                least_s = 0.0 if self._is_first else REMAINDER_MIN_S
                is_due = _is_over(evidence) or _span_s(evidence) >= least_s
            if not (is_last or is_due):
                return False
            following = self._evidence = self._opened(self._sensors)
            self._is_ended, self._is_first = False, is_last
            if not is_due:
                return False
        found = [one for one in diagnose(evidence) if one.code not in _OF_LONGER_TIMES]
        delivered = {name for name, source in evidence.sources.items() if source.read}
        with self._lock:
            # Restarted meanwhile, or with other sensors: the findings are out of date.
            if self._evidence is following:
                for one in self._held.update(found, delivered, self._data_time_s()):
                    _log.warning("diagnosis: %s", one.sentence)
        return True

    # Reports of all aircraft by one receiver must not end the window before a radar has seen them.
    def _opened(self, sensors: SensorTable) -> Evidence:
        return Evidence(sensors, spreads_positions=True, proceed=self._proceed)

    # Between two pieces of a diagnosis.
    def _proceed(self) -> None:
        if self._continued_s is not None:
            busy_s = self._clock.monotonic_s() - self._continued_s
            if busy_s >= PIECE_S:
                # Not after the end of a stream, which clients wait for: the event is set then.
                self._waking.wait(min(busy_s * (1.0 / BUSY_SHARE - 1.0), PAUSE_MAX_S))
                self._continued_s = self._clock.monotonic_s()
        if self._is_stopping:
            raise _StoppedError

    def _data_time_s(self) -> float:
        time_s = self._data_time()
        return -math.inf if time_s is None else time_s

    def _run(self) -> None:
        while True:
            with self._lock:
                waking = self._waking
            if waking.wait(self._period_s):
                with self._lock:
                    if self._is_stopping:
                        return
                    self._waking = self._threads.event()
            self._continued_s = self._clock.monotonic_s()
            try:
                self.check()
            except Exception as error:
                # The service continues without a diagnosis.
                _log.error("diagnosis failed", exc_info=error)


# Minus infinity without measurements.
def _span_s(evidence: Evidence) -> float:
    spans_s = [one.last_s - one.first_s for one in evidence.sources.values() if one.read]
    return max(spans_s, default=-math.inf)


# Records of an unknown ASTERIX source have no time.
def _is_over(evidence: Evidence) -> bool:
    return any(
        one.last_s - one.first_s >= WINDOW_S
        or (one.read >= ROWS_MAX and not one.spread)
        or one.rejected[RejectCode.UNKNOWN_SENSOR] >= UNKNOWN_MAX
        for one in evidence.sources.values()
    )


# The columns of a sensor, and of its bias parameters; empty if there is no such sensor.
def _described(sensors: SensorTable, name: str) -> list[NDArray[Any]]:
    if name not in sensors.ids:
        return []
    row = sensors.ids.index(name)
    own = sensors.parameter_sensor == row
    columns = {one.name: getattr(sensors, one.name) for one in fields(sensors)}
    of_sensor = [
        column[row]
        for name, column in columns.items()
        if name not in _OF_PARAMETERS and isinstance(column, np.ndarray) and len(column)
    ]
    return [*of_sensor, *(columns[name][own] for name in _OF_PARAMETERS[1:])]


def _is_alike(before: list[NDArray[Any]], now: list[NDArray[Any]]) -> bool:
    return len(before) == len(now) and all(
        np.array_equal(old, new, equal_nan=True) for old, new in zip(before, now, strict=True)
    )


# A row rejected at the interface is arbitrary text of the sender; of an ASTERIX record without a
# sensor, the reason has the source.
def _sensor_of(row: RejectedRow) -> str:
    source = row.reason.partition(UNKNOWN_SOURCE)[2]
    if source:
        return source
    if not row.raw:
        # Of a storm, most rows are kept without their content.
        return ""
    try:
        raw: Any = json.loads(row.raw)
    except (ValueError, RecursionError):
        return ""
    name = raw.get("sensor_id") if isinstance(raw, dict) else None
    return name if isinstance(name, str) else ""
