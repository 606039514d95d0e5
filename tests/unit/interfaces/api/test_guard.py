"""The limit layer: how many requests and how many bytes at one time."""

import asyncio
import threading
from collections.abc import AsyncIterator
from concurrent.futures import Future
from dataclasses import replace
from typing import Any

import httpx
import pytest
from fastapi import FastAPI
from structlog.testing import capture_logs

from multiradar.access.authentication import Authentication
from multiradar.access.shares import client_at
from multiradar.api.bodies import Bodies, Body
from multiradar.api.factory import create_api
from multiradar.errors import RequestError
from multiradar.ingest.http import measurement_routes
from multiradar.runtime.live.receipt import Receipt
from multiradar.settings.limits import HttpLimits
from support.access import KEYS, authentication
from support.fakes.fake_service import FakeService
from support.processes.waiting import pause, wait_until

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


NDJSON = {"content-type": "application/x-ndjson"}


def _caller(application: FastAPI, address: str) -> httpx.AsyncClient:
    transport = httpx.ASGITransport(application, client=(address, 1))
    return httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1")


async def _slow_body(first: asyncio.Event, rest: asyncio.Event) -> AsyncIterator[bytes]:
    yield b"\n" * 900
    first.set()
    await rest.wait()
    yield b"\n"


async def test_the_body_that_has_been_arriving_longest_ends_for_others(
    narrow: httpx.AsyncClient,
) -> None:
    first, rest = asyncio.Event(), asyncio.Event()
    slow = asyncio.create_task(
        narrow.post("/v1/measurements", content=_slow_body(first, rest), headers=NDJSON)
    )
    await first.wait()
    others = [
        await narrow.post("/v1/measurements", content=b"\n" * size, headers=NDJSON)
        for size in (700, 1000)
    ]
    assert [one.status_code for one in others] == [200, 200]
    ended = await slow
    assert (ended.status_code, ended.json()["code"]) == (408, "BODY_TIMEOUT")
    assert "released for other requests" in ended.json()["detail"]


async def test_a_rejected_body_whose_rest_is_discarded_is_not_ended_for_others(
    narrow: httpx.AsyncClient,
) -> None:
    rejected, rest = asyncio.Event(), asyncio.Event()

    async def too_large() -> AsyncIterator[bytes]:
        yield b"\n" * 900
        yield b"\n" * 200
        rejected.set()
        await rest.wait()
        yield b"\n"

    large = asyncio.create_task(
        narrow.post("/v1/measurements", content=too_large(), headers=NDJSON)
    )
    await rejected.wait()
    other = await narrow.post("/v1/measurements", content=b"\n" * 700, headers=NDJSON)
    assert (other.status_code, other.json()["code"]) == (503, "TOO_MANY_BODIES")
    rest.set()
    assert (await large).status_code == 413
    again = await narrow.post("/v1/measurements", content=b"\n" * 700, headers=NDJSON)
    assert again.status_code == 200


async def test_a_body_that_has_just_expired_gives_room_to_others() -> None:
    bodies = Bodies(LIMITS)
    loop = asyncio.get_running_loop()
    slow, other = Body(bodies, "a", 0.01), Body(bodies, "b", 1.0)
    slow.hold(1_000)

    async def receive() -> None:
        async with slow.deadline():
            await asyncio.Event().wait()

    waiting = asyncio.create_task(receive())
    await asyncio.sleep(0.0)
    # Both are due at the same turn of the loop, its deadline first.
    loop.call_later(0.02, other.hold, 1_000)
    loop.call_soon(pause, 0.03)
    with pytest.raises(TimeoutError):
        await waiting
    assert (slow.held, other.held) == (0, 1_000)


async def test_a_body_that_was_ended_takes_no_further_piece() -> None:
    """One that came at the same turn was counted without those before it, and ended others."""
    bodies = Bodies(LIMITS)
    slow, other = Body(bodies, "a", 10.0), Body(bodies, "b", 10.0)
    slow.hold(1_000)
    other.hold(1_000)
    with pytest.raises(RequestError, match="released for other requests") as rejected:
        slow.hold(1_000)
    assert rejected.value.status == 408
    assert (slow.held, other.held) == (0, 1_000)


def _holding(bodies: Bodies, client: str, count: int) -> Body:
    body = Body(bodies, client, 10.0)
    body.hold(count)
    return body


async def test_no_body_is_ended_where_that_makes_no_room() -> None:
    bodies = Bodies(replace(LIMITS, client_bodies_bytes_max=1_200))
    arriving, complete = _holding(bodies, "a", 300), _holding(bodies, "b", 900)
    complete.arrived()
    for client, status in (("c", 503), ("b", 429)):
        with pytest.raises(RequestError) as rejected:
            _holding(bodies, client, 700)
        assert rejected.value.status == status
    assert (arriving.held, complete.held) == (300, 900)
    # What is possible is not rejected.
    assert _holding(bodies, "c", 600).held == 600
    assert arriving.held == 0


async def test_bodies_of_the_same_client_end_first_and_then_those_of_others() -> None:
    bodies = Bodies(replace(LIMITS, client_bodies_bytes_max=700))
    complete = _holding(bodies, "a", 500)
    complete.arrived()
    other, own = _holding(bodies, "b", 700), _holding(bodies, "c", 300)
    assert _holding(bodies, "c", 500).held == 500
    assert (complete.held, other.held, own.held) == (500, 0, 0)


