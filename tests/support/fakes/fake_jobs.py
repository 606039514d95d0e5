"""Days that run one after the other in the process of the test."""

from collections import deque
from collections.abc import Mapping

from multiradar.cluster.jobs import Job, JobEvent
from multiradar.toolbox.tracking.reprocessing.job import run_day


class FakeJobs:
    """Runs each day when its end is waited for.

    Parameters
    ----------
    lost : mapping of str to str
        Days whose process is lost, with the reason.
    """

    def __init__(self, lost: Mapping[str, str] | None = None) -> None:
        self._lost = dict(lost or {})
        self._waiting: deque[tuple[str, Job]] = deque()
        #: The days that were started, in order.
        self.started: list[str] = []
        #: How many ran at the same time at most.
        self.at_once = 0
        self.closed = False

    def start(self, name: str, job: Job) -> None:
        self.started.append(name)
        self._waiting.append((name, job))
        self.at_once = max(self.at_once, len(self._waiting))

    def next(self) -> JobEvent:
        name, job = self._waiting.popleft()
        if name in self._lost:
            return JobEvent(name, lost=self._lost[name])
        return JobEvent(name, answer=run_day(job))

    def close(self) -> None:
        self.closed = True
