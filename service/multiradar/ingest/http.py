"""Measurements over HTTP, and what changes their processing: ends of streams, the data clock."""

import json
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Annotated, Any

from fastapi import APIRouter, Depends, Query, Request
from pydantic import BaseModel, Field
from starlette.responses import Response

from multiradar.access.clients import Caller
from multiradar.access.parameters import AsNumber, strict_query
from multiradar.access.requirement import FEED, OPERATE, log_operated
from multiradar.access.security_log import SECURITY_LOG, RepeatedEvents
from multiradar.access.turns import Turns
from multiradar.access.workers import Workers
from multiradar.errors import RequestError
from multiradar.ingest.bodies import MEDIA_TYPES, decode
from multiradar.ingest.bound_sensors import of_allowed_sensors
from multiradar.ingest.http_requests import (
    ENGINE_LATE,
    KEY_PARAMETER,
    acknowledged,
    body_of,
    idempotency_key,
    source_of,
)
from multiradar.runtime.live.receipt import Receipt, key_of_sender, once_executed, receipt_json
from multiradar.runtime.ports import OperatedSink
from multiradar_schemas.measurements.measurement import MEASUREMENTS, Seconds
from multiradar_schemas.reject import RejectCode

#: Reject codes that depend on the time of arrival and the configuration, not on the content.
_CIRCUMSTANCES = frozenset(
    {
        RejectCode.TIME_LATE,
        RejectCode.TIME_FUTURE,
        RejectCode.RATE_EXCEEDED,
        RejectCode.DUPLICATE,
        RejectCode.UNKNOWN_SENSOR,
        RejectCode.SENSOR_DISABLED,
        RejectCode.SENSOR_NOT_ALLOWED,
    }
)

#: Reason of a timeout.
_JOURNAL_LATE = (
    "the journal did not respond in time, so the message may or may not be recorded; "
    "send it again with the same Idempotency-Key"
)


_FORCE_TEXT = (
    "End the stream even while sensors deliver real-time data; their next plots will then be late"
)
_TIME_TEXT = "New data time, s, as in `time_s` of the measurements"


class RefusedRow(BaseModel):
    """A rejected row; it is in the quarantine, see `/v1/rejects`."""

    index: int = Field(description="Index of the row in the message, from 0", examples=[2])
    code: str = Field(description="Stable code of the reason", examples=["OUT_OF_RANGE"])
    reason: str = Field(description="Human-readable reason")


class Acknowledgement(BaseModel):
    """Result of a message, sent when the whole message is on disk."""

    accepted: int = Field(description="Number of rows accepted into the journal")
    rejected: list[RefusedRow] = Field(description="Rejected rows, in ascending order of index")
    duplicate: bool = Field(
        description=(
            "A message with this Idempotency-Key was ingested earlier; this message was not "
            "ingested, and the counts refer to the earlier message"
        )
    )
    journal_sequence: int = Field(description="Journal entry that contains the message")


class Draining(BaseModel):
    """The service is draining."""

    draining: bool


@dataclass(frozen=True, slots=True)
class IntakeBounds:
    """Limits of the intake.

    Attributes
    ----------
    rows_max : int
        Maximum number of measurements in a message; more are answered 413.
    threads : int
        Threads that decode bodies, in turns between clients.
    acknowledge_deadline_s : float
        Maximum wait for the journal, or for the tracker at the end of a stream, before the answer
        is 503.
    large_octets : int
        Size from which a body waits for its turn.
    large_octets_max : int
        Maximum total size of such bodies whose rows are in memory: these take several times as
        much as the body.
    """

    rows_max: int = 100_000
    threads: int = 2
    acknowledge_deadline_s: float = 30.0
    large_octets: int = 1 << 20
    large_octets_max: int = 16 << 20


def measurement_routes(
    sink: OperatedSink, bounds: IntakeBounds | None = None, drain: Callable[[], None] = lambda: None
) -> APIRouter:
    """Return the routes that receive measurements.

    Parameters
    ----------
    sink : OperatedSink
        The running service.
    bounds : IntakeBounds, optional
        Limits of the intake. The limit layer around the application bounds the size of a body.
    drain : callable
        Stops the process for an operator; returns at once.
    """
    intake = _Intake(sink, bounds or IntakeBounds())
    router = APIRouter(prefix="/v1", tags=["measurements"])
    keyed = {"parameters": [KEY_PARAMETER]}
    for name, role, receive, answers, extra, text in (
        ("measurements", FEED, intake.measurements, _ANSWERS, _REQUEST_BODY, _MEASUREMENTS_TEXT),
        ("flush", OPERATE, intake.flush, _FLUSH_ANSWERS, keyed, _FLUSH_TEXT),
        ("clock", OPERATE, intake.set_clock, _CLOCK_ANSWERS, keyed, _CLOCK_TEXT),
    ):
        router.add_api_route(
            f"/{name}",
            receive,
            methods=["POST"],
            dependencies=[role, Depends(strict_query)],
            response_model=Acknowledgement,
            responses=answers,
            openapi_extra=extra,
            name=f"post_{name}",
            description=text,
        )
    _add_drain(router, drain)
    return router


