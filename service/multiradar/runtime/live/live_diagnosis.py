"""Diagnosis of sensors in the running service, from the last measurements.

Measurements are gathered over a window of data time. At the second check after its end, when the
engine has processed the last of them, a separate thread diagnoses them, and the next window starts.
No other thread waits for it, and no output depends on it.
"""

import json
import logging
import threading
from collections.abc import Sequence
from typing import Any

import polars as pl

from multiradar.diagnosis.evidence import ROWS_MAX, Evidence
from multiradar.diagnosis.findings import diagnose
from multiradar.diagnosis.model import Diagnosis
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.live.threads import SystemThreads, Thread, Threads
from multiradar.storage.entries import RejectedRow
from multiradar.tracking.outputs import EngineOutput

_log = logging.getLogger(__name__)

#: A window ends when one of its sources spans this data time, s, or reaches `ROWS_MAX` rows.
WINDOW_S = 60.0
#: Interval between checks for the end of the window, s of the machine.
PERIOD_S = 5.0
#: Codes that need more than a window: a radar without aircraft in coverage sends nothing,
#: and an airport may close at night.
_OF_LONGER_TIMES = ("no_measurements", "times_jump")
#: The code of a wrong site, and the alarm.
_SITE = "site"


class LiveDiagnosis:
    """Diagnoses incoming measurements; every method may be called from any thread.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    period_s : float
        Interval between checks for the end of a window, s.
    threads : Threads, optional
        Starts its thread; one of the system by default.
    """

    def __init__(
        self, sensors: SensorTable, period_s: float = PERIOD_S, threads: Threads | None = None
    ) -> None:
        self._threads = threads or SystemThreads()
        self._sensors = sensors
        self._period_s = period_s
        self._lock = threading.Lock()
        self._evidence = Evidence(sensors)
        self._found: tuple[Diagnosis, ...] = ()
        self._is_ended = False
        self._stopping = self._threads.event()
        self._thread: Thread | None = None

    def start(self) -> None:
        """Start the thread."""
        self._thread = self._threads.start(self._run, "diagnosis")

    def stop(self) -> None:
        """Stop; may be called twice, and without a start."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()

    def record(self, frame: pl.DataFrame, rejects: Sequence[RejectedRow]) -> None:
        """Record measurements as received, and their rejected rows."""
        if self._thread is None:
            return
        with self._lock:
            if len(frame):
                self._evidence.record_rows(frame)
            for row in rejects:
                self._evidence.reject(_sensor_of(row), row.code)

    def put(self, output: EngineOutput) -> None:
        """Record output of the engine."""
        if self._thread is None:
            return
        with self._lock:
            self._evidence.record_output(output)

    def restart(self) -> None:
        """Start over: the engine restarts, and its output has been diagnosed."""
        with self._lock:
            self._evidence = Evidence(self._sensors)

    def use(self, sensors: SensorTable) -> None:
        """Start over with other sensors."""
        self._sensors = sensors
        self.restart()

    def set_back(self) -> None:
        """Start over: earlier times follow."""
        self.restart()

    def records(self) -> list[dict[str, str]]:
        """Return the present findings."""
        return [one.document() for one in self._found]

    def of(self, sensor_id: str) -> list[dict[str, str]]:
        """Return the present findings about a sensor."""
        return [one for one in self.records() if one["sensor_id"] == sensor_id]

    def confirmed(self, sensor_id: str, alarms: Sequence[str]) -> list[str]:
        """Return the alarms of a sensor without `site` while the wrong site is that of another.

        Tracks follow the most accurate radar; if its site is wrong, the others seem displaced.
        """
        sites = {one.sensor_id for one in self._found if one.code == _SITE}
        is_other = bool(sites) and sensor_id not in sites
        return [one for one in alarms if not (is_other and one == _SITE)]

    def check(self) -> bool:
        """Diagnose if the window had ended at the check before; return whether it had."""
        with self._lock:
            evidence = self._evidence
            was_ended, self._is_ended = self._is_ended, _is_over(evidence)
            if not (was_ended and self._is_ended):
                return False
            self._evidence, self._is_ended = Evidence(self._sensors), False
        found = tuple(one for one in diagnose(evidence) if one.code not in _OF_LONGER_TIMES)
        known = {(one.sensor_id, one.code) for one in self._found}
        for one in found:
            if (one.sensor_id, one.code) not in known:
                _log.warning("diagnosis: %s", one.sentence)
        self._found = found
        return True

    def _run(self) -> None:
        while not self._stopping.wait(self._period_s):
            try:
                self.check()
            except Exception as error:
                # The service continues without a diagnosis.
                _log.error("diagnosis failed", exc_info=error)


def _is_over(evidence: Evidence) -> bool:
    sources = evidence.sources.values()
    return any(one.last_s - one.first_s >= WINDOW_S or one.read >= ROWS_MAX for one in sources)


# A row rejected at the interface is arbitrary text of the sender.
def _sensor_of(row: RejectedRow) -> str:
    try:
        raw: Any = json.loads(row.raw)
    except ValueError:
        return ""
    name = raw.get("sensor_id") if isinstance(raw, dict) else None
    return name if isinstance(name, str) else ""