async def test_bodies_that_have_arrived_are_bounded_together_and_by_client(
    service: FakeService,
) -> None:
    held: list[Future[Receipt]] = []
    service.answer = lambda _, future: held.append(future)
    limits = replace(LIMITS, client_bodies_bytes_max=1_000)
    application = create_api(service, limits, routers=[measurement_routes(service)])
    async with _caller(application, "10.0.0.1") as one, _caller(application, "10.0.0.2") as other:
        complete = asyncio.create_task(
            one.post("/v1/measurements", content=b"\n" * 900, headers=NDJSON)
        )
        await asyncio.to_thread(wait_until, lambda: held, "the message to be submitted")
        rejected = [
            await caller.post("/v1/measurements", content=b"\n" * 700, headers=NDJSON)
            for caller in (one, other)
        ]
        codes = [(answer.status_code, answer.json()["code"]) for answer in rejected]
        assert codes == [(429, "TOO_MANY_BODIES"), (503, "TOO_MANY_BODIES")]
        assert {answer.headers["retry-after"] for answer in rejected} == {"1"}
        held[0].set_result(Receipt(0, (), False, 1))
        assert (await complete).status_code == 200


async def test_requests_count_from_the_arrival_of_their_bodies_on(
    narrow: httpx.AsyncClient,
) -> None:
    rest = asyncio.Event()
    firsts = [asyncio.Event() for _ in range(10 * LIMITS.requests_max)]

    async def trickling(first: asyncio.Event) -> AsyncIterator[bytes]:
        yield b"\n"
        first.set()
        await rest.wait()

    slow = [
        asyncio.create_task(
            narrow.post("/v1/measurements", content=trickling(first), headers=NDJSON)
        )
        for first in firsts
    ]
    for first in firsts:
        await first.wait()
    assert (await narrow.get("/v1/tracks/1")).status_code == 200
    sent = await narrow.post("/v1/measurements", content=b"\n", headers=NDJSON)
    assert sent.status_code == 200
    rest.set()
    # They arrive together, more than may be in progress.
    assert {(await one).status_code for one in slow} <= {200, 503}


async def test_a_request_that_does_not_read_its_body_counts_at_once(
    narrow: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.gate = threading.Event()
    rest = asyncio.Event()

    async def never() -> AsyncIterator[bytes]:
        await rest.wait()
        yield b"x"

    everybody = LIMITS.requests_max
    waiting = [
        asyncio.create_task(narrow.request("GET", "/v1/tracks", content=never()))
        for _ in range(everybody)
    ]
    await asyncio.to_thread(
        wait_until, lambda: len(service.view.readers) == everybody, "the requests to be worked on"
    )
    assert (await narrow.get("/v1/status")).status_code == 503
    service.view.gate.set()
    rest.set()
    assert {(await one).status_code for one in waiting} == {200}


async def test_one_client_does_not_use_up_the_requests_of_others(service: FakeService) -> None:
    limits = HttpLimits(requests_max=4, client_requests_max=2, threads=8)
    application = create_api(service, limits)
    service.view.gate = threading.Event()
    async with _caller(application, "10.0.0.1") as one, _caller(application, "10.0.0.2") as other:
        waiting = [asyncio.create_task(one.get("/v1/tracks")) for _ in range(2)]
        await asyncio.to_thread(
            wait_until, lambda: len(service.view.readers) == 2, "the requests to be worked on"
        )
        rejected = await one.get("/v1/tracks/1")
        assert (rejected.status_code, rejected.json()["code"]) == (429, "TOO_MANY_REQUESTS")
        assert rejected.headers["retry-after"] == "1"
        assert "expected at most 2; wait until some" in rejected.json()["detail"]
        assert (await other.get("/v1/tracks/1")).status_code == 200
        service.view.gate.set()
        assert [(await two).status_code for two in waiting] == [200, 200]
        assert (await one.get("/v1/tracks/1")).status_code == 200


async def test_clients_with_keys_have_their_shares_by_key_not_by_address() -> None:
    found = authentication()
    scope = {"client": ("10.0.0.1", 1), "headers": [], "state": {}}

    def client(bearer: str) -> str:
        return found.client({**scope, "headers": [(b"authorization", bearer.encode())]})

    assert client(f"Bearer {KEYS['display']}") == "client display"
    assert client(f"bearer {KEYS['feed']}") == "client feed"
    # Keys that are not valid are no way to more shares.
    assert client("Bearer mr_wrong") == client("Basic x") == found.client(scope) == "10.0.0.1"
    assert Authentication().client(scope) == "10.0.0.1"


def test_a_network_of_64_bits_is_one_client() -> None:
    assert client_at("2001:db8:1:2::1") == client_at("2001:db8:1:2:ffff::7") == "2001:db8:1:2::/64"
    assert client_at("::ffff:10.0.0.1") == client_at("10.0.0.1")
    assert client_at("testclient") == "testclient"


async def test_a_client_that_disconnects_within_its_body_is_not_an_error(
    service: FakeService,
) -> None:
    application = create_api(service, LIMITS, routers=[measurement_routes(service)])
    messages = iter(
        [{"type": "http.request", "body": b"x", "more_body": True}, {"type": "http.disconnect"}]
    )

    async def receive() -> Any:
        return next(messages)

    async def send(_message: Any) -> None:
        return

    scope = {
        "type": "http", "method": "POST", "path": "/v1/measurements", "query_string": b"",
        "raw_path": b"/v1/measurements", "client": ("10.0.0.1", 1), "state": {},
        "headers": [(b"content-type", b"application/x-ndjson"), (b"content-length", b"9")],
    }  # fmt: skip
    with capture_logs() as logs:
        await application(scope, receive, send)
    assert [one["log_level"] for one in logs] == ["debug"]


@pytest.mark.parametrize(("length", "status"), [(1_000, 200), (1_001, 413)])
@pytest.mark.fault(35)
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
