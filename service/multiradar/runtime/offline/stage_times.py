"""How long each stage of a run took, compilation of kernels apart."""

import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import TypeVar

from numba.core import event

from multiradar.clock import Clock

Item = TypeVar("Item")

STARTING, COMPILING, READING, TRACKING, WRITING = (
    "starting", "compiling", "reading", "tracking", "writing",
)  # fmt: skip
_COMPILATION = "numba:compile"


class StageTimes(event.Listener):
    """Divides the time of a run between its stages: at each moment one of them runs.

    What belongs to no stage is the start. While any thread compiles kernels, nothing else counts;
    kernels that come from the cache are not compiled.

    Parameters
    ----------
    clock : Clock
        Tells the time.
    since_s : float, optional
        When the run began, by that clock; now where not given.
    """

    def __init__(self, clock: Clock, since_s: float | None = None) -> None:
        self._clock = clock
        # Compilation may be told of by threads of the tracker.
        self._lock = threading.Lock()
        self._stages = [STARTING]
        self._compilations = 0
        self._since_s = clock.monotonic_s() if since_s is None else since_s
        self._seconds: dict[str, float] = {STARTING: 0.0, COMPILING: 0.0}

    @contextmanager
    def measure(self, stage: str) -> Iterator[None]:
        """Count the time within to a stage; a stage within it counts apart."""
        with self._lock:
            self._settle()
            self._stages.append(stage)
            self._seconds.setdefault(stage, 0.0)
        try:
            yield
        finally:
            with self._lock:
                self._settle()
                self._stages.pop()

    @contextmanager
    def enter(self, stage: str, manager: AbstractContextManager[Item]) -> Iterator[Item]:
        """Enter and leave a context manager; the time that these take counts to a stage."""
        with ExitStack() as held:
            with self.measure(stage):
                entered = held.enter_context(manager)
            yield entered

    def timed(self, stage: str, call: Callable[[Item], object]) -> Callable[[Item], None]:
        """Return a function that does the same; its time counts to a stage."""

        def measured(item: Item) -> None:
            with self.measure(stage):
                call(item)

        return measured

    def each(self, stage: str, items: Iterable[Item]) -> Iterator[Item]:
        """Yield items; the time that making them takes counts to a stage."""
        iterator = iter(items)
        nothing = object()
        while True:
            with self.measure(stage):
                item = next(iterator, nothing)
            if item is nothing:
                return
            yield item  # type: ignore[misc]  # not the object above

    @contextmanager
    def listening(self) -> Iterator[None]:
        """Notice compilations within."""
        event.register(_COMPILATION, self)  # type: ignore[no-untyped-call]  # of numba
        try:
            yield
        finally:
            event.unregister(_COMPILATION, self)  # type: ignore[no-untyped-call]  # of numba

    def on_start(self, _event: event.Event) -> None:
        """Notice that a kernel begins to be compiled."""
        with self._lock:
            self._settle()
            self._compilations += 1

    def on_end(self, _event: event.Event) -> None:
        """Notice that a kernel is compiled."""
        with self._lock:
            self._settle()
            self._compilations -= 1

    def seconds(self) -> dict[str, float]:
        """Return the time of each stage so far, s, in the order in which they first ran."""
        with self._lock:
            self._settle()
            return dict(self._seconds)

    def _settle(self) -> None:
        now_s = self._clock.monotonic_s()
        stage = COMPILING if self._compilations else self._stages[-1]
        self._seconds[stage] += now_s - self._since_s
        self._since_s = now_s
