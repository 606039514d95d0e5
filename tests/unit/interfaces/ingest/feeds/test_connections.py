"""A port that receivers connect to: who may, and who waits."""

import socket
from collections.abc import Iterator

import pytest
from structlog.testing import capture_logs

from multiradar.clock import FixedClock
from multiradar.ingest.feeds.connections import SILENCE_MAX_S, AcceptedConnection
from support.processes.waiting import wait_until


class Scene:
    def __init__(self) -> None:
        self.clock = FixedClock()
        self.ports: list[AcceptedConnection] = []
        self.peers: list[socket.socket] = []

    def port(self, *senders: str, address: str = "127.0.0.1") -> AcceptedConnection:
        self.ports.append(AcceptedConnection(address, 0, senders, self.clock))
        return self.ports[-1]

    def connect(self, port: AcceptedConnection) -> socket.socket:
        address, _, number = port.endpoint.removeprefix("tcp/").rpartition(":")
        self.peers.append(socket.create_connection((address, int(number))))
        return self.peers[-1]


@pytest.fixture
def scene() -> Iterator[Scene]:
    made = Scene()
    yield made
    for peer in made.peers:
        peer.close()
    for port in made.ports:
        port.release()


def received(port: AcceptedConnection) -> bytes:
    found: list[bytes] = []

    def came() -> bool:
        found.append(port.receive() or b"")
        return any(found)

    wait_until(came, "text")
    return b"".join(found)


def test_a_silent_peer_makes_room_for_the_next(scene: Scene) -> None:
    port = scene.port()
    scene.connect(port)
    wait_until(port.open, "the connection")
    scene.clock.advance(SILENCE_MAX_S + 1.0)
    # While no other is there, it may be silent: at night there are no aircraft.
    assert port.receive() is None
    scene.connect(port).sendall(b"a")
    with pytest.raises(ConnectionError, match="silent for 60 s"):
        wait_until(lambda: port.receive() is not None, "the end")
    port.close()
    wait_until(port.open, "the second connection")
    assert received(port) == b"a"


def test_a_peer_that_sends_keeps_its_place(scene: Scene) -> None:
    port = scene.port()
    first = scene.connect(port)
    wait_until(port.open, "the connection")
    scene.connect(port)
    for _ in range(3):
        scene.clock.advance(SILENCE_MAX_S)
        first.sendall(b"a")
        assert received(port) == b"a"
    assert port.receive() is None


@pytest.mark.parametrize(("address", "origin"), [("127.0.0.1", "127.0.0.1"), ("::1", "::/64")])
def test_a_peer_that_is_not_listed_is_rejected_and_logged(
    scene: Scene, address: str, origin: str
) -> None:
    """A host with a network of IPv6 addresses was logged with each of them."""
    port = scene.port("192.0.2.0/24", "2001:db8::/32", address=address)
    peer = scene.connect(port)
    with capture_logs() as logs:
        wait_until(lambda: port.open() or bool(logs), "the rejection")
    assert [(one["event"], one["origin"]) for one in logs] == [("connection_not_allowed", origin)]
    assert peer.recv(1) == b""
    listed = scene.port("192.0.2.0/24", "127.0.0.0/8")
    scene.connect(listed)
    wait_until(listed.open, "the connection")
