"""Feeds over real sockets on loopback: receivers that are killed, restarted, slow and hostile."""

import gzip
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from multiradar.app import Application
from multiradar.errors import ConfigurationError
from multiradar.settings.service import load_settings
from multiradar.wire import sensor_table
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile
from support.asterix.octets import block, record, time_of_day
from support.processes import clients
from support.processes.receivers import Receiver, connected, snapshot_server
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.scenarios import feeds
from support.scenarios.feeds import aircraft, base_station, readsb_line, snapshot

SENSORS = SensorsFile(
    sensor=tuple(
        Sensor.model_validate(
            {"id": one, "kind": "adsb", "latitude_deg": 47.0, "longitude_deg": 8.5}
        )
        for one in ("adsb", "0-1")
    )
)
Serve = Callable[..., Application]
JSON = {"Content-Type": "application/json"}


@pytest.fixture
def serving(tmp_path: Path) -> Iterator[Serve]:
    """Start the application with feeds; stop it at the end."""
    started: list[Application] = []

    def serve(*source: dict[str, Any], **sections: Any) -> Application:
        settings = load_settings(
            None,
            {
                "server": {"port": 0},
                "journal": {"path": tmp_path / "journal.sqlite"},
                "zenoh": {"enabled": False},
                "feeds": {
                    "source": list(source), "reconnect_min_s": 0.01, "reconnect_max_s": 0.05,
                    "batch_interval_s": 0.01,
                },
                "tracking": {"reorder_horizon_s": 30.0},
            } | sections,
        )  # fmt: skip
        application = Application(settings, sensor_table(SENSORS), lambda: None)
        started.append(application)
        application.start()
        return application

    yield serve
    for application in started:
        application.stop()


@pytest.fixture
def now_s(monkeypatch: pytest.MonkeyPatch) -> float:
    """Return the time, which is also that of the messages."""
    now = round(time.time(), 1)
    monkeypatch.setattr(feeds, "BEGIN_S", now)
    return now


def status(application: Application) -> dict[str, Any]:
    found: dict[str, Any] = (
        clients.get(f"{application.http_url}/v1/status").raise_for_status().json()
    )
    return found


def settled(application: Application, name: str, **numbers: int) -> dict[str, Any]:
    """Wait for counters of a feed; check that everything is accounted for."""

    def source() -> dict[str, Any]:
        found: dict[str, Any] = status(application)["feeds"]["sources"][name]
        return found

    wait_until(
        lambda: all(source()[counter] >= number for counter, number in numbers.items()),
        f"{numbers} of {name}",
    )
    found = source()
    parts = ("accepted", "rejected", "duplicate")
    assert found["reports_read"] == sum(found[f"reports_{part}"] for part in parts)
    return found


def endpoint_port(application: Application, place: int = 0) -> int:
    return int(application.feed_endpoints[place].rpartition(":")[2])


def test_a_receiver_is_killed_and_restarted_and_its_tracks_go_on(
    serving: Serve, now_s: float
) -> None:
    receiver = Receiver()
    application = serving({"name": "roof", "url": f"tcp://127.0.0.1:{receiver.port}"})
    receiver.accept()
    receiver.send(*(readsb_line(s - 20.0) for s in range(8)), readsb_line(-12.0)[:40])
    settled(application, "roof", rows_accepted=8)
    port = receiver.port
    receiver.kill()
    # Several attempts find no server.
    faults = settled(application, "roof", reports_rejected=1)["connection_faults"]
    found = settled(application, "roof", connection_faults=faults + 3)
    assert found["state"] == "waiting"
    assert "refused" in found["last_error"]
    receiver = Receiver(port)
    receiver.accept()
    text = b"".join(readsb_line(s - 12.0) for s in range(10))
    receiver.send(*(text[k : k + 1] for k in range(len(text))))
    found = settled(application, "roof", rows_accepted=18)
    assert (found["state"], found["connections"]) == ("connected", 2)
    assert found["rejected_by_code"] == {"TRUNCATED": 1}
    assert found["last_received_s"] == pytest.approx(now_s, abs=WAIT_TIMEOUT_S)
    application.service.flush(source="test").result(WAIT_TIMEOUT_S)
    application.service.settled().result(WAIT_TIMEOUT_S)
    (track,) = clients.get(f"{application.http_url}/v1/tracks").json()["tracks"]
    assert (track["mode_s_address"], track["callsign"]) == ("3c6444", "DLH8JW")
    assert track["state"] == "confirmed"
    assert track["heading_deg"] == pytest.approx(0.0, abs=1.0)
    (reject,) = clients.get(f"{application.http_url}/v1/rejects").json()["rejects"]
    assert (reject["source"], reject["code"]) == ("feeds/roof", "TRUNCATED")
    metrics = clients.get(f"{application.http_url}/metrics").text
    assert 'multiradar_feed_reports_total{feed="roof",result="accepted"} 18.0' in metrics
    assert 'multiradar_feed_connected{feed="roof"} 1.0' in metrics
    receiver.kill()


def test_a_receiver_may_connect_to_us_on_loopback(serving: Serve, now_s: float) -> None:
    application = serving({"name": "push", "url": "listen://127.0.0.1:0"})
    assert settled(application, "push")["state"] in ("starting", "waiting")
    for turn in range(2):
        with connected(endpoint_port(application)) as client:
            client.sendall(b"".join(base_station(s - 20.0 + 5 * turn) for s in range(5)))
            settled(application, "push", rows_accepted=5 * (turn + 1))
    found = settled(application, "push", connection_faults=2)
    assert found["last_error"] == "the connection was closed by the peer"
    assert now_s > 0.0


