"""Sources of datagrams: a UDP port, or memory in tests."""

import socket
import struct
import threading
from collections import deque
from collections.abc import Mapping, Sequence
from ipaddress import IPv4Address, IPv4Network
from typing import Protocol

from multiradar.access.security_log import RepeatedEvents
from multiradar.errors import ConfigurationError
from multiradar.ingest.udp import is_group

#: Maximum size of a datagram over IPv4, octets.
DATAGRAM_OCTETS_MAX = 65_535
#: Timeout of a reception, after which a stop is possible, s.
WAIT_S = 0.2
# Linux SO_RXQ_OVFL: count of datagrams dropped because the buffer was full, reported with the next
# one. Python has no name for it.
_DROPS = 40
_ANCILLARY = socket.CMSG_SPACE(4)


class DatagramSource(Protocol):
    """Datagrams in the order of reception."""

    @property
    def endpoint(self) -> str:
        """Address it listens on, such as `udp/127.0.0.1:8600`."""
        ...

    @property
    def lost(self) -> int:
        """Datagrams dropped by the system before they were read, as far as it reports them."""
        ...

    @property
    def status(self) -> Mapping[str, object]:
        """State of a connection and its last error; empty for a port."""
        ...

    @property
    def sender(self) -> str:
        """Where the last datagram came from: an address or an endpoint."""
        ...

    @property
    def can_wait(self) -> bool:
        """Whether data that are not read wait at the sender, as in a stream."""
        ...

    def receive(self) -> bytes | None:
        """Wait a moment for the next datagram; None if there was none. Raise OSError on a fault."""
        ...

    def close(self) -> None:
        """Close the source; may be called twice."""
        ...


class UdpSource:
    """A UDP port, unicast or of a multicast group.

    Parameters
    ----------
    address : str
        IPv4 address of this host, or of a multicast group to join.
    port : int
        UDP port; 0 picks a free one.
    interface : str
        Address of the interface on which a group is joined.
    buffer_octets : int
        Requested receive buffer; the system may give less.
    senders : sequence of str
        Addresses or networks whose datagrams are received; empty for all.
    events : RepeatedEvents, optional
        Logs datagrams of others.

    Raises
    ------
    ConfigurationError
        If the port cannot be opened.
    """

    can_wait = False

    def __init__(
        self,
        address: str,
        port: int,
        interface: str,
        buffer_octets: int,
        *,
        senders: Sequence[str] = (),
        events: RepeatedEvents | None = None,
    ) -> None:
        self.lost = 0
        self.sender = ""
        self._senders = tuple(IPv4Network(one) for one in senders)
        self._events = events
        self._not_allowed = 0
        self._buffer = bytearray(DATAGRAM_OCTETS_MAX)
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._open(address, port, interface, buffer_octets)
        except OSError as error:
            self._socket.close()
            msg = f"udp {address}:{port} on {interface}: cannot listen: {error.strerror}"
            raise ConfigurationError(msg) from error
        host, port = self._socket.getsockname()
        self.endpoint = f"udp/{host}:{port}"

    @property
    def status(self) -> Mapping[str, object]:
        """Datagrams of senders that are not allowed, where some are listed."""
        return {"datagrams_not_allowed": self._not_allowed} if self._senders else {}

    def receive(self) -> bytes | None:
        """Wait a moment for the next datagram of an allowed sender."""
        try:
            octets, ancillary, _flags, sender = self._socket.recvmsg_into(
                [self._buffer], _ANCILLARY
            )
        except TimeoutError:
            return None
        for level, kind, value in ancillary:
            if level == socket.SOL_SOCKET and kind == _DROPS and len(value) >= 4:
                (self.lost,) = struct.unpack("=I", value[:4])
        self.sender = sender[0]
        if self._senders and not any(IPv4Address(self.sender) in one for one in self._senders):
            self._not_allowed += 1
            if self._events is not None:
                self._events.warn("datagram_not_allowed", self.sender, listener=self.endpoint)
            return None
        return bytes(memoryview(self._buffer)[:octets])

    def close(self) -> None:
        """Leave the group and the port."""
        self._socket.close()

    def _open(self, address: str, port: int, interface: str, buffer_octets: int) -> None:
        own = self._socket
        own.settimeout(WAIT_S)
        own.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer_octets)
        if is_group(address):
            # Other processes on this host may listen to the group, too.
            own.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        # Bound to the group, so that datagrams to other addresses are not received.
        own.bind((address, port))
        if is_group(address):
            joined = socket.inet_aton(address) + socket.inet_aton(interface)
            own.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, joined)
        try:
            own.setsockopt(socket.SOL_SOCKET, _DROPS, 1)
        except OSError:
            # Not on Linux: drops are not reported.
            self.lost = 0


class MemorySource:
    """Datagrams from memory, the twin of `UdpSource` for tests.

    Attributes
    ----------
    faults : deque of Exception
        Raised one by one before anything is received.
    can_wait : bool
        Whether it stands for a stream.
    """

    can_wait = False

    def __init__(self, endpoint: str = "memory") -> None:
        self.endpoint = endpoint
        self.sender = ""
        self.lost = 0
        self.status: Mapping[str, object] = {}
        self.closed = False
        self.faults: deque[Exception] = deque()
        self._waiting: deque[bytes] = deque()
        self._came = threading.Event()

    def send(self, *datagrams: bytes) -> None:
        """Queue datagrams for reception."""
        self._waiting.extend(datagrams)
        self._came.set()

    def receive(self) -> bytes | None:
        """Wait a moment for the next datagram."""
        if self.faults:
            raise self.faults.popleft()
        if not self._waiting:
            self._came.clear()
            if not self._waiting:
                self._came.wait(WAIT_S)
        return self._waiting.popleft() if self._waiting else None

    def close(self) -> None:
        """Record the end of reception."""
        self.closed = True
