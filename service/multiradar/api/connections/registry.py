"""The open connections: how many each client may have, and the end of those that do not read."""

import asyncio
from collections import Counter
from dataclasses import dataclass

from multiradar.access.shares import client_at
from multiradar.observability.metrics import HTTP_CONNECTIONS, HTTP_CONNECTIONS_DROPPED
from multiradar.settings.limits import HttpLimits


class Registry:
    """The open connections of a server. Used on the thread of the event loop only.

    Parameters
    ----------
    limits : HttpLimits
        Their limits.
    """

    def __init__(self, limits: HttpLimits) -> None:
        self.limits = limits
        self._open: dict[asyncio.Transport, _Connection] = {}
        # In order of insertion: the first has been idle longest.
        self._idle: dict[asyncio.Transport, None] = {}
        self._clients: Counter[str] = Counter()
        self._sweeping = False

    def admit(self, transport: asyncio.Transport) -> bool:
        """Count a new connection; drop it, and return False, if there is no place for it."""
        if transport in self._open:  # Since before its handshake.
            return True
        client = _client_of(transport)
        of_client = self._clients[client] >= self.limits.client_connections_max
        full = of_client or len(self._open) >= self.limits.connections_max
        if full and not self._evict(client if of_client else None):
            self.drop(transport, "too_many_of_client" if of_client else "too_many")
            return False
        self._clients[client] += 1
        loop = asyncio.get_running_loop()
        self._open[transport] = _Connection(transport, client, loop.time())
        self._idle[transport] = None
        HTTP_CONNECTIONS.inc()
        if not self._sweeping:
            self._sweeping = True
            loop.call_later(self._sweep_interval_s(), self._sweep)
        return True

    def secured(self, transport: asyncio.Transport, over: asyncio.Transport) -> bool:
        """Give TLS the place of the connection below it; return False if that has been dropped."""
        if over not in self._open:
            return False
        client = self._open.pop(over).client
        del self._idle[over]
        self._open[transport] = _Connection(over, client, asyncio.get_running_loop().time())
        self._idle[transport] = None
        return True

    def busy(self, transport: asyncio.Transport) -> None:
        """Note that a connection has a request, or a stream: it is not replaced."""
        self._idle.pop(transport, None)

    def idle(self, transport: asyncio.Transport) -> None:
        """Note that a connection waits for a request: from now on it may be replaced."""
        if transport in self._open:
            self._idle[transport] = None

    def lost(self, transport: asyncio.Transport) -> None:
        """Give back the place of a connection."""
        self._idle.pop(transport, None)
        lost = self._open.pop(transport, None)
        if lost is not None:
            HTTP_CONNECTIONS.dec()
            self._clients[lost.client] -= 1
            if not self._clients[lost.client]:
                del self._clients[lost.client]

    def drop(self, transport: asyncio.Transport, cause: str) -> None:
        """Abort a connection, and count it with its cause."""
        HTTP_CONNECTIONS_DROPPED.labels(cause=cause).inc()
        self._abort(transport)

    async def end_all(self) -> None:
        """Abort all connections, and let the event loop close them."""
        for transport in list(self._open):
            self._abort(transport)
            self.lost(transport)
        # First that of TCP, then TLS above it, then the protocol.
        for _ in range(3):
            await asyncio.sleep(0.0)

    def _abort(self, transport: asyncio.Transport) -> None:
        # TLS that has been closed twice, as uvicorn does, cannot be aborted itself.
        known = self._open.get(transport)
        (transport if known is None else known.over).abort()

    def _evict(self, client: str | None) -> bool:
        # Of a client, or of all.
        for one, known in self._open.items():
            if client in (None, known.client) and self._only_waits_for_goodbye(one):
                self._abort(one)
                self.lost(one)
                return True
        candidates = (one for one in self._idle if client in (None, self._open[one].client))
        oldest = next(candidates, None)
        if oldest is None:
            return False
        self.drop(oldest, "idle_longest")
        self.lost(oldest)
        return True

    # Closed, and all octets are with the system: TLS waits for the goodbye of its client.
    def _only_waits_for_goodbye(self, transport: asyncio.Transport) -> bool:
        return transport.is_closing() and not self._open[transport].over.get_write_buffer_size()

    def _sweep(self) -> None:
        try:
            for transport in list(self._open):
                if self._only_waits_for_goodbye(transport):
                    self._abort(transport)
                else:
                    self._check_progress(transport)
        finally:
            # Whatever happens: this alone ends clients that do not read.
            self._sweeping = bool(self._open)
            if self._sweeping:
                loop = asyncio.get_running_loop()
                loop.call_later(self._sweep_interval_s(), self._sweep)

    # A buffer that does not shrink means that the client does not read. Twice the deadline of a
    # piece leaves time for a close code behind it.
    def _check_progress(self, transport: asyncio.Transport) -> None:
        now_s = asyncio.get_running_loop().time()
        one = self._open[transport]
        size = one.over.get_write_buffer_size()
        if size == 0 or size < one.size:
            one.since_s = now_s
        elif one.since_s < now_s - 2.0 * self.limits.send_deadline_s:
            self.drop(transport, "does_not_read")
        one.size = size

    def _sweep_interval_s(self) -> float:
        return self.limits.send_deadline_s / 10.0


@dataclass(slots=True)
class _Connection:
    # That of TCP, which with TLS is another transport; octets that it still has to deliver, and
    # since when they have not decreased.
    over: asyncio.Transport
    client: str
    since_s: float
    size: int = 0


def _client_of(transport: asyncio.Transport) -> str:
    return client_at((transport.get_extra_info("peername") or ("unknown",))[0])