def _add_drain(router: APIRouter, drain: Callable[[], None]) -> None:
    @router.post(
        "/drain", dependencies=[OPERATE, Depends(strict_query)], response_model=Draining,
        responses=_DRAIN_ANSWERS, description=_DRAIN_TEXT, name="post_drain",
    )  # fmt: skip
    async def post_drain(request: Request) -> Response:
        await _mark(request)
        drain()
        log_operated(request)
        SECURITY_LOG.info("drained", client=request.state.caller.name)
        return Response(b'{"draining": true}', media_type="application/json")


class _Intake:
    def __init__(self, sink: OperatedSink, bounds: IntakeBounds) -> None:
        self._sink = sink
        self._bounds = bounds
        self._workers = Workers(bounds.threads, name="multiradar-intake")
        self._turns = Turns(bounds.large_octets, bounds.large_octets_max)

    async def measurements(self, request: Request) -> Response:
        media_type = _media_type(request)
        caller: Caller = request.state.caller
        key = idempotency_key(request)
        body = await body_of(request)
        source = source_of(caller)
        # Before its rows are read, which takes a second at the maximum size.
        self._sink.require_source(source)

        def submit() -> Future[Receipt]:
            # A message before it may have put the source into quarantine.
            self._sink.require_source(source)
            try:
                decoded = decode(media_type, body, self._bounds.rows_max)
            except RequestError:
                self._sink.note_unreadable(source, len(body))
                raise
            decoded = of_allowed_sensors(decoded, caller.sensors)
            return self._sink.submit(
                decoded.frame,
                source=source,
                idempotency_key=key_of_sender(caller.name, key),
                rejected=decoded.rejected,
            )

        async with self._turns.of(len(body)):
            receipt = await self._acknowledged(submit, _JOURNAL_LATE)
            _log_sender(request, caller, receipt)
            return await self._answered(receipt)

    async def flush(
        self,
        request: Request,
        force: Annotated[bool, Query(description=_FORCE_TEXT)] = False,
    ) -> Response:
        source, key = await _mark(request)

        def submit() -> Future[Receipt]:
            future = self._sink.flush(source=source, idempotency_key=key, force=force)
            return once_executed(future, lambda: log_operated(request))

        receipt = await self._acknowledged(submit, ENGINE_LATE)
        return await self._answered(receipt)

    async def set_clock(
        self, request: Request, time_s: Annotated[Seconds, Query(description=_TIME_TEXT), AsNumber]
    ) -> Response:
        source, key = await _mark(request)

        def executed() -> None:
            log_operated(request)
            SECURITY_LOG.info("clock_set", client=request.state.caller.name, time_s=time_s)

        def submit() -> Future[Receipt]:
            future = self._sink.set_clock(time_s, source=source, idempotency_key=key)
            return once_executed(future, executed)

        receipt = await self._acknowledged(submit, ENGINE_LATE)
        return await self._answered(receipt)

    async def _acknowledged(self, submit: Callable[[], Future[Receipt]], late: str) -> Receipt:
        return await acknowledged(submit, late, self._workers, self._bounds.acknowledge_deadline_s)

    async def _answered(self, receipt: Receipt) -> Response:
        return await self._workers.run(_answer, receipt)


async def _mark(request: Request) -> tuple[str, str | None]:
    """Return source and key of a message without measurements."""
    caller: Caller = request.state.caller
    key = key_of_sender(caller.name, idempotency_key(request))
    if await body_of(request):
        raise RequestError(400, "BODY_NOT_EXPECTED", "expected no body")
    return source_of(caller), key


def _log_sender(request: Request, caller: Caller, receipt: Receipt) -> None:
    if not caller.name:
        return
    events: RepeatedEvents = request.app.state.authentication.events
    accepted, rejected = receipt.accepted, len(receipt.rejected)
    events.note("sent", caller.name, accepted=accepted, rejected=rejected)
    foreign = sum(row.code == RejectCode.SENSOR_NOT_ALLOWED for row in receipt.rejected)
    if foreign:
        events.warn("sensors_rejected", caller.name, rows=foreign)


def _answer(receipt: Receipt) -> Response:
    document = receipt_json(receipt)
    codes = {row.code for row in receipt.rejected}
    if receipt.accepted == 0 and codes and not codes & _CIRCUMSTANCES:
        raise RequestError(
            422,
            "NO_MEASUREMENTS",
            f"none of the {len(receipt.rejected)} rows is a valid measurement; the first: "
            f"{receipt.rejected[0].reason}",
            members=document[1:-1],
        )
    return Response(document, media_type="application/json")


