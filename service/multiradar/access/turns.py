"""Turns of large messages, so that what their rows take in memory is bounded."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager


class Turns:
    """Turns of large messages, in the order of their arrival. Used on the thread of the event loop.

    Parameters
    ----------
    large_octets : int
        Octets from which a message takes a turn; smaller ones never wait.
    octets_max : int
        Octets of all messages that have a turn; one of more octets has its turn alone.
    """

    def __init__(self, large_octets: int, octets_max: int) -> None:
        self._large = large_octets
        self._most = octets_max
        self._octets = 0
        self._first = asyncio.Lock()
        self._ended = asyncio.Event()

    @asynccontextmanager
    async def of(self, octets: int) -> AsyncIterator[None]:
        """Wait for the turn of a message, and end it with the context."""
        if octets < self._large:
            yield
            return
        async with self._first:
            while self._octets and self._octets + octets > self._most:
                self._ended.clear()
                await self._ended.wait()
            self._octets += octets
        try:
            yield
        finally:
            self._octets -= octets
            self._ended.set()
