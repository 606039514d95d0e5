"""The security log: who sent, was rejected or changed what. It never has a secret.

Its events are those of the logger `multiradar.security`. Rejections of an address are logged once a
second with the number of those between, and those of all addresses ten times a second: addresses
may be forged, and an attack must not fill a disk. That a client sends is logged once a minute. The
sender of each message is in the journal.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Any

import structlog

from multiradar.clock import Clock

SECURITY_LOG = structlog.get_logger("multiradar.security")

#: Interval between two entries of one event and origin, s: of rejections, and of what is normal.
INTERVAL_S = 1.0
NOTE_INTERVAL_S = 60.0
#: Maximum entries of one event within `INTERVAL_S`, of all origins.
ENTRIES_MAX = 10
#: Origins and events retained; the oldest are discarded first.
RETAINED_MAX = 4096


# Entries of an event since a time, s, and what was not logged and is of no retained origin.
@dataclass(slots=True)
class _Event:
    begin_s: float = -inf
    entries: int = 0
    unlogged: int = 0


class RepeatedEvents:
    """Logs events that others can cause at will; for any thread.

    Parameters
    ----------
    clock : Clock
        Monotonic time.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._seen: OrderedDict[tuple[str, str], tuple[float, int]] = OrderedDict()
        self._events: dict[str, _Event] = {}
        self._lock = threading.Lock()

    def warn(self, event: str, origin: str, **values: Any) -> None:
        """Log a rejection of an address or client, or count it for the next entry."""
        self._log(SECURITY_LOG.warning, INTERVAL_S, event, origin, values)

    def note(self, event: str, origin: str, **values: Any) -> None:
        """Log what an address or client does all the time."""
        self._log(SECURITY_LOG.info, NOTE_INTERVAL_S, event, origin, values)

    def _log(
        self,
        log: Callable[..., Any],
        interval_s: float,
        event: str,
        origin: str,
        values: dict[str, Any],
    ) -> None:
        now_s = self._clock.monotonic_s()
        with self._lock:
            since_s, unlogged = self._seen.pop((event, origin), (-inf, 0))
            if now_s - since_s < interval_s:
                self._seen[event, origin] = since_s, unlogged + 1
                return
            every = self._events.setdefault(event, _Event())
            if now_s - every.begin_s >= INTERVAL_S:
                every.begin_s, every.entries = now_s, 0
            if every.entries >= ENTRIES_MAX:
                every.unlogged += unlogged + 1
                return
            every.entries += 1
            others, every.unlogged = every.unlogged, 0
            self._seen[event, origin] = now_s, 0
            while len(self._seen) > RETAINED_MAX:
                (name, _), (_, discarded) = self._seen.popitem(last=False)
                self._events[name].unlogged += discarded
        log(event, origin=origin, unlogged=unlogged, unlogged_others=others, **values)
