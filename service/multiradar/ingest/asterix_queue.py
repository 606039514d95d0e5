"""The bounded queue between the ports and the decoder."""

import threading
from collections import deque
from typing import NamedTuple


class Received(NamedTuple):
    """A datagram as it came.

    Attributes
    ----------
    listener : int
        Place of its listener.
    number : int
        Its number there, from 1.
    received_s : float
        Unix time of its reception, s.
    octets : bytes
        What it carries.
    """

    listener: int
    number: int
    received_s: float
    octets: bytes


class DatagramQueue:
    """Datagrams that wait, bounded by their number and by their octets; full means dropped.

    Parameters
    ----------
    datagrams_max, octets_max : int
        The bounds.
    """

    def __init__(self, datagrams_max: int, octets_max: int) -> None:
        self._datagrams_max = datagrams_max
        self._octets_max = octets_max
        self._waiting: deque[Received] = deque()
        self._octets = 0
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._waiting)

    @property
    def octets(self) -> int:
        """Octets that wait."""
        return self._octets

    def put(self, received: Received) -> bool:
        """Add a datagram; False if there is no room for it."""
        size = len(received.octets)
        with self._lock:
            if len(self._waiting) >= self._datagrams_max or self._octets + size > self._octets_max:
                return False
            self._waiting.append(received)
            self._octets += size
            return True

    def take(self, datagrams_max: int) -> list[Received]:
        """Return the oldest datagrams, at most so many; empty when none waits."""
        with self._lock:
            count = min(datagrams_max, len(self._waiting))
            taken = [self._waiting.popleft() for _ in range(count)]
            self._octets -= sum(len(one.octets) for one in taken)
            return taken
