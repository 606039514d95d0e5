"""Clients that read a service and discard what they read, at little cost; in a process of its own.

    python -m validation.service.subscribers.plain_readers INTERFACE COUNT URL

The end of the standard input ends it; it then prints the octets that each client received.
"""

import json
import selectors
import socket
import sys
from urllib.parse import urlsplit

from multiradar.clock import SystemClock

#: What a client of each stream requests.
STREAMS = {"websocket": "/v1/stream?kinds=track", "sse": "/v1/events?kinds=track"}
#: What a client requests once a second.
POLLED = {
    "picture": "/v1/picture",
    "tracks-json": "/v1/tracks?limit=10000",
    "tracks-arrow": "/v1/tracks?limit=10000&format=arrow",
    "tracks-geojson": "/v1/tracks?limit=10000&format=geojson",
    "aircraft": "/data/aircraft.json",
}
_POLL_S = 1.0
_PIECE = 1 << 20
_UPGRADE = (
    "Upgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
    "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n"
)
_PING, _PONG = 0x89, 0x8A
_LENGTH_BYTES = {126: 2, 127: 8}
_CLOCK = SystemClock()


class Reader:
    """A connection, and what it received.

    Parameters
    ----------
    address : str
        Host and port.
    path : str
        What it requests.
    frames : bool
        Whether over a WebSocket, whose pings are answered.
    """

    def __init__(self, address: str, path: str, *, frames: bool) -> None:
        host, port = address.rsplit(":", 1)
        self.socket = socket.create_connection((host, int(port)))
        self.octets = 0
        self._frames = frames
        self._request = f"GET {path} HTTP/1.1\r\nHost: {address}\r\n"
        self._head = bytearray()
        self._left = 0
        self._open = False
        self.ask(_UPGRADE if frames else "")

    def ask(self, more: str = "") -> None:
        """Request it."""
        self.socket.sendall(f"{self._request}{more}\r\n".encode())

    def receive(self, piece: memoryview) -> None:
        """Count a piece, and answer pings."""
        self.octets += len(piece)
        while self._frames and len(piece):
            skipped = min(self._left, len(piece))
            self._left -= skipped
            piece = piece[skipped:]
            if len(piece):
                self._head.append(piece[0])
                piece = piece[1:]
                self._read_head()

    def _read_head(self) -> None:
        head = self._head
        if not self._open:
            self._open = head.endswith(b"\r\n\r\n")
            if self._open:
                head.clear()
            return
        if len(head) < 2:
            return
        begin = 2 + _LENGTH_BYTES.get(head[1], 0)
        if len(head) < begin:
            return
        length = int.from_bytes(head[2:], "big") if begin > 2 else head[1]
        if head[0] == _PING:
            if len(head) < begin + length:
                return
            # With a mask of zeros.
            self.socket.sendall(bytes([_PONG, 0x80 | length, 0, 0, 0, 0]) + head[begin:])
            length = 0
        self._left = length
        head.clear()


def main() -> int:
    """Read until the standard input ends."""
    interface, count, url = sys.argv[1:]
    address = urlsplit(url).netloc
    path = STREAMS.get(interface) or POLLED[interface]
    waiting = selectors.DefaultSelector()
    waiting.register(sys.stdin, selectors.EVENT_READ)
    readers = [Reader(address, path, frames=interface == "websocket") for _ in range(int(count))]
    for one in readers:
        waiting.register(one.socket, selectors.EVENT_READ, one)
    space = memoryview(bytearray(_PIECE))
    due_s = _CLOCK.monotonic_s() + _POLL_S
    while True:
        for key, _ in waiting.select(0.1):
            if key.data is None:
                print(json.dumps([one.octets for one in readers]))
                return 0
            size = key.data.socket.recv_into(space)
            key.data.receive(space[:size])
            if not size:
                waiting.unregister(key.fileobj)
        if interface in POLLED and _CLOCK.monotonic_s() > due_s:
            due_s += _POLL_S
            for one in readers:
                one.ask()


if __name__ == "__main__":
    raise SystemExit(main())
