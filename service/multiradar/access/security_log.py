"""The security log: who sent, was rejected or changed what. It never has a secret.

Its events are those of the logger `multiradar.security`. Rejections of an address are logged once a
second with the number of those between, so that an attack cannot fill a disk; that a client sends,
once a minute. The sender of each message is in the journal.
"""

import threading
from collections import OrderedDict
from collections.abc import Callable
from math import inf
from typing import Any

import structlog

from multiradar.clock import Clock

SECURITY_LOG = structlog.get_logger("multiradar.security")

#: Interval between two entries of one event and origin, s: of rejections, and of what is normal.
INTERVAL_S = 1.0
NOTE_INTERVAL_S = 60.0
#: Origins and events retained; the oldest are discarded first.
RETAINED_MAX = 4096


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
            self._seen[event, origin] = now_s, 0
            while len(self._seen) > RETAINED_MAX:
                self._seen.popitem(last=False)
        log(event, origin=origin, unlogged=unlogged, **values)
