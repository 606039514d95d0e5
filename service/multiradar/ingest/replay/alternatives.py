"""Replay to a pair of services of which one is the primary, or to several addresses of one."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import polars as pl

from multiradar.errors import UnavailableError
from multiradar.ingest.replay.replaying import Answer, Destination

_T = TypeVar("_T")


class Alternatives:
    """Destinations with one journal: each batch goes to the one that acknowledges it.

    A batch keeps its key, so that one whose acknowledgement was lost in a takeover is a duplicate
    for the service that took over.

    Parameters
    ----------
    destinations : sequence of Destination
        At least one; the first is tried first.
    """

    def __init__(self, destinations: Sequence[Destination]) -> None:
        self._destinations = tuple(destinations)
        self._current = 0

    def send(self, frame: pl.DataFrame, key: str) -> Answer:
        """Deliver a batch to the first that acknowledges it."""
        return self._first(lambda one: one.send(frame, key))

    def flush(self, key: str) -> None:
        """Mark the end of the stream at the first that acknowledges it."""
        self._first(lambda one: one.flush(key))

    def starting(self) -> str | None:
        """Return the progress of a service that is starting."""
        found = (one.starting() for one in self._destinations)
        return next((progress for progress in found if progress is not None), None)

    def configured(self) -> tuple[str, ...]:
        """Return the configured sensors, which all have."""
        return next((names for one in self._destinations if (names := one.configured())), ())

    def status(self) -> Mapping[str, Any]:
        """Return the status of the one that acknowledged last."""
        return self._destinations[self._current].status()

    def close(self) -> None:
        """Close all connections."""
        for one in self._destinations:
            one.close()

    # The one that acknowledged the batch before comes first.
    def _first(self, attempt: Callable[[Destination], _T]) -> _T:
        failures = []
        for more in range(len(self._destinations)):
            number = (self._current + more) % len(self._destinations)
            try:
                answer = attempt(self._destinations[number])
            except UnavailableError as error:
                failures.append(error)
                continue
            self._current = number
            return answer
        pauses = [one.retry_after_s for one in failures if one.retry_after_s is not None]
        raise UnavailableError(
            "; ".join(map(str, failures)),
            min(pauses, default=None),
            answered=any(one.answered for one in failures),
        )
