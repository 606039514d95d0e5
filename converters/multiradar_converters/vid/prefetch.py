"""Computes the next item of an iterator in another thread."""

from collections.abc import Iterator
from concurrent.futures import Executor
from typing import TypeVar

Item = TypeVar("Item")


def prefetch(items: Iterator[Item], pool: Executor) -> Iterator[Item]:
    """Yield the items, each computed in another thread while the previous one is in use.

    Parameters
    ----------
    items : iterator
        Must not be used elsewhere.
    pool : Executor
        Must have a free thread.

    Yields
    ------
    item
        In order; exceptions of the iterator are raised here.
    """
    waiting = pool.submit(next, items, None)
    while (item := waiting.result()) is not None:
        waiting = pool.submit(next, items, None)
        yield item
