"""Pauses publishing while a subscriber joins.

An advanced subscriber queries the caches for the history when it joins, and again for samples that
it misses meanwhile. If an update of a track arrives between the end of the first query and the
answer to the second, the subscriber takes it as the beginning and discards the history
(eclipse-zenoh 1.10). Therefore the first query is held open, and nothing is published, until there
are no more queries, and for another gap after its end, which an update may overtake. A subscriber
that reconnects queries again, so there is a pause for every new connection. The pause is bounded,
and so is its fraction of the time.
"""

import threading
from collections.abc import Callable

from multiradar.clock import Clock
from multiradar.ingest.zenoh.bus import Request

#: Subscribers have caught up after so long without a query, …
QUERY_GAP_S = 0.05
#: … plus the time of the answers of the caches, per cached sample.
ANSWER_S = 5e-6
#: Maximum of the sum, for thousands of tracks.
QUERY_GAP_MAX_S = 0.5
#: Maximum pause.
WAIT_MAX_S = 2.0
#: Maximum pause in a row, for any number of joins …
ALLOWANCE_MAX_S = 3.0
#: … and the maximum fraction of the time in the long run.
ALLOWANCE_SHARE = 0.2
#: Maximum queries held open.
_HELD_MAX = 256


class JoinGate:
    """Detects joining subscribers.

    Parameters
    ----------
    clock : Clock
        For the limits.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._held: list[Request] = []
        self._waiting = False
        self._began_s = 0.0
        self._ends_s = float("-inf")
        self._queried_s = 0.0
        self._allowance_s = ALLOWANCE_MAX_S
        self._counted_s = float("-inf")
        self._lock = threading.Lock()
        self.waits = 0
        #: Samples in the caches; set by the publisher.
        self.samples = 0

    @property
    def closed(self) -> bool:
        """True while publishing is paused."""
        return self._waiting

    def on_arrival(self) -> None:
        """Start a pause for a new connection: it may query the history at once.

        An update sent before that query would be its first of a track that was initiated while it
        was disconnected, and it would take the update as the beginning of the track.
        """
        now_s = self._clock.monotonic_s()
        with self._lock:
            self._queried_s = now_s
            if not self._waiting:
                self._begin(now_s)

    def on_query(self, request: Request) -> None:
        """Register a query to the caches; the caches answer it themselves."""
        now_s = self._clock.monotonic_s()
        # A query for one track, or from a number on, does not come from a joining subscriber.
        joining = "_sn" not in request.parameters and "*" in request.key.partition("/@adv")[0]
        with self._lock:
            self._queried_s = now_s
            if joining and not self._waiting:
                self._begin(now_s)
            keep = joining and self._waiting and now_s < self._ends_s
            keep = keep and len(self._held) < _HELD_MAX
            if keep:
                self._held.append(request)
        if not keep:
            request.finish()

    def wait_for_joins(self, pause: Callable[[float], None]) -> None:
        """Wait while a subscriber joins, then finish the queries held open."""
        while self._waiting:
            now_s = self._clock.monotonic_s()
            with self._lock:
                gap_s = self._queried_s + self._query_gap_s() - now_s
                left_s = self._ends_s - now_s
                if min(gap_s, left_s) > 0.0:
                    remaining_s = min(gap_s, left_s)
                    done: list[Request] = []
                else:
                    remaining_s = 0.0
                    done, self._held = self._held, []
                    self._queried_s = now_s
                    # Otherwise the gap after the end of the queries begins.
                    if not done or left_s <= 0.0:
                        self._waiting = False
                        self._allowance_s -= now_s - self._began_s
                        self._counted_s = self._ends_s = now_s
            for request in done:
                request.finish()
            if remaining_s > 0.0:
                pause(remaining_s)

    def _query_gap_s(self) -> float:
        if not self._held:  # A new connection that may not need the history.
            return QUERY_GAP_S
        return min(QUERY_GAP_S + ANSWER_S * self.samples, QUERY_GAP_MAX_S)

    def _begin(self, now_s: float) -> None:
        gained_s = ALLOWANCE_SHARE * (now_s - self._counted_s)
        self._allowance_s = min(self._allowance_s + gained_s, ALLOWANCE_MAX_S)
        self._counted_s = now_s
        if self._allowance_s > QUERY_GAP_S:
            self._waiting = True
            self._began_s = now_s
            self._ends_s = now_s + min(WAIT_MAX_S, self._allowance_s)
            self.waits += 1
