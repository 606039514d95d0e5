"""The standby: follows the journal of the primary, and takes over when that ends.

It processes each entry that the primary has acknowledged with the same engine, and neither writes
nor publishes. The primary has locked the journal; the system releases the lock when the process
ends, however it does. The standby then has the lock, reads the journal to its end, and accepts
measurements. Journal, engine and numbers of events continue, so the output is that of one service.
"""

import logging
from collections.abc import Callable
from typing import Any, Protocol

from multiradar.clock import Clock
from multiradar.errors import RemovedEntriesError
from multiradar.runtime.live.readiness import PRIMARY
from multiradar.runtime.live.threads import SystemThreads, Thread, Threads, log_end

_log = logging.getLogger(__name__)

#: The lock and the journal are looked at so often, s.
PERIOD_S = 0.02

_LAGGED = (
    "the journal was shortened while this standby lagged: entries that it has not yet processed "
    "are only in the archive; start it again (it continues from the newest snapshot)"
)


class FollowedJournal(Protocol):
    """A journal that another service writes."""

    @property
    def following(self) -> bool:
        """Whether another service writes it."""
        ...

    def acknowledged(self) -> int | None:
        """Return the last entry that another service has acknowledged; None while it is written."""
        ...

    def lead(self) -> bool:
        """Open it for writing if no other service does any more; return whether that is so."""
        ...


class FollowingService(Protocol):
    """The service as its standby uses it."""

    role: Callable[[], dict[str, Any]]

    def start(self, *, following: bool) -> None:
        """Replay the journal."""
        ...

    def follow(self, until: int) -> int:
        """Process entries of another service, up to one; return the last."""
        ...

    def lead(self) -> None:
        """Accept measurements: no other service writes the journal."""
        ...

    def fail(self, error: Exception) -> None:
        """Stop for good."""
        ...


class Standby:
    """Follows a journal in a thread of its own until it takes over.

    Parameters
    ----------
    service : FollowingService
        The service, which has this journal; not started.
    journal : FollowedJournal
        The journal, which another service writes.
    clock : Clock
        Times lag and takeover.
    on_lead : callable
        Called, in that thread, once the service accepts measurements: starts what sends and
        receives.
    threads : Threads, optional
        Starts the thread; one of the system by default.
    """

    def __init__(
        self,
        service: FollowingService,
        journal: FollowedJournal,
        clock: Clock,
        on_lead: Callable[[], None],
        threads: Threads | None = None,
    ) -> None:
        self._service, self._journal, self._clock = service, journal, clock
        self._on_lead = on_lead
        self._threads = threads or SystemThreads()
        self._stopping = self._threads.event()
        self._thread: Thread | None = None
        self._acknowledged = self._processed = 0
        # Since when there was always an entry to process, s; None: it is level with the primary.
        self._behind_since_s: float | None = None

    def start(self) -> None:
        """Replay the journal, then follow it.

        Raises
        ------
        JournalError, ConfigurationError, PipelineError
            As `Service.start`.
        """
        # The whole journal is to be processed, until `step` knows what the replay has.
        self._acknowledged = self._journal.acknowledged() or 0
        self._behind_since_s = self._clock.monotonic_s()
        self._service.role = self.document
        self._service.start(following=True)
        self._thread = self._threads.start(self._run, "standby")

    def stop(self) -> None:
        """Stop following; may be called twice, and without a start."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()

    def document(self) -> dict[str, Any]:
        """Return the role and how far it is behind the primary, for the status.

        Returns
        -------
        dict
            `role`; `lag_entries`: acknowledged entries that are not processed yet, all of them
            during the replay; `lag_s`: time for which there have been any, s.
        """
        since_s = self._behind_since_s
        return {
            "role": "standby",
            "lag_entries": max(self._acknowledged - self._processed, 0),
            "lag_s": 0.0 if since_s is None else round(self._clock.monotonic_s() - since_s, 2),
        }

    def step(self) -> bool:
        """Process what the primary has acknowledged, or take over; return whether it has.

        Raises
        ------
        JournalError, PipelineError
            If the journal cannot be followed, or not be continued.
        """
        began_s = self._clock.monotonic_s()
        if self._journal.lead():
            _log.warning("the primary has stopped; taking over")
            self._service.lead()
            self._service.role = lambda: PRIMARY
            accepting_s = self._clock.monotonic_s() - began_s
            self._on_lead()
            _log.warning(
                "takeover: measurements accepted after %.0f ms, all interfaces open after %.0f ms",
                1e3 * accepting_s, 1e3 * (self._clock.monotonic_s() - began_s),
            )  # fmt: skip
            return True
        acknowledged = self._journal.acknowledged()
        if acknowledged is not None:
            self._acknowledged = acknowledged
            if acknowledged > self._processed and self._behind_since_s is None:
                self._behind_since_s = began_s
            self._processed = self._service.follow(acknowledged)
            if self._processed >= acknowledged:
                self._behind_since_s = None
        return False

    def _run(self) -> None:
        try:
            while not self._stopping.wait(0.0 if self._behind_since_s is not None else PERIOD_S):
                if self.step():
                    return
        except RemovedEntriesError:
            # The advice of the journal is for a start without a usable snapshot.
            self._stop_for(RemovedEntriesError(_LAGGED))
        except Exception as error:
            self._stop_for(error)

    def _stop_for(self, error: Exception) -> None:
        log_end(_log, "the standby has stopped", error)
        self._service.fail(error)
