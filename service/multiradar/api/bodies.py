"""The bodies of all requests in memory: bounded together and by client, slow ones ended first."""

import asyncio

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

    def deadline(self) -> asyncio.Timeout:
        """Return a context that ends what waits for the body at its deadline."""
        self._waiting = asyncio.timeout_at(self._until_s)
        return self._waiting

    def hold(self, count: int) -> None:
        """Hold a piece; other bodies that have been arriving for longer may end for it.

        Raises
        ------
        RequestError
            429 at the bound of the client, 503 at that of all.
        """
        self._bodies.add(self, count)

    def arrived(self) -> None:
        """Note that it is complete: it is not ended for others any more."""
        self._bodies.arrived(self)

    def release(self) -> None:
        """Give back its memory."""
        self._bodies.release(self)

    def end(self) -> None:
        """End it now, for others."""
        self._until_s = 0.0
        self._late = (
            "the body arrived too slowly, and its memory was released for other requests; "
            "send it again"
        )
        if self._waiting is not None:
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
        """Note that a body is complete."""
        self._arriving.pop(body, None)

    def release(self, body: Body) -> None:
        """Give back the memory of a body."""
        self.arrived(body)
        self._shares.remove(body.client, body.held)
        body.held = 0

    def _make_room(self, body: Body, count: int) -> None:
        for other in list(self._arriving):
            of_client = self._shares.held(body.client) + count > self._each
            if not of_client and self._shares.total + count <= self._whole:
                return
            if other is not body and (not of_client or other.client == body.client):
                other.end()
                self.release(other)
