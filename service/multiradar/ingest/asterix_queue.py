"""The bounded queue between the ports and the decoder."""

import threading
from collections import deque
from typing import NamedTuple


class Received(NamedTuple):
    """A received datagram.

    Attributes
    ----------
    listener : int
        Index of its listener.
    number : int
        Its number at the listener, from 1.
    received_s : float
        Unix time of its reception, s.
    octets : bytes
        Its content.
    sender : str
        Where it came from: an address or an endpoint; empty if unknown, without a share of its own.
    """

    listener: int
    number: int
    received_s: float
    octets: bytes
    sender: str = ""


class DatagramQueue:
    """Queue of datagrams, bounded by number and octets; datagrams that do not fit are dropped.

    One sender holds at most half of it, or a single datagram, so that its flood leaves room for the
    others.

    Parameters
    ----------
    datagrams_max, octets_max : int
        Limits.
    """

    def __init__(self, datagrams_max: int, octets_max: int) -> None:
        self._datagrams_max = datagrams_max
        self._octets_max = octets_max
        self._waiting: deque[Received] = deque()
        self._octets = 0
        # Datagrams and octets by sender.
        self._held: dict[str, tuple[int, int]] = {}
        self._lock = threading.Lock()

    def __len__(self) -> int:
        return len(self._waiting)

    @property
    def octets(self) -> int:
        """Octets in the queue."""
        return self._octets

    def put(self, received: Received) -> bool:
        """Add a datagram; False if it does not fit."""
        size = len(received.octets)
        with self._lock:
            if len(self._waiting) >= self._datagrams_max or self._octets + size > self._octets_max:
                return False
            count, held = self._held.get(received.sender, (0, 0))
            # A single datagram may be larger than half of a small queue.
            if (
                received.sender
                and count
                and (2 * count >= self._datagrams_max or 2 * (held + size) > self._octets_max)
            ):
                return False
            self._held[received.sender] = count + 1, held + size
            self._waiting.append(received)
            self._octets += size
            return True

    def pop(self, datagrams_max: int) -> list[Received]:
        """Remove and return the oldest datagrams, at most `datagrams_max`."""
        with self._lock:
            count = min(datagrams_max, len(self._waiting))
            popped = [self._waiting.popleft() for _ in range(count)]
            self._octets -= sum(len(one.octets) for one in popped)
            for one in popped:
                waiting, held = self._held.pop(one.sender)
                if waiting > 1:
                    self._held[one.sender] = waiting - 1, held - len(one.octets)
            return popped
