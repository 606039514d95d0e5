"""Receivers on loopback: servers that can be killed and started again at the same port."""

import http.server
import socket
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from support.processes.waiting import WAIT_TIMEOUT_S, join


def connected(port: int) -> socket.socket:
    """Return a connection to a port of loopback."""
    return socket.create_connection(("127.0.0.1", port), timeout=WAIT_TIMEOUT_S)


class Receiver:
    """A TCP server with one client, such as readsb with `--net-json-port`."""

    def __init__(self, port: int = 0) -> None:
        self._listener = socket.create_server(("127.0.0.1", port))
        self._listener.settimeout(WAIT_TIMEOUT_S)
        self.port = int(self._listener.getsockname()[1])
        self._client: socket.socket | None = None

    def accept(self) -> None:
        """Wait for the client."""
        self._client, _ = self._listener.accept()
        self._client.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def send(self, *pieces: bytes) -> None:
        """Send pieces."""
        assert self._client is not None
        for piece in pieces:
            self._client.sendall(piece)

    def drop(self, *, reset: bool = False) -> None:
        """Close the connection, or break it."""
        assert self._client is not None
        if reset:
            linger = b"\x01\x00\x00\x00\x00\x00\x00\x00"
            self._client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, linger)
        self._client.close()
        self._client = None

    def kill(self) -> None:
        """Close everything; nothing listens at the port any more."""
        if self._client is not None:
            self.drop(reset=True)
        self._listener.close()


class SnapshotServer:
    """An HTTP server with answers one after another; the last one is repeated."""

    def __init__(self, answers: Sequence[tuple[int, dict[str, str], bytes]]) -> None:
        self.answers = list(answers)
        self.paths: list[str] = []
        outer = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_GET(self) -> None:
                outer.paths.append(self.path)
                one = outer.answers.pop(0) if len(outer.answers) > 1 else outer.answers[0]
                status, headers, body = one
                self.send_response(status)
                for name, value in headers.items():
                    self.send_header(name, value)
                self.end_headers()
                self.wfile.write(body)

            def log_message(self, *_arguments: object) -> None:
                pass

        self._server = http.server.HTTPServer(("127.0.0.1", 0), Handler)
        self.port = self._server.server_port
        self._thread = threading.Thread(target=self._server.serve_forever)
        self._thread.start()

    def close(self) -> None:
        """Stop serving."""
        self._server.shutdown()
        join(self._thread)
        self._server.server_close()


@contextmanager
def snapshot_server(
    *answers: tuple[int, dict[str, str], bytes],
) -> Iterator[SnapshotServer]:
    """Serve answers until the end."""
    server = SnapshotServer(answers)
    try:
        yield server
    finally:
        server.close()
