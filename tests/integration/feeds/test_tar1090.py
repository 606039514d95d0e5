"""`/data/aircraft.json` of a running service, asked for as tar1090 does."""

import time
from collections.abc import Callable
from pathlib import Path

import pytest

from multiradar.api.answers.aircraft import AircraftJson, ReceiverJson
from multiradar.app import Application
from multiradar.settings.service import load_settings
from multiradar.wire import sensor_table
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile
from support.processes import clients
from support.processes.receivers import Receiver
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.scenarios import feeds
from support.scenarios.feeds import aircraft, readsb_line

SITE = {"kind": "adsb", "latitude_deg": 47.0, "longitude_deg": 8.5}


@pytest.fixture
def asked(tmp_path: Path) -> Callable[[str], Application]:
    """Start the application with one feed."""

    def start(url: str) -> Application:
        settings = load_settings(
            None,
            {
                "server": {"port": 0},
                "journal": {"path": tmp_path / "journal.sqlite"},
                "zenoh": {"enabled": False},
                "feeds": {"source": [{"name": "roof", "url": url}]},
                "tracking": {"reorder_horizon_s": 30.0},
            },
        )
        sensors = SensorsFile(
            sensor=(
                Sensor.model_validate({"id": "adsb"} | SITE),
                Sensor.model_validate({"id": "mlat"} | SITE | {"kind": "mlat"}),
            )
        )
        return Application(settings, sensor_table(sensors), lambda: None)

    return start


def test_what_a_receiver_sends_is_shown_by_tar1090(
    asked: Callable[[str], Application], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(feeds, "BEGIN_S", round(time.time(), 1))
    receiver = Receiver()
    application = asked(f"tcp://127.0.0.1:{receiver.port}")
    try:
        application.start()
        site = clients.get(f"{application.http_url}/data/receiver.json?_=1").raise_for_status()
        assert ReceiverJson.model_validate_json(site.content).lat == 47.0
        url = f"{application.http_url}/data/aircraft.json?_=1700000000000"
        assert AircraftJson.model_validate_json(clients.get(url).content).aircraft == []
        receiver.accept()
        for s in range(12):
            receiver.send(
                readsb_line(s - 20.0), readsb_line(s - 20.0, hex="4ca8d1", lon=9.0, type="mlat")
            )
        counts = application.service.view.status
        wait_until(lambda: counts()["feeds"]["sources"]["roof"]["rows_accepted"] == 24, "24 rows")
        application.service.flush(source="test").result(WAIT_TIMEOUT_S)
        application.service.settled().result(WAIT_TIMEOUT_S)
        answer = clients.get(url).raise_for_status()
        assert answer.headers["content-type"] == "application/json"
        assert answer.headers["cache-control"] == "no-cache"
        shown = AircraftJson.model_validate_json(answer.content)
        assert shown.now == pytest.approx(feeds.BEGIN_S - 9.0, abs=0.01)
        found = {one.hex: one for one in shown.aircraft}
        assert {hex_: one.type for hex_, one in found.items()} == {
            "3c6444": "adsb_icao", "4ca8d1": "mlat",
        }  # fmt: skip
        one, sent = found["3c6444"], aircraft(-9.0)
        assert (one.flight, one.squawk) == (sent["flight"], sent["squawk"])
        assert one.alt_baro == pytest.approx(sent["alt_baro"], abs=25)
        assert one.gs == pytest.approx(sent["gs"], abs=5.0)
        assert (one.lat, one.lon) == pytest.approx((sent["lat"], sent["lon"]), abs=3e-4)
        assert one.messages == 12
        # The next request is answered from the same state.
        assert clients.get(url).content == answer.content
    finally:
        application.stop()
        receiver.kill()
