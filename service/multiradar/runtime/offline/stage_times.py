"""Duration of the stages of a run, with the compilation of kernels counted separately."""

import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from typing import TypeVar

from numba.core import event

from multiradar.clock import Clock

Item = TypeVar("Item")

STARTING, COMPILING, READING, TRACKING, WRITING, WAITING = (
    "starting", "compiling", "reading", "tracking", "writing", "waiting",
)  # fmt: skip
_COMPILATION = "numba:compile"


class StageTimes(event.Listener):
    """Attributes the time of a run to its stages; one of them is active at any time.

    Time outside any stage counts as the start. While any thread compiles kernels, the time counts
    as compilation; kernels loaded from the cache are not compiled.

    Parameters
    ----------
    clock : Clock
        The clock.
    since_s : float, optional
        Start of the run by that clock; now by default.
    """

    def __init__(self, clock: Clock, since_s: float | None = None) -> None:
        self._clock = clock
        # Compilation may be reported by threads of the tracker.
        self._lock = threading.Lock()
        self._stages = [STARTING]
        self._compilations = 0
        self._since_s = clock.monotonic_s() if since_s is None else since_s
        self._seconds: dict[str, float] = {STARTING: 0.0, COMPILING: 0.0}
        self._beside: list[StageTimes] = []

    def beside(self) -> "StageTimes":
        """Return the stages of another thread that works beside this one."""
        other = StageTimes(self._clock)
        self._beside.append(other)
        return other

    def beside_seconds(self) -> dict[str, float]:
        """Return the time of each stage of other threads so far, s."""
        found: dict[str, float] = {}
        for other in self._beside:
            for stage, time_s in other.seconds().items():
                if stage not in (STARTING, COMPILING):
                    found[stage] = found.get(stage, 0.0) + time_s
        return found

    @contextmanager
    def measure(self, stage: str) -> Iterator[None]:
        """Attribute the time within to a stage; nested stages count separately."""
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
        """Enter and leave a context manager; that time counts to a stage."""
        with ExitStack() as held:
            with self.measure(stage):
                entered = held.enter_context(manager)
            yield entered

    def timed(self, stage: str, call: Callable[[Item], object]) -> Callable[[Item], None]:
        """Wrap a function so that its time counts to a stage."""

        def measured(item: Item) -> None:
            with self.measure(stage):
                call(item)

        return measured

    def each(self, stage: str, items: Iterable[Item]) -> Iterator[Item]:
        """Yield items; the time to produce them counts to a stage."""
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
        """Count compilations within."""
        event.register(_COMPILATION, self)  # type: ignore[no-untyped-call]  # of numba
        try:
            yield
        finally:
            event.unregister(_COMPILATION, self)  # type: ignore[no-untyped-call]  # of numba

    def on_start(self, _event: event.Event) -> None:
        """Record the start of a compilation."""
        with self._lock:
            self._settle()
            self._compilations += 1

    def on_end(self, _event: event.Event) -> None:
        """Record the end of a compilation."""
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
