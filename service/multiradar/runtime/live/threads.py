"""Threads of the live pipeline, and what they wait for.

A simulation passes its own, which run one at a time in an order given by a seed.
"""

import logging
import threading
from collections.abc import Callable
from typing import Any, Protocol

from multiradar.errors import MultiradarError


class Thread(Protocol):
    """A thread that was started."""

    def join(self) -> None:
        """Wait for its end."""
        ...


class Event(Protocol):
    """A flag; threads wait until it is set."""

    def set(self) -> None:
        """Set it, and wake all that wait."""
        ...

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it is set, at most so many seconds; return whether it is."""
        ...


class Condition(Protocol):
    """A lock whose owner can wait for a change."""

    def __enter__(self) -> Any: ...

    def __exit__(self, *raised: Any) -> Any: ...

    def wait(self) -> Any:
        """Release the lock, wait for a notification, acquire the lock again."""
        ...

    def notify(self) -> None:
        """Wake one thread that waits."""
        ...

    def notify_all(self) -> None:
        """Wake all threads that wait."""
        ...


class Threads(Protocol):
    """Starts threads, and makes what they wait for."""

    def start(self, body: Callable[[], None], name: str) -> Thread:
        """Start a thread."""
        ...

    def condition(self) -> Condition:
        """Return a condition."""
        ...

    def event(self) -> Event:
        """Return an event that is not set."""
        ...


class SystemThreads:
    """Threads of the operating system; they do not keep the process alive."""

    def start(self, body: Callable[[], None], name: str) -> Thread:
        """Start a thread."""
        thread = threading.Thread(target=body, name=name, daemon=True)
        thread.start()
        return thread

    def condition(self) -> Condition:
        """Return a condition."""
        return threading.Condition()

    def event(self) -> Event:
        """Return an event that is not set."""
        return threading.Event()


def log_end(log: logging.Logger, what: str, error: Exception) -> None:
    """Log the error that ends a thread; of input or environment, its message is enough."""
    named = isinstance(error, MultiradarError)
    log.error("%s: %s", what, error, exc_info=None if named else error)