def test_a_line_of_100_mb_is_one_reject(serving: Serve, now_s: float) -> None:
    receiver = Receiver()
    application = serving({"name": "bad", "url": f"tcp://127.0.0.1:{receiver.port}"})
    receiver.accept()
    receiver.send(*[b"x" * (1 << 20)] * 100, b"\n", readsb_line(-1.0))
    found = settled(application, "bad", rows_accepted=1)
    assert found["rejected_by_code"] == {"TOO_LARGE": 1}
    assert found["octets"] > 100 << 20
    # One without an end is as harmless.
    receiver.send(*[b"{" * (1 << 20)] * 4)
    receiver.drop()
    found = settled(application, "bad", reports_rejected=2)
    assert found["rejected_by_code"] == {"TOO_LARGE": 1, "TRUNCATED": 1}
    receiver.kill()
    assert now_s > 0.0


def test_snapshots_are_requested_again_and_again_and_errors_survived(
    serving: Serve, now_s: float
) -> None:
    def text(second: float) -> bytes:
        return snapshot(second, [aircraft(second), {"hex": "4ca8d1", "type": "mode_s"}])

    answers = [
        (404, {}, b"not found"),
        (302, {"Location": "http://192.0.2.1/"}, b""),
        (200, JSON, text(-9.0)),
        (200, JSON | {"Content-Encoding": "gzip"}, gzip.compress(text(-8.0))),
        (200, JSON | {"Content-Encoding": "gzip"}, b"\x1f\x8bnot gzip"),
        (500, {}, b""),
        (200, JSON, b"<html>no snapshot</html>"),
        (200, JSON, text(-7.0)),
    ]
    with snapshot_server(*answers) as server:
        url = f"http://127.0.0.1:{server.port}/tar1090/data/aircraft.json"
        application = serving({"name": "web", "url": url, "interval_s": 0.1})
        found = settled(application, "web", rows_accepted=3, reports_duplicate=2)
    assert set(server.paths) == {"/tar1090/data/aircraft.json"}
    assert found["connection_faults"] == 4
    assert found["reports_rejected"] == 1
    assert found["messages_without_position"] >= 3
    assert now_s > 0.0


def test_a_file_of_readsb_is_read_when_it_changes(
    serving: Serve, now_s: float, tmp_path: Path
) -> None:
    path = tmp_path / "aircraft.json"
    application = serving({"name": "file", "url": path.as_uri(), "interval_s": 0.1})
    assert "No such file" in settled(application, "file", connection_faults=2)["last_error"]
    for turn in range(3):
        written = tmp_path / "new"
        written.write_bytes(snapshot(turn - 9.0, [aircraft(turn - 9.0)]))
        written.rename(path)
        settled(application, "file", rows_accepted=turn + 1)
    assert settled(application, "file")["reports_read"] == 3
    assert now_s > 0.0


def cat021(time_s: float, latitude: float) -> bytes:
    """Return a block as readsb writes it: source 0-1, positions of 180 / 2**23 degrees."""
    moment = time_of_day(time_s % 86_400.0)
    position = "".join(f"{round(one / (180 / 2**23)):06x}" for one in (latitude, 8.5))
    # Source, descriptor, position, address, time of reception, quality, flight level, time of
    # transmission, category of the emitter.
    items = [(1, "0001"), (2, "00"), (6, position), (11, "3c6444"), (12, moment), (17, "00"),
             (21, "0578"), (28, moment), (30, "00")]  # fmt: skip
    return block(21, record(*items))


def test_category_021_of_readsb_over_tcp(serving: Serve, now_s: float) -> None:
    receiver = Receiver()
    url = f"tcp://127.0.0.1:{receiver.port}"
    asterix = {"connect": [{"name": "readsb", "url": url}], "batch_interval_s": 0.01}
    application = serving(asterix=asterix, feeds={"reconnect_min_s": 0.01})

    def heard(**numbers: int) -> dict[str, Any]:
        def listener() -> dict[str, Any]:
            found: dict[str, Any] = status(application)["asterix"]["listeners"]["readsb"]
            return found

        wait_until(lambda: all(listener()[name] >= k for name, k in numbers.items()), f"{numbers}")
        return listener()

    blocks = [cat021(now_s - 20.0 + s, 47.0 + 0.002 * s) for s in range(8)]
    text = [b"".join(blocks[:4]), b"".join(blocks[4:])]
    receiver.accept()
    receiver.send(*(text[0][k : k + 1] for k in range(len(text[0]))))
    assert heard(rows_accepted=4)["state"] == "connected"
    receiver.send(text[1][:20])
    heard(octets=len(text[0]))
    receiver.drop()
    # The next connection begins with a whole block.
    assert heard(octets_quarantined=20)["last_error"] == "the connection was closed by the peer"
    receiver.accept()
    receiver.send(text[1])
    heard(rows_accepted=8)
    receiver.send(b"\x15\x00\x01 no block")
    found = heard(octets_quarantined=32)
    assert found["octets"] == found["octets_decoded"] + found["octets_quarantined"]
    assert found["last_error"] == "expected ASTERIX blocks, found a block length below 3"
    receiver.kill()


def test_a_feed_needs_a_sensor_of_positions(serving: Serve) -> None:
    with pytest.raises(
        ConfigurationError, match=r"feeds.source x: .*known: 0-1, adsb\), was roof$"
    ):
        serving({"name": "x", "url": "tcp://127.0.0.1:1", "sensor": "roof"})


def test_a_port_in_use_is_reported(serving: Serve) -> None:
    receiver = Receiver()
    with pytest.raises(ConfigurationError, match=r"cannot listen"):
        serving({"url": f"listen://127.0.0.1:{receiver.port}"})
    receiver.kill()
