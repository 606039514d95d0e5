"""Every route as every role, without credentials and with wrong ones, from the OpenAPI document."""

from collections.abc import AsyncIterator, Iterator
from typing import Any

import httpx
import pytest
from fastapi import APIRouter, FastAPI
from structlog.testing import capture_logs
from websockets.exceptions import ConnectionClosed, InvalidStatus

from multiradar.access.attempts import WITHIN_S, WRONG_MAX
from multiradar.api.factory import create_api
from multiradar.clock import FixedClock
from multiradar.errors import ConfigurationError
from multiradar.ingest.http import measurement_routes
from multiradar.settings.access import Role
from multiradar.settings.limits import HttpLimits
from support.access import KEYS, authentication, bearer, guarded_api
from support.fakes.fake_service import FakeService
from support.processes import clients
from support.processes.live_server import serving
from support.processes.waiting import WAIT_TIMEOUT_S

#: What needs no credentials: probes, and the page with its files, which has no data.
PUBLIC = {"/healthz", "/readyz"}
PUBLIC_OUTSIDE_OPENAPI = ("/", "/page/page.js", "/docs", "/openapi.json")
_VALUES = {"track_id": "1", "sensor_id": "41-10", "number": "0"}


@pytest.fixture
def guarded(service: FakeService) -> FastAPI:
    return guarded_api(service)


@pytest.fixture
async def caller(guarded: FastAPI) -> AsyncIterator[httpx.AsyncClient]:
    transport = httpx.ASGITransport(guarded)
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as one:
        yield one


def operations(application: FastAPI) -> Iterator[tuple[str, str, dict[str, Any]]]:
    for path, methods in application.openapi()["paths"].items():
        for method, operation in methods.items():
            yield method, path, operation


def role_of(operation: dict[str, Any]) -> Role | None:
    """Return the role that the document declares; None for a public operation."""
    declared = operation.get("security")
    if declared is None:
        return None
    roles = {role for scheme in declared for names in scheme.values() for role in names}
    (role,) = roles
    return Role(role)


async def status(caller: httpx.AsyncClient, method: str, path: str, key: str | None) -> int:
    """Ask as this key; a stream ends with its headers."""
    headers = {} if key is None else bearer(key)
    if path == "/v1/events":
        # Beyond the check the parameter is wrong, so that no stream opens.
        path += "?kinds=unknown"
    answer = await caller.request(method, path.format(**_VALUES), headers=headers)
    return answer.status_code


@pytest.mark.slow
@pytest.mark.fault(39)
async def test_every_route_asks_for_the_role_that_it_declares(
    guarded: FastAPI, caller: httpx.AsyncClient
) -> None:
    asked = 0
    for method, path, operation in operations(guarded):
        role = role_of(operation)
        assert (role is None) == (path in PUBLIC), path
        for key in (None, "mr_unknown", "a.b.c", ""):
            got = await status(caller, method, path, key)
            # After many wrong ones from an address: too many attempts.
            assert (got in (401, 429)) == (role is not None), (path, key, got)
        for name in ("feed", "display", "operate"):
            allowed = role is None or name in (role, Role.OPERATE)
            got = await status(caller, method, path, KEYS[name])
            assert (got not in (401, 403)) == allowed, (path, name, got)
            asked += 1
    assert asked == 3 * len(list(operations(guarded)))


@pytest.mark.slow
@pytest.mark.fault(39)
async def test_roles_are_those_of_the_documents(guarded: FastAPI) -> None:
    # A path has several operations: a GET and a PUT of the same sensor.
    roles = {(method, path): role_of(one) for method, path, one in operations(guarded)}
    public = {(method, path) for (method, path), role in roles.items() if role is None}
    assert public == {("get", path) for path in PUBLIC}
    assert {one for one, role in roles.items() if role is Role.FEED} == {
        ("post", "/v1/measurements")
    }
    assert {one for one, role in roles.items() if role is Role.OPERATE} == {
        ("post", "/v1/flush"), ("post", "/v1/clock"), ("post", "/v1/drain"),
        ("put", "/v1/sensors/{sensor_id}"),
    }  # fmt: skip
    shown = {one for one, role in roles.items() if role is Role.DISPLAY}
    assert {method for method, _ in shown} == {"get"}
    assert ("get", "/v1/sensors/{sensor_id}") in shown


async def test_files_of_the_page_and_documentation_are_public(caller: httpx.AsyncClient) -> None:
    for path in PUBLIC_OUTSIDE_OPENAPI:
        assert (await caller.get(path)).status_code == 200, path


def test_the_web_socket_asks_for_the_role_display(guarded: FastAPI) -> None:
    with serving(guarded, HttpLimits()) as port:
        address = f"ws://127.0.0.1:{port}/v1/stream"
        for key, expected in ((None, 401), ("mr_unknown", 401), (KEYS["feed"], 403)):
            headers = {} if key is None else bearer(key)
            with pytest.raises(InvalidStatus) as denied:
                clients.event_socket(address, additional_headers=headers)
            assert denied.value.response.status_code == expected
        headers = bearer(KEYS["display"])
        with clients.event_socket(address, additional_headers=headers) as socket:
            # A message ends the stream of a client that may read it.
            socket.send("anything")
            with pytest.raises(ConnectionClosed):
                socket.recv(WAIT_TIMEOUT_S)
            assert socket.close_code == 1008


