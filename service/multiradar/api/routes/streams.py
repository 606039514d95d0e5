"""Event streams: the WebSocket `/v1/stream` and the server-sent events `/v1/events`."""

import asyncio
import contextlib
import secrets
from collections.abc import Coroutine, Mapping, Sequence
from itertools import chain
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request
from starlette.requests import ClientDisconnect
from starlette.responses import Response
from starlette.types import Receive, Scope, Send
from starlette.websockets import WebSocket, WebSocketDisconnect

from multiradar.access.clients import Caller
from multiradar.access.parameters import parameter_error, strict_query
from multiradar.access.requirement import DISPLAY
from multiradar.api.access import Access, Granted
from multiradar.api.batches import KINDS, Batch
from multiradar.api.connections.frames import FRAME, text_frame
from multiradar.api.query import INTEGER_MOST, AsInteger, integer, list_form
from multiradar.errors import RequestError
from multiradar.observability.metrics import HTTP_CONNECTIONS_DROPPED, HTTP_REJECTIONS
from multiradar.runtime.ports import StreamEvents

#: Close codes of `/v1/stream`.
CLOSE_POLICY = 1008
CLOSE_RESTART = 1012
CLOSE_TRY_LATER = 1013
CLOSE_SLOW_CLIENT = 4408

_EVENT_STREAM = "text/event-stream"
# Maximum length of the reason in a close frame, bytes.
_CLOSE_REASON_LENGTH_MAX = 120
# Reconnection delay of an event source, ms: randomised, so that clients do not reconnect together
# after a failure.
_RETRY_MS = 2000
_RETRY_SPREAD_MS = 2000


router = APIRouter(prefix="/v1", tags=["streams"], dependencies=[DISPLAY])

After = Annotated[
    int | None,
    Query(
        ge=0,
        le=INTEGER_MOST,
        description="Sequence number of the last event received; 0: start with the oldest retained "
        "event; absent: start with the next event. The header `Last-Event-ID` overrides this "
        "parameter",
        examples=[0],
    ),
    AsInteger,
]
Kinds = Annotated[
    str | None,
    Query(
        description="Kinds of events, separated by commas: track, bias, ended, status, sensor",
        json_schema_extra=list_form(KINDS),
        examples=["track,bias"],
    ),
]


@router.get(
    "/events",
    dependencies=[Depends(strict_query)],
    responses={200: {"content": {_EVENT_STREAM: {"schema": {"type": "string"}}}}},
    response_class=Response,
)
async def server_sent_events(
    request: Request, access: Granted, after: After = None, kinds: Kinds = None
) -> Response:
    """Stream events: `id` is the sequence number, `event` the kind, `data` the JSON object."""
    chosen = chosen_kinds(kinds)
    # A body that does not arrive is answered 408 now, not an error within the stream.
    async for _ in request.stream():
        pass
    last_event_id = request.headers.get("last-event-id")
    if last_event_id is not None:
        after = _sequence(last_event_id, "Last-Event-ID")
    return _EventStream(access, request.state.caller, after, chosen)


@router.websocket("/stream")
async def web_socket(socket: WebSocket, access: Granted) -> None:
    """Stream batches of events; parameters `after` and `kinds` as for `/v1/events`."""
    # Accepted first: before that, a close code does not reach the client.
    await socket.accept()
    with contextlib.ExitStack() as held:
        try:
            after, chosen = _socket_parameters(socket.query_params.multi_items())
            held.enter_context(access.hub.slot("websocket"))
        except RequestError as error:
            HTTP_REJECTIONS.labels(code=error.code).inc()
            code = CLOSE_POLICY if error.parameters else CLOSE_TRY_LATER
            await socket.close(code, f"{error.code}: {error}"[:_CLOSE_REASON_LENGTH_MAX])
            return
        sender = _send_batches(socket, access, after, chosen)
        await _first_of(sender, _listen(socket))


def chosen_kinds(text: str | None) -> frozenset[str]:
    """Return the kinds named in a comma-separated list; all of them where there is none.

    Raises
    ------
    RequestError
        422 for an unknown name.
    """
    if text is None:
        return frozenset(KINDS)
    kinds = frozenset(text.split(","))
    if not kinds <= frozenset(KINDS):
        raise parameter_error({"kinds": f"expected one or more of {', '.join(KINDS)}"})
    return kinds


def message(events: StreamEvents) -> bytes:
    """Return events as the text of one WebSocket message."""
    return b"".join(_message_parts(events))


def frame(events: StreamEvents) -> bytes:
    """Return events as the frame of one WebSocket message."""
    return text_frame(_message_parts(events))


def event_lines(events: StreamEvents) -> bytes:
    """Return events as the text of server-sent events."""
    columns = zip(events.numbers, events.kinds, events.payloads, strict=True)
    return b"".join(
        b"id: %d\nevent: %s\ndata: %s\n\n" % (number, kind.encode(), payload)
        for number, kind, payload in columns
    )


