"""Virtual time, and threads that run one at a time in an order given by a seed.

A thread of the pipeline is a greenlet. It gives way where it enters a condition or waits, so that
each run of a seed interleaves the threads in the same way.
"""

import contextlib
import functools
import random
from collections.abc import Callable
from math import inf
from typing import Any

from greenlet import greenlet  # type: ignore[import-untyped]  # has no stubs


class Killed(BaseException):  # not an error: the process has died
    """Raised in all threads of a process that is killed."""


class VirtualClock:
    """Time of the machine; moved by the simulation.

    Attributes
    ----------
    elapsed_s : float
        True time since the start of the run, s.
    offset_s : float
        Error of the system time, s.
    on_wrong : callable
        Called when the system time is read while it is wrong.
    """

    def __init__(self, start_s: float) -> None:
        self._start_s = start_s
        self.elapsed_s = 0.0
        self.offset_s = 0.0
        self.on_wrong: Callable[[], None] = lambda: None

    @property
    def true_s(self) -> float:
        """True time, UTC, s."""
        return self._start_s + self.elapsed_s

    def now_s(self) -> float:
        """Return the system time, UTC, s."""
        if self.offset_s:
            self.on_wrong()
        return self.true_s + self.offset_s

    def monotonic_s(self) -> float:
        """Return seconds since an arbitrary origin, never going back."""
        return 1000.0 + self.elapsed_s


class SimulatedThread:
    """A thread of the simulation."""

    def __init__(self, scheduler: "Scheduler", body: Callable[[], None], name: str) -> None:
        self._scheduler = scheduler
        self.name = name
        self.greenlet = greenlet(body)
        #: Whether it waits, for a notification or until a time; then when that is, s.
        self.waits = False
        self.until_s = inf
        #: It does not run before, s: the machine is busy.
        self.stalled_until_s = -inf
        #: Called when it could run, but for that.
        self.on_stall: Callable[[], None] = lambda: None

    @property
    def ended(self) -> bool:
        """Whether it has ended."""
        return bool(self.greenlet.dead)

    def stalls(self, now_s: float) -> bool:
        """Return whether it does not run at a time, s, although it could."""
        if self.stalled_until_s <= now_s:
            return False
        self.on_stall()
        return True

    def join(self) -> None:
        """Run threads until this one has ended."""
        while not self.ended:
            if not self._scheduler.step(stalled=True):
                raise AssertionError(f"the thread {self.name} never ends")


class Scheduler:
    """Provides threads, conditions and events to the pipeline, and runs them.

    Parameters
    ----------
    random : Random
        Draws the order.
    clock : VirtualClock
        Time of waits.
    """

    def __init__(self, random: random.Random, clock: VirtualClock) -> None:
        self._random = random
        self._clock = clock
        self._main = greenlet.getcurrent()
        self._current: SimulatedThread | None = None
        self.threads: list[SimulatedThread] = []

    def start(self, body: Callable[[], None], name: str) -> SimulatedThread:
        """Start a thread."""
        thread = SimulatedThread(self, body, name)
        self.threads.append(thread)
        return thread

    def condition(self) -> "SimulatedCondition":
        """Return a condition."""
        return SimulatedCondition(self)

    def event(self) -> "SimulatedEvent":
        """Return an event that is not set."""
        return SimulatedEvent(self)

    def step(self, *, stalled: bool = False) -> bool:
        """Run one thread until it gives way; return whether one could run."""
        now_s = self._clock.elapsed_s
        ready = [
            one
            for one in self.threads
            if not one.ended
            and (not one.waits or one.until_s <= now_s)
            and (stalled or not one.stalls(now_s))
        ]
        if not ready:
            return False
        thread = self._random.choice(ready)
        thread.waits = False
        self._run(thread, thread.greenlet.switch)
        return True

    def settle(self) -> None:
        """Run threads until all wait."""
        while self.step():
            pass

    def kill(self) -> None:
        """End all threads where they are."""
        for thread in self.threads:
            if thread.greenlet:
                self._run(thread, functools.partial(thread.greenlet.throw, Killed))
        self.threads.clear()

    def give_way(self, *, waits: bool = False, until_s: float = inf) -> SimulatedThread | None:
        """Let others run; return the thread that called, None for the simulation itself."""
        thread = self._current
        if thread is None:
            assert not waits, "the simulation itself would wait"
            return None
        thread.waits, thread.until_s = waits, until_s
        self._main.switch()
        return thread

    @property
    def current(self) -> SimulatedThread | None:
        """The thread that runs; None for the simulation itself."""
        return self._current

    def deadline_s(self, timeout_s: float | None) -> float:
        """Return when a wait ends, s."""
        return inf if timeout_s is None else self._clock.elapsed_s + timeout_s

    def _run(self, thread: SimulatedThread, resume: Callable[[], Any]) -> None:
        # A thread that joins another runs it, and goes on itself afterwards.
        before, self._current = self._current, thread
        try:
            with contextlib.suppress(Killed):
                resume()
        finally:
            self._current = before


class SimulatedCondition:
    """A condition. Threads give way at its entrance only, so its lock is never contended."""

    def __init__(self, scheduler: Scheduler) -> None:
        self._scheduler = scheduler
        self._waiting: list[SimulatedThread] = []

    def __enter__(self) -> None:
        self._scheduler.give_way()

    def __exit__(self, *raised: object) -> None:
        pass

    def wait(self) -> None:
        """Wait for a notification."""
        thread = self._scheduler.current
        assert thread is not None, "the simulation itself would wait"
        self._waiting.append(thread)
        self._scheduler.give_way(waits=True)

    def notify(self) -> None:
        """Wake the thread that has waited longest."""
        if self._waiting:
            self._waiting.pop(0).waits = False

    def notify_all(self) -> None:
        """Wake all threads that wait."""
        while self._waiting:
            self.notify()


class SimulatedEvent:
    """An event; a wait ends in virtual time."""

    def __init__(self, scheduler: Scheduler) -> None:
        self._scheduler = scheduler
        self._waiting: list[SimulatedThread] = []
        self._set = False

    def set(self) -> None:
        """Set it, and wake all that wait."""
        self._set = True
        while self._waiting:
            self._waiting.pop().waits = False

    def wait(self, timeout: float | None = None) -> bool:
        """Wait until it is set, at most so many seconds; return whether it is."""
        thread = self._scheduler.current
        if not self._set and thread is not None:
            self._waiting.append(thread)
            self._scheduler.give_way(waits=True, until_s=self._scheduler.deadline_s(timeout))
            if thread in self._waiting:
                self._waiting.remove(thread)
        return self._set