async def test_a_rejection_is_a_problem_with_a_challenge(caller: httpx.AsyncClient) -> None:
    missing = await caller.get("/v1/tracks")
    assert (missing.status_code, missing.json()["code"]) == (401, "CREDENTIALS_MISSING")
    assert missing.headers["www-authenticate"].startswith("Bearer")
    wrong = await caller.get("/v1/tracks", headers=bearer("mr_x"))
    assert (wrong.status_code, wrong.json()["code"]) == (401, "CREDENTIALS_INVALID")
    role = await caller.get("/v1/tracks", headers=bearer(KEYS["feed"]))
    assert (role.status_code, role.json()["code"]) == (403, "ROLE_NOT_ALLOWED")
    assert "the role display, which feed does not have" in role.json()["detail"]


@pytest.mark.fault(38)
async def test_wrong_keys_of_an_address_are_asked_to_pause_and_valid_ones_accepted(
    service: FakeService,
) -> None:
    clock = FixedClock()
    application = guarded_api(service, authentication(clock=clock))

    def host(address: str) -> httpx.AsyncClient:
        transport = httpx.ASGITransport(application, client=(address, 1))
        return httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1")

    async with host("192.0.2.1") as guessing, host("192.0.2.2") as other:
        # Neither counts: no key, and a valid one of another role.
        assert await status(guessing, "GET", "/v1/status", None) == 401
        assert await status(guessing, "GET", "/v1/status", KEYS["feed"]) == 403
        for number in range(WRONG_MAX):
            wrong = ("mr_wrong", "a.b.c")[number % 2]
            assert await status(guessing, "GET", "/v1/status", wrong) == 401, number
        for method, path in (("GET", "/v1/status"), ("POST", "/v1/measurements")):
            paused = await guessing.request(method, path, headers=bearer("mr_wrong"))
            assert (paused.status_code, paused.json()["code"]) == (429, "TOO_MANY_ATTEMPTS")
            assert paused.headers["retry-after"] == str(int(WITHIN_S) + 1)
            assert paused.headers["content-type"] == "application/problem+json"
        assert await status(guessing, "GET", "/v1/status", KEYS["display"]) == 200
        assert await status(other, "GET", "/v1/status", "mr_wrong") == 401
        clock.advance(WITHIN_S)
        assert await status(guessing, "GET", "/v1/status", "mr_wrong") == 401


async def test_rejections_of_a_network_of_64_bits_are_one_origin_in_the_log(
    guarded: FastAPI,
) -> None:
    keys = (None, "mr_x", KEYS["feed"])
    with capture_logs() as logs:
        for address in ("2001:db8::1", "2001:db8::2", "2001:db8:0:1::1"):
            transport = httpx.ASGITransport(guarded, client=(address, 1))
            async with httpx.AsyncClient(transport=transport, base_url="http://[::1]") as one:
                assert [await status(one, "GET", "/v1/tracks", key) for key in keys] == [
                    401, 401, 403,
                ]  # fmt: skip
    logged = [(one["origin"], one["address"]) for one in logs if one["event"] == "rejected"]
    assert logged == [
        ("2001:db8::/64", "2001:db8::1"), ("2001:db8:0:1::/64", "2001:db8:0:1::1"),
    ]  # fmt: skip


async def test_nothing_of_a_body_is_read_before_the_check(
    caller: httpx.AsyncClient, service: FakeService
) -> None:
    read = []

    async def body() -> AsyncIterator[bytes]:
        read.append(1)
        yield b"\n"

    headers = {"content-type": "application/x-ndjson"}
    answer = await caller.post("/v1/measurements", content=body(), headers=headers)
    assert answer.status_code == 401
    assert service.submissions == []
    # The client of the test sends its body in advance; a route reads it not.
    assert answer.json()["code"] == "CREDENTIALS_MISSING"


@pytest.mark.fault(39)
def test_a_route_without_a_role_cannot_be_served(service: FakeService) -> None:
    router = APIRouter(prefix="/v1")

    @router.get("/new")
    async def _new() -> None:
        """Declare no role."""

    with pytest.raises(ConfigurationError, match=r"route /v1/new: expected exactly one of FEED"):
        create_api(service, routers=[router])


def test_the_document_declares_how_to_prove_who_one_is(guarded: FastAPI) -> None:
    schemes = guarded.openapi()["components"]["securitySchemes"]
    assert schemes["bearer"]["type"] == "http"
    assert schemes["bearer"]["scheme"] == "bearer"
    assert schemes["certificate"]["type"] == "mutualTLS"


async def test_without_credentials_in_the_settings_everybody_may_do_everything(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    assert (await client.get("/v1/tracks")).status_code == 200
    assert (await client.get("/v1/tracks", headers=bearer("mr_any"))).status_code == 200
    assert (await client.post("/v1/flush")).status_code == 200
    assert service.flushes == ["http"]


@pytest.mark.parametrize(
    ("address", "status"), [("127.0.0.1", 200), ("::1", 200), ("192.0.2.7", 403), ("::2", 403)]
)
async def test_without_credentials_only_this_machine_ends_a_stream(
    address: str, status: int
) -> None:
    service = FakeService()
    application = create_api(service, routers=[measurement_routes(service)])
    transport = httpx.ASGITransport(application, client=(address, 1))
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as caller:
        answer = await caller.post("/v1/flush")
        assert answer.status_code == status
        assert len(service.flushes) == (status == 200)
        assert status == 200 or answer.json()["code"] == "ROLE_NOT_ALLOWED"
        sent = await caller.post(
            "/v1/measurements", content=b"[]", headers={"content-type": "application/json"}
        )
        assert sent.status_code == 200
