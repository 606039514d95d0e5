"""Notifications to systemd, as `sd_notify(3)` describes them: ready, alive, stopping."""

import socket
import threading
from collections.abc import Callable, Mapping

import structlog

_log = structlog.get_logger("multiradar.supervisor")

#: Interval without a watchdog: extensions of the start, s.
_PERIOD_S = 10.0
#: Each notification before the service is ready extends the start by so many intervals.
_EXTENDED = 6


class Supervisor:
    """Reports to the supervisor that started the process; without one it does nothing.

    Parameters
    ----------
    environment : mapping
        `NOTIFY_SOCKET` and `WATCHDOG_USEC` as set by systemd.
    stalled : callable
        Returns a text while only a restart can help: then nothing is reported any more.
    """

    def __init__(self, environment: Mapping[str, str], stalled: Callable[[], str]) -> None:
        self._address = environment.get("NOTIFY_SOCKET", "")
        watchdog_s = float(environment.get("WATCHDOG_USEC", "0")) / 1e6
        # Twice in its time, as its manual recommends.
        self._period_s = watchdog_s / 2.0 or _PERIOD_S
        self._stalled = stalled
        self._ready = False
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="supervisor", daemon=True)

    def start(self) -> None:
        """Report from now on that the process starts."""
        if self._address:
            self._thread.start()

    def ready(self) -> None:
        """Report that the process serves, and from now on that it moves."""
        self._ready = True
        self._notify("READY=1")

    def stop(self) -> None:
        """Report that the process ends; may be called twice."""
        if not self._stopping.is_set():
            self._notify("STOPPING=1")
        self._stopping.set()
        if self._thread.ident is not None:
            self._thread.join()

    def _run(self) -> None:
        while True:
            if not self._stalled():
                extended_us = round(self._period_s * _EXTENDED * 1e6)
                self._notify("WATCHDOG=1" if self._ready else f"EXTEND_TIMEOUT_USEC={extended_us}")
            if self._stopping.wait(self._period_s):
                return

    def _notify(self, state: str) -> None:
        if not self._address:
            return
        # A name with @ is in the abstract namespace of Linux.
        address = f"\0{self._address[1:]}" if self._address[0] == "@" else self._address
        try:
            with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as client:
                # Without a wait for a supervisor that does not read.
                client.setblocking(False)
                client.sendto(state.encode(), address)
        except OSError as error:
            # The service does not depend on its supervisor.
            _log.warning("supervisor_not_reached", state=state, reason=str(error))
