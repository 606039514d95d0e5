"""Every error answer is a problem document with a stable code and without internals."""

import time
from typing import cast

import httpx
import pytest
from fastapi import FastAPI
from starlette.types import Message
from structlog.testing import capture_logs

from multiradar.api.factory import create_api
from multiradar.api.guard import LimitLayer
from multiradar.api.problems import Problem
from multiradar.errors import (
    IdempotencyConflictError,
    JournalError,
    JournalFullError,
    PipelineError,
    QueueFullError,
)
from multiradar.ingest.http import measurement_routes
from multiradar.settings.limits import HttpLimits
from support.fakes.fake_service import FakeService


@pytest.fixture(scope="module")
def unchanging() -> FastAPI:
    """One application for all requests that change nothing."""
    service = FakeService()
    return create_api(service, routers=[measurement_routes(service)])


_LONG = "9" * 400


def _is_problem(answer: httpx.Response, status: int, code: str) -> dict[str, object]:
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    document: dict[str, object] = answer.json()
    Problem.model_validate(document)
    assert document["code"] == code, document
    assert document["status"] == status
    assert document["type"] == f"urn:multiradar:problem:{code.lower().replace('_', '-')}"
    assert document["instance"] == f"urn:multiradar:request:{answer.headers['x-request-id']}"
    assert str(document["detail"])
    return document


