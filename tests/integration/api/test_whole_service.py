"""The real service behind the interface: measurements in, tracks, biases and events out."""

import gc
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from multiradar.app import Application
from multiradar.observability.metrics import exposition
from multiradar.settings.service import load_settings
from multiradar.storage.entries import RejectedRow
from multiradar.wire import sensor_table
from multiradar_compiled.ahead import compile_ahead
from multiradar_schemas.products.bias import BiasEstimate
from multiradar_schemas.products.forecast import Forecast
from multiradar_schemas.products.track import Track, TrackUpdate
from multiradar_schemas.sensors.sensor import parse_sensors
from support.processes import clients
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until

_SENSORS = """
[[sensor]]
id = "41-10"
kind = "radar"
latitude_deg = 55.0
longitude_deg = 37.0
height_m = 200.0
[[sensor]]
id = "41-11"
kind = "radar"
latitude_deg = 55.5
longitude_deg = 38.0
height_m = 150.0
"""


def _plots(start_s: float, turns: int) -> list[dict[str, Any]]:
    """Two aircraft that fly away from a radar at 200 m/s, one plot every five seconds."""
    return [
        {
            "time_s": start_s + 5.0 * turn + 0.5 * aircraft,
            "sensor_id": "41-10",
            "kind": "radar",
            "range_m": 60_000.0 + 200.0 * (start_s + 5.0 * turn - 1000.0) + 5_000.0 * aircraft,
            "azimuth_deg": 40.0 + 90.0 * aircraft,
            "height_m": 9_000.0,
            "mode_s_address": f"4840d{aircraft}",
        }
        for turn in range(turns)
        for aircraft in range(2)
    ]


def _application(folder: Path) -> Application:
    settings = load_settings(
        None,
        {
            "server": {"port": 0},
            "http": {"acknowledge_deadline_s": WAIT_TIMEOUT_S},
            "journal": {"path": folder / "journal.sqlite"},
            "zenoh": {"enabled": False},
        },
    )
    return Application(settings, sensor_table(parse_sensors(_SENSORS)), lambda: None)


def _feed(application: Application) -> None:
    with clients.client(application.http_url) as client:
        for batch in (_plots(1000.0, 10), _plots(1050.0, 10)):
            assert client.post("/v1/measurements", json=batch).json()["accepted"] == len(batch)
        # Answered when all of it is processed.
        assert client.post("/v1/flush").status_code == 200


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Application]:
    application = _application(tmp_path_factory.mktemp("service"))
    application.start()
    _feed(application)
    yield application
    application.stop()


@pytest.fixture
def client(running: Application) -> Iterator[httpx.Client]:
    with clients.client(running.http_url) as client:
        yield client


def _all_events(running: Application, after: int, last: int) -> list[dict[str, Any]]:
    url = running.http_url.replace("http", "ws") + f"/v1/stream?after={after}"
    events: list[dict[str, Any]] = []
    with clients.event_socket(url) as stream:
        while not events or events[-1]["sequence"] < last:
            events += json.loads(stream.recv(timeout=WAIT_TIMEOUT_S)).get("events", [])
    return events


