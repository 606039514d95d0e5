"""Work of a study on all processors, which Ctrl-C ends."""

import os
from collections.abc import Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from typing import Any

from multiradar.research.studies.result import Progress


@contextmanager
def workers() -> Iterator[ThreadPoolExecutor]:
    """Give threads to work in, one for each processor.

    Yields
    ------
    ThreadPoolExecutor
        When the block is left, what has not begun is dropped and what has begun is not waited for:
        compiled work cannot be stopped. So wait with `finish` for all that is wanted.
    """
    executor = ThreadPoolExecutor(max_workers=processors())
    try:
        yield executor
    finally:
        executor.shutdown(wait=False, cancel_futures=True)


def finish(futures: Sequence[Future[Any]], progress: Progress) -> None:
    """Wait until all is done, or raise the first error of any.

    Parameters
    ----------
    futures : sequence of Future
        What is being done.
    progress : Progress
        Told how many of them are done; what it raises ends the waiting too.
    """
    progress(0, len(futures))
    for done, future in enumerate(as_completed(futures), 1):
        future.result()
        progress(done, len(futures))


def processors() -> int:
    """Return the number of processors that this process may run on, at least 1.

    Systems that bind no process to processors (all but Linux) are asked for those they have.
    """
    bound = getattr(os, "sched_getaffinity", None)
    return len(bound(0)) if bound is not None else os.cpu_count() or 1
