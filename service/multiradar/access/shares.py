"""Shares of the clients in what the service has a limited number of.

A client is the name that its credentials prove, or else its address; of an IPv6 address the
network of 64 bits, which one host may use all of.
"""

from collections import Counter
from contextvars import ContextVar
from ipaddress import IPv6Address, ip_address, ip_network

from multiradar.errors import RequestError

#: The client of the request that is being answered.
CLIENT: ContextVar[str] = ContextVar("client", default="")

_HOST_BITS = 64


def client_at(address: str) -> str:
    """Return the client at an address."""
    try:
        found = ip_address(address.partition("%")[0])
    except ValueError:
        return address
    if not isinstance(found, IPv6Address):
        return str(found)
    if found.ipv4_mapped is not None:
        return str(found.ipv4_mapped)
    return str(ip_network((found, _HOST_BITS), strict=False))


class Shares:
    """Counts what all clients and each client hold. Used on one thread.

    Parameters
    ----------
    name : str
        What is counted, in words.
    code : str
        Code of the rejection.
    whole, each : int
        What all clients together, and each client, may hold.
    retry_after_s : int
        When a rejected client may try again.
    """

    def __init__(self, name: str, code: str, whole: int, each: int, retry_after_s: int = 1) -> None:
        self._name = name
        self._code = code
        self._whole = whole
        self._each = each
        self._retry_after = {"retry-after": str(retry_after_s)}
        self._held: Counter[str] = Counter()
        #: What all clients hold.
        self.total = 0

    def held(self, client: str) -> int:
        """Return what a client holds."""
        return self._held[client]

    def add(self, client: str, count: int = 1) -> None:
        """Let a client hold more.

        Raises
        ------
        RequestError
            429 at the bound of the client, 503 at that of all.
        """
        if self._held[client] + count > self._each:
            raise RequestError(
                429,
                self._code,
                f"this client has {self._held[client]} {self._name}, expected at most "
                f"{self._each}; wait until some have finished, or use a separate key for each "
                "client",
                self._retry_after,
            )
        if self.total + count > self._whole:
            raise RequestError(
                503,
                self._code,
                f"all clients together have {self.total} {self._name}, expected at most "
                f"{self._whole}; try again later",
                self._retry_after,
            )
        self._held[client] += count
        self.total += count

    def remove(self, client: str, count: int = 1) -> None:
        """Let a client hold less."""
        self.total -= count
        self._held[client] -= count
        if not self._held[client]:
            del self._held[client]
