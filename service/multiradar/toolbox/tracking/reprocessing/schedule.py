"""The order of days: chains of days that start from each other, several chains at a time."""

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from multiradar.cluster.jobs import JobEvent, Jobs
from multiradar.toolbox.messages.progress import JobBars
from multiradar.toolbox.tracking.reprocessing.days import Day
from multiradar.toolbox.tracking.reprocessing.records import DayRecord

MADE, KEPT, FAILED = "made", "kept", "failed"


@dataclass(frozen=True, slots=True)
class Outcome:
    """What became of a day.

    Attributes
    ----------
    day : Day
        The day.
    status : str
        made, kept (complete already), or failed.
    record : DayRecord, optional
        Of a day that is complete.
    reason : str
        Why it failed, or was made again; a sentence.
    """

    day: Day
    status: str
    record: DayRecord | None = None
    reason: str = ""


@dataclass(slots=True)
class Chain:
    """Days of which one is made at a time.

    Attributes
    ----------
    days : deque of Day
        Those that are left.
    before : Outcome, optional
        The last complete day, from whose biases the next starts.
    """

    days: deque[Day]
    before: Outcome | None = field(default=None)


@dataclass(frozen=True, slots=True)
class Start:
    """How a day starts: with a job, or not at all.

    Attributes
    ----------
    job : mapping
        To run; empty if the outcome is known.
    outcome : Outcome, optional
        Known without a job.
    """

    job: Mapping[str, Any]
    outcome: Outcome | None = None


class Schedule:
    """Runs the days of all chains, as many at a time as there are slots.

    Parameters
    ----------
    jobs : Jobs
        Runs the jobs.
    slots : int
        Jobs at a time.
    start : callable
        Returns how the next day of a chain starts.
    on_end : callable
        Called with each outcome.
    bars : JobBars
        Shows the progress.
    """

    def __init__(
        self,
        jobs: Jobs,
        slots: int,
        *,
        start: Callable[[Day, Chain], Start],
        on_end: Callable[[Outcome], None],
        bars: JobBars,
    ) -> None:
        self._jobs, self._slots, self._bars = jobs, slots, bars
        self._start_of, self._on_end = start, on_end
        self._waiting: deque[Chain] = deque()
        self._running: dict[str, tuple[Day, Chain]] = {}

    def run(self, chains: Iterable[Chain]) -> None:
        """Run all days; the chains are started in their order."""
        self._waiting.extend(chain for chain in chains if chain.days)
        while self._waiting or self._running:
            while self._waiting and len(self._running) < self._slots:
                self._start(self._waiting.popleft())
            if self._running:
                self._wait()

    def _start(self, chain: Chain) -> None:
        day = chain.days.popleft()
        started = self._start_of(day, chain)
        if started.outcome is not None:
            self._end(chain, started.outcome)
            return
        self._running[day.name] = day, chain
        self._jobs.start(day.name, started.job)

    def _wait(self) -> None:
        event = self._jobs.next()
        if not event.ended:
            self._bars.show(event.name, event.done, event.total)
            return
        day, chain = self._running.pop(event.name)
        self._end(chain, _outcome(day, event))

    def _end(self, chain: Chain, outcome: Outcome) -> None:
        if outcome.record is not None:
            chain.before = outcome
        if chain.days:
            self._waiting.appendleft(chain)
        self._bars.end(outcome.day.name)
        self._on_end(outcome)


def _outcome(day: Day, event: JobEvent) -> Outcome:
    if event.answer is None:
        return Outcome(day, FAILED, reason=event.lost)
    if "error" in event.answer:
        return Outcome(day, FAILED, reason=str(event.answer["error"]))
    return Outcome(day, MADE, DayRecord(**event.answer["record"]))
