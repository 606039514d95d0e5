"""A thread that writes the output of one block while the next one is tracked.

Kernels, hashes and tables release the interpreter, so on two cores the two overlap. The calls run
one after the other in the order in which they were put, so the output does not depend on it.
"""

from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor

from multiradar.runtime.offline.stage_times import WAITING, WRITING, StageTimes


class BesideTracking:
    """Runs calls in a thread, in their order; at most one waits while one runs.

    Parameters
    ----------
    stages : StageTimes
        Stages of the tracking thread; its waits count there.

    Attributes
    ----------
    times : StageTimes
        Stages of the thread; its calls count as writing.
    """

    def __init__(self, stages: StageTimes) -> None:
        self._stages = stages
        self.times = stages.beside()
        self._thread = ThreadPoolExecutor(1, thread_name_prefix="multiradar-writing")
        self._pending: list[Future[None]] = []

    def put(self, call: Callable[[], None]) -> None:
        """Run a call after those before it; raises the error of an earlier one."""
        self._wait(1)
        self._pending.append(self._thread.submit(self._run, call))

    def finish(self) -> None:
        """Wait until all calls have run; raises the first error of one."""
        self._wait(0)

    def close(self) -> None:
        """End the thread after the present call; may be called twice."""
        self._thread.shutdown(cancel_futures=True)

    def _run(self, call: Callable[[], None]) -> None:
        with self.times.measure(WRITING):
            call()

    def _wait(self, most: int) -> None:
        with self._stages.measure(WAITING):
            while len(self._pending) > most:
                self._pending.pop(0).result()
