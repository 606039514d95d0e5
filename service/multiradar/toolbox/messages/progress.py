"""A progress bar on standard error; none if that is not a terminal."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager


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
    if not sys.stderr.isatty():
        yield lambda _done, _total: None
        return
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
    with Progress(*columns, console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task(what, total=None)
        yield lambda done, total: progress.update(task, completed=done, total=total)
