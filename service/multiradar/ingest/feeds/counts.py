"""Counters and states of feeds, shown by `/v1/status` and `/metrics`.

::

    reports_read     = reports_accepted + reports_rejected + reports_duplicate
    reports_accepted = rows_accepted + rows_rejected + rows_lost + on their way to the journal

Messages without a position are counted beside them.
"""

import threading
from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Any

#: States of a feed: before the first attempt, connected, waiting for a new attempt or for a peer,
#: and at the end.
STARTING, CONNECTED, WAITING, STOPPED = "starting", "connected", "waiting", "stopped"
#: Counters of a feed, in the order of the report.
NAMES = (
    "connections",
    "connection_faults",
    "octets",
    "reports_read",
    "reports_accepted",
    "reports_rejected",
    "reports_duplicate",
    "messages_without_position",
    "rows_accepted",
    "rows_rejected",
    "rows_lost",
    "batches_failed",
)


class FeedCounts:
    """Counters, state and last error by feed; thread-safe.

    Parameters
    ----------
    labels : iterable of str
        The feeds.
    """

    def __init__(self, labels: Iterable[str]) -> None:
        self._lock = threading.Lock()
        self.labels = tuple(labels)
        self._numbers = {label: dict.fromkeys(NAMES, 0) for label in self.labels}
        self._codes = {label: Counter[str]() for label in self.labels}
        self._states: dict[str, dict[str, Any]] = {
            label: {
                "endpoint": "", "state": STARTING, "last_error": None, "last_received_s": None
            }
            for label in self.labels
        }  # fmt: skip
        self._clocks: dict[str, dict[str, dict[str, Any]]] = {label: {} for label in self.labels}

    def add(self, label: str, **numbers: int) -> None:
        """Add to counters of a feed by name."""
        with self._lock:
            own = self._numbers[label]
            for name, number in numbers.items():
                own[name] += number

    def rejected(self, label: str, codes: Mapping[str, int]) -> None:
        """Add rejects of a feed by code."""
        with self._lock:
            self._codes[label].update(codes)

    def set_state(self, label: str, **values: Any) -> None:
        """Set the endpoint, state, last error or time of the last text of a feed."""
        with self._lock:
            self._states[label] |= values

    def clocks(
        self, label: str, clocks: Mapping[str, Mapping[str, Any]]
    ) -> list[tuple[str, str, str]]:
        """Set clock offset and latency of sensors; return new alarms: sensor, code and reason."""
        with self._lock:
            before = self._clocks[label]
            self._clocks[label] = {name: dict(one) for name, one in clocks.items()}
            return [
                (name, one["alarm"], one["reason"])
                for name, one in clocks.items()
                if one["alarm"] not in (None, before.get(name, {}).get("alarm"))
            ]

    def document(self) -> dict[str, Any]:
        """Return all counters and states."""
        with self._lock:
            return {
                "sources": {
                    label: {
                        **self._states[label],
                        **self._numbers[label],
                        "rejected_by_code": dict(sorted(self._codes[label].items())),
                        "clocks": {
                            name: dict(one) for name, one in sorted(self._clocks[label].items())
                        },
                    }
                    for label in self.labels
                }
            }
