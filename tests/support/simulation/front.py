"""The HTTP application in virtual time: one application for all processes of all runs."""

import asyncio
from collections import deque
from collections.abc import Callable
from concurrent.futures import Executor, Future
from typing import Any, cast

from fastapi import FastAPI

from multiradar.access.authentication import Authentication
from multiradar.access.clients import key_digest
from multiradar.api.factory import create_api
from multiradar.clock import Clock
from multiradar.ingest.http import IntakeBounds, measurement_routes
from multiradar.ingest.http_sensors import sensor_change_routes
from multiradar.runtime.live.receipt import Receipt
from multiradar.runtime.live.service import Service
from multiradar.runtime.ports import OperatedSink, ReadableService, View
from multiradar.settings.access import AccessSettings, ClientSettings, Role
from multiradar.settings.limits import HttpLimits

#: Clients, their roles and the sensors that they may send.
CLIENTS: dict[str, tuple[Role, tuple[str, ...]]] = {
    "alpha": (Role.FEED, ("41-10",)),
    "bravo": (Role.FEED, ("41-20",)),
    "charlie": (Role.FEED, ("adsb",)),
    "any": (Role.FEED, ()),
    "rival": (Role.FEED, ("41-10",)),
    "screen": (Role.DISPLAY, ()),
    "operator": (Role.OPERATE, ()),
}
KEYS = {name: f"mr_{name}-{'k' * 30}" for name in CLIENTS}
BODY_BYTES_MAX = 65_536
ROWS_MAX = 200
BODY_DEADLINE_S = 5.0


class _NoFiles:
    # The selector of a loop without files and sockets: none is ever ready.

    def select(self, _timeout: float | None) -> list[Any]:
        return []


class VirtualLoop(asyncio.BaseEventLoop):
    """An event loop in virtual time that never waits, and has no files."""

    # Of the base class: callbacks that are ready, timers, and how early one may be called, s.
    _ready: deque[asyncio.Handle]
    _scheduled: list[asyncio.TimerHandle]
    _clock_resolution: float

    def __init__(self, clock: Clock) -> None:
        self._virtual = clock
        self._selector = _NoFiles()
        super().__init__()

    def time(self) -> float:
        """Return virtual time, s."""
        return self._virtual.monotonic_s()

    def call_soon_threadsafe(  # type: ignore[override]  # the stubs name each argument
        self, callback: Any, *arguments: Any, context: Any = None
    ) -> Any:
        """Call soon: only one thread of a simulation runs."""
        return self.call_soon(callback, *arguments, context=context)

    def run_in_executor(  # type: ignore[override]  # done at once, typed as awaited
        self, executor: Executor | None, func: Callable[..., Any], *arguments: Any
    ) -> "asyncio.Future[Any]":
        """Run at once."""
        future = self.create_future()
        try:
            future.set_result(func(*arguments))
        except Exception as error:
            future.set_exception(error)
        return future

    def pump(self) -> None:
        """Run what can run, and timers that are due."""
        due_s = self._virtual.monotonic_s() + self._clock_resolution
        for _ in range(1000):
            if not self._ready and not (self._scheduled and self._scheduled[0].when() < due_s):
                return
            self.call_soon(self.stop)
            self.run_forever()
        raise AssertionError("the event loop never comes to rest")

    def _process_events(self, _events: list[Any]) -> None:
        pass


class Current:
    """The service of the process that runs, whichever it is."""

    def __init__(self) -> None:
        self.service: Service | None = None
        #: Messages on their way: key and future.
        self.submitted: list[tuple[str | None, Future[Receipt]]] = []
        self.view = cast(View, _CurrentView(self))

    def use(self, service: Service, submitted: list[tuple[str | None, Future[Receipt]]]) -> None:
        """Serve with another one."""
        self.service, self.submitted = service, submitted

    def submit(self, frame: Any, **given: Any) -> Future[Receipt]:
        """Submit to it."""
        assert self.service is not None
        future = self.service.submit(frame, **given)
        self.submitted.append((given.get("idempotency_key"), future))
        return future

    def flush(self, **given: Any) -> Future[Receipt]:
        """Submit to it."""
        assert self.service is not None
        return self.service.flush(**given)

    def set_clock(self, time_s: float, **given: Any) -> Future[Receipt]:
        """Submit to it."""
        assert self.service is not None
        return self.service.set_clock(time_s, **given)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.service, name)


