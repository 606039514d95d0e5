"""Where the text of a feed comes from: a TCP connection, or memory in tests."""

import socket
import threading
from collections import deque
from collections.abc import Sequence
from ipaddress import ip_address, ip_network
from typing import Protocol

from multiradar.access.security_log import RepeatedEvents
from multiradar.access.shares import client_at
from multiradar.clock import Clock, SystemClock
from multiradar.errors import ConfigurationError

#: Maximum wait for data, after which a stop is possible, s.
WAIT_S = 0.2
#: Octets that are read at once.
CHUNK_OCTETS = 1 << 16
#: A peer that has sent nothing for so long makes room for another one, s.
SILENCE_MAX_S = 60.0
# A peer that was switched off without closing the connection is detected after a minute.
_KEEPALIVE = (("TCP_KEEPIDLE", 30), ("TCP_KEEPINTVL", 10), ("TCP_KEEPCNT", 3))


class FeedConnection(Protocol):
    """Text of a feed; connected and closed again and again, by one thread."""

    @property
    def endpoint(self) -> str:
        """Its address."""
        ...

    @property
    def whole(self) -> bool:
        """Whether each piece is a whole document, and not part of a stream of lines."""
        ...

    def open(self) -> bool:
        """Connect; False if it has to be called again. Raise OSError if that is not possible."""
        ...

    def receive(self) -> bytes | None:
        """Wait a moment for text; None if there was none, empty at the end. Raise OSError."""
        ...

    def close(self) -> None:
        """Close the connection; may be called twice."""
        ...

    def release(self) -> None:
        """Release everything, also what is not connected; may be called twice."""
        ...


class TcpConnection:
    """A connection to a server of lines.

    Parameters
    ----------
    host : str
        Name or address.
    port : int
        TCP port.
    timeout_s : float
        Maximum time to connect, s.
    """

    whole = False

    def __init__(self, host: str, port: int, timeout_s: float) -> None:
        self.endpoint = f"tcp/{host}:{port}"
        self._address, self._timeout_s = (host, port), timeout_s
        self._socket: socket.socket | None = None

    def open(self) -> bool:
        """Connect."""
        self._socket = socket.create_connection(self._address, self._timeout_s)
        _prepare(self._socket)
        return True

    def receive(self) -> bytes | None:
        """Wait a moment for text."""
        return _received(self._socket)

    def close(self) -> None:
        """Close the connection."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    release = close


class AcceptedConnection:
    """A port that accepts one connection at a time; others wait until it ends or is silent.

    Parameters
    ----------
    address : str
        Address of this host.
    port : int
        TCP port; 0 picks a free one.
    senders : sequence of str
        Addresses or networks whose connections are accepted; empty for all.
    clock : Clock, optional
        Measures silence.

    Raises
    ------
    ConfigurationError
        If the port cannot be opened.
    """

    whole = False

    def __init__(
        self, address: str, port: int, senders: Sequence[str] = (), clock: Clock | None = None
    ) -> None:
        self._senders = tuple(ip_network(one) for one in senders)
        self._clock = clock or SystemClock()
        self._events = RepeatedEvents(self._clock)
        try:
            family = socket.AF_INET6 if ":" in address else socket.AF_INET
            self._listener = socket.create_server((address, port), family=family, backlog=4)
        except OSError as error:
            msg = f"tcp {address}:{port}: cannot listen: {error.strerror or error}"
            raise ConfigurationError(msg) from error
        host, bound = self._listener.getsockname()[:2]
        self.endpoint = f"tcp/{host}:{bound}"
        self._socket: socket.socket | None = None
        self._next: socket.socket | None = None
        self._heard_s = 0.0

    def open(self) -> bool:
        """Wait a moment for a connection."""
        self._socket, self._next = self._next or self._accepted(WAIT_S), None
        self._heard_s = self._clock.monotonic_s()
        return self._socket is not None

    def receive(self) -> bytes | None:
        """Wait a moment for text; a peer that is silent makes room for the next one."""
        text = _received(self._socket)
        now_s = self._clock.monotonic_s()
        if text is not None:
            self._heard_s = now_s
        elif now_s - self._heard_s > SILENCE_MAX_S:
            self._next = self._next or self._accepted(0.0)
            if self._next is not None:
                msg = f"the peer was silent for {SILENCE_MAX_S:g} s, and another one has connected"
                raise ConnectionError(msg)
        return text

    def close(self) -> None:
        """Close the connection."""
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def release(self) -> None:
        """Close the port, too."""
        self.close()
        if self._next is not None:
            self._next.close()
            self._next = None
        self._listener.close()

    def _accepted(self, wait_s: float) -> socket.socket | None:
        self._listener.settimeout(wait_s)
        try:
            found, (peer, *_) = self._listener.accept()
        except (TimeoutError, BlockingIOError):
            return None
        if self._senders and not any(ip_address(peer) in one for one in self._senders):
            found.close()
            origin = client_at(peer)
            self._events.warn(
                "connection_not_allowed", origin, address=peer, listener=self.endpoint
            )
            return None
        _prepare(found)
        return found


class MemoryConnection:
    """Text from memory, the twin of the others for tests.

    Attributes
    ----------
    faults : deque of Exception
        Raised one by one on connecting.
    """

    def __init__(self, *, whole: bool = False, endpoint: str = "memory") -> None:
        self.endpoint, self.whole = endpoint, whole
        self.opened = self.closed = 0
        self.released = False
        self.faults: deque[Exception] = deque()
        self._waiting: deque[bytes | Exception] = deque()
        self._came = threading.Event()

    def send(self, *pieces: bytes | Exception) -> None:
        """Queue pieces for reception; an empty one ends the connection, an error is raised."""
        self._waiting.extend(pieces)
        self._came.set()

    def open(self) -> bool:
        """Connect."""
        if self.faults:
            raise self.faults.popleft()
        self.opened += 1
        return True

    def receive(self) -> bytes | None:
        """Wait a moment for text."""
        if not self._waiting:
            self._came.clear()
            if not self._waiting:
                self._came.wait(WAIT_S)
        piece = self._waiting.popleft() if self._waiting else None
        if isinstance(piece, Exception):
            raise piece
        return piece

    def close(self) -> None:
        """Count the end of the connection."""
        self.closed += 1

    def release(self) -> None:
        """Record that it is no longer used."""
        self.released = True


def _prepare(connected: socket.socket) -> None:
    connected.settimeout(WAIT_S)
    connected.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _KEEPALIVE:
        option = getattr(socket, name, None)
        if option is not None:
            connected.setsockopt(socket.IPPROTO_TCP, option, value)


def _received(connected: socket.socket | None) -> bytes | None:
    if connected is None:
        return b""
    try:
        return connected.recv(CHUNK_OCTETS)
    except TimeoutError:
        return None
