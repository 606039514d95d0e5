"""A progress bar on standard error; none if that is not a terminal."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.progress import Progress, TaskID

#: Called with the number of steps done and the total, in place of a bar.
Show = Callable[[int, int], None]

_SHOW: ContextVar[Show | None] = ContextVar("show", default=None)


@contextmanager
def progress_to(show: Show) -> Iterator[None]:
    """Pass the progress to a function, such as one that sends it to another process."""
    token = _SHOW.set(show)
    try:
        yield
    finally:
        _SHOW.reset(token)


@contextmanager
def progress_bar(what: str, total: int) -> Iterator[Callable[[int], None]]:
    """Show a progress bar.

    Parameters
    ----------
    what : str
        What is being done.
    total : int
        Steps in all.

    Yields
    ------
    callable
        To be called with the number of steps done.
    """
    with counting_bar(what) as show:
        show(0, total)
        yield lambda done: show(done, total)


@contextmanager
def counting_bar(what: str) -> Iterator[Callable[[int, int], None]]:
    """Show a progress bar whose total is given with each call.

    Parameters
    ----------
    what : str
        What is being done.

    Yields
    ------
    callable
        To be called with the number of steps done, and the total.
    """
    show = _SHOW.get()
    if show is not None or not sys.stderr.isatty():
        yield show or (lambda _done, _total: None)
        return
    with _bars() as progress:
        task = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)


class JobBars:
    """A bar for all jobs and one for each that runs, on standard error.

    Parameters
    ----------
    progress : Progress, optional
        Of rich; None shows nothing.
    what : str
        What is being done.
    total : int
        Jobs in all.
    """

    def __init__(self, progress: "Progress | None", what: str, total: int) -> None:
        self._progress = progress
        self._tasks: dict[str, TaskID] = {}
        self._all = None if progress is None else progress.add_task(what, total=total)

    def show(self, name: str, done: int, total: int) -> None:
        """Show the progress of a job that runs."""
        if self._progress is not None:
            if name not in self._tasks:
                self._tasks[name] = self._progress.add_task(name, total=None)
            self._progress.update(self._tasks[name], completed=done, total=total)

    def end(self, name: str) -> None:
        """Count a job that has ended."""
        if self._progress is not None and self._all is not None:
            self._progress.advance(self._all)
            if name in self._tasks:
                self._progress.remove_task(self._tasks.pop(name))


@contextmanager
def job_bars(what: str, total: int) -> Iterator[JobBars]:
    """Show the progress of jobs that run at the same time.

    Parameters
    ----------
    what : str
        What is being done.
    total : int
        Jobs in all.

    Yields
    ------
    JobBars
        To be called with the progress of each.
    """
    if not sys.stderr.isatty():
        yield JobBars(None, what, total)
        return
    with _bars() as progress:
        yield JobBars(progress, what, total)


def _bars() -> "Progress":
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
    )
    return Progress(*columns, console=Console(stderr=True), transient=True)