def _message_parts(events: StreamEvents) -> list[bytes]:
    numbers, payloads = events.numbers, events.payloads
    heads = [
        f'}},{{"sequence":{number},"kind":"{kind}","key":"{key}","data":'.encode()
        for number, kind, key in zip(numbers, events.kinds, events.keys, strict=True)
    ]
    heads[0] = heads[0].removeprefix(b"},")
    start = b'{"type":"events","first":%d,"last":%d,"events":[' % (numbers[0], numbers[-1])
    # Joined, not formatted: each payload is copied once.
    parts = chain.from_iterable(zip(heads, payloads, strict=True))
    return [start, *parts, b"}]}"]


async def _send_batches(
    socket: WebSocket, access: Access, after: int | None, kinds: frozenset[str]
) -> None:
    whole = FRAME in (socket.scope.get("extensions") or {})
    batches = access.hub.batches("websocket", after, kinds, frame if whole else message)
    async with contextlib.aclosing(batches):
        async for batch in batches:
            if not access.authentication.is_current(socket.state.caller):
                await socket.close(CLOSE_POLICY, "the credentials have expired or were revoked")
                return
            sent: dict[str, Any] = {"type": "websocket.send"}
            if batch.text and whole:
                sent[FRAME] = batch.text
            else:
                sent["text"] = batch.text.decode() or _heartbeat(batch)
            try:
                async with asyncio.timeout(access.limits.send_deadline_s):
                    await socket.send(sent)
            except TimeoutError:
                HTTP_CONNECTIONS_DROPPED.labels(cause="slow_client").inc()
                await socket.close(
                    CLOSE_SLOW_CLIENT,
                    f"client too slow; resume with `after` less than {batch.last}",
                )
                return
            except WebSocketDisconnect:
                return
    await socket.close(
        CLOSE_RESTART, "service is stopping; resume at the standby, or after a restart"
    )


async def _first_of(*works: Coroutine[None, None, None]) -> None:
    # Run concurrently until one ends, then cancel the others; an error of one is raised.
    tasks = {asyncio.create_task(work) for work in works}
    try:
        done, _ = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
    for task in done:
        task.result()


def _heartbeat(batch: Batch) -> str:
    return f'{{"type":"heartbeat","last":{batch.last}}}'


async def _listen(socket: WebSocket) -> None:
    # The stream is one-way: a message from the client closes it; a disconnect ends it.
    received = await socket.receive()
    if received["type"] == "websocket.receive":
        await socket.close(CLOSE_POLICY, "this stream accepts no messages")


def _socket_parameters(items: Sequence[tuple[str, str]]) -> tuple[int | None, frozenset[str]]:
    given: Mapping[str, str] = dict(items)
    known = {"after", "kinds"}
    if set(given) - known or len(given) != len(items):
        raise parameter_error(
            {"query": "expected only the parameters after and kinds, each at most once"},
            "UNKNOWN_PARAMETER",
        )
    after = _sequence(given["after"], "after") if "after" in given else None
    return after, chosen_kinds(given.get("kinds"))


def _sequence(text: str, name: str) -> int:
    try:
        sequence = integer(text)
    except ValueError as error:
        raise parameter_error({name: str(error)}) from error
    if sequence < 0:
        raise parameter_error({name: "expected a sequence number, 0 or more"})
    return sequence


class _EventStream(Response):
    # A response that sends batches until the client disconnects or stops reading.

    def __init__(
        self, access: Access, caller: Caller, after: int | None, kinds: frozenset[str]
    ) -> None:
        super().__init__(media_type=_EVENT_STREAM)
        del self.headers["content-length"]
        self.headers["x-accel-buffering"] = "no"
        self._access = access
        self._caller = caller
        self._after = after
        self._kinds = kinds

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        # Rejected before anything is sent, so that the answer is a problem document.
        with self._access.hub.slot("sse"):
            start = {"type": "http.response.start", "status": 200, "headers": self.raw_headers}
            await send(start)
            await _first_of(self._send_batches(send), _until_gone(receive))

    async def _send_batches(self, send: Send) -> None:
        # A comment and the reconnection delay are sent first, at once.
        retry_ms = _RETRY_MS + secrets.randbelow(_RETRY_SPREAD_MS)
        await _send_body(send, b": multiradar events\nretry: %d\n\n" % retry_ms)
        batches = self._access.hub.batches("sse", self._after, self._kinds, event_lines)
        async with contextlib.aclosing(batches):
            async for batch in batches:
                if not self._access.authentication.is_current(self._caller):
                    break
                # A separate `id` line advances the resume position without an event.
                text = batch.text or b": heartbeat\nid: %d\n\n" % batch.last
                try:
                    await _send_body(send, text)
                except TimeoutError:
                    HTTP_CONNECTIONS_DROPPED.labels(cause="slow_client").inc()
                    raise
        # A complete response: the client reconnects at once.
        await send({"type": "http.response.body", "body": b"", "more_body": False})


async def _send_body(send: Send, text: bytes) -> None:
    await send({"type": "http.response.body", "body": text, "more_body": True})


async def _until_gone(receive: Receive) -> None:
    with contextlib.suppress(ClientDisconnect):
        while (await receive())["type"] != "http.disconnect":
            continue
