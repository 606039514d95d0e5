"""Clocks. Only this module reads the time of the machine; all others receive a clock."""

import time
from typing import Protocol


class Clock(Protocol):
    """A source of time."""

    def now_s(self) -> float:
        """Return the time, UTC, in seconds since the Unix epoch."""
        ...

    def monotonic_s(self) -> float:
        """Return seconds since an arbitrary origin, never going back."""
        ...


class SystemClock:
    """The system clock."""

    def now_s(self) -> float:
        """Return the time, UTC, in seconds since the Unix epoch."""
        return time.time()

    def monotonic_s(self) -> float:
        """Return seconds since an arbitrary origin, never going back."""
        return time.monotonic()


class FixedClock:
    """A clock that is set explicitly, for tests."""

    def __init__(self, now_s: float = 0.0) -> None:
        self._now_s = now_s

    def now_s(self) -> float:
        """Return the time it was last set to, in seconds since the Unix epoch."""
        return self._now_s

    def monotonic_s(self) -> float:
        """Return the same as `now_s`."""
        return self._now_s

    def advance(self, duration_s: float) -> None:
        """Move forward by a duration in seconds."""
        if duration_s < 0.0:
            msg = f"expected a duration of at least 0 s, was {duration_s} s"
            raise ValueError(msg)
        self._now_s += duration_s
