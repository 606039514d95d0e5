"""The bodies of all requests in memory: bounded together and by client, slow ones ended first."""

import asyncio
from collections.abc import AsyncIterator, Iterable
from contextlib import asynccontextmanager

from multiradar.access.shares import Shares
from multiradar.errors import RequestError
from multiradar.settings.limits import HttpLimits


class Body:
    """A body that arrives.

    Parameters
    ----------
    bodies : Bodies
        All of them.
    client : str
        Its client.
    duration_s : float
        Maximum time until it is received.
    """

    def __init__(self, bodies: "Bodies", client: str, duration_s: float) -> None:
        self._bodies = bodies
        self.client = client
        #: Octets in memory.
        self.held = 0
        self._until_s = asyncio.get_running_loop().time() + duration_s
        self._late = f"the body did not arrive within {duration_s} s"
        self._waiting: asyncio.Timeout | None = None
        self._ended = False

    @asynccontextmanager
    async def deadline(self) -> AsyncIterator[None]:
        """End what waits for the body, within this context, at its deadline."""
        try:
            async with asyncio.timeout_at(self._until_s) as self._waiting:
                yield
        finally:
            self._waiting = None

    def hold(self, count: int) -> None:
        """Hold a piece; other bodies that have been arriving for longer may end for it.

        Raises
        ------
        RequestError
            429 at the bound of the client, 503 at that of all; 408 if it has been ended.
        """
        if self._ended:
            # The piece came at the same time.
            raise self.error()
        self._bodies.add(self, count)

    def arrived(self) -> None:
        """Note that it is complete, or rejected: it is not ended for others any more."""
        self._bodies.arrived(self)

    def release(self) -> None:
        """Give back its memory."""
        self._bodies.release(self)

    def end(self) -> None:
        """End it now, for others."""
        self._ended = True
        self._until_s = 0.0
        self._late = (
            "the body arrived too slowly, and its memory was released for other requests; "
            "send it again"
        )
        # One that has just expired can no longer be changed.
        if self._waiting is not None and not self._waiting.expired():
            self._waiting.reschedule(self._until_s)

    def error(self) -> RequestError:
        """Return the error after the deadline."""
        return RequestError(408, "BODY_TIMEOUT", self._late)


class Bodies:
    """The bodies of all requests. Used on the thread of the event loop.

    Parameters
    ----------
    limits : HttpLimits
        Bounds of all of them and of those of a client.
    """

    def __init__(self, limits: HttpLimits) -> None:
        self._each = limits.client_bodies_bytes_max
        self._whole = limits.bodies_bytes_max
        self._shares = Shares(
            "octets of request bodies in progress", "TOO_MANY_BODIES", self._whole, self._each
        )
        # In the order of their first octets.
        self._arriving: dict[Body, None] = {}

    def add(self, body: Body, count: int) -> None:
        """Hold a piece of a body; see `Body.hold`."""
        self._arriving[body] = None
        self._make_room(body, count)
        self._shares.add(body.client, count)
        body.held += count

    def arrived(self, body: Body) -> None:
        """Note that a body is complete, or rejected."""
        self._arriving.pop(body, None)

    def release(self, body: Body) -> None:
        """Give back the memory of a body."""
        self.arrived(body)
        self._shares.remove(body.client, body.held)
        body.held = 0

    def _make_room(self, body: Body, count: int) -> None:
        of_client, of_all = self._excess(body, count)
        if of_client <= 0 and of_all <= 0:
            return
        others = [one for one in self._arriving if one is not body]
        own = [one for one in others if one.client == body.client]
        if of_client > _held(own) or of_all > _held(others):
            # Bodies that have arrived fill the bound: ending others gains nothing.
            return
        for one in own:
            if self._excess(body, count)[0] > 0:
                self._end(one)
        for one in list(self._arriving):
            if one is not body and self._excess(body, count)[1] > 0:
                self._end(one)

    # Octets beyond the bounds of the client and of all with another piece.
    def _excess(self, body: Body, count: int) -> tuple[int, int]:
        of_client = self._shares.held(body.client) + count - self._each
        return of_client, self._shares.total + count - self._whole

    def _end(self, body: Body) -> None:
        body.end()
        self.release(body)


def _held(bodies: Iterable[Body]) -> int:
    return sum(one.held for one in bodies)
