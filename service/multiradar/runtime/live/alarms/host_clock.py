"""The clock of the machine: times of reception, and alarms where it or all sensors are wrong.

Reception is timed by the monotonic clock from the system time of the start, which may itself have
been wrong. A step of the system time is therefore followed if there are reasons for it other than
the step: see `HostClock.now_s`. What is received is dated with that time, and the journal contains
what was accepted; no output of the engine depends on the alarms.
"""

import logging
import math
import threading
from collections.abc import Callable
from statistics import median

from multiradar.clock import Clock
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.admission.admission_by_time import Admission
from multiradar.runtime.live.alarms.silence import REAL_TIME_WITHIN_S

#: The system time was set when it moved by more than this against the monotonic clock, s.
SET_BY_S = 1.0
#: All sensors are apart from the clock of the machine by more than this, s: no network delays all.
APART_S = 10.0
#: A step is evaluated so often, s of the monotonic clock.
EVALUATED_EVERY_S = 1.0
#: Beyond it measurements are those of a replay in real time, s: a date and a time zone.
APART_MAX_S = 26 * 3600.0
_DAY_S = 86_400.0
_log = logging.getLogger(__name__)


class HostClock:
    """Compares the clock of the machine with those of the sensors; any thread reads.

    It is a `Clock` that dates what is received.

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
        # Steps of the system time that `now_s` has followed, s, and when one was last evaluated.
        self._followed_s, self._evaluated_s = 0.0, -math.inf
        self._evaluating = threading.Lock()
        #: Hears the sensors; None before the start.
        self.admission: Admission | None = None

    def now_s(self) -> float:
        """Return the time of a reception now, UTC, s, which does not follow every step.

        A step of the system time is followed if most of the sensors that are heard in real time
        agree better with the system time after it, by `APART_S` or half the step, or if no sensor
        is heard. Times are compared within the day first, since radars report only a time of day,
        and what they send is dated with this time; then with the date.
        """
        if abs(self.apart_s) > SET_BY_S:
            with self._evaluating:
                self._evaluate()
        return self.received_s + self._followed_s

    def monotonic_s(self) -> float:
        """Return seconds since an arbitrary origin, never going back."""
        return self._clock.monotonic_s()

    def agreeing(self, time_s: float) -> Callable[[], None]:
        """Return what follows a step of the system time to the time that an operator gives now.

        To be called when that command is in the journal. It follows if both are the same within
        `APART_S`, or half the step. Another time is one of a replay.
        """
        given_s = self.received_s

        def agree() -> None:
            with self._evaluating:
                apart_s, off_s = self.apart_s, time_s - (given_s + self._followed_s)
                left_s = abs(off_s - apart_s)
                near = left_s < abs(off_s) and left_s <= max(APART_S, 0.5 * abs(apart_s))
                if abs(apart_s) > SET_BY_S and near:
                    self._follow(apart_s)

        return agree

    @property
    def received_s(self) -> float:
        """Time of a reception now, UTC, s, for comparisons: no step is ever followed."""
        return self._started_s + self._clock.monotonic_s()

    @property
    def apart_s(self) -> float:
        """By how much the system time is ahead of `now_s`, s: a step that was not followed."""
        return self._clock.now_s() - self.received_s - self._followed_s

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
        self.now_s()  # also where nothing is received
        if abs(self.apart_s) > SET_BY_S:
            found.append(
                f"the system clock has been stepped by {self.apart_s:+.1f} s since the service "
                "started, but times of reception have not followed, because the sensors do not "
                "confirm it: check the time synchronisation; if the system clock is right, set "
                "the data time"
            )
        return found

    # By number of the sensor, against the present system time.
    def _leads_s(self) -> dict[int, float]:
        return self._leads_after(self.apart_s + self._followed_s)

    # By number of the sensor, against the time of the start after steps of so much.
    def _leads_after(self, steps_s: float) -> dict[int, float]:
        if self.admission is None:
            return {}
        leads_s = self.admission.leads_s(self.received_s)
        return {sensor: lead_s - steps_s for sensor, lead_s in leads_s.items()}

    # Another thread may just have followed the step.
    def _evaluate(self) -> None:
        apart_s, monotonic_s = self.apart_s, self.monotonic_s()
        if abs(apart_s) <= SET_BY_S or monotonic_s - self._evaluated_s < EVALUATED_EVERY_S:
            return
        self._evaluated_s = monotonic_s
        leads_s = self._leads_after(self._followed_s)
        if not leads_s or sum(_confirmed(one, apart_s) for one in leads_s.values()) > 0:
            self._follow(apart_s)

    def _follow(self, step_s: float) -> None:
        self._followed_s += step_s
        _log.warning("times of reception follow a step of the system clock by %+.1f s", step_s)


# Whether a sensor with a lead confirms a step (1) or contradicts it (-1), or neither (0).
def _confirmed(lead_s: float, step_s: float) -> int:
    for distance_s in (_within_day, abs):
        gain_s = distance_s(lead_s) - distance_s(lead_s - step_s)
        if abs(gain_s) > min(APART_S, 0.5 * abs(step_s)):
            return 1 if gain_s > 0.0 else -1
    return 0


def _within_day(lead_s: float) -> float:
    return abs(math.remainder(lead_s, _DAY_S))