class _CurrentView:
    def __init__(self, current: Current) -> None:
        self._current = current

    def __getattr__(self, name: str) -> Any:
        assert self._current.service is not None
        return getattr(self._current.service.view, name)


class Front:
    """The application, and the service behind it.

    Parameters
    ----------
    clock : Clock
        Time of the log.
    """

    def __init__(self, clock: Clock) -> None:
        self.current = Current()
        limits = HttpLimits(
            body_bytes_max=BODY_BYTES_MAX,
            bodies_bytes_max=4 * BODY_BYTES_MAX,
            body_deadline_s=BODY_DEADLINE_S,
            requests_max=32,
        )
        listed = tuple(
            ClientSettings(
                name=name,
                role=role,
                key_sha256=key_digest(KEYS[name]),
                **({"sensors": own} if own else {}),
            )
            for name, (role, own) in CLIENTS.items()
        )
        sink = cast(OperatedSink, self.current)
        self.application: FastAPI = create_api(
            cast(ReadableService, self.current),
            limits,
            routers=(
                measurement_routes(sink, IntakeBounds(rows_max=ROWS_MAX)),
                sensor_change_routes(sink),
            ),
            authentication=Authentication(AccessSettings(clients=listed), clock),
        )


class Exchange:
    """A request and its answer.

    Parameters
    ----------
    method, path : str
        What is asked.
    headers : dict
        Its headers.
    chunks : list of (float, bytes)
        Pieces of the body, each with the pause before it, s; the client leaves after the last one
        if `whole` is false.
    """

    def __init__(
        self, method: str, path: str, headers: dict[str, str],
        chunks: list[tuple[float, bytes]], *, whole: bool = True,
    ) -> None:  # fmt: skip
        size = sum(len(octets) for _, octets in chunks)
        # A long body is announced in pieces, so that its length is known only when it has come.
        known = whole and size <= BODY_BYTES_MAX
        framing = {"content-length": str(size)} if known else {"transfer-encoding": "chunked"}
        headers = headers | framing
        path, _, query = path.partition("?")
        self._scope = {
            "type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "method": method,
            "path": path, "raw_path": path.encode(), "query_string": query.encode(),
            "root_path": "", "scheme": "http", "server": ("simulated", 80),
            "client": ("192.0.2.1", 1), "state": {},
            "headers": [
                (name.lower().encode(), value.encode("latin-1")) for name, value in headers.items()
            ],
        }  # fmt: skip
        self._chunks = list(chunks)
        self._whole = whole
        self.status: int | None = None
        self.headers: dict[bytes, bytes] = {}
        self.body = b""
        self.complete = False

    async def run(self, application: FastAPI) -> None:
        """Serve the request."""
        await application(self._scope, self._receive, self._send)

    async def _receive(self) -> dict[str, Any]:
        if not self._chunks:
            if self._whole:
                await asyncio.get_running_loop().create_future()
            return {"type": "http.disconnect"}
        pause_s, octets = self._chunks.pop(0)
        if pause_s:
            # In virtual time.
            loop = asyncio.get_running_loop()
            due = loop.create_future()
            loop.call_later(pause_s, due.set_result, None)
            await due
        more = bool(self._chunks) or not self._whole
        return {"type": "http.request", "body": octets, "more_body": more}

    async def _send(self, message: Any) -> None:
        if message["type"] == "http.response.start":
            self.status = message["status"]
            self.headers = dict(message["headers"])
        else:
            self.body += message.get("body", b"")
            self.complete = not message.get("more_body", False)
