"""HEAD is answered wherever GET is: the same status and headers, no body."""

import asyncio
from collections.abc import MutableMapping
from typing import Any

import httpx
import pytest
from fastapi import FastAPI

_DEADLINE_S = 60.0
_CHANGING = {"x-request-id"}
_PATHS = [
    "/", "/docs", "/openapi.json", "/healthz", "/readyz", "/metrics", "/v1/status", "/v1/picture",
    "/v1/tracks", "/v1/tracks?format=geojson", "/v1/tracks?limit=0", "/v1/tracks/1",
    "/v1/tracks/999", "/v1/tracks/1/history", "/v1/tracks/1/transitions",
    "/v1/tracks/1/forecast", "/v1/encounters",
    "/v1/tracks/1/manoeuvre-plane", "/v1/tracks/1/observability", "/v1/tracks/1/trajectories",
    "/v1/tracks/1/plots", "/v1/residuals", "/v1/regions",
    "/v1/sensors", "/v1/sensors/41-10", "/v1/sensors/41-10/bias",
    "/v1/sensors/41-10/configuration", "/v1/rejects", "/nowhere",
    "/v1/measurements", "/data/aircraft.json", "/data/receiver.json",
]  # fmt: skip


def _kept(answer: httpx.Response) -> dict[str, str]:
    return {name: value for name, value in answer.headers.items() if name not in _CHANGING}


def test_every_path_that_is_got_is_asked_for(application: FastAPI) -> None:
    got = {path for path, one in application.openapi()["paths"].items() if "get" in one}
    asked = {path.partition("?")[0].replace("/41-10", "/{sensor_id}") for path in _PATHS}
    asked = {path.replace("/tracks/1", "/tracks/{track_id}") for path in asked}
    assert got - asked == {"/v1/events"}


@pytest.mark.parametrize("path", _PATHS)
async def test_head_answers_as_get_without_a_body(client: httpx.AsyncClient, path: str) -> None:
    got, head = await client.get(path), await client.head(path)
    assert head.status_code == got.status_code
    assert got.content or got.status_code == 307
    assert head.content == b""
    reported, expected = _kept(head), _kept(got)
    if path == "/metrics":
        # It counts requests, these two among them.
        reported.pop("content-length"), expected.pop("content-length")
    assert reported == expected


@pytest.mark.parametrize("path", ["/v1/tracks", "/nowhere", "/v1/events"])
async def test_no_byte_of_a_body_is_sent(application: FastAPI, path: str) -> None:
    sent: list[dict[str, Any]] = []
    ended = asyncio.Event()

    async def receive() -> dict[str, Any]:
        if not sent:
            return {"type": "http.request", "body": b"", "more_body": False}
        await ended.wait()
        return {"type": "http.disconnect"}

    async def send(message: MutableMapping[str, Any]) -> None:
        sent.append(dict(message))
        if message["type"] == "http.response.body" and not message.get("more_body", False):
            ended.set()

    scope = {
        "type": "http", "asgi": {"version": "3.0"}, "http_version": "1.1", "method": "HEAD",
        "scheme": "http", "path": path, "raw_path": path.encode(), "root_path": "",
        "query_string": b"", "headers": [(b"host", b"127.0.0.1")], "client": None, "server": None,
    }  # fmt: skip
    async with asyncio.timeout(_DEADLINE_S):
        await application(scope, receive, send)
    assert [one["type"] for one in sent] == ["http.response.start", "http.response.body"]
    assert sent[1]["body"] == b""
    assert scope["method"] == "HEAD"


async def test_head_of_a_stream_ends(client: httpx.AsyncClient) -> None:
    async with asyncio.timeout(_DEADLINE_S):
        head = await client.head("/v1/events")
        assert (head.status_code, head.content) == (200, b"")
        assert head.headers["content-type"].startswith("text/event-stream")
        # Its place is free again: as many may ask as like.
        for _ in range(40):
            assert (await client.head("/v1/events?after=0")).status_code == 200


async def test_head_of_a_stream_is_rejected_as_get_is(client: httpx.AsyncClient) -> None:
    assert (await client.head("/v1/events?after=x")).status_code == 422


async def test_what_is_not_got_is_not_answered(client: httpx.AsyncClient) -> None:
    head = await client.head("/v1/flush")
    assert (head.status_code, head.headers["allow"]) == (405, "POST")
