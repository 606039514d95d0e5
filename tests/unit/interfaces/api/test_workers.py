"""Threads of requests: turns between clients, and expensive queries on threads of their own."""

import asyncio
import threading
from collections.abc import Callable, Iterator
from typing import Any

import httpx
import numpy as np
import pytest

from multiradar.access.shares import CLIENT
from multiradar.access.workers import Workers
from multiradar.api.factory import create_api
from multiradar.api.workers import QueryWorkers
from multiradar.errors import DeadlineError, RequestError
from multiradar.runtime.queries.deadline import check_deadline, deadline
from multiradar.runtime.queries.encounters import _parts
from multiradar.runtime.queries.registry import Query
from multiradar.settings.limits import HttpLimits
from support.fakes.fake_service import FakeService, FakeView
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until

PATIENT = HttpLimits(query_deadline_s=WAIT_TIMEOUT_S)


@pytest.fixture
def gate() -> Iterator[threading.Event]:
    event = threading.Event()
    yield event
    event.set()


def _of(client: str, work: Any) -> "asyncio.Task[Any]":
    token = CLIENT.set(client)
    task = asyncio.create_task(work)
    CLIENT.reset(token)
    return task


async def _started(condition: Callable[[], object]) -> None:
    await asyncio.to_thread(wait_until, condition, "the work to be started")


async def test_a_client_with_much_work_and_one_with_little_are_served_in_turns(
    gate: threading.Event,
) -> None:
    workers, order = Workers(1), list[str]()
    blocking = _of("many", workers.run(gate.wait, WAIT_TIMEOUT_S))
    works = [_of("many", workers.run(order.append, "many")) for _ in range(3)]
    works += [_of("few", workers.run(order.append, "few"))]
    await asyncio.sleep(0)
    gate.set()
    await asyncio.gather(blocking, *works)
    assert order == ["many", "few", "many", "many"]
    assert await workers.run(lambda: 1) == 1


async def test_cancelled_work_gives_its_turn_back(
    gate: threading.Event,
) -> None:
    workers = Workers(1)
    blocking = asyncio.create_task(workers.run(gate.wait, WAIT_TIMEOUT_S))
    given_up = asyncio.create_task(workers.run(gate.wait, WAIT_TIMEOUT_S))
    await asyncio.sleep(0)
    given_up.cancel()
    gate.set()
    await blocking
    assert await workers.run(lambda: 2) == 2


@pytest.mark.parametrize("cancelled", [1, 3])
async def test_work_behind_cancelled_work_is_started_when_a_thread_is_free(
    gate: threading.Event, cancelled: int
) -> None:
    """It waited, with a thread free, until another request came."""
    workers = Workers(1)
    blocking = asyncio.create_task(workers.run(gate.wait, WAIT_TIMEOUT_S))
    given_up = [asyncio.create_task(workers.run(gate.wait, 0)) for _ in range(cancelled)]
    behind = asyncio.create_task(workers.run(lambda: 3))
    await asyncio.sleep(0)
    for one in given_up:
        one.cancel()
    await asyncio.sleep(0)
    gate.set()
    await blocking
    async with asyncio.timeout(WAIT_TIMEOUT_S):
        assert await behind == 3


async def test_one_kind_of_query_of_a_client_leaves_a_thread_to_others(
    gate: threading.Event,
) -> None:
    queries, running = QueryWorkers(PATIENT), list[int]()

    def block() -> None:
        running.append(1)
        gate.wait(WAIT_TIMEOUT_S)

    heavy = [_of("one", queries.run("encounters", block)) for _ in range(4)]
    await _started(lambda: running)
    assert await _of("one", queries.run("picture", lambda: "frame")) == "frame"
    assert await _of("other", queries.run("encounters", lambda: "found")) == "found"
    assert len(running) == 1
    gate.set()
    await asyncio.gather(*heavy)


async def test_expensive_queries_of_a_client_are_bounded(gate: threading.Event) -> None:
    queries = QueryWorkers(HttpLimits(client_queries_max=2, query_deadline_s=WAIT_TIMEOUT_S))
    heavy = [_of("one", queries.run("x", gate.wait, WAIT_TIMEOUT_S)) for _ in range(2)]
    await asyncio.sleep(0)
    with pytest.raises(RequestError) as rejected:
        await _of("one", queries.run("y", lambda: None))
    assert (rejected.value.status, rejected.value.code) == (429, "TOO_MANY_QUERIES")
    assert rejected.value.headers["retry-after"]
    assert await _of("other", queries.run("y", lambda: 3)) == 3
    gate.set()
    await asyncio.gather(*heavy)
    assert await _of("one", queries.run("y", lambda: 4)) == 4


@pytest.mark.parametrize("place", ["running", "waiting", "checked"])
async def test_a_query_beyond_its_deadline_is_answered_with_what_to_do(
    gate: threading.Event, place: str
) -> None:
    queries = QueryWorkers(HttpLimits(query_deadline_s=0.1))

    def checking() -> None:
        while not gate.is_set():
            check_deadline()

    work: Any = checking if place == "checked" else (lambda: gate.wait(WAIT_TIMEOUT_S))
    tasks = [_of("one", queries.run("x", work)) for _ in range(2 if place == "waiting" else 1)]
    for task in tasks:
        with pytest.raises(RequestError) as rejected:
            await task
        assert (rejected.value.status, rejected.value.code) == (503, "QUERY_TIMEOUT")
        assert rejected.value.headers["retry-after"]
        assert "use a shorter horizon" in str(rejected.value)


def test_encounters_check_the_deadline_between_pieces() -> None:
    assert np.array_equal(np.concatenate(list(_parts(1001))), np.arange(1001))
    with deadline(-1.0), pytest.raises(DeadlineError):
        list(_parts(1))


async def test_heavy_queries_of_one_client_do_not_delay_a_track_of_another(
    service: FakeService, gate: threading.Event, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = []

    def ask(_view: FakeView, _query: Query, *_: object, **_given: object) -> dict[str, Any]:
        asked.append(1)
        gate.wait(WAIT_TIMEOUT_S)
        return {}

    monkeypatch.setattr(FakeView, "ask", ask)
    transport = httpx.ASGITransport(create_api(service, PATIENT))
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
        heavy = [asyncio.create_task(client.get("/v1/encounters")) for _ in range(16)]
        await _started(lambda: asked)
        assert (await client.get("/v1/tracks/1")).status_code == 200
        rejected = await client.get("/v1/encounters")
        assert (rejected.status_code, rejected.json()["code"]) == (429, "TOO_MANY_QUERIES")
        gate.set()
        assert {(await one).status_code for one in heavy} == {200}
