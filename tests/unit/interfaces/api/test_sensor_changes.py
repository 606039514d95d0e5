"""Sensors over HTTP: read, tried, changed and added; what is wrong is named and changes nothing."""

import json
import time
from collections.abc import Iterable
from concurrent.futures import Future
from typing import Any

import httpx
import pytest
from structlog.testing import capture_logs

from multiradar.api.factory import create_api
from multiradar.ingest.http_sensors import BODY_BYTES_MAX, KEYS_MAX, sensor_change_routes
from multiradar.runtime.live.receipt import Receipt
from support.fakes.fake_service import FakeService

_OWN = "/v1/sensors/41-10"


async def _described(client: httpx.AsyncClient) -> dict[str, Any]:
    answer = await client.get(f"{_OWN}/configuration")
    assert answer.status_code == 200
    document: dict[str, Any] = answer.json()
    return document


async def test_a_description_is_read_changed_tried_and_sent_back(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    described = await _described(client)
    assert described["kind"] == "radar"
    # The same again changes nothing, and is no entry of the journal.
    same = (await client.put(_OWN, json=described)).json()
    assert (same["applied"], same["changes"], same["journal_sequence"]) == (False, [], None)
    described |= {"range_sigma_m": 80.0, "enabled": False}
    with capture_logs() as logs:
        tried = (await client.put(f"{_OWN}?dry_run=true", json=described)).json()
    assert "operated" not in [one["event"] for one in logs]
    assert tried["changes"] == [
        {"field": "range_sigma_m", "before": 50.0, "after": 80.0},
        {"field": "enabled", "before": True, "after": False},
    ]
    assert (tried["applied"], tried["health_reset"], tried["biases_reset"]) == (False, True, [])
    assert service.sensor_changes == []
    with capture_logs() as logs:
        headers = {"idempotency-key": "one"}
        made = (await client.put(_OWN, json=described, headers=headers)).json()
    assert made == tried | {"applied": True, "journal_sequence": 1}
    assert len(service.sensor_changes) == 1
    count = 'requests_total{method="PUT",route="/v1/sensors/{sensor_id}",status="200"}'
    assert count in (await client.get("/metrics")).text
    assert (await _described(client)) == described
    logged = [one for one in logs if one["event"] == "sensor_changed"]
    assert [one["fields"] for one in logged] == [["range_sigma_m", "enabled"]]
    assert [one["method"] for one in logs if one["event"] == "operated"] == ["PUT"]


async def test_a_change_that_is_confirmed_after_the_answer_is_logged_then(
    service: FakeService, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It was applied, and the security log did not contain it."""
    changed, late = service.change_sensor, Future[Receipt]()
    receipts: list[Receipt] = []

    def change_later(change: bytes, **of_sender: Any) -> "Future[Receipt]":
        receipts.append(changed(change, **of_sender).result())
        return late

    monkeypatch.setattr(service, "change_sensor", change_later)
    application = create_api(service, routers=[sensor_change_routes(service, 0.01)])
    transport = httpx.ASGITransport(application)
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
        described = await _described(client)
        with capture_logs() as logs:
            answer = await client.put(_OWN, json=described | {"range_sigma_m": 80.0})
            assert (answer.status_code, answer.json()["code"]) == (503, "NOT_ACKNOWLEDGED")
            assert [one for one in logs if one["event"] == "sensor_changed"] == []
            late.set_result(receipts[0])
    logged = [one for one in logs if one["event"] == "sensor_changed"]
    assert [one["fields"] for one in logged] == [["range_sigma_m"]]


async def test_a_late_retry_is_a_duplicate_and_leaves_the_later_change(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    described = await _described(client)

    async def put(range_sigma_m: float, key: str) -> dict[str, Any]:
        values = described | {"range_sigma_m": range_sigma_m}
        answer = await client.put(_OWN, json=values, headers={"idempotency-key": key})
        assert answer.status_code == 200
        document: dict[str, Any] = answer.json()
        return document

    first = await put(60.0, "one")
    assert (first["applied"], first["duplicate"], first["journal_sequence"]) == (True, False, 1)
    # Also where it is in force, as after an answer that was lost.
    with capture_logs() as logs:
        for _ in range(2):
            again = await put(60.0, "one")
            assert (again["applied"], again["duplicate"]) == (True, True)
            assert (again["changes"], again["journal_sequence"]) == ([], 1)
            assert (await put(70.0, "two"))["journal_sequence"] == 2
    assert (await _described(client))["range_sigma_m"] == 70.0
    # One that changed nothing does not undo a later one either.
    assert (await put(70.0, "three"))["journal_sequence"] == 3
    await put(80.0, "four")
    assert (await put(70.0, "three"))["duplicate"]
    assert (await _described(client))["range_sigma_m"] == 80.0
    assert len([one for one in logs if one["event"] == "sensor_changed"]) == 1


async def test_a_moved_radar_and_one_that_is_named_start_from_the_priors(
    client: httpx.AsyncClient,
) -> None:
    described = await _described(client)
    for query, values in (("", {"latitude_deg": 50.1}), ("&reset_biases=true", {})):
        answer = await client.put(f"{_OWN}?dry_run=true{query}", json=described | values)
        assert answer.json()["biases_reset"] == ["range_offset_m", "azimuth_offset_deg"], query


async def test_a_sensor_is_added(client: httpx.AsyncClient, service: FakeService) -> None:
    site = {"kind": "radar", "latitude_deg": 50.5, "longitude_deg": 15.0, "height_m": 200.0}
    answer = (await client.put("/v1/sensors/41-30", json=site)).json()
    assert (answer["added"], answer["applied"]) == (True, True)
    assert service.sensors.table.ids[-1] == "41-30"


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"range_sigma_m": -3}, "range_sigma_m: expected"),
        ({"range_sigmas_m": 3}, "range_sigma_m"),
        ({"id": "other"}, "expected 41-10, the sensor in the URL, was 'other'"),
        ({"kind": "adsb", "latitude_deg": None}, "cannot change while the service runs"),
        ({"also": ["41-20"]}, "two sensors are named 41-20"),
        ({"bias": {"range_offset_m": {"estimate": False}}}, "the estimated biases cannot change"),
        ({"latitude_deg": 1e400}, "latitude_deg: expected"),
    ],
)
async def test_a_wrong_description_is_named(
    client: httpx.AsyncClient, service: FakeService, values: dict[str, Any], text: str
) -> None:
    body = json.dumps(await _described(client) | values).replace("Infinity", "1e400")
    answer = await client.put(_OWN, content=body, headers={"content-type": "application/json"})
    assert (answer.status_code, answer.json()["code"]) == (422, "SENSOR_INVALID")
    assert text in answer.json()["detail"]
    assert service.sensor_changes == []


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"", 400), (b"[1]", 400), (b'{"kind": NaN}', 400), (b"[" * 100_000, 413),
        (b"[" * 60_000, 400), (b'{"id": 1, "id": 2}', 400), (b"\xff", 400),
        (b" " * (BODY_BYTES_MAX + 1), 413), (b"{}", 422),
    ],
)  # fmt: skip
async def test_a_body_that_is_no_description_is_rejected(
    client: httpx.AsyncClient, body: bytes, status: int
) -> None:
    answer = await client.put(_OWN, content=body, headers={"content-type": "application/json"})
    assert answer.status_code == status


@pytest.mark.parametrize("names", [[*range(7_000), 6_999], range(7_000)])
async def test_thousands_of_keys_do_not_delay_others(
    client: httpx.AsyncClient, names: Iterable[int]
) -> None:
    body = "{" + ",".join(f'"{name}":0' for name in names) + "}"
    start_s = time.process_time()
    answer = await client.put(_OWN, content=body, headers={"content-type": "application/json"})
    assert time.process_time() - start_s < 0.2
    assert (answer.status_code, answer.json()["code"]) == (400, "MALFORMED_BODY")
    assert f"expected at most {KEYS_MAX} keys" in answer.json()["detail"]


async def test_wrong_requests_are_rejected(client: httpx.AsyncClient, service: FakeService) -> None:
    described = await _described(client)
    assert (await client.put(_OWN, content=b"{}")).status_code == 415
    for path in (f"{_OWN}?dry_run=yes", f"{_OWN}?dry=true", "/v1/sensors/a%20b"):
        assert (await client.put(path, json=described)).status_code == 422, path
    assert (await client.put("/v1/sensors/..%2Fx", json=described)).status_code in (404, 405)
    for name in ("dry_run", "reset_biases"):
        answer = await client.put(f"{_OWN}?{name}=true&{name}=false", json=described)
        assert (answer.status_code, answer.json()["code"]) == (422, "INVALID_PARAMETER")
    assert service.sensor_changes == []
    missing = await client.get("/v1/sensors/99-9/configuration")
    assert (missing.status_code, missing.json()["code"]) == (404, "SENSOR_NOT_FOUND")
