"""The clock of the machine: times of reception, and alarms where it or all sensors are wrong.

Reception is timed by the monotonic clock, which no correction of the system time moves. No output
of the engine depends on the alarms.
"""

from statistics import median

from multiradar.clock import Clock
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission.admission_by_time import Admission
from multiradar.runtime.live.alarms.silence import REAL_TIME_WITHIN_S

#: The system time was set when it moved by more than this against the monotonic clock, s.
SET_BY_S = 1.0
#: All sensors are apart from the clock of the machine by more than this, s: no network delays all.
APART_S = 10.0
#: Beyond it measurements are those of a replay in real time, s: a date and a time zone.
APART_MAX_S = 26 * 3600.0


class HostClock:
    """Compares the clock of the machine with those of the sensors; any thread reads.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    clock : Clock
        The clock of the machine.
    """

    def __init__(self, sensors: SensorTable, clock: Clock) -> None:
        #: The sensors.
        self.sensors = sensors
        self._clock = clock
        self._started_s = clock.now_s() - clock.monotonic_s()
        #: Hears the sensors; None before the start.
        self.admission: Admission | None = None

    @property
    def received_s(self) -> float:
        """Time of a reception now, UTC, s; never set back."""
        return self._started_s + self._clock.monotonic_s()

    @property
    def set_by_s(self) -> float:
        """By how much the system time was set since the start, s."""
        return self._clock.now_s() - self.received_s

    def live(self) -> list[str]:
        """Return the sensors that deliver in real time."""
        return [
            self.sensors.ids[sensor]
            for sensor, lead_s in self._leads_s().items()
            if abs(lead_s) <= REAL_TIME_WITHIN_S
        ]

    def lead_s(self) -> float | None:
        """Return by how much all sensors are ahead of this machine, s; None if they are not."""
        leads_s = list(self._leads_s().values())
        if len(leads_s) < min(2, len(self.sensors)):
            return None
        lead_s = median(leads_s)
        alike = all(
            APART_S < one * (1.0 if lead_s > 0.0 else -1.0) < APART_MAX_S for one in leads_s
        )
        return lead_s if alike else None

    def sentences(self) -> list[str]:
        """Return what is wrong, in words."""
        found = []
        lead_s = self.lead_s()
        if lead_s is not None:
            side = "ahead of" if lead_s > 0.0 else "behind"
            found.append(
                f"the clocks of all {len(self._leads_s())} real-time sensors are "
                f"{abs(lead_s):.0f} s {side} the system clock: check the system clock and the "
                "time source of the sensors"
            )
        if abs(self.set_by_s) > SET_BY_S:
            found.append(
                f"the system clock has been stepped by {self.set_by_s:+.1f} s since the service "
                "started, but the data time has not followed: check the time synchronisation"
            )
        return found

    # By number of the sensor, against the present system time.
    def _leads_s(self) -> dict[int, float]:
        if self.admission is None:
            return {}
        set_by_s = self.set_by_s
        leads_s = self.admission.leads_s(self.received_s)
        return {sensor: lead_s - set_by_s for sensor, lead_s in leads_s.items()}