def test_a_service_says_that_it_starts_before_it_compiles(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    application = _application(tmp_path)

    class AskedError(Exception):
        pass

    def ask(*_: object) -> None:
        raise AskedError(httpx.get(f"{application.http_url}/readyz", timeout=WAIT_TIMEOUT_S).text)

    monkeypatch.setattr("multiradar.app.compile_ahead", ask)
    try:
        with pytest.raises(AskedError, match="the service is starting: looking for kernels"):
            application.start()
    finally:
        application.stop()


def test_metrics_state_that_the_service_starts_or_drains(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    application = _application(tmp_path)
    scraped: dict[str, list[str]] = {}

    def scrape(step: str) -> None:
        text = clients.get(f"{application.http_url}/metrics").text
        scraped[step] = [
            line for line in text.splitlines()
            if line.startswith(("multiradar_running ", 'multiradar_unready{reason="NOT_READY"'))
        ]  # fmt: skip

    end = application.service.publication.stop

    def compiled(*given: Any) -> None:
        scrape("starting")
        compile_ahead(*given)

    def ended() -> None:
        # Called again after HTTP has stopped.
        if "draining" not in scraped:
            scrape("draining")
        end()

    monkeypatch.setattr("multiradar.app.compile_ahead", compiled)
    monkeypatch.setattr(application.service.publication, "stop", ended)
    application.start()
    scrape("running")
    application.stop()
    reason = 'multiradar_unready{reason="NOT_READY"}'
    not_ready = ["multiradar_running 0.0", f"{reason} 1.0"]
    assert scraped == {
        "starting": not_ready,
        "running": ["multiradar_running 1.0", f"{reason} 0.0"],
        "draining": not_ready,
    }
    # Another service in this process has its own.
    assert b"multiradar_running" not in exposition()
    application.stop()


def test_every_measurement_is_accounted_for(client: httpx.Client) -> None:
    status = client.get("/v1/status").json()
    assert status["state"] == "running"
    assert status["read"] == status["accepted"] + status["rejected"] + status["duplicate"]
    assert status["accepted"] == 40
    assert status["processed_sequence"] == status["journal_sequence"]
    assert client.get("/readyz").status_code == 200


def test_tracks_history_and_forecast_are_those_of_the_schemas(client: httpx.Client) -> None:
    tracks = client.get("/v1/tracks").json()["tracks"]
    assert sorted(track["mode_s_address"] for track in tracks) == ["4840d0", "4840d1"]
    for track in tracks:
        Track.model_validate(track)
        history = client.get(f"/v1/tracks/{track['track_id']}/history").json()["updates"]
        assert len(history) == 20
        assert [TrackUpdate.model_validate(row).time_s for row in history] == sorted(
            row["time_s"] for row in history
        )
        url = f"/v1/tracks/{track['track_id']}/forecast?horizon_s=60&step_s=20"
        forecast = client.get(url).json()
        points = forecast["points"]
        assert len(points) == 4
        sigmas = [point["position_sigma_m"] for point in points]
        assert sigmas == sorted(sigmas)
        Forecast.model_validate(forecast)


def test_the_biases_of_each_radar_are_served_with_their_sigma(client: httpx.Client) -> None:
    assert [one["id"] for one in client.get("/v1/sensors").json()["sensors"]] == ["41-10", "41-11"]
    now = client.get("/v1/sensors/41-10/bias").json()["biases"]
    assert {row["parameter"] for row in now} == {"range_offset_m", "azimuth_offset_deg"}
    for row in now:
        assert BiasEstimate.model_validate(row).sigma > 0.0
    history = client.get("/v1/sensors/41-10/bias?history=true&limit=3").json()
    assert (history["count"], history["next_cursor"] is not None) == (3, True)


def test_a_rejected_row_is_listed_by_its_index_and_quarantined(
    client: httpx.Client,
) -> None:
    rows = _plots(2000.0, 1)
    body = [rows[0], {**rows[0], "sensor_id": "99-1"}, {**rows[0], "range_m": -1.0}]
    answer = client.post("/v1/measurements", json=body).json()
    assert answer["accepted"] + len(answer["rejected"]) == 3
    codes = {row["index"]: row["code"] for row in answer["rejected"]}
    assert codes[1] == "UNKNOWN_SENSOR"
    assert codes[2] == "OUT_OF_RANGE"
    kept = client.get("/v1/rejects").json()["rejects"]
    assert [row["code"] for row in kept if row["index"] in (1, 2)] == [
        "UNKNOWN_SENSOR",
        "OUT_OF_RANGE",
    ]


def test_the_rows_of_an_answered_message_leave_the_memory(client: httpx.Client) -> None:
    # Valid rows of a radar with a clock decades ahead: quarantined on disk, not kept in memory.
    row = _plots(1000.0, 1)[0]
    many = [{**row, "time_s": 4e9 + at / 100.0} for at in range(3000)]

    def held() -> int:
        # Not by isinstance, which asks the objects of weak references.
        return sum(type(one) is RejectedRow for one in gc.get_objects())

    gc.collect()
    before = held()
    gc.disable()
    try:
        answer = client.post("/v1/measurements", json=many).json()
        assert [one["code"] for one in answer["rejected"]] == ["TIME_FUTURE"] * 3000
        # The newest for `/v1/rejects`.
        wait_until(lambda: held() <= before + 1100, "rejected rows released")
    finally:
        gc.enable()


def test_the_same_key_is_accepted_once_and_another_message_rejected(client: httpx.Client) -> None:
    key = {"idempotency-key": "once"}
    body = _plots(1100.0, 1)
    first = client.post("/v1/measurements", json=body, headers=key).json()
    again = client.post("/v1/measurements", json=body, headers=key).json()
    assert again == {**first, "duplicate": True}
    other = client.post("/v1/measurements", json=_plots(1105.0, 1), headers=key)
    assert (other.status_code, other.json()["code"]) == (422, "IDEMPOTENCY_KEY_REUSED")


def test_a_restart_serves_the_same_tracks_and_the_same_events(tmp_path: Path) -> None:
    first = _application(tmp_path)
    first.start()
    try:
        _feed(first)
        with clients.client(first.http_url) as client:
            before = client.get("/v1/status").json()
            tracks = client.get("/v1/tracks").content
        events = _all_events(first, 0, before["event_sequence"])
    finally:
        first.stop()
    assert [event["sequence"] for event in events] == list(range(1, before["event_sequence"] + 1))
    second = _application(tmp_path)
    second.start()
    try:
        with clients.client(second.http_url) as client:
            after = client.get("/v1/status").json()
            assert client.get("/v1/tracks").content == tracks
        middle = len(events) // 2
        assert _all_events(second, middle, len(events)) == events[middle:]
    finally:
        second.stop()
    assert after["output_sha256"] == before["output_sha256"]
