"""Errors as problem documents (RFC 9457)."""

import json
import math
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from pydantic import BaseModel, Field
from starlette.exceptions import HTTPException
from starlette.responses import Response
from starlette.routing import Match, Route, WebSocketRoute
from starlette.types import Scope

from multiradar.access.parameters import parameter_error
from multiradar.errors import (
    IdempotencyConflictError,
    InputError,
    JournalError,
    JournalFullError,
    LiveStreamError,
    MultiradarError,
    PipelineError,
    QuarantineError,
    QueueFullError,
    RequestError,
)
from multiradar.observability.metrics import HTTP_REJECTIONS
from multiradar_schemas.documents.names import did_you_mean, unknown_choice

MEDIA_TYPE = "application/problem+json"

#: Key of the request identifier in the ASGI scope.
REQUEST_ID_KEY = "multiradar.request_id"

#: For longer paths no similar one is searched.
PATH_LENGTH_MAX = 100

# Codes of errors of the framework.
_CODES_BY_STATUS = {404: "NOT_FOUND", 405: "METHOD_NOT_ALLOWED"}


# Errors of the service; the first match counts. The detail is the message of the error.
_SERVICE_ERRORS: tuple[tuple[type[MultiradarError], int, str], ...] = (
    (IdempotencyConflictError, 422, "IDEMPOTENCY_KEY_REUSED"),
    (InputError, 400, "MALFORMED_BODY"),
    (LiveStreamError, 409, "STREAM_IS_LIVE"),
    (JournalFullError, 507, "JOURNAL_FULL"),
    (JournalError, 503, "JOURNAL_FAILED"),
    (PipelineError, 503, "NOT_READY"),
)


class ParameterProblem(BaseModel):
    """An invalid parameter."""

    parameter: str = Field(description="Name of the parameter")
    reason: str = Field(description="Description of the expected value")


class Problem(BaseModel):
    """A problem document, RFC 9457."""

    type: str = Field(
        description="URN of the code", examples=["urn:multiradar:problem:track-not-found"]
    )
    title: str = Field(description="Human-readable name of the code", examples=["Track not found"])
    status: int = Field(description="HTTP status", examples=[404])
    detail: str = Field(
        description="Human-readable description of the error",
        examples=["no live track with number 7"],
    )
    instance: str = Field(
        description="URN of the request; the log contains the same identifier",
        examples=["urn:multiradar:request:4f1c9a52d0e3b7a6"],
    )
    code: str = Field(description="Stable code for programs", examples=["TRACK_NOT_FOUND"])
    errors: list[ParameterProblem] | None = Field(
        default=None, description="Invalid parameters; absent if none"
    )


def problem_response(error: RequestError, scope: Scope) -> Response:
    """Return the problem document of a rejected request."""
    return Response(
        problem_bytes(error, str(scope.get(REQUEST_ID_KEY, "unknown"))),
        status_code=error.status,
        headers=error.headers,
        media_type=MEDIA_TYPE,
    )


def problem_bytes(error: RequestError, request_id: str) -> bytes:
    """Return the problem document as JSON, in UTF-8."""
    HTTP_REJECTIONS.labels(code=error.code).inc()
    document: dict[str, object] = {
        "type": f"urn:multiradar:problem:{error.code.lower().replace('_', '-')}",
        "title": error.code.replace("_", " ").capitalize(),
        "status": error.status,
        "detail": str(error),
        "instance": f"urn:multiradar:request:{request_id}",
        "code": error.code,
    }
    if error.parameters:
        document["errors"] = [
            {"parameter": name, "reason": reason} for name, reason in error.parameters.items()
        ]
    encoded = json.dumps(document, ensure_ascii=True).encode()
    return b"{%s, %s" % (error.members, encoded[1:]) if error.members else encoded


def install(application: FastAPI) -> None:
    """Answer every error of the application with a problem document."""
    application.add_exception_handler(RequestError, _request_error)
    application.add_exception_handler(MultiradarError, _service_error)
    application.add_exception_handler(RequestValidationError, _invalid)
    application.add_exception_handler(HTTPException, _framework)


async def _request_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestError)
    return problem_response(error, request.scope)


async def _service_error(request: Request, error: Exception) -> Response:
    assert isinstance(error, MultiradarError)
    return problem_response(_translated(error), request.scope)


def _translated(error: MultiradarError) -> RequestError:
    if isinstance(error, QueueFullError):
        retry_after_s = max(1, math.ceil(error.retry_after_s))
        code = "SOURCE_QUARANTINED" if isinstance(error, QuarantineError) else "QUEUE_FULL"
        return RequestError(429, code, str(error), {"retry-after": str(retry_after_s)})
    for kind, status, code in _SERVICE_ERRORS:
        if isinstance(error, kind):
            # A service that starts, drains or is the standby: there is another, or soon.
            headers = {"retry-after": "1"} if code == "NOT_READY" else {}
            return RequestError(status, code, error.for_clients, headers)
    raise error


async def _invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RequestValidationError)
    parameters = {str(entry["loc"][-1]): _reason(entry) for entry in error.errors()}
    return problem_response(parameter_error(parameters), request.scope)


def _reason(entry: Mapping[str, Any]) -> str:
    if entry["type"] == "literal_error":
        return unknown_choice(entry["input"], entry["ctx"]["expected"])
    return str(entry["msg"]).removeprefix("Value error, ")


# Those of all routes of the path; HEAD is supported wherever GET is.
def _methods(request: Request) -> list[str]:
    found: set[str] = set()
    for route in request.app.state.routes:
        if isinstance(route, Route) and route.matches(request.scope)[0] is not Match.NONE:
            found |= route.methods or set()
    return sorted({*found, "HEAD"} if "GET" in found else found)


async def _framework(request: Request, error: Exception) -> Response:
    assert isinstance(error, HTTPException)
    code = _CODES_BY_STATUS.get(error.status_code, "REQUEST_REFUSED")
    detail = HTTPStatus(error.status_code).phrase
    if error.status_code == HTTPStatus.NOT_FOUND:
        detail = f"no such path{_meant(request)}"
        if _is_websocket(request):
            detail = (
                f"{request.url.path} is a WebSocket: connect to it with ws:// or wss://, or read "
                "/v1/events over HTTP"
            )
    elif error.status_code == HTTPStatus.METHOD_NOT_ALLOWED:
        detail = f"the path does not support the method {request.method}"
    headers = dict(error.headers or {})
    if "Allow" in headers:
        headers["Allow"] = ", ".join(_methods(request))
    return problem_response(RequestError(error.status_code, code, detail, headers), request.scope)


def _is_websocket(request: Request) -> bool:
    routes = (one for one in request.app.state.routes if isinstance(one, WebSocketRoute))
    return any(one.path == request.url.path for one in routes)


def _meant(request: Request) -> str:
    path = request.url.path
    if len(path) > PATH_LENGTH_MAX:
        return ""
    routes = (one for one in request.app.state.routes if isinstance(one, Route))
    known = {_filled(one.path, path) for one in routes if one.include_in_schema}
    return did_you_mean(path, sorted(known))


# `/v1/tracks/{number}` for `/v1/trakcs/7` is `/v1/tracks/7`.
def _filled(template: str, path: str) -> str:
    parts, given = template.split("/"), path.split("/")
    if len(parts) != len(given):
        return template
    pairs = zip(parts, given, strict=True)
    return "/".join(one if one and part.startswith("{") else part for part, one in pairs)
