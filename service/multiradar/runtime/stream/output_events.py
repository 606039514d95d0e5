"""The output of the engine as numbered events, with periodic status events."""

from collections.abc import Callable

import numpy as np

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.stream.event_encoding import encode_events, event_order, status_marks
from multiradar.runtime.stream.events import EventRing
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.outputs import EngineOutput


class OutputEvents:
    """Converts output to events in the ring; written by the engine's thread.

    Parameters
    ----------
    sensors : SensorTable
        The sensors.
    limits : RuntimeLimits
        The size of the ring, and the data time between two status events.
    """

    def __init__(self, sensors: SensorTable, limits: RuntimeLimits) -> None:
        self._sensors = sensors
        self._period_s = limits.status_period_s
        self.ring = EventRing(limits.events_max)
        #: Returns the time of the machine less data time, s; None without data in real time.
        self.delay_s: Callable[[], float | None] = lambda: None
        self._reached_s, self._last_mark = -np.inf, np.nan

    def publish(self, output: EngineOutput) -> None:
        """Append the events of one output."""
        reached_s = np.maximum.accumulate(np.r_[self._reached_s, output.updates.time_s])
        self._reached_s, reached_s = float(reached_s[-1]), reached_s[1:]
        marks, self._last_mark = status_marks(
            reached_s, output.updates.sequence, self._last_mark, self._period_s
        )
        order = event_order(reached_s, output, marks)
        if len(order):
            first, table, delay_s = self.ring.head + 1, self._sensors, self.delay_s()
            self.ring.append(
                len(order),
                lambda: encode_events(first, output, marks, order, table, delay_s=delay_s),
            )

    def restart(self) -> None:
        """Discard all events: the journal is replayed from the start."""
        self._reached_s, self._last_mark = -np.inf, np.nan
        self.ring.clear()
