"""Clock offset and latency of sensors from their latest messages."""

from collections import deque
from collections.abc import Iterable

import numpy as np

from multiradar_converters.asterix.decoding.sensor_clocks import (
    Differences,
    SensorClock,
    clock_alarm,
    receiver_zone_s,
    sensor_clock,
)

#: Messages of a sensor that are retained, of reports and of service messages each.
RETAINED_MAX = 512


class RecentDifferences:
    """Retains how much later the latest messages were received than their times.

    Parameters
    ----------
    sources : iterable of int
        The sources to retain; bounds the memory.
    """

    def __init__(self, sources: Iterable[int]) -> None:
        self._found = {
            source: (deque[float](maxlen=RETAINED_MAX), deque[float](maxlen=RETAINED_MAX))
            for source in sources
        }
        self._clocks: dict[int, SensorClock] = {}

    def extend(self, sources: Iterable[int]) -> None:
        """Retain those of further sources, too."""
        more = RecentDifferences(sources)._found
        self._found = more | self._found

    def push(self, found: Differences) -> None:
        """Add messages; those of other sources are ignored."""
        for source in np.unique(found.source).tolist():
            if source not in self._found:
                continue
            own = found.source == source
            reports, services = self._found[source]
            reports.extend(found.delay_s[own & found.report][-RETAINED_MAX:].tolist())
            services.extend(found.delay_s[own & ~found.report][-RETAINED_MAX:].tolist())
            self._clocks[source] = sensor_clock(np.array(reports), np.array(services))

    def document(self) -> dict[int, dict[str, object]]:
        """Return the figures of each source, and its alarm: code and reason, or None."""
        zone_s = receiver_zone_s(self._clocks)
        return {
            source: one.document() | _alarm(clock_alarm(one, zone_s))
            for source, one in sorted(self._clocks.items())
        }


def _alarm(alarm: tuple[str, str] | None) -> dict[str, object]:
    code, reason = alarm or (None, None)
    return {"alarm": code, "reason": reason}
