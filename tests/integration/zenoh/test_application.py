"""The whole application on Zenoh: its address, and events that it sends over HTTP, too."""

import itertools
import json
from pathlib import Path
from typing import Any

import pytest
import zenoh

from multiradar import app
from multiradar.app import Application
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import ZenohBus
from multiradar.settings.service import load_settings
from support.processes.clients import client, event_source
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.processes.zenoh_subscriber import client_config
from support.scenarios import live_scene
from support.scenarios.zenoh_scene import free_endpoint


def test_the_endpoints_announced_are_those_of_the_configuration_file(tmp_path: Path) -> None:
    endpoint = free_endpoint()
    file = tmp_path / "zenoh.json5"
    file.write_text(f"""{{
        mode: "peer",
        listen: {{ endpoints: ["{endpoint}"] }},
        scouting: {{ multicast: {{ enabled: false }} }},
    }}""")
    settings = {
        "server": {"port": 0},
        "journal": {"path": tmp_path / "journal.sqlite"},
        "zenoh": {"config_file": file},
    }
    application = Application(load_settings(None, settings), live_scene.sensors(), lambda: None)
    assert list(application.zenoh_endpoints) == []
    application.start()
    try:
        assert list(application.zenoh_endpoints) == [endpoint]
    finally:
        application.stop()
    assert list(application.zenoh_endpoints) == []


def test_a_change_of_a_sensor_is_one_event_over_http_and_zenoh(tmp_path: Path) -> None:
    settings = {
        "server": {"port": 0},
        "journal": {"path": tmp_path / "journal.sqlite"},
        "zenoh": {"listen": [free_endpoint()]},
    }
    application = Application(
        load_settings(None, settings), live_scene.sensors(), lambda: None,
        live_scene.sensors_file(),
    )  # fmt: skip
    application.start()
    samples: list[tuple[str, dict[str, Any]]] = []
    heard: list[str] = []
    try:
        with zenoh.open(client_config(application.zenoh_endpoints[0])) as session:

            def on_sample(sample: zenoh.Sample) -> None:
                samples.append((str(sample.key_expr), json.loads(sample.payload.to_bytes())))

            session.declare_subscriber("multiradar/v1/sensors/*", on_sample)
            # Declared later: when it receives, the service knows of both.
            session.declare_subscriber(
                "multiradar/v1/status", lambda sample: heard.append(str(sample.key_expr))
            )
            wait_until(lambda: heard, "the status")
            with client(application.http_url) as http:
                known = http.get("/v1/sensors/41-20/configuration").json()
                changed = http.put("/v1/sensors/41-20", json=known | {"enabled": False})
                assert changed.status_code == 200, changed.text
            wait_until(lambda: samples, "the event over Zenoh")
        url = f"{application.http_url}/v1/events?after=0&kinds=sensor"
        with event_source(url) as source:
            # The first block is the delay before a reconnection.
            lines = itertools.dropwhile(lambda one: not one.startswith("id"), source.iter_lines())
            event = dict(line.split(": ", 1) for line in itertools.takewhile(bool, lines))
    finally:
        application.stop()
    assert (event["id"], event["event"]) == ("1", "sensor")
    over_http = json.loads(event["data"])
    assert samples == [("multiradar/v1/sensors/41-20", over_http)]
    assert over_http["sensor_id"] == "41-20"
    assert (over_http["fields"], over_http["enabled"]) == (["enabled"], False)


def test_a_takeover_loses_nothing_while_zenoh_waits_for_its_port(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The session before closes its port up to 30 s after the journal is free."""
    # A busy machine takes longer for the part below.
    monkeypatch.setattr(app, "_LISTEN_WAIT_S", WAIT_TIMEOUT_S)
    held = ZenohBus(ZenohOptions(listen=(free_endpoint(),)))
    failed: list[bool] = []

    def built(endpoint: str) -> Application:
        settings = {
            "server": {"port": 0},
            "journal": {"path": tmp_path / "journal.sqlite", "standby": True},
            "zenoh": {"listen": [endpoint]},
            "asterix": {"listen": [{"name": "radars", "address": "127.0.0.1", "port": 0}]},
        }
        return Application(
            load_settings(None, settings), live_scene.sensors(), lambda: failed.append(True),
            live_scene.sensors_file(),
        )  # fmt: skip

    primary, standby = built(free_endpoint()), built(held.endpoints[0])
    primary.start()
    standby.start()
    try:
        primary.stop()
        wait_until(lambda: standby.asterix_endpoints or failed, "ASTERIX")
        with client(standby.http_url) as http:
            known = http.get("/v1/sensors/41-20/configuration").json()
            changed = http.put("/v1/sensors/41-20", json=known | {"enabled": False})
            assert changed.status_code == 200, changed.text
        assert not standby.zenoh_endpoints
        held.close()
        wait_until(lambda: not standby.following or failed, "Zenoh")
        assert not failed
        wait_until(lambda: standby.service.view.status()["zenoh"]["published_sensors"], "the event")
    finally:
        standby.stop()