@pytest.mark.parametrize(
    ("method", "path", "status", "code"),
    [
        ("GET", "/nowhere", 404, "NOT_FOUND"),
        ("GET", "/v1", 404, "NOT_FOUND"),
        ("GET", "/v1/tracks/", 404, "NOT_FOUND"),
        ("GET", "//v1/tracks", 404, "NOT_FOUND"),
        ("POST", "/v1/tracks", 405, "METHOD_NOT_ALLOWED"),
        ("DELETE", "/v1/tracks/1", 405, "METHOD_NOT_ALLOWED"),
        ("GET", "/v1/measurements", 405, "METHOD_NOT_ALLOWED"),
        ("GET", "/v1/tracks/0", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks/-1", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks/1.0", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks/1_0", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks/%D9%A3", 422, "INVALID_PARAMETER"),
        ("GET", f"/v1/tracks/{_LONG}", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks/true", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks/..%2f..%2fetc%2fpasswd", 404, "NOT_FOUND"),
        ("GET", "/v1/tracks?limit=0", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?limit=10001", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?limit=1e3", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?limit=", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?limit=1&limit=2", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?bbox=1,2,3", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?bbox=1,2,3,4,5", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?bbox=0,10,1,9", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?bbox=0,0,181,1", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?bbox=nan,0,1,1", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?bbox=0,0,1,1e999", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?bbox=" + "1," * 2000, 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?since=yesterday", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?since=nan", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?since=1e12", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?since=2026-01-01T00:00:00", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?since=9999-12-31T23:59:59%2B00:00", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?identity=zzzz", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?identity=mode_3a:9999", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?identity=name:1", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?identity=callsign:A-1", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?identity='%20OR%201=1", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?fields=track_id,password", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?format=xml", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/tracks?cursor=AAAA", 422, "CURSOR_INVALID"),
        ("GET", "/v1/tracks?cursor=..", 422, "CURSOR_INVALID"),
        ("GET", "/v1/tracks?cursor=bQAAAAAAAPA_AQAAAAAAAAA", 422, "CURSOR_INVALID"),
        ("GET", "/v1/tracks/1/history?cursor=dAIAAAAAAAAA", 422, "CURSOR_INVALID"),
        ("GET", "/v1/tracks/1/history?cursor=bQAAAAAAAPh__________38", 422, "CURSOR_INVALID"),
        ("GET", "/v1/tracks?debug=1", 422, "UNKNOWN_PARAMETER"),
        ("GET", "/v1/tracks/1?fields=track_id", 422, "UNKNOWN_PARAMETER"),
        ("GET", "/v1/tracks?%0d%0aset-cookie:x=1", 422, "UNKNOWN_PARAMETER"),
        ("GET", "/healthz?x=1", 422, "UNKNOWN_PARAMETER"),
        ("GET", "/v1/sensors/a%20b", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/sensors/" + "a" * 65, 422, "INVALID_PARAMETER"),
        ("GET", "/v1/sensors/unknown", 404, "SENSOR_NOT_FOUND"),
        ("GET", "/v1/sensors/%2e%2e", 404, "SENSOR_NOT_FOUND"),
        ("GET", "/v1/sensors/unknown/bias", 404, "SENSOR_NOT_FOUND"),
        ("GET", "/v1/sensors/unknown/bias?history=true", 404, "SENSOR_NOT_FOUND"),
        ("GET", "/v1/sensors/41-10/bias?history=yes", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/sensors/41-10/bias?since=3", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/sensors/41-10/bias?until=3", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/sensors/41-10/bias?history=true&until=3&cursor=x", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/rejects?after=-1", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/events?after=-1", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/events?after=x", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/events?kinds=tracks", 422, "INVALID_PARAMETER"),
        ("GET", "/v1/events?kind=track", 422, "UNKNOWN_PARAMETER"),
    ],
)
@pytest.mark.fault(40)
async def test_a_hostile_request_is_a_coded_problem(
    unchanging: FastAPI, method: str, path: str, status: int, code: str
) -> None:
    transport = httpx.ASGITransport(unchanging)
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
        _is_problem(await client.request(method, path), status, code)


@pytest.mark.parametrize(
    ("query", "code", "count"),
    [
        ("&".join(["at"] * 5_000), "INVALID_PARAMETER", 1),
        ("&".join(f"limi{number}" for number in range(1_900)), "UNKNOWN_PARAMETER", 8),
    ],
)
async def test_thousands_of_parameters_do_not_delay_others(
    client: httpx.AsyncClient, query: str, code: str, count: int
) -> None:
    await client.get("/v1/tracks?at")
    start_s = time.process_time()
    answer = await client.get(f"/v1/tracks?{query}")
    assert time.process_time() - start_s < 0.1
    assert len(cast("list[object]", _is_problem(answer, 422, code)["errors"])) == count


async def test_an_unknown_parameter_is_named_with_those_that_are_known(
    client: httpx.AsyncClient,
) -> None:
    answer = await client.get("/v1/tracks?bbx=1,2,3,4")
    document = _is_problem(answer, 422, "UNKNOWN_PARAMETER")
    assert document["errors"] == [
        {
            "parameter": "bbx",
            "reason": "unknown parameter (did you mean 'bbox'?); known: at, bbox, cursor, fields, "
            "format, identity, limit, since",
        }
    ]


@pytest.mark.parametrize(
    ("query", "reason"),
    [
        (
            "format=geojsn",
            "unknown name 'geojsn' (did you mean 'geojson'?); known: json, geojson, ar",
        ),
        ("fields=time_s,latitude", "unknown 'latitude' (did you mean 'latitude_deg'?); known: tim"),
    ],
)
async def test_an_unknown_name_is_reported_with_the_most_similar_known_name(
    client: httpx.AsyncClient, query: str, reason: str
) -> None:
    document = _is_problem(await client.get(f"/v1/tracks?{query}"), 422, "INVALID_PARAMETER")
    (error,) = cast("list[dict[str, str]]", document["errors"])
    assert error["reason"].startswith(reason)


async def test_a_405_says_what_is_allowed(client: httpx.AsyncClient) -> None:
    answer = await client.post("/v1/tracks")
    assert answer.headers["allow"] == "GET, HEAD"


async def test_an_internal_error_reports_its_identifier_and_nothing_else(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.failure = ZeroDivisionError("secret /etc/shadow")
    with capture_logs() as logged:
        answer = await client.get("/v1/tracks", headers={"x-request-id": "my-request.7"})
    document = _is_problem(answer, 500, "INTERNAL_ERROR")
    assert document["instance"] == "urn:multiradar:request:my-request.7"
    assert [entry["request"] for entry in logged] == ["my-request.7"]
    assert logged[0]["exc_info"] is service.view.failure
    assert "secret" not in answer.text
    assert "ZeroDivision" not in answer.text


@pytest.mark.parametrize("given", ["a" * 65, "a b", "ü", "{}", ""])
async def test_a_request_identifier_that_is_no_word_is_replaced(
    client: httpx.AsyncClient, given: str
) -> None:
    answer = await client.get("/healthz", headers={b"x-request-id": given.encode()})
    assert len(answer.headers["x-request-id"]) == 16
    assert answer.headers["x-request-id"] != given


@pytest.mark.parametrize(
    ("failure", "status", "code"),
    [
        (QueueFullError("intake", 5, 1.2), 429, "QUEUE_FULL"),
        (JournalFullError("no room"), 507, "JOURNAL_FULL"),
        (JournalError("broken"), 503, "JOURNAL_FAILED"),
        (PipelineError("stopping"), 503, "NOT_READY"),
        (IdempotencyConflictError("key", 3), 422, "IDEMPOTENCY_KEY_REUSED"),
    ],
)
@pytest.mark.fault(24)
async def test_what_the_service_rejects_has_its_status(
    client: httpx.AsyncClient, service: FakeService, failure: Exception, status: int, code: str
) -> None:
    service.failure = failure
    answer = await client.post("/v1/flush")
    _is_problem(answer, status, code)
    assert answer.headers.get("retry-after") == {"QUEUE_FULL": "2", "NOT_READY": "1"}.get(code)


async def test_every_answer_has_the_security_headers(client: httpx.AsyncClient) -> None:
    for path in ("/v1/tracks", "/nowhere", "/docs"):
        headers = (await client.get(path)).headers
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["x-frame-options"] == "DENY"
        assert headers["content-security-policy"].startswith("default-src 'none'")
        assert headers["cache-control"] == "no-store"


async def test_a_page_of_another_origin_changes_nothing(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    answer = await client.post("/v1/flush", headers={"origin": "https://elsewhere.example"})
    _is_problem(answer, 403, "ORIGIN_NOT_ALLOWED")
    assert service.flushes == []
    answer = await client.post("/v1/flush", headers={"origin": "http://127.0.0.1"})
    assert answer.status_code == 200


@pytest.mark.parametrize(
    ("host", "status"),
    [
        ("127.0.0.1:8080", 200),
        ("LOCALHOST", 200),
        ("[::1]:80", 200),
        ("rebound.example", 421),
        ("127.0.0.1.rebound.example", 421),
        ("localhost/@rebound.example", 421),
        ("", 421),
        ("[", 421),
        ("[x]", 421),
    ],
)
async def test_only_known_names_of_the_host_are_answered(
    application: LimitLayer, host: str, status: int
) -> None:
    layer = LimitLayer(application, HttpLimits(), ["localhost", "127.0.0.1", "::1"])
    transport = httpx.ASGITransport(layer)
    async with httpx.AsyncClient(transport=transport, base_url="http://x") as client:
        answer = await client.get("/healthz", headers={"host": host})
    assert answer.status_code == status


@pytest.mark.parametrize(
    ("host", "status"),
    [("any.example", 200), ("", 200), ("[2001:db8::1]:80", 200), ("[", 421), ("[x]", 421),
     ("a]", 421), ("any.example/healthz?", 421), (":80", 421)],
)  # fmt: skip
async def test_where_all_names_are_known_a_host_still_has_the_form_of_one(
    client: httpx.AsyncClient, host: str, status: int
) -> None:
    with capture_logs() as logged:
        answer = await client.get("/healthz", headers={"host": host})
    assert answer.status_code == status
    assert status == 200 or answer.json()["code"] == "HOST_NOT_ALLOWED"
    assert logged == []


async def test_a_web_socket_with_a_host_that_is_none_is_closed(application: LimitLayer) -> None:
    sent: list[Message] = []

    async def receive() -> Message:
        return {"type": "websocket.connect"}

    async def send(message: Message) -> None:
        sent.append(message)

    scope = {"type": "websocket", "path": "/v1/stream", "headers": [(b"host", b"[")]}
    await LimitLayer(application, HttpLimits())(scope, receive, send)
    assert sent == [{"type": "websocket.close", "code": 1008, "reason": "HOST_NOT_ALLOWED"}]


@pytest.mark.parametrize(
    ("path", "detail"),
    [
        ("/v1/track", "no such path (did you mean '/v1/tracks'?)"),
        ("/v1/tracks/", "no such path (did you mean '/v1/tracks'?)"),
        ("/v1/trakcs/7", "no such path (did you mean '/v1/tracks/7'?)"),
        ("/v1/measurement", "no such path (did you mean '/v1/measurements'?)"),
        (
            "/v1/stream",
            "/v1/stream is a WebSocket: connect to it with ws:// or wss://, or read /v1/events "
            "over HTTP",
        ),
        ("/etc/passwd", "no such path"),
        (f"/v1/tracks{'s' * 100}", "no such path"),
    ],
)
async def test_an_unknown_path_names_the_nearest(
    unchanging: FastAPI, path: str, detail: str
) -> None:
    async with httpx.AsyncClient(
        transport=httpx.ASGITransport(unchanging), base_url="http://test"
    ) as client:
        answer = await client.get(path)
    assert _is_problem(answer, 404, "NOT_FOUND")["detail"] == detail
