"""A recording sent as UDP datagrams, in the time in which it came or faster."""

import errno
import socket
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from multiradar.clock import Clock
from multiradar.errors import PeerError
from multiradar.ingest.replay import FIRST_CONTACT_S, SILENCE_MAX_S
from multiradar.ingest.udp import is_group, open_sending
from multiradar_converters.asterix.writing.sending import Sending

#: At the highest speed so many datagrams are sent, then a listener gets a moment to read them.
BURST_DATAGRAMS = 16
BURST_PAUSE_S = 0.001


class DatagramSink(Protocol):
    """Where datagrams are sent to."""

    def send(self, octets: bytes) -> None:
        """Send a datagram; raise `PeerError` when it cannot be."""
        ...

    def refused(self) -> int:
        """Return how many datagrams the other machine refused, as nobody listens there."""
        ...

    def close(self) -> None:
        """Let go of the port."""
        ...


class UdpSink:
    """A UDP address, unicast or of a multicast group.

    Parameters
    ----------
    address : str
        IPv4 address, or that of a group.
    port : int
        UDP port.
    interface : str
        Address of the interface by which a group is reached.

    Raises
    ------
    PeerError
        If this machine has no such interface.
    """

    def __init__(self, address: str, port: int, interface: str) -> None:
        self._target = (address, port)
        self._refused = 0
        try:
            self._socket = open_sending(address, interface)
            if not is_group(address):
                # Only then the system says that nobody listens, at the datagram after.
                self._socket.connect(self._target)
        except OSError as error:
            msg = f"udp:{address}:{port}: cannot send by {interface}, {error.strerror}"
            raise PeerError(msg) from error

    def send(self, octets: bytes) -> None:
        """Send a datagram; nobody says whether it arrives."""
        try:
            self._send(octets)
        except OSError as error:
            address, port = self._target
            raise PeerError(f"udp:{address}:{port}: cannot send there, {error.strerror}") from error

    def refused(self) -> int:
        """Return how many datagrams were refused; those to a group never are."""
        if self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) == errno.ECONNREFUSED:
            self._refused += 1
        return self._refused

    def _send(self, octets: bytes) -> None:
        if is_group(self._target[0]):
            self._socket.sendto(octets, self._target)
            return
        try:
            self._socket.send(octets)
        except ConnectionRefusedError:
            # What was refused is the datagram before; this one has not been sent.
            self._refused += 1
            self._socket.send(octets)

    def close(self) -> None:
        """Let go of the port."""
        self._socket.close()


@dataclass(slots=True)
class MemorySink:
    """Keeps what is sent, the twin of `UdpSink` for tests."""

    sent: list[bytes] = field(default_factory=list)
    closed: bool = False

    def send(self, octets: bytes) -> None:
        """Keep a datagram."""
        self.sent.append(octets)

    def refused(self) -> int:
        """Return none: all are kept."""
        return 0

    def close(self) -> None:
        """Note that nothing more comes."""
        self.closed = True


def wall_times(due_s: NDArray[np.float64], speed: float) -> NDArray[np.float64]:
    """Return when datagrams are sent.

    Parameters
    ----------
    due_s : float64[n]
        When they are due in the time of the recording, s, never falling.
    speed : float
        Seconds of the recording in a second; may be infinite.

    Returns
    -------
    float64[n]
        Seconds since the first; a silence longer than `SILENCE_MAX_S` is cut to it.
    """
    steps = np.diff(due_s, prepend=due_s[:1])
    return np.cumsum(np.minimum(steps, SILENCE_MAX_S)) / speed


def begin_s(due_s: NDArray[np.float64], speed: float, now_s: float) -> float:
    """Return when a recording sent from now on must begin so that none of it is in the future.

    Parameters
    ----------
    due_s : float64[n]
        When its datagrams are due, s since the first.
    speed : float
        Seconds of the recording in a second.
    now_s : float
        Now, Unix time, s.

    Returns
    -------
    float
        Unix time, s: now, or so much before as it runs faster than time.
    """
    return now_s - float(np.max(due_s - wall_times(due_s, speed), initial=0.0))


def send_all(
    sending: Sending,
    sink: DatagramSink,
    speed: float,
    *,
    clock: Clock,
    pause: Callable[[float], None],
    on_sent: Callable[[int], None] = lambda _count: None,
    on_refused: Callable[[], None] = lambda: None,
) -> int:
    """Send every datagram when it is due.

    Parameters
    ----------
    sending : Sending
        The datagrams.
    sink : DatagramSink
        Where to.
    speed : float
        Seconds of the recording in a second; may be infinite.
    clock : Clock
        Paces them.
    pause : callable
        Waits for a number of seconds.
    on_sent : callable
        Called with how many were sent, from time to time.
    on_refused : callable
        Called when the first one is refused.

    Returns
    -------
    int
        Octets sent.

    Raises
    ------
    PeerError
        A datagram cannot be sent, or most are refused for `FIRST_CONTACT_S` or to the end.
    """
    datagrams = sending.datagrams
    start_s, sent, octets, refused = clock.monotonic_s(), 0, 0, 0
    for k, (begin, end, wall_s) in enumerate(
        zip(
            datagrams.begins.tolist(),
            datagrams.ends.tolist(),
            wall_times(sending.due_s, speed).tolist(),
            strict=True,
        )
    ):
        remaining_s = start_s + wall_s - clock.monotonic_s()
        if remaining_s > 0.0:
            on_sent(k)
            pause(remaining_s)
        elif k and k % BURST_DATAGRAMS == 0:
            pause(BURST_PAUSE_S)
        sink.send(datagrams.data[begin:end].tobytes())
        octets += end - begin
        sent += 1
        before, refused = refused, sink.refused()
        if refused and not before:
            on_refused()
        if 2 * refused > sent and clock.monotonic_s() - start_s >= FIRST_CONTACT_S:
            break
    on_sent(sent)
    if 2 * refused > sent:
        raise PeerError(f"nobody listens there: {refused} of {sent} datagrams were refused")
    return octets
