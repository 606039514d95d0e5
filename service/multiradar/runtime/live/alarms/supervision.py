"""What the service watches while it runs: clocks, silence, storms, disk, snapshots, rejects."""

from collections.abc import Callable
from typing import Any

from multiradar.clock import Clock
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission.admission_by_time import Admission
from multiradar.runtime.admission.arrivals import ArrivalBoard
from multiradar.runtime.admission.sources import Sources
from multiradar.runtime.live.alarms.host_clock import HostClock
from multiradar.runtime.live.alarms.sensor_alarms import SensorAlarms
from multiradar.runtime.live.alarms.silence import Silence
from multiradar.runtime.live.readiness import Check, Disk, LastMinute, lag_reason
from multiradar.runtime.live.snapshots import Snapshots
from multiradar.storage.entries import Entry

#: Alarms of the whole service, in `alarms` of the status.
NO_DATA, HOST_CLOCK, SNAPSHOTS_FAILING = "no_data", "host_clock", "snapshots_failing"
SOURCE_QUARANTINED = "source_quarantined"


class Supervision:
    """Watches what comes in; one thread notes, any thread reads.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    horizon_s : float
        Reorder horizon, s.
    clock : Clock
        The clock of the machine.
    disk : Disk
        Space for the journal.
    sources : Sources
        What each source sends.
    saturated : callable
        Returns the sensors that could lately initiate no more tracks.
    """

    def __init__(
        self,
        sensors: SensorTable,
        horizon_s: float,
        clock: Clock,
        *,
        disk: Disk,
        sources: Sources,
        saturated: Callable[[], list[str]],
    ) -> None:
        self.arrivals = ArrivalBoard(sensors, horizon_s)
        self.sensors = SensorAlarms(sensors, saturated)
        self.host_clock = HostClock(sensors, clock)
        self.silence = Silence(sensors, self.host_clock)
        self.disk = disk
        self.snapshots: Snapshots | None = None
        self._sources = sources
        self._last_minute = LastMinute(clock)
        self._admission: Admission | None = None

    def attach(self, admission: Admission) -> None:
        """Set the admission, which compares the times and counts the measurements."""
        admission.arrivals = self.arrivals
        self._admission = self.sensors.admission = self.host_clock.admission = admission
        if admission.data_clock_s is not None:
            self.silence.resume(admission.data_clock_s)

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors: those so far at their places."""
        for one in (self.arrivals, self.sensors, self.silence):
            one.use(sensors)
        self.host_clock.sensors = sensors

    def checks(self, lags_s: Callable[[], dict[str, float]], lag_max_s: float) -> list[Check]:
        """Return what makes the service unready, a lag among it, the most severe first."""

        def waiting_s() -> float:
            lags = lags_s()
            return max(lags["intake"], lags["journal"])

        self.silence.waiting_s = waiting_s
        return [
            self.disk.reason,
            lambda: lag_reason(lags_s(), lag_max_s),
            self._last_minute.reason,
            self.silence.reason,
        ]

    def note(self, entry: Entry) -> None:
        """Note an entry that is in the journal."""
        clock_s = None if self._admission is None else self._admission.data_clock_s
        if entry.accepted and clock_s is not None:
            self.silence.hear(clock_s)
        self._sources.note(entry)
        self.disk.note_written()
        self._last_minute.note(entry.accepted, entry.rejects)

    def document(self) -> dict[str, Any]:
        """Return alarms and warnings, for the status."""
        unsaved = "" if self.snapshots is None else self.snapshots.failure
        quarantined = list(self._sources.warnings())
        alarms = {
            NO_DATA: self.silence.is_alarm,
            HOST_CLOCK: self.host_clock.lead_s() is not None,
            SNAPSHOTS_FAILING: bool(unsaved),
            SOURCE_QUARANTINED: bool(quarantined),
        }
        disk_alarms, disk_warnings = self.disk.alarms()
        return {
            "arrivals": self.arrivals.records(),
            "warnings": [
                *filter(None, [self.silence.sentence(), unsaved]),
                *self.host_clock.sentences(),
                *quarantined,
                *self.arrivals.warnings(),
                *self.sensors.warnings(),
                *disk_warnings,
            ],
            "alarms": [*(name for name, raised in alarms.items() if raised), *disk_alarms],
            "data_delay_s": _rounded(self.silence.delay_s),
            "silence_s": _rounded(self.silence.duration_s),
            "silence_limit_s": self.silence.bound_s,
            "received_age_s": _rounded(self.silence.received_age_s),
        }


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 2)
