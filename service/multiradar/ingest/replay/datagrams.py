"""Replay of a recording as UDP datagrams, in real time or faster."""

import errno
import socket
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from multiradar.clock import Clock
from multiradar.errors import PeerError
from multiradar.ingest.replay.replaying import FIRST_CONTACT_S, SILENCE_MAX_S
from multiradar.ingest.udp import is_group, open_sending
from multiradar_converters.asterix.writing.sending import Sending

#: At maximum speed, a pause after each burst gives the listener time to read, s.
BURST_DATAGRAMS = 16
BURST_PAUSE_S = 0.001


class DatagramSink(Protocol):
    """Destination of datagrams."""

    def send(self, octets: bytes) -> None:
        """Send a datagram; raise `PeerError` when it cannot be."""
        ...

    def rejected(self) -> int:
        """Return the number of datagrams rejected by the host (port unreachable)."""
        ...

    def close(self) -> None:
        """Close the socket."""
        ...


class UdpSink:
    """A UDP address, unicast or of a multicast group.

    Parameters
    ----------
    address : str
        IPv4 address of a host or a multicast group.
    port : int
        UDP port.
    interface : str
        Address of the interface for multicast.

    Raises
    ------
    PeerError
        If this host has no such interface.
    """

    def __init__(self, address: str, port: int, interface: str) -> None:
        self._target = (address, port)
        self._rejected = 0
        try:
            self._socket = open_sending(address, interface)
            if not is_group(address):
                # Only a connected socket reports an unreachable port, at the next datagram.
                self._socket.connect(self._target)
        except OSError as error:
            msg = f"udp:{address}:{port}: cannot send via {interface}: {error.strerror}"
            raise PeerError(msg) from error

    def send(self, octets: bytes) -> None:
        """Send a datagram; its arrival is not confirmed."""
        try:
            self._send(octets)
        except OSError as error:
            address, port = self._target
            raise PeerError(
                f"udp:{address}:{port}: cannot send to this address: {error.strerror}"
            ) from error

    def rejected(self) -> int:
        """Return the number of rejected datagrams; always 0 for a multicast group."""
        if self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR) == errno.ECONNREFUSED:
            self._rejected += 1
        return self._rejected

    def _send(self, octets: bytes) -> None:
        if is_group(self._target[0]):
            self._socket.sendto(octets, self._target)
            return
        try:
            self._socket.send(octets)
        except ConnectionRefusedError:
            # The datagram before was rejected; this one has not been sent.
            self._rejected += 1
            self._socket.send(octets)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


@dataclass(slots=True)
class MemorySink:
    """Keeps datagrams in memory; the counterpart of `UdpSink` for tests."""

    sent: list[bytes] = field(default_factory=list)
    closed: bool = False

    def send(self, octets: bytes) -> None:
        """Keep a datagram."""
        self.sent.append(octets)

    def rejected(self) -> int:
        """Return 0."""
        return 0

    def close(self) -> None:
        """Record the end."""
        self.closed = True


def wall_times(due_s: NDArray[np.float64], speed: float) -> NDArray[np.float64]:
    """Return when datagrams are sent.

    Parameters
    ----------
    due_s : float64[n]
        When they are due in the time of the recording, s, non-decreasing.
    speed : float
        Playback speed (1 = real time); may be infinite.

    Returns
    -------
    float64[n]
        Seconds since the first; gaps longer than `SILENCE_MAX_S` are shortened to it.
    """
    steps = np.diff(due_s, prepend=due_s[:1])
    return np.cumsum(np.minimum(steps, SILENCE_MAX_S)) / speed


def begin_s(due_s: NDArray[np.float64], speed: float, now_s: float) -> float:
    """Return the start time of a recording sent from now on so that none of it is in the future.

    Parameters
    ----------
    due_s : float64[n]
        When its datagrams are due, s since the first.
    speed : float
        Playback speed (1 = real time).
    now_s : float
        Now, Unix time, s.

    Returns
    -------
    float
        Unix time, s: now, or earlier if playback is faster than real time.
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
    on_rejected: Callable[[], None] = lambda: None,
) -> int:
    """Send every datagram when due.

    Parameters
    ----------
    sending : Sending
        The datagrams.
    sink : DatagramSink
        The destination.
    speed : float
        Playback speed (1 = real time); may be infinite.
    clock : Clock
        Paces them.
    pause : callable
        Waits for a number of seconds.
    on_sent : callable
        Called with the number sent, from time to time.
    on_rejected : callable
        Called when the first one is rejected.

    Returns
    -------
    int
        Octets sent.

    Raises
    ------
    PeerError
        A datagram cannot be sent, or most of them are rejected for `FIRST_CONTACT_S` or until the
        end.
    """
    datagrams = sending.datagrams
    start_s, sent, octets, rejected = clock.monotonic_s(), 0, 0, 0
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
        before, rejected = rejected, sink.rejected()
        if rejected and not before:
            on_rejected()
        if 2 * rejected > sent and clock.monotonic_s() - start_s >= FIRST_CONTACT_S:
            break
    on_sent(sent)
    if 2 * rejected > sent:
        raise PeerError(
            f"no listener at this address: {rejected} of {sent} datagrams were rejected"
        )
    return octets
