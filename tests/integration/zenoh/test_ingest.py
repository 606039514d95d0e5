"""Measurements over Zenoh into the real service: acknowledged on disk, counted, never silent."""

import json
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import polars as pl
import pytest
import zenoh

from multiradar.errors import QueueFullError, UnavailableError
from multiradar.ingest.replay.http import MEDIA_TYPES, Encoding, encode
from multiradar.ingest.replay.replaying import Answer
from multiradar.ingest.replay.zenoh import ZenohDestination
from multiradar.ingest.zenoh.gateway import ZenohGateway
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.runtime.live.service import Service
from support.fakes.fake_service import FakeService
from support.processes.live_process import live_service
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.processes.zenoh_subscriber import SubscriberProcess, client_config
from support.scenarios.live_scene import recording
from support.scenarios.zenoh_scene import StreamingView, free_endpoint, gateway

MEASUREMENTS = "multiradar/v1/measurements"


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    running = live_service(tmp_path / "journal.sqlite")
    running.start()
    yield running
    running.stop()


@pytest.fixture
def running(service: Service) -> Iterator[ZenohGateway]:
    gateway = ZenohGateway(service, ZenohOptions(listen=(free_endpoint(),), status_period_s=0.2))
    gateway.start()
    yield gateway
    gateway.stop()


@pytest.fixture
def client(running: ZenohGateway) -> Iterator[zenoh.Session]:
    with zenoh.open(client_config(running.endpoints[0])) as session:
        yield session


def ask(session: zenoh.Session, selector: str, **content: Any) -> tuple[str, dict[str, Any]]:
    """Return the key and document of the one answer; the key is empty for an error."""
    replies = list(session.get(selector, timeout=WAIT_TIMEOUT_S, **content))
    assert len(replies) == 1, replies
    reply = replies[0]
    if reply.ok is not None:
        return str(reply.ok.key_expr), json.loads(reply.ok.payload.to_bytes())
    assert reply.err is not None
    return "", json.loads(reply.err.payload.to_bytes())


def of_sensor(frame: pl.DataFrame, sensor_id: str) -> pl.DataFrame:
    return frame.filter(pl.col("sensor_id") == sensor_id)


def waited_for(counts: ZenohGateway, name: str, number: int) -> int:
    wait_until(lambda: counts.counts.number(name) >= number, f"{number} {name}")
    return counts.counts.number(name)


@pytest.mark.parametrize("encoding", list(Encoding))
def test_a_query_is_answered_when_its_measurements_are_in_the_journal(
    client: zenoh.Session, service: Service, encoding: Encoding
) -> None:
    rows = of_sensor(recording(300), "41-10")
    content = {"payload": encode(rows, encoding), "encoding": MEDIA_TYPES[encoding]}
    key, receipt = ask(client, f"{MEASUREMENTS}/41-10", **content, attachment="batch-1")
    assert key == f"{MEASUREMENTS}/41-10"
    assert receipt == {
        "accepted": rows.height,
        "rejected": [],
        "duplicate": False,
        "journal_sequence": 1,
    }
    assert service.view.status()["accepted"] == rows.height
    # A repeated query with the same key is not accepted again.
    _, again = ask(client, f"{MEASUREMENTS}/41-10", **content, attachment="batch-1")
    assert again == {**receipt, "duplicate": True}
    assert service.view.status()["accepted"] == rows.height


def test_a_query_lists_each_rejected_row(client: zenoh.Session) -> None:
    rows = of_sensor(recording(60), "41-10").with_columns(
        sensor_id=pl.when(pl.int_range(pl.len()) == 1).then(pl.lit("41-20")).otherwise("sensor_id")
    )
    payload = encode(rows, Encoding.JSON)
    _, receipt = ask(client, f"{MEASUREMENTS}/41-10", payload=payload, encoding="application/json")
    assert receipt["accepted"] == rows.height - 1
    assert [(row["index"], row["code"]) for row in receipt["rejected"]] == [(1, "UNKNOWN_SENSOR")]


def test_samples_are_accepted_and_tracked(
    running: ZenohGateway, client: zenoh.Session, service: Service
) -> None:
    rows = recording(400)
    for sensor_id in ("41-10", "41-20", "adsb"):
        payload = encode(of_sensor(rows, sensor_id), Encoding.ARROW)
        client.put(
            f"{MEASUREMENTS}/{sensor_id}", payload, encoding="application/vnd.apache.arrow.stream"
        )
    assert waited_for(running, "messages_taken", 3) == 3
    service.flush(source="test").result(WAIT_TIMEOUT_S)
    updates = service.settled().result(WAIT_TIMEOUT_S)
    assert updates > 100
    assert waited_for(running, "published_tracks", updates) == updates
    with SubscriberProcess(running.endpoints[0], updates) as subscriber:
        result = subscriber.result()
    assert (result["distinct"], result["greatest"]) == (updates, updates)
    assert (result["twice"], result["out_of_order"], result["mismatched"]) == (0, 0, 0)


