"""A real server on a free port of the loopback, in a thread of the test."""

import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager

from fastapi import FastAPI

from multiradar.api.connections.server import TlsFiles, server
from multiradar.settings.limits import HttpLimits
from support.processes import clients
from support.processes.waiting import WAIT_TIMEOUT_S, join


@contextmanager
def serving(application: FastAPI, limits: HttpLimits, tls: TlsFiles | None = None) -> Iterator[int]:
    """Serve an application; yields the port."""
    listener = socket.create_server(("127.0.0.1", 0))
    running = server(application, "127.0.0.1", 0, limits, tls)
    started = threading.Event()
    startup = running.startup

    async def signalled_startup(sockets: list[socket.socket] | None = None) -> None:
        await startup(sockets)
        started.set()

    running.startup = signalled_startup  # type: ignore[method-assign]
    thread = threading.Thread(target=running.run, kwargs={"sockets": [listener]})
    thread.start()
    try:
        assert started.wait(WAIT_TIMEOUT_S)
        yield int(listener.getsockname()[1])
    finally:
        running.should_exit = True
        join(thread)
        listener.close()


def dropped_connections(port: int) -> float:
    """Return the number of connections dropped in this process because the client did not read."""
    name = 'multiradar_http_connections_dropped_total{cause="does_not_read"} '
    metrics = clients.get(f"http://127.0.0.1:{port}/metrics").text
    return sum(
        float(line.removeprefix(name)) for line in metrics.splitlines() if line.startswith(name)
    )


class RawClient:
    """A socket that sends exactly the given bytes."""

    def __init__(
        self, port: int, receive_buffer_bytes: int | None = None, address: str = "127.0.0.1"
    ) -> None:
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        if receive_buffer_bytes is not None:
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer_bytes)
        self.socket.settimeout(WAIT_TIMEOUT_S)
        self.socket.bind((address, 0))
        self.socket.connect(("127.0.0.1", port))

    def send(self, text: bytes) -> None:
        """Send all of it."""
        self.socket.sendall(text)

    def answer(self) -> bytes:
        """Return everything until the server closes the connection."""
        received = b""
        while True:
            try:
                piece = self.socket.recv(65536)
            except ConnectionResetError:
                return received
            if not piece:
                return received
            received += piece

    def until(self, mark: bytes) -> bytes:
        """Return what comes, up to a mark and what came with it."""
        received = b""
        while mark not in received:
            piece = self.socket.recv(65536)
            assert piece, received
            received += piece
        return received

    def close(self) -> None:
        """Close the socket."""
        self.socket.close()
