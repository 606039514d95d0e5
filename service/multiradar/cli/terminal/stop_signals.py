"""SIGTERM and Ctrl-C of commands that serve until they are stopped."""

import itertools
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

from multiradar.cli.terminal.stopping import leave

_PIECE_S = 0.5
_PIECES_OF_A_PERIOD = 10


class Stop:
    """Set by the first signal.

    During the start the process exits at once, without an exception, which could be raised within
    compiled code: all acknowledged data are on disk.
    """

    def __init__(self) -> None:
        self._requested = threading.Event()
        self._starting = True

    def on_signal(self, _number: int, _frame: FrameType | None) -> None:
        """Stop; the handler of the signals."""
        self._requested.set()
        if self._starting:
            leave(0)

    def set(self) -> None:
        """Stop."""
        self._requested.set()

    def started(self) -> None:
        """Wait for what runs from now on."""
        self._starting = False

    def wait(self, meanwhile: Callable[[], None] = lambda: None) -> None:
        """Return when stopped; call a function every few seconds until then."""
        # In short waits: a library may have set signals so that a wait continues after one.
        for piece in itertools.count(1):
            if self._requested.wait(_PIECE_S):
                return
            if piece % _PIECES_OF_A_PERIOD == 0:
                meanwhile()


@contextmanager
def stop_on_signals() -> Iterator[Stop]:
    """Return what SIGTERM and SIGINT set while the context is entered."""
    stop = Stop()
    before = {
        number: signal.signal(number, stop.on_signal) for number in (signal.SIGTERM, signal.SIGINT)
    }
    try:
        yield stop
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