def test_a_replay_over_zenoh_is_accepted_once(running: ZenohGateway, service: Service) -> None:
    rows = recording(200)
    destination = ZenohDestination(running.endpoints[0], "arrow")
    try:
        assert destination.send(rows, "run-0-199") == Answer(200, 0, duplicate=False)
        assert destination.send(rows, "run-0-199") == Answer(200, 0, duplicate=True)
        destination.flush("run-end")
    finally:
        destination.close()
    assert service.settled().result(WAIT_TIMEOUT_S) > 0
    assert service.view.status()["accepted"] == 200


def test_an_invalid_payload_is_counted_and_reported_on_the_status_key(
    running: ZenohGateway, client: zenoh.Session, service: Service
) -> None:
    received: list[dict[str, Any]] = []
    client.declare_subscriber(
        "multiradar/v1/status",
        lambda sample: received.append(json.loads(sample.payload.to_bytes())),
    )
    client.put(f"{MEASUREMENTS}/41-10", b"[{", encoding="application/json")
    assert waited_for(running, "messages_malformed", 1) == 1
    wait_until(
        lambda: any(status["zenoh"]["messages_malformed"] for status in received),
        "a status that counts the message",
    )
    alarm = received[-1]["zenoh"]["alarms"][-1]
    assert alarm["code"] == "MALFORMED_JSON"
    assert alarm["key"] == f"{MEASUREMENTS}/41-10"
    # As an answer to a query it is an error, and nothing was accepted.
    key, error = ask(client, f"{MEASUREMENTS}/41-10", payload=b"[{", encoding="application/json")
    assert (key, error["code"]) == ("", "MALFORMED_JSON")
    assert service.view.status()["read"] == 0


def test_a_query_without_content_is_rejected(client: zenoh.Session) -> None:
    key, error = ask(client, f"{MEASUREMENTS}/41-10")
    assert (key, error["code"]) == ("", "MISSING_FIELD")


def test_a_key_used_for_another_message_is_rejected_as_over_http(
    client: zenoh.Session, running: ZenohGateway
) -> None:
    rows = of_sensor(recording(60), "41-10")
    for part, code in ((rows[:5], None), (rows[5:], "IDEMPOTENCY_KEY_REUSED")):
        _, answer = ask(
            client,
            f"{MEASUREMENTS}/41-10",
            payload=encode(part, Encoding.JSON),
            encoding="application/json",
            attachment="batch-1",
        )
        assert answer.get("code") == code
    assert running.counts.document()["alarms"][-1]["code"] == "IDEMPOTENCY_KEY_REUSED"


def test_a_misspelt_parameter_is_rejected(client: zenoh.Session) -> None:
    _, error = ask(client, f"{MEASUREMENTS}/*?flsh")
    assert error["code"] == "UNKNOWN_PARAMETER"
    assert "flush" in error["reason"]


def test_a_full_intake_asks_queries_to_retry_and_counts_lost_samples() -> None:
    def reject(_submission: Any, _future: "Future[Any]") -> None:
        raise QueueFullError("intake", 7, 2.5)

    view = StreamingView()
    with gateway(view, FakeService(view=view, answer=reject)) as full:
        destination = ZenohDestination(full.endpoints[0], "json")
        try:
            with pytest.raises(UnavailableError) as caught:
                destination.send(recording(20), "key")
            assert caught.value.retry_after_s == 2.5
        finally:
            destination.close()
        with zenoh.open(client_config(full.endpoints[0])) as session:
            payload = encode(of_sensor(recording(20), "41-10"), Encoding.JSON)
            session.put(f"{MEASUREMENTS}/41-10", payload, encoding="application/json")
            assert waited_for(full, "messages_lost_upstream", 1) == 1
        _, status = json_status(full)
    assert status["zenoh"]["alarms"][-1]["code"] == "QUEUE_FULL"


def json_status(running: ZenohGateway) -> tuple[str, dict[str, Any]]:
    with zenoh.open(client_config(running.endpoints[0])) as session:
        return ask(session, "multiradar/v1/status")
