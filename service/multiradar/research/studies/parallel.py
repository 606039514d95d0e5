"""Parallel execution of a study, with interruption by Ctrl-C."""

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from typing import Any

from multiradar.research.studies.result import Progress


@contextmanager
def workers() -> Iterator[ThreadPoolExecutor]:
    """Provide a thread pool with one thread per processor.

    Yields
    ------
    ThreadPoolExecutor
        On exit, pending work is dropped and running work is not waited for: compiled work cannot
        be interrupted. Wait with `finish` for all required results.
    """
    executor = ThreadPoolExecutor(max_workers=processors())
    try:
        yield executor
    finally:
        executor.shutdown(wait=False, cancel_futures=True)


def finish(futures: Sequence[Future[Any]], progress: Progress) -> None:
    """Wait until all futures are done, or raise the first error.

    Parameters
    ----------
    futures : sequence of Future
        Running work.
    progress : Progress
        Called with the number of completed futures; its exceptions end the waiting, too.
    """
    progress(0, len(futures))
    for done, future in enumerate(as_completed(futures), 1):
        future.result()
        progress(done, len(futures))


def processors() -> int:
    """Return the number of processors available to this process, at least 1.

    On systems without processor affinity (all but Linux), the number of processors.
    """
    bound = getattr(os, "sched_getaffinity", None)
    return len(bound(0)) if bound is not None else os.cpu_count() or 1
