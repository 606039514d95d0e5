"""Counters of ASTERIX listeners, shown by `/v1/status` and `/metrics`.

::

    octets  = dropped + waiting + decoding + framing + decoded + skipped + quarantined
    records = measurement + duplicate + left_out + refused           target reports only
    measurement = accepted + rejected + lost + on their way to the journal
"""

import threading
from collections import Counter
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from typing import Any

#: Counters of a listener, in the order of the report.
NAMES = (
    "datagrams",
    "octets",
    "datagrams_dropped",
    "octets_dropped",
    "octets_framing",
    "octets_decoded",
    "octets_skipped",
    "octets_quarantined",
    "records_measurement",
    "records_duplicate",
    "records_left_out",
    "records_refused",
    "rows_accepted",
    "rows_rejected",
    "rows_lost",
    "receive_faults",
)


class AsterixCounts:
    """Counters by listener; thread-safe.

    Parameters
    ----------
    labels : iterable of str
        The listeners.
    """

    def __init__(self, labels: Iterable[str]) -> None:
        # Of one thread several times: see `at_once`.
        self._lock = threading.RLock()
        self.labels = tuple(labels)
        self._numbers = [dict.fromkeys(NAMES, 0) for _ in self.labels]
        self._codes: list[Counter[str]] = [Counter() for _ in self.labels]
        self._categories: Counter[int] = Counter()
        self._batches_failed = self._decoding_octets = 0
        self._clocks: dict[str, dict[str, Any]] = {}
        # Evaluated on reading: what waits, and what the system dropped.
        self.waiting: Callable[[], tuple[int, int]] = lambda: (0, 0)
        self.lost_by_system: Callable[[int], int] = lambda _listener: 0
        self.endpoint: Callable[[int], str] = lambda _listener: ""
        self.status: Callable[[int], Mapping[str, Any]] = lambda _listener: {}

    def add(self, listener: int, **numbers: int) -> None:
        """Add to counters of a listener by name."""
        with self._lock:
            own = self._numbers[listener]
            for name, number in numbers.items():
                own[name] += number

    def at_once(self) -> AbstractContextManager[object]:
        """Return a context in which no document is made: its changes appear together."""
        return self._lock

    def decoding(self, octets: int) -> None:
        """Add octets that left the queue to be decoded; negative when they are in other counts."""
        with self._lock:
            self._decoding_octets += octets

    def rejected(self, listener: int, codes: Mapping[str, int]) -> None:
        """Add rejects of a listener by code."""
        with self._lock:
            self._codes[listener].update(codes)

    def decoded(self, categories: Mapping[int, int]) -> None:
        """Add records by category."""
        with self._lock:
            self._categories.update(categories)

    def clocks(self, clocks: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str, str]]:
        """Set clock offset and latency of sensors; return new alarms: sensor, code and reason."""
        with self._lock:
            before = self._clocks
            self._clocks = before | {name: dict(one) for name, one in clocks.items()}
            return [
                (name, one["alarm"], one["reason"])
                for name, one in clocks.items()
                if one["alarm"] not in (None, before.get(name, {}).get("alarm"))
            ]

    def batch_failed(self) -> None:
        """Count a batch, or part of one, that failed to decode because of an internal error."""
        with self._lock:
            self._batches_failed += 1

    def number(self, listener: int, name: str) -> int:
        """Return one counter."""
        with self._lock:
            return self._numbers[listener][name]

    def document(self) -> dict[str, Any]:
        """Return all counters."""
        with self._lock:
            datagrams, octets = self.waiting()
            listeners = {
                label: {
                    "endpoint": self.endpoint(k),
                    **self.status(k),
                    **self._numbers[k],
                    "datagrams_lost_by_system": self.lost_by_system(k),
                    "refused_by_code": dict(sorted(self._codes[k].items())),
                }
                for k, label in enumerate(self.labels)
            }
            return {
                "listeners": listeners,
                "records_by_category": {
                    f"{category:03d}": count for category, count in sorted(self._categories.items())
                },
                "clocks": {name: dict(one) for name, one in sorted(self._clocks.items())},
                "waiting_datagrams": datagrams,
                "waiting_octets": octets,
                "decoding_octets": self._decoding_octets,
                "batches_failed": self._batches_failed,
            }
