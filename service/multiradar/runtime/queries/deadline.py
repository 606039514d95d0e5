"""The deadline of a query, which expensive calculations check between pieces of their work."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from math import inf

from multiradar.clock import SystemClock
from multiradar.errors import DeadlineError

_CLOCK = SystemClock()
_UNTIL_S: ContextVar[float] = ContextVar("deadline", default=inf)


@contextmanager
def deadline(duration_s: float) -> Iterator[None]:
    """Let the query of this thread take so long at most."""
    token = _UNTIL_S.set(_CLOCK.monotonic_s() + duration_s)
    try:
        yield
    finally:
        _UNTIL_S.reset(token)


def check_deadline() -> None:
    """End a query that has taken too long.

    Raises
    ------
    DeadlineError
        If its deadline has passed.
    """
    if _CLOCK.monotonic_s() > _UNTIL_S.get():
        raise DeadlineError
