"""What can be asked over Zenoh: tracks, biases, forecasts, status, what follows a number."""

import json
from collections.abc import Iterator
from typing import Any

import httpx
import pytest
import zenoh

from multiradar.api.factory import create_api
from multiradar.ingest.zenoh import queries
from multiradar.ingest.zenoh.gateway import ZenohGateway
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.runtime.live.service import Service
from multiradar.runtime.queries.parameters import (
    HORIZON_DEFAULT_S,
    PROBABILITY_DEFAULT,
    STEP_DEFAULT_S,
)
from multiradar.runtime.queries.registry import QUERIES, Query
from support.processes.live_process import live_service
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.processes.zenoh_subscriber import client_config
from support.scenarios import asked
from support.scenarios.live_scene import recording
from support.scenarios.zenoh_scene import free_endpoint


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    running = live_service(tmp_path_factory.mktemp("journal") / "journal.sqlite")
    running.start()
    running.submit(recording(600), source="test").result(WAIT_TIMEOUT_S)
    running.flush(source="test").result(WAIT_TIMEOUT_S)
    running.settled().result(WAIT_TIMEOUT_S)
    yield running
    running.stop()


@pytest.fixture(scope="module")
def session(service: Service) -> Iterator[zenoh.Session]:
    gateway = ZenohGateway(service, ZenohOptions(listen=(free_endpoint(),)))
    gateway.start()
    updates = service.view.status()["output_sequence"]
    wait_until(
        lambda: gateway.counts.number("published_tracks") >= updates, f"{updates} published tracks"
    )
    with zenoh.open(client_config(gateway.endpoints[0])) as opened:
        yield opened
    gateway.stop()


def answers(session: zenoh.Session, selector: str) -> list[tuple[str, Any, str]]:
    """Key, document and attachment of each answer; the key of an error is empty."""
    found = []
    for reply in session.get(
        selector, timeout=WAIT_TIMEOUT_S, consolidation=zenoh.ConsolidationMode.NONE
    ):
        if reply.ok is not None:
            attached = reply.ok.attachment
            text = "" if attached is None else attached.to_string()
            found.append((str(reply.ok.key_expr), json.loads(reply.ok.payload.to_bytes()), text))
        elif reply.err is not None:
            found.append(("", json.loads(reply.err.payload.to_bytes()), ""))
    return found


def test_the_live_tracks_can_be_asked_for_at_once_or_one_by_one(
    session: zenoh.Session, service: Service
) -> None:
    live = service.view.tracks()
    every = answers(session, "multiradar/v1/tracks/*")
    assert {key for key, _, _ in every} == {
        f"multiradar/v1/tracks/{track}" for track in live["track_id"]
    }
    track = int(live["track_id"][0])
    ((key, document, attachment),) = answers(session, f"multiradar/v1/tracks/{track}")
    assert key == f"multiradar/v1/tracks/{track}"
    assert document["track_id"] == track
    assert attachment == str(document["sequence"])


def test_a_query_with_a_number_gets_the_following_updates(
    session: zenoh.Session, service: Service
) -> None:
    updates = service.view.status()["output_sequence"]
    following = answers(session, f"multiradar/v1/tracks/*?after={updates - 20}")
    numbers = [document["sequence"] for _, document, _ in following]
    assert numbers == list(range(updates - 19, updates + 1))
    assert [attachment for _, _, attachment in following] == [str(one) for one in numbers]
    some = answers(session, "multiradar/v1/tracks/*?after=0;limit=7")
    assert [document["sequence"] for _, document, _ in some] == list(range(1, 8))
    assert answers(session, f"multiradar/v1/tracks/*?after={updates}") == []
    track = following[-1][1]["track_id"]
    own = answers(session, f"multiradar/v1/tracks/{track}?after=0")
    assert own
    assert {document["track_id"] for _, document, _ in own} == {track}
    # The first update of the last track follows those of others.
    newest = max(service.view.tracks()["track_id"])
    ((_, first, _),) = answers(session, f"multiradar/v1/tracks/{newest}?after=0;limit=1")
    assert first["track_id"] == newest
    assert first["sequence"] > 1


@pytest.mark.parametrize("selector", ["after=0", "after=0;limit=7"])
def test_the_updates_in_one_answer_are_bounded(
    session: zenoh.Session, monkeypatch: pytest.MonkeyPatch, selector: str
) -> None:
    monkeypatch.setattr(queries, "CATCH_UP_LIMIT", 5)
    found = answers(session, f"multiradar/v1/tracks/*?{selector}")
    assert [document["sequence"] for _, document, _ in found] == [1, 2, 3, 4, 5]


def test_a_forecast_has_a_covariance_that_grows(session: zenoh.Session, service: Service) -> None:
    track = int(service.view.tracks()["track_id"][0])
    selector = f"multiradar/v1/forecasts/{track}?horizon_s=60;step_s=20"
    ((key, document, _),) = answers(session, selector)
    assert key == f"multiradar/v1/forecasts/{track}"
    points = document["points"]
    assert len(points) == 4
    sigmas = [point["position_sigma_m"] for point in points]
    assert sigmas == sorted(sigmas)
    assert sigmas[0] < sigmas[-1]


def test_a_forecast_without_parameters_is_that_of_http(
    session: zenoh.Session, service: Service
) -> None:
    track = int(service.view.tracks()["track_id"][0])
    ((_, document, _),) = answers(session, f"multiradar/v1/forecasts/{track}")
    known = asked.forecast(service.view, track, HORIZON_DEFAULT_S, STEP_DEFAULT_S)
    assert known is not None
    assert (document["probability"], document["by"]) == (PROBABILITY_DEFAULT, "filter")
    assert document["points"] == json.loads(json.dumps(known))