def _media_type(request: Request) -> str:
    encoding = request.headers.get("content-encoding", "identity").strip().lower()
    if encoding not in {"", "identity"}:
        raise RequestError(
            415,
            "CONTENT_ENCODING_UNSUPPORTED",
            "expected an uncompressed body",
            {"accept-encoding": "identity"},
        )
    media_type, _, parameters = request.headers.get("content-type", "").partition(";")
    media_type = media_type.strip().lower()
    charset = parameters.replace(" ", "").replace('"', "").lower()
    if media_type not in MEDIA_TYPES or charset not in {"", "charset=utf-8", "charset=utf8"}:
        raise RequestError(
            415,
            "CONTENT_TYPE_UNSUPPORTED",
            f"expected a Content-Type of {', '.join(MEDIA_TYPES)}, with text in UTF-8",
            {"accept-post": ", ".join(MEDIA_TYPES)},
        )
    return media_type


_MEASUREMENTS_TEXT = """\
Post measurements: a JSON array (or a single object), NDJSON, or an Arrow IPC stream with the
columns of `measurements.parquet`. The response is sent when the message is in the journal, on disk.
Rejected rows are listed with index and reason and kept in the quarantine; all other rows are
ingested.
"""

_FLUSH_TEXT = """\
Mark the end of a stream: buffered measurements are processed immediately, the epoch is closed, and
from then on measurements older than the newest measurement are late. The request is recorded in the
journal. The response is sent when the results of all earlier measurements can be read. While
sensors deliver real-time data, the request is rejected unless forced, because measurements still in
transit would then be late.
"""

_CLOCK_TEXT = """\
Set the data time; use this after most sensors have had wrong clocks. From then on, measurements are
accepted if they are at most the reorder horizon older than this time. A step back terminates all
tracks; radar biases are kept. The request is recorded in the journal, and the response is sent when
the new time applies.
"""

_DRAIN_TEXT = """\
Stop the service for maintenance. The service rejects further measurements (503), processes and
publishes the acknowledged measurements, writes a snapshot, releases the journal and exits with
status 0. A standby takes over.
"""

_EXAMPLE = [
    {
        "time_s": 1767182400.25,
        "sensor_id": "41-10",
        "kind": "radar",
        "range_m": 84321.5,
        "azimuth_deg": 231.402,
        "height_m": 10668.0,
        "mode_3a": "2741",
        "mode_s_address": "4840d6",
    }
]

# Rows are validated one by one: those of this form are accepted, whatever the others are.
_ROWS = MEASUREMENTS.json_schema(ref_template="#/components/schemas/{model}")
_KINDS = _ROWS.pop("$defs")

_REQUEST_BODY: dict[str, Any] = {
    "parameters": [KEY_PARAMETER],
    "requestBody": {
        "required": True,
        "content": {
            "application/json": {
                "schema": {"anyOf": [_ROWS, _ROWS["items"]], "$defs": _KINDS},
                "example": _EXAMPLE,
            },
            "application/x-ndjson": {
                "schema": {
                    "type": "string",
                    "description": "One measurement per line, as in `application/json`",
                },
                "example": "".join(f"{json.dumps(row)}\n" for row in _EXAMPLE),
            },
            "application/vnd.apache.arrow.stream": {
                "schema": {"type": "string", "format": "binary"}
            },
        },
    },
}

_ANSWERS: dict[int | str, dict[str, Any]] = {
    400: {"description": "The body cannot be parsed, or the Idempotency-Key is not valid"},
    413: {"description": "The body is too large and was not read completely"},
    415: {"description": "Unsupported media type, or a compressed body; see `Accept-Post`"},
    422: {
        "description": "No row is a valid measurement (see `rejected`), or the Idempotency-Key "
        "was used for another message"
    },
    429: {"description": "Back-pressure: the journal cannot keep up; see `Retry-After`"},
    503: {"description": "The journal failed, or the service is not ready"},
    507: {"description": "Disk full; nothing was ingested"},
}

_CLOCK_ANSWERS: dict[int | str, dict[str, Any]] = {
    400: {"description": "The request has a body, or the Idempotency-Key is not valid"},
    422: {
        "description": "Invalid parameter, or the Idempotency-Key was used for a different message"
    },
    **{code: _ANSWERS[code] for code in (429, 503, 507)},
}

_DRAIN_ANSWERS: dict[int | str, dict[str, Any]] = {
    400: {"description": "The request has a body, or the Idempotency-Key is not valid"},
    422: {"description": "Invalid parameter"},
}

_FLUSH_ANSWERS: dict[int | str, dict[str, Any]] = {
    **_CLOCK_ANSWERS,
    409: {"description": "Sensors deliver real-time data; use `force` to end the stream anyway"},
}
