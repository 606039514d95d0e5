"""Where the text of a feed comes from: a TCP connection, or memory in tests."""

import socket
import threading
from collections import deque
from typing import Protocol

from multiradar.errors import ConfigurationError

#: Maximum wait for data, after which a stop is possible, s.
WAIT_S = 0.2
#: Octets that are read at once.
CHUNK_OCTETS = 1 << 16
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
    """A port that accepts one connection at a time; others wait.

    Parameters
    ----------
    address : str
        Address of this host.
    port : int
        TCP port; 0 picks a free one.

    Raises
    ------
    ConfigurationError
        If the port cannot be opened.
    """

    whole = False

    def __init__(self, address: str, port: int) -> None:
        try:
            family = socket.AF_INET6 if ":" in address else socket.AF_INET
            self._listener = socket.create_server((address, port), family=family, backlog=4)
        except OSError as error:
            msg = f"tcp {address}:{port}: cannot listen: {error.strerror or error}"
            raise ConfigurationError(msg) from error
        self._listener.settimeout(WAIT_S)
        host, bound = self._listener.getsockname()[:2]
        self.endpoint = f"tcp/{host}:{bound}"
        self._socket: socket.socket | None = None

    def open(self) -> bool:
        """Wait a moment for a connection."""
        try:
            self._socket, _ = self._listener.accept()
        except TimeoutError:
            return False
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

    def release(self) -> None:
        """Close the port, too."""
        self.close()
        self._listener.close()


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
