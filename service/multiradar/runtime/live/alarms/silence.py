"""Total silence: no sensor delivers measurements any more.

The data time stands still without measurements, so nothing that depends on it would show that they
have ceased. This is the only part that compares data times with the clock of the machine, and no
output of the engine depends on it. It applies to data in real time; a replay of older data ends
without an alarm. Silence while the service could not receive raises none either: a proxy would send
nothing to a service that is unready for that reason.
"""

import math
from collections.abc import Callable

import numpy as np

from multiradar.clock import Clock
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.live.readiness import NO_DATA, Reason

#: Data are in real time when their time is this near to the clock of the machine, s.
REAL_TIME_WITHIN_S = 600.0
#: After a restart, so are data whose last time is at most so old, s: the service may have been
#: stopped for long, and a replay of the same day is rare.
RESTARTED_WITHIN_S = 86_400.0
#: The alarm is raised after so many scans of the fastest radar without any measurement.
SCANS = 2.0
#: Likewise without radars of known scan period, s.
WITHOUT_SCANS_S = 10.0


class Silence:
    """Time since the last measurement of any sensor; any thread reads.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    clock : Clock
        The clock of the machine.
    """

    def __init__(self, sensors: SensorTable, clock: Clock) -> None:
        self.use(sensors)
        self._clock = clock
        self._heard_s = self._received_s = math.nan
        self._behind_s = math.nan
        self._resumed_s = -math.inf
        #: Returns the time since reception of the oldest message that is not yet in the journal, s.
        self.waiting_s: Callable[[], float] = lambda: 0.0

    def use(self, sensors: SensorTable) -> None:
        """Continue with other sensors."""
        periods_s = sensors.rotation_period_s[
            np.isfinite(sensors.rotation_period_s) & ~sensors.disabled
        ]
        #: Silence from which the alarm is raised, s.
        self.bound_s = SCANS * float(periods_s.min()) if len(periods_s) else WITHOUT_SCANS_S

    def hear(self, data_clock_s: float) -> None:
        """Note the reception of measurements, with the data clock after them, s."""
        self._behind_s = self._clock.now_s() - data_clock_s
        self._heard_s = self._received_s = self._clock.monotonic_s()

    def resume(self, data_clock_s: float) -> None:
        """Continue after a restart or takeover with the data clock of the journal, s."""
        self._resumed_s = self._clock.monotonic_s()
        old_s = self._clock.now_s() - data_clock_s
        if -REAL_TIME_WITHIN_S <= old_s <= RESTARTED_WITHIN_S:
            self._behind_s = 0.0
            self._heard_s = self._resumed_s - max(old_s, 0.0)

    @property
    def received_age_s(self) -> float | None:
        """Time since the last reception, s, also in a replay; None: none since the start."""
        if math.isnan(self._received_s):
            return None
        return max(self._clock.monotonic_s() - self._received_s, 0.0)

    @property
    def duration_s(self) -> float | None:
        """Time since the last measurement, s; None without data in real time."""
        if not abs(self._behind_s) <= REAL_TIME_WITHIN_S:
            return None
        return max(self._clock.monotonic_s() - self._heard_s, 0.0)

    @property
    def delay_s(self) -> float | None:
        """Time of the machine less data time, s; None without data in real time."""
        duration_s = self.duration_s
        return None if duration_s is None else self._behind_s + duration_s

    @property
    def has_ceased(self) -> bool:
        """Whether the tracks are stale, since there are no data, for whatever reason."""
        return (self.duration_s or 0.0) > self.bound_s

    @property
    def is_alarm(self) -> bool:
        """Whether the data have ceased, and the service has been able to receive for so long.

        It is known up to the oldest message that waits: a service that is behind is not without
        data.
        """
        able_s = self._clock.monotonic_s() - self._resumed_s
        known_s = (self.duration_s or 0.0) - self.waiting_s()
        return known_s > self.bound_s and able_s > self.bound_s

    def sentence(self) -> str:
        """Return what is wrong, in words; empty without an alarm."""
        if not self.is_alarm:
            return ""
        return (
            f"no measurements from any sensor for {self.duration_s:.0f} s (limit "
            f"{self.bound_s:g} s); all tracks are stale: check the network and the converters"
        )

    def reason(self) -> Reason | None:
        """Return the alarm as a reason; None without one."""
        return Reason(NO_DATA, self.sentence()) if self.is_alarm else None
