"""Encounters over HTTP, over Zenoh and of a recording are the same numbers."""

import json
from pathlib import Path
from typing import Any

import httpx
import polars as pl
import pytest
import zenoh

from multiradar.api.factory import create_api
from multiradar.ingest.zenoh.gateway import ZenohGateway
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.runtime.offline.offline_job import ENCOUNTERS_FILE, OfflineJob
from multiradar.runtime.offline.offline_run import track_recording
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.storage.recording import Recording
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.products.encounter import ENCOUNTER_SCHEMA, Encounters
from support.processes.live_process import live_service
from support.processes.waiting import WAIT_TIMEOUT_S
from support.processes.zenoh_subscriber import client_config
from support.scenarios.live_scene import recording, sensors
from support.scenarios.zenoh_scene import free_endpoint

#: After a minute and a half forecasts of ten seconds have been evaluated.
ROWS = 2400
ASKED = {"horizon_s": 90, "distance_m": 12000, "height_m": 250}
QUERY = EncounterQuery(90.0, 12_000.0, 250.0, limit=None)


async def _over_http(application: Any, **asked: Any) -> dict[str, Any]:
    transport = httpx.ASGITransport(application)
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
        answer = await client.get("/v1/encounters", params=asked)
        assert answer.status_code == 200, answer.text
        found: dict[str, Any] = answer.json()
        return found


def _over_zenoh(session: zenoh.Session, selector: str) -> dict[str, Any]:
    (reply,) = session.get(f"multiradar/v1/encounters{selector}", timeout=WAIT_TIMEOUT_S)
    answer = reply.ok or reply.err
    assert answer is not None
    found: dict[str, Any] = json.loads(answer.payload.to_bytes())
    return found


@pytest.mark.parametrize("batch_rows", [8192, 97])
async def test_http_zenoh_and_offline_agree(tmp_path: Path, batch_rows: int) -> None:
    frame = recording(ROWS)
    frame.write_parquet(tmp_path / "measurements.parquet")
    (tmp_path / "out").mkdir()
    job = OfflineJob(
        Recording(tmp_path / "measurements.parquet"), sensors(), TrackingSettings(),
        batch_rows=batch_rows, encounters=QUERY,
    )  # fmt: skip
    result = track_recording(job, tmp_path / "out")
    table = pl.read_parquet(tmp_path / "out" / ENCOUNTERS_FILE)
    assert dict(table.schema) == dict(ENCOUNTER_SCHEMA)
    assert result.window_rows[ENCOUNTERS_FILE] == len(table)
    assert table["time_s"].n_unique() == 30, "one picture for each epoch of 4 s of 120 s"
    last = table.filter(pl.col("time_s") == table["time_s"].max())

    service = live_service(tmp_path / "state" / "journal.sqlite")
    service.start()
    gateway = ZenohGateway(service, ZenohOptions(listen=(free_endpoint(),)))
    gateway.start()
    try:
        service.submit(frame, source="test").result(WAIT_TIMEOUT_S)
        service.flush(source="test").result(WAIT_TIMEOUT_S)
        service.settled().result(WAIT_TIMEOUT_S)
        http = await _over_http(create_api(service), **ASKED)
        with zenoh.open(client_config(gateway.endpoints[0])) as session:
            selector = "?" + ";".join(f"{name}={value}" for name, value in ASKED.items())
            assert _over_zenoh(session, selector) == http
            error = _over_zenoh(session, "?horizon_s=601")
            assert error["code"] == "OUT_OF_RANGE"
            assert _over_zenoh(session, "?order=distance")["code"] == "OUT_OF_RANGE"
            assert _over_zenoh(session, "?limit=0")["code"] == "OUT_OF_RANGE"
            assert _over_zenoh(session, "?range_m=5")["code"] == "UNKNOWN_PARAMETER"
    finally:
        gateway.stop()
        service.stop()
    assert Encounters.model_validate(http).count == http["total"] > 5
    assert last.to_dicts() == http["encounters"]