def test_a_region_of_another_probability_is_that_of_http(
    session: zenoh.Session, service: Service
) -> None:
    track = int(service.view.tracks()["track_id"][0])
    selector = f"multiradar/v1/forecasts/{track}?horizon_s=60;probability=0.5;by=filter"
    ((_, document, _),) = answers(session, selector)
    known = asked.forecast(service.view, track, 60.0, STEP_DEFAULT_S, 0.5)
    assert document["points"] == json.loads(json.dumps(known))


def test_biases_of_one_sensor_and_of_all(session: zenoh.Session, service: Service) -> None:
    ((_, biases, _),) = answers(session, "multiradar/v1/biases/41-10")
    assert biases == json.loads(json.dumps(asked.biases(service.view, "41-10")))
    assert {bias["parameter"] for bias in biases} >= {"range_offset_m", "azimuth_offset_deg"}
    every = answers(session, "multiradar/v1/biases/*")
    assert {key.rpartition("/")[2] for key, _, _ in every} == {"41-10", "41-20", "adsb"}


def test_a_sensor_is_published_as_over_http(session: zenoh.Session, service: Service) -> None:
    known = {sensor["id"]: sensor for sensor in service.view.sensors()}
    every = {key: found for key, found, _ in answers(session, "multiradar/v1/sensors/*")}
    assert set(every) == {f"multiradar/v1/sensors/{name}" for name in known}
    radar = every["multiradar/v1/sensors/41-10"]
    assert radar["updates"] == known["41-10"]["updates"]
    assert radar["health"] == known["41-10"]["health"]
    assert radar["health"]["alarms"] == ""
    ((_, alone, _),) = answers(session, "multiradar/v1/sensors/41-10")
    assert alone["health"] == radar["health"]


def test_the_status_agrees_with_the_service(session: zenoh.Session, service: Service) -> None:
    ((_, status, _),) = answers(session, "multiradar/v1/status")
    known = service.view.status()
    assert status["output_sha256"] == known["output_sha256"]
    assert status["read"] == known["read"] == 600
    assert status["zenoh"]["handler_errors"] == 0


@pytest.mark.parametrize(
    ("selector", "code"),
    [
        ("multiradar/v1/tracks/999999", "NOT_FOUND"),
        ("multiradar/v1/tracks/abc", "OUT_OF_RANGE"),
        ("multiradar/v1/tracks/1?after=x", "NOT_A_NUMBER"),
        ("multiradar/v1/tracks/*?befor=7", "UNKNOWN_PARAMETER"),
        ("multiradar/v1/biases/41-10?after=7", "UNKNOWN_PARAMETER"),
        ("multiradar/v1/forecasts/1?horizon=60", "UNKNOWN_PARAMETER"),
        ("multiradar/v1/status?x", "UNKNOWN_PARAMETER"),
        ("multiradar/v1/forecasts/999999", "NOT_FOUND"),
        ("multiradar/v1/forecasts/1?horizon_s=nan", "NOT_A_NUMBER"),
        ("multiradar/v1/forecasts/1?horizon_s=1_0", "NOT_A_NUMBER"),
        ("multiradar/v1/forecasts/1?horizon_s= 10", "NOT_A_NUMBER"),
        ("multiradar/v1/forecasts/1?horizon_s=-5", "OUT_OF_RANGE"),
        ("multiradar/v1/forecasts/1?probability=1", "OUT_OF_RANGE"),
        ("multiradar/v1/forecasts/1?by=magic", "OUT_OF_RANGE"),
        ("multiradar/v1/forecasts/1?horizon_s=1e9;step_s=1", "OUT_OF_RANGE"),
        ("multiradar/v1/forecasts/1?horizon_s=1e5;step_s=1e4", "OUT_OF_RANGE"),
        ("multiradar/v1/forecasts/1?horizon_s=1e200;step_s=1e199", "OUT_OF_RANGE"),
        ("multiradar/v1/forecasts/1?horizon_s=60;horizon_s=30", "INVALID_PARAMETER"),
        ("multiradar/v1/tracks/*?after=7;limit=1;after=7", "INVALID_PARAMETER"),
        ("multiradar/v1/measurements/*?flush;flush", "INVALID_PARAMETER"),
        ("multiradar/v1/status?x;x", "UNKNOWN_PARAMETER"),
        ("multiradar/v1/biases/unlisted", "NOT_FOUND"),
        ("multiradar/v1/sensors/unlisted", "NOT_FOUND"),
    ],
)
def test_what_cannot_be_answered_is_an_error_with_a_code(
    session: zenoh.Session, selector: str, code: str
) -> None:
    ((key, document, _),) = answers(session, selector)
    assert (key, document["code"]) == ("", code)
    assert document["reason"]


@pytest.mark.parametrize("query", [pytest.param(one, id=one.name) for one in QUERIES])
async def test_every_query_answers_as_over_http(
    session: zenoh.Session, service: Service, query: Query
) -> None:
    """What is declared once is served by both, with the same numbers or the same code."""
    track = int(service.view.tracks()["track_id"][0])
    of_track = (f"/v1/tracks/{track}/{query.name}", f"{query.plural}/{track}")
    path, key = of_track if query.of_track else (f"/v1/{query.name}", query.plural)
    transport = httpx.ASGITransport(create_api(service))
    async with httpx.AsyncClient(transport=transport, base_url="http://127.0.0.1") as client:
        http = (await client.get(path)).json()
    (reply,) = session.get(f"multiradar/v1/{key}", timeout=WAIT_TIMEOUT_S)
    answer = reply.ok or reply.err
    assert answer is not None
    document = json.loads(answer.payload.to_bytes())
    if reply.ok:
        assert document == http
    else:
        assert document["code"] == http["code"]
