"""What is retained of each aircraft, bounded."""

from collections.abc import Callable
from typing import Generic, TypeVar

#: Maximum number of aircraft; more than are in the air at once. Beyond it the half with the oldest
#: messages is discarded.
AIRCRAFT_MAX = 1 << 15

T = TypeVar("T")


class Aircraft(Generic[T]):
    """Values by address.

    Parameters
    ----------
    new : callable
        Returns the values of an aircraft that is not known yet.
    """

    def __init__(self, new: Callable[[], T]) -> None:
        self._new = new
        self._known: dict[int, tuple[float, T]] = {}

    def __len__(self) -> int:
        return len(self._known)

    def of(self, address: int, time_s: float) -> T:
        """Return the values of an aircraft, with a message of this time."""
        found = self._known.get(address)
        values = self._new() if found is None else found[1]
        self._known[address] = time_s, values
        if len(self._known) > AIRCRAFT_MAX:
            latest = sorted(self._known.items(), key=lambda one: one[1][0])[AIRCRAFT_MAX // 2 :]
            self._known = dict(latest)
        return values
