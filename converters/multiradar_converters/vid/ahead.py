"""Working one item ahead of whoever takes them."""

from collections.abc import Iterator
from concurrent.futures import Executor
from typing import TypeVar

Item = TypeVar("Item")


def ahead(items: Iterator[Item], pool: Executor) -> Iterator[Item]:
    """Yield the items, each made in another thread while the one before is in use.

    Parameters
    ----------
    items : iterator
        Not used by anybody else.
    pool : Executor
        Has a thread to spare.

    Yields
    ------
    item
        In their order; what making one raises is raised here.
    """
    waiting = pool.submit(next, items, None)
    while (item := waiting.result()) is not None:
        waiting = pool.submit(next, items, None)
        yield item
