"""Counters of the Zenoh interface, published on the status key."""

import threading
from collections import deque
from typing import Any

#: Number of alarms in the status.
_ALARMS_SHOWN = 8


class ZenohCounts:
    """Counters; thread-safe.

    ::

        messages_read = messages_taken + messages_malformed + messages_lost_upstream
                      + messages_refused      once everything is in the journal
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._numbers: dict[str, int] = dict.fromkeys(
            (
                "messages_read",
                "messages_taken",
                "messages_malformed",
                "messages_lost_upstream",
                "messages_refused",
                "rows_accepted",
                "rows_rejected",
                "rows_duplicate",
                "queries",
                "queries_refused",
                "published_tracks",
                "published_biases",
                "published_ended",
                "published_sensors",
                "published_gaps",
                "published_lost",
                "streams",
            ),
            0,
        )
        self._alarms: deque[dict[str, Any]] = deque(maxlen=_ALARMS_SHOWN)
        self._alarm_count = 0

    def add(self, **numbers: int) -> None:
        """Add to counters by name."""
        with self._lock:
            for name, number in numbers.items():
                self._numbers[name] += number

    def alarm(self, code: str, reason: str, key: str) -> None:
        """Raise an alarm for the operator; the status has the last few."""
        with self._lock:
            self._alarm_count += 1
            self._alarms.append(
                {"number": self._alarm_count, "code": code, "reason": reason, "key": key}
            )

    @property
    def alarm_count(self) -> int:
        """Number of alarms so far."""
        return self._alarm_count

    def number(self, name: str) -> int:
        """Return one counter."""
        with self._lock:
            return self._numbers[name]

    def document(self) -> dict[str, Any]:
        """Return all counters and the last alarms."""
        with self._lock:
            return {
                **self._numbers,
                "alarm_count": self._alarm_count,
                "alarms": list(self._alarms),
            }
