"""HTTP on a thread of its own."""

import errno
import socket
import threading
from collections.abc import Callable, Sequence

import structlog
from starlette.types import ASGIApp

from multiradar.access.exposure import is_loopback
from multiradar.api.connections.server import TlsFiles, server
from multiradar.errors import ConfigurationError
from multiradar.settings.limits import HttpLimits

_log = structlog.get_logger("multiradar.http")

#: Host names accepted on a loopback address; others indicate DNS rebinding.
LOOPBACK_NAMES = ("127.0.0.1", "localhost", "::1")
_STOP_TIMEOUT_S = 20.0
_BACKLOG = 128


class HttpServer:
    """HTTP on a thread of its own.

    Parameters
    ----------
    build : callable
        Returns the application; called with the names accepted in the Host header, none for any.
    host : str
        Address to listen on.
    port : int
        Port; 0 picks a free one.
    limits : HttpLimits
        Limits for clients.
    on_failure : callable
        Called from that thread when the server stops unexpectedly.
    tls : TlsFiles, optional
        Files of TLS.
    names : sequence of str
        Names of this host in addition to those of loopback; others are then rejected.

    Raises
    ------
    ConfigurationError
        If it cannot listen, or a file of TLS cannot be used.
    """

    def __init__(
        self,
        build: Callable[[Sequence[str]], ASGIApp],
        host: str,
        port: int,
        limits: HttpLimits,
        on_failure: Callable[[], None],
        *,
        tls: TlsFiles | None = None,
        names: Sequence[str] = (),
    ) -> None:
        self._listener = _listen(host, port)
        given = host
        host, port = self._listener.getsockname()[:2]
        scheme = "http" if tls is None else "https"
        self.url = f"{scheme}://[{host}]:{port}" if ":" in host else f"{scheme}://{host}:{port}"
        known = names or is_loopback(host)
        application = build((*LOOPBACK_NAMES, given, *names) if known else ())
        try:
            self._server = server(application, host, port, limits, tls)
        except ConfigurationError:
            self._listener.close()
            raise
        self._on_failure = on_failure
        self._thread = threading.Thread(target=self._run, name="http", daemon=True)

    def start(self) -> None:
        """Start serving."""
        self._thread.start()

    def stop(self) -> None:
        """Finish pending requests, close the connections, stop."""
        self._server.should_exit = True
        if self._thread.ident is not None:
            self._thread.join(_STOP_TIMEOUT_S)
        self._listener.close()

    def _run(self) -> None:
        try:
            # uvicorn installs no signal handlers outside the main thread.
            self._server.run(sockets=[self._listener])
        except Exception as error:
            _log.error("http_failed", exc_info=error)
        if not self._server.should_exit:
            self._on_failure()


def _listen(host: str, port: int) -> socket.socket:
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    try:
        return socket.create_server((host, port), family=family, backlog=_BACKLOG)
    except OSError as error:
        msg = f"{host}:{port}: cannot listen: {error.strerror or error}"
        if error.errno == errno.EADDRINUSE:
            msg += "; stop the process that listens there, or choose another port with --port"
        raise ConfigurationError(msg) from error
