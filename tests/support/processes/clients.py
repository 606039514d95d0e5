"""Clients of a service under test: they wait as long as tests do."""

from typing import Any

import httpx
from websockets.sync.client import ClientConnection, connect

from support.processes.waiting import WAIT_TIMEOUT_S


def client(url: str) -> httpx.Client:
    """Return a client of a service."""
    return httpx.Client(base_url=url, timeout=WAIT_TIMEOUT_S, trust_env=False)


def get(url: str, headers: dict[str, str] | None = None) -> httpx.Response:
    """Return an answer, whatever it is."""
    return httpx.get(url, headers=headers, timeout=WAIT_TIMEOUT_S, trust_env=False)


def event_source(url: str, headers: dict[str, str] | None = None) -> Any:
    """Open a stream of server-sent events; a context manager that gives the response."""
    return httpx.stream("GET", url, headers=headers, timeout=WAIT_TIMEOUT_S, trust_env=False)


def event_socket(url: str, **options: Any) -> ClientConnection:
    """Open a WebSocket that is closed by the service alone, however long it is silent.

    It receives without bounds: with a full queue it would not see the end of a connection.
    """
    opened: ClientConnection = connect(
        url, open_timeout=WAIT_TIMEOUT_S, close_timeout=WAIT_TIMEOUT_S, ping_interval=None,
        compression=None, **({"max_queue": None} | options),
    )  # fmt: skip
    return opened
