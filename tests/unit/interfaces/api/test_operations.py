"""Health, readiness, counters, status, quarantine, sensors and biases."""

from typing import Any

import httpx
import polars as pl
import pytest

from multiradar.runtime.live.readiness import Reason
from multiradar.storage.entries import Quarantined, RejectedRow
from multiradar_schemas.products.bias import BIAS_SCHEMA, BiasEstimate
from support.fakes.fake_service import FakeService


def _biases(epochs: int) -> pl.DataFrame:
    rows = [
        (10.0 * epoch, "41-10", parameter, 1.5 * epoch, 0.25, epoch, 0.0005)
        for epoch in range(epochs)
        for parameter in ("range_offset_m", "azimuth_offset_deg")
    ]
    return pl.DataFrame(rows, schema=BIAS_SCHEMA, orient="row")


async def test_only_a_service_that_a_restart_helps_is_not_alive(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.reasons = (Reason("NO_DATA", "no measurements from any sensor for 75 s"),)
    assert (await client.get("/healthz")).json() == {"status": "alive"}
    service.stalled = "the engine has made no progress for 75 s (limit 60 s)"
    answer = await client.get("/healthz")
    assert (answer.status_code, answer.json()["code"]) == (503, "STALLED")
    assert answer.json()["detail"] == service.stalled


async def test_readiness_gives_all_reasons_and_the_code_of_the_first(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    assert (await client.get("/readyz")).json() == {"ready": True}
    service.reasons = (Reason("JOURNAL_FULL", "no space"), Reason("NO_DATA", "no measurement"))
    answer = await client.get("/readyz")
    assert (answer.status_code, answer.json()["code"]) == (503, "JOURNAL_FULL")
    assert answer.json()["detail"] == "no space; no measurement"
    assert answer.json()["reasons"] == [
        {"code": "JOURNAL_FULL", "reason": "no space"},
        {"code": "NO_DATA", "reason": "no measurement"},
    ]


async def test_requests_are_counted_by_route_and_never_by_path(client: httpx.AsyncClient) -> None:
    await client.get("/v1/tracks/1")
    await client.get("/v1/tracks/424242")
    await client.get("/v1/no-such-path-424242")
    await client.request("BREW", "/healthz")
    text = (await client.get("/metrics")).text
    assert 'route="/v1/tracks/{track_id}",status="200"' in text
    assert 'route="/v1/tracks/{track_id}",status="404"' in text
    assert 'multiradar_http_refusals_total{code="TRACK_NOT_FOUND"}' in text
    assert "424242" not in text
    assert "BREW" not in text


async def test_status_is_what_the_service_says(client: httpx.AsyncClient) -> None:
    assert (await client.get("/v1/status")).json() == {
        "version": "0.1.0",
        "data_time_s": None,
        "event_sequence": 0,
        "pages": {},
    }


async def test_the_quarantine_is_read_by_pages(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.quarantine = [
        Quarantined(number, 5, "http", RejectedRow(number, "OUT_OF_RANGE", "why", "{}"))
        for number in range(1, 6)
    ]
    first = (await client.get("/v1/rejects?limit=3")).json()
    second = (await client.get(f"/v1/rejects?limit=3&after={first['next_after']}")).json()
    assert [row["number"] for row in first["rejects"] + second["rejects"]] == [1, 2, 3, 4, 5]
    assert second["next_after"] is None
    assert first["rejects"][0] == {
        "number": 1,
        "journal_sequence": 5,
        "source": "http",
        "index": 1,
        "code": "OUT_OF_RANGE",
        "reason": "why",
        "raw": "{}",
    }


async def test_pages_of_the_quarantine_smaller_than_asked_for_lose_no_row(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.page_rows_max = 2
    service.quarantine = [
        Quarantined(number, 5, "http", RejectedRow(number, "OUT_OF_RANGE", "why", "{}"))
        for number in range(1, 6)
    ]
    seen: list[int] = []
    after: int | None = 0
    while after is not None:
        page = (await client.get(f"/v1/rejects?after={after}")).json()
        assert page["count"] <= 2
        seen += [row["number"] for row in page["rejects"]]
        after = page["next_after"]
    assert seen == [1, 2, 3, 4, 5]


async def test_the_quarantine_is_read_by_reason(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.quarantine = [
        Quarantined(number, 5, "http", RejectedRow(number, code, "why", "{}"))
        for number, code in enumerate(["OUT_OF_RANGE", "TIME_LATE", "OUT_OF_RANGE"], start=1)
    ]
    page = (await client.get("/v1/rejects?code=OUT_OF_RANGE")).json()
    assert [row["number"] for row in page["rejects"]] == [1, 3]
    assert (await client.get("/v1/rejects?code=NO_SUCH_REASON")).status_code == 422


async def test_sensors_are_listed_and_found_by_name(client: httpx.AsyncClient) -> None:
    listed = (await client.get("/v1/sensors")).json()
    assert listed["count"] == 1
    sensor = (await client.get("/v1/sensors/41-10")).json()
    assert sensor == listed["sensors"][0]
    # JSON has no infinity: a range without bound is absent.
    assert sensor["range_max_m"] is None


async def test_the_current_biases_are_rows_of_the_schema(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.biases = _biases(3)
    answer = (await client.get("/v1/sensors/41-10/bias")).json()
    assert answer["count"] == 2
    assert [BiasEstimate.model_validate(row).estimate for row in answer["biases"]] == [3.0, 3.0]


@pytest.mark.parametrize("limit", [1, 3, 100])
async def test_the_history_of_biases_is_read_by_pages(
    client: httpx.AsyncClient, service: FakeService, limit: int
) -> None:
    service.view.biases = _biases(5)
    seen: list[dict[str, Any]] = []
    parameters = {"history": "true", "limit": str(limit)}
    while True:
        page = (await client.get("/v1/sensors/41-10/bias", params=parameters)).json()
        seen += page["biases"]
        if page["next_cursor"] is None:
            break
        parameters["cursor"] = page["next_cursor"]
    assert seen == service.view.biases.to_dicts()


async def test_pages_of_biases_smaller_than_asked_for_lose_no_row(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.page_rows_max = 3
    service.view.biases = _biases(5)
    page = (await client.get("/v1/sensors/41-10/bias?history=true")).json()
    assert page["count"] == 3
    assert page["next_cursor"] is not None


async def test_the_history_of_biases_begins_at_since(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.biases = _biases(5)
    answer = await client.get("/v1/sensors/41-10/bias?history=true&since=30")
    assert [row["epoch"] for row in answer.json()["biases"]] == [3, 3, 4, 4]


async def test_with_until_biases_are_the_last_ones_up_to_it(
    client: httpx.AsyncClient, service: FakeService
) -> None:
    service.view.biases = _biases(5)
    for asked, expected in (("until=30", [2, 2, 3, 3]), ("until=39&since=30", [3, 3])):
        answer = await client.get(f"/v1/sensors/41-10/bias?history=true&limit=4&{asked}")
        assert [row["epoch"] for row in answer.json()["biases"]] == expected
        assert answer.json()["next_cursor"] is None
