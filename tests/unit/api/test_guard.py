"""The limit layer: how many requests and how many bytes at one time."""

import asyncio
import threading
from collections.abc import AsyncIterator

import httpx
import pytest

from multiradar.api.factory import create_api
from multiradar.ingest.http import measurement_routes
from multiradar.settings.limits import HttpLimits
from support.fakes.fake_service import FakeService
from support.processes.waiting import wait_until

LIMITS = HttpLimits(requests_max=3, threads=8, body_bytes_max=1_000, bodies_bytes_max=1_500)


@pytest.fixture
async def narrow(service: FakeService) -> AsyncIterator[httpx.AsyncClient]:
    application = create_api(service, LIMITS, routers=[measurement_routes(service)])
    transport = httpx.ASGITransport(application)
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
        yield client


async def test_requests_beyond_the_maximum_get_retry_after_and_health_still_answers(
    narrow: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.gate = threading.Event()
    waiting = [asyncio.create_task(narrow.get("/v1/tracks")) for _ in range(LIMITS.requests_max)]
    everybody = LIMITS.requests_max
    await asyncio.to_thread(
        wait_until, lambda: len(service.view.readers) == everybody, "the requests to be worked on"
    )
    rejected = await narrow.get("/v1/status")
    assert (rejected.status_code, rejected.json()["code"]) == (503, "TOO_MANY_REQUESTS")
    assert rejected.headers["retry-after"] == "1"
    assert (await narrow.get("/healthz")).status_code == 200
    service.view.gate.set()
    assert [(await one).status_code for one in waiting] == [200] * LIMITS.requests_max
    assert (await narrow.get("/v1/status")).status_code == 200


async def _slow_body(first: asyncio.Event, rest: asyncio.Event) -> AsyncIterator[bytes]:
    yield b"\n" * 900
    first.set()
    await rest.wait()
    yield b"\n"


async def test_bodies_are_bounded_together_and_their_bytes_given_back(
    narrow: httpx.AsyncClient,
) -> None:
    first, rest = asyncio.Event(), asyncio.Event()
    headers = {"content-type": "application/x-ndjson"}
    slow = asyncio.create_task(
        narrow.post("/v1/measurements", content=_slow_body(first, rest), headers=headers)
    )
    await first.wait()
    rejected = await narrow.post("/v1/measurements", content=b"\n" * 700, headers=headers)
    assert (rejected.status_code, rejected.json()["code"]) == (503, "TOO_MANY_BODIES")
    rest.set()
    assert (await slow).status_code == 200
    taken = await narrow.post("/v1/measurements", content=b"\n" * 1000, headers=headers)
    assert taken.status_code == 200


@pytest.mark.parametrize(("length", "status"), [(1_000, 200), (1_001, 413)])
async def test_a_body_is_taken_up_to_its_limit(
    narrow: httpx.AsyncClient, length: int, status: int
) -> None:
    async def pieces() -> AsyncIterator[bytes]:
        for _ in range(length):
            yield b"\n"

    headers = {"content-type": "application/x-ndjson"}
    answer = await narrow.post("/v1/measurements", content=pieces(), headers=headers)
    assert answer.status_code == status


@pytest.mark.parametrize(("more", "status"), [(0, 200), (1, 431)])
async def test_headers_are_read_up_to_their_limit(
    service: FakeService, more: int, status: int
) -> None:
    limits = HttpLimits(header_bytes_max=500)
    transport = httpx.ASGITransport(create_api(service, limits))
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
        # Path and headers count, without what separates them.
        request = client.build_request("GET", "/healthz", headers={"x": ""})
        least = len("/healthz") + sum(len(name) + len(text) for name, text in request.headers.raw)
        request.headers["x"] = "a" * (500 - least + more)
        answer = await client.send(request)
    assert answer.status_code == status
    assert status == 200 or answer.json()["code"] == "HEADERS_TOO_LARGE"
