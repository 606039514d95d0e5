"""Subscribers that join while updates flow: publishing waits a moment for them.

An advanced subscriber asks the caches for the history when it joins, and for what it misses while
the answer is on its way. If an update of a track arrives between the end of the first and the
answer to the second, the subscriber takes it for the beginning and throws the history away
(eclipse-zenoh 1.10). So its first question is not ended, and nothing is published, until it asks no
more. Who comes back after a lost connection asks again; so a moment is waited for everybody who
connects. The wait is bounded, and so is its share of the time.
"""

import threading
from collections.abc import Callable

from multiradar.clock import Clock
from multiradar.ingest.zenoh.bus import Request

#: Nobody asked for so long: they have caught up, …
QUIET_S = 0.05
#: … when the caches have answered by then. So long it takes them for each sample that they hold.
ANSWER_S = 5e-6
#: The caches of thousands of tracks are not waited for to the end.
QUIET_MAX_S = 0.5
#: Longest wait.
WAIT_MAX_S = 2.0
#: Time that may be waited in a row, however many join …
ALLOWANCE_MAX_S = 3.0
#: … and the share of the time that may be waited in the long run.
ALLOWANCE_SHARE = 0.2
#: Questions that are kept open at a time.
_HELD_MAX = 256


class JoinGate:
    """Knows whether somebody is joining.

    Parameters
    ----------
    clock : Clock
        For the bounds.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._held: list[Request] = []
        self._waiting = False
        self._began_s = 0.0
        self._ends_s = float("-inf")
        self._asked_s = 0.0
        self._allowance_s = ALLOWANCE_MAX_S
        self._counted_s = float("-inf")
        self._lock = threading.Lock()
        self.waits = 0
        #: Samples that the caches hold; the publisher says it.
        self.samples = 0

    @property
    def closed(self) -> bool:
        """True while publishing waits."""
        return self._waiting

    def on_arrival(self) -> None:
        """Wait a moment for somebody who connected: they may ask for the history at once.

        An update sent before that would be the first that they see of a track that began while they
        were away, and they would take it for its beginning.
        """
        now_s = self._clock.monotonic_s()
        with self._lock:
            self._asked_s = now_s
            if not self._waiting:
                self._begin(now_s)

    def on_query(self, request: Request) -> None:
        """Take a question to the caches; the caches answer it themselves."""
        now_s = self._clock.monotonic_s()
        # A question about one track, or from a number on, is not that of a subscriber that joins.
        joining = "_sn" not in request.parameters and "*" in request.key.partition("/@adv")[0]
        with self._lock:
            self._asked_s = now_s
            if joining and not self._waiting:
                self._begin(now_s)
            keep = joining and self._waiting and now_s < self._ends_s
            keep = keep and len(self._held) < _HELD_MAX
            if keep:
                self._held.append(request)
        if not keep:
            request.finish()

    def open_when_quiet(self, pause: Callable[[float], None]) -> None:
        """Wait while somebody joins, and let the questions that were kept open end."""
        while self._waiting:
            now_s = self._clock.monotonic_s()
            with self._lock:
                quiet_s = self._asked_s + self._quiet_s() - now_s
                left_s = self._ends_s - now_s
                if min(quiet_s, left_s) > 0.0:
                    remaining_s = min(quiet_s, left_s)
                    done: list[Request] = []
                else:
                    remaining_s = 0.0
                    done, self._held, self._waiting = self._held, [], False
                    self._allowance_s -= now_s - self._began_s
                    self._counted_s = self._ends_s = now_s
            for request in done:
                request.finish()
            if remaining_s > 0.0:
                pause(remaining_s)

    def _quiet_s(self) -> float:
        if not self._held:  # Somebody connected who may want no history at all.
            return QUIET_S
        return min(QUIET_S + ANSWER_S * self.samples, QUIET_MAX_S)

    def _begin(self, now_s: float) -> None:
        gained_s = ALLOWANCE_SHARE * (now_s - self._counted_s)
        self._allowance_s = min(self._allowance_s + gained_s, ALLOWANCE_MAX_S)
        self._counted_s = now_s
        if self._allowance_s > QUIET_S:
            self._waiting = True
            self._began_s = now_s
            self._ends_s = now_s + min(WAIT_MAX_S, self._allowance_s)
            self.waits += 1
