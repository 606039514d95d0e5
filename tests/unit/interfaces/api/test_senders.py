"""Senders: the sensors that they may send, their idempotency keys, and what errors reveal."""

import json
from collections.abc import AsyncIterator

import httpx
import pytest
from structlog.testing import capture_logs

from multiradar.access.clients import key_digest
from multiradar.clock import SystemClock
from multiradar.errors import JournalError, JournalFullError
from multiradar.ingest.bodies import decode
from multiradar.ingest.bound_sensors import of_allowed_sensors
from multiradar.observability.logs import configure_logs
from multiradar.runtime.live.receipt import IDEMPOTENCY_KEY_LENGTH_MAX
from support.access import KEYS, bearer, guarded_api
from support.fakes.fake_service import FakeService

PLOT = {"time_s": 1.0, "kind": "radar", "range_m": 5e4, "azimuth_deg": 10.0}


@pytest.fixture
async def caller(service: FakeService) -> AsyncIterator[httpx.AsyncClient]:
    transport = httpx.ASGITransport(guarded_api(service))
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as one:
        yield one


async def send(
    caller: httpx.AsyncClient, name: str, *sensors: str | None, key: str | None = None
) -> httpx.Response:
    rows = [PLOT if one is None else {**PLOT, "sensor_id": one} for one in sensors]
    headers = bearer(KEYS[name]) | {"content-type": "application/json"}
    if key is not None:
        headers["idempotency-key"] = key
    return await caller.post("/v1/measurements", content=json.dumps(rows), headers=headers)


@pytest.mark.fault(20)
async def test_rows_of_other_sensors_are_rejected_with_code_and_count(
    caller: httpx.AsyncClient, service: FakeService
) -> None:
    with capture_logs() as logs:
        answer = await send(caller, "radar", "41-10", "41-20", "41-10", "adsb")
    assert answer.status_code == 200
    rejected = answer.json()["rejected"]
    assert answer.json()["accepted"] == 2
    assert [(row["index"], row["code"]) for row in rejected] == [
        (1, "SENSOR_NOT_ALLOWED"),
        (3, "SENSOR_NOT_ALLOWED"),
    ]
    assert rejected[0]["reason"] == (
        "sensor_id: expected a sensor allowed for this sender (41-10), was 41-20"
    )
    (submission,) = service.submissions
    assert submission.frame["sensor_id"].to_list() == ["41-10", "41-10"]
    assert '"sensor_id": "41-20"' in submission.rejected[0].raw
    (logged,) = [one for one in logs if one["event"] == "sensors_rejected"]
    assert (logged["origin"], logged["rows"]) == ("radar", 2)


def test_a_sender_without_sensors_sends_for_none() -> None:
    body = json.dumps([PLOT | {"sensor_id": "41-10"}]).encode()
    decoded = decode("application/json", body, 10)
    assert of_allowed_sensors(decoded, None) is decoded
    none = of_allowed_sensors(decoded, frozenset())
    assert len(none.frame) == 0
    assert none.rejected[0].reason == (
        "sensor_id: expected a sensor allowed for this sender (none), was 41-10"
    )


async def test_an_unbound_feed_sends_for_every_sensor(
    caller: httpx.AsyncClient, service: FakeService
) -> None:
    answer = await send(caller, "feed", "41-10", "41-20")
    assert answer.json() == {
        "accepted": 2, "rejected": [], "duplicate": False, "journal_sequence": 1,
    }  # fmt: skip
    assert service.submissions[0].source == "http:feed"


async def test_the_same_key_of_another_client_is_another_key(
    caller: httpx.AsyncClient, service: FakeService
) -> None:
    longest = "k" * IDEMPOTENCY_KEY_LENGTH_MAX
    for name in ("radar", "rival", "operate"):
        await send(caller, name, "41-10", key=longest)
    await caller.post("/v1/flush", headers=bearer(KEYS["operate"]) | {"idempotency-key": "end"})
    kept = [one.idempotency_key for one in service.submissions]
    assert kept == [f"{name}\x1f{longest}" for name in ("radar", "rival", "operate")]


async def test_a_name_cannot_be_made_of_a_key(caller: httpx.AsyncClient) -> None:
    answer = await send(caller, "rival", "41-10", key="x\x1fradar")
    assert (answer.status_code, answer.json()["code"]) == (400, "IDEMPOTENCY_KEY_INVALID")


@pytest.mark.parametrize(
    ("failure", "status", "code"),
    [
        (JournalError("/var/lib/multiradar/journal.sqlite: damaged"), 503, "JOURNAL_FAILED"),
        (JournalFullError("/var/lib/multiradar/journal.sqlite: disk full"), 507, "JOURNAL_FULL"),
    ],
)
async def test_an_error_does_not_reveal_a_path_of_the_server(
    caller: httpx.AsyncClient, service: FakeService, failure: Exception, status: int, code: str
) -> None:
    service.failure = failure
    answer = await send(caller, "feed", "41-10")
    assert (answer.status_code, answer.json()["code"]) == (status, code)
    assert "/var" not in answer.text
    assert "journal.sqlite" not in answer.text
    assert answer.json()["detail"]


@pytest.mark.fault(41)
async def test_no_secret_is_logged(
    caller: httpx.AsyncClient, capfd: pytest.CaptureFixture[str]
) -> None:
    configure_logs("debug", "json", SystemClock())
    wrong = "mr_wrong-and-secret"
    for name in KEYS:
        await send(caller, name, "41-10", "41-20")
        await caller.post("/v1/flush", headers=bearer(KEYS[name]))
        await caller.get("/v1/tracks", headers=bearer(KEYS[name]))
    for path in ("/v1/tracks", f"/v1/tracks?key={wrong}", "/v1/nothing"):
        await caller.get(path, headers=bearer(wrong))
        await caller.get(path, headers={"authorization": f"Basic {wrong}"})
    logged = capfd.readouterr().err
    for event in ("rejected", "operated", "sent", "sensors_rejected"):
        assert f'"event": "{event}"' in logged
    for secret in (wrong, *KEYS.values(), *map(key_digest, KEYS.values())):
        assert secret not in logged
    assert "ROLE_NOT_ALLOWED" in logged
