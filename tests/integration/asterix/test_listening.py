"""ASTERIX over UDP on loopback: multicast in, tracks over REST, every octet in a count."""

import socket
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import httpx
import pytest

from multiradar.app import Application
from multiradar.settings import load_settings
from support import asterix_scene, live_scene

GROUP = "239.192.77.1"
TURNS = 12


@pytest.fixture
def serving(tmp_path: Path) -> Iterator[Callable[..., Application]]:
    """Start the application with listeners; stop it at the end."""
    started: list[Application] = []

    def serve(*listen: dict[str, Any], **asterix: Any) -> Application:
        settings = load_settings(
            None,
            {
                "server": {"port": 0},
                "journal": {"path": tmp_path / "journal.sqlite"},
                "zenoh": {"enabled": False},
                "asterix": {"listen": list(listen), **asterix},
            },
        )
        application = Application(settings, live_scene.sensors(), lambda: None)
        started.append(application)
        application.start()
        return application

    yield serve
    for application in started:
        application.stop()


def sender() -> socket.socket:
    """Return a socket whose groups are those of loopback."""
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
    return made


def address(endpoint: str) -> tuple[str, int]:
    host, _, port = endpoint.removeprefix("udp/").partition(":")
    return host, int(port)


def status(application: Application) -> dict[str, Any]:
    found: dict[str, Any] = httpx.get(f"{application.http_url}/v1/status").raise_for_status().json()
    return found


def settled(application: Application, octets: int) -> dict[str, Any]:
    """Wait until so many octets were heard and all of them have become something."""
    for _ in range(300):
        document = status(application)
        heard = document["asterix"]["listeners"].values()
        became = sum(
            one[f"octets_{name}"]
            for one in heard
            for name in ("decoded", "skipped", "quarantined", "dropped")
        )
        rows = sum(one["rows_accepted"] + one["rows_rejected"] for one in heard)
        if became == octets and rows == sum(one["records_measurement"] for one in heard):
            application.service.settled().result(30)
            return status(application)
        time.sleep(0.05)
    raise AssertionError(document)


def test_tracks_appear_from_multicast_and_every_octet_is_counted(
    serving: Callable[..., Application],
) -> None:
    application = serving({"name": "group", "address": GROUP, "port": 0})
    whole = asterix_scene.datagrams(time.time() - 4.0 * (TURNS + 1), TURNS)
    bad = b"\x30\x00\x09\xff\xff"
    with sender() as out:
        for _, octets in whole:
            out.sendto(octets, address(application.asterix_endpoints[0]))
        out.sendto(bad, address(application.asterix_endpoints[0]))
    count = sum(len(octets) for _, octets in whole)
    document = settled(application, count + len(bad))
    heard = document["asterix"]["listeners"]["group"]
    assert heard["octets"] == heard["octets_decoded"] + heard["octets_quarantined"]
    assert heard["octets_quarantined"] == len(bad)
    assert heard["records_measurement"] == asterix_scene.records(TURNS) == heard["rows_accepted"]
    assert document["accepted"] == asterix_scene.records(TURNS)
    application.service.flush(source="test").result(30)
    application.service.settled().result(30)
    answer = httpx.get(f"{application.http_url}/v1/tracks").raise_for_status().json()
    confirmed = [one for one in answer["tracks"] if one["state"] == "confirmed"]
    assert {one["mode_s_address"] for one in confirmed} == asterix_scene.addresses()
    assert len(answer["tracks"]) == asterix_scene.AIRCRAFT
    (refused,) = httpx.get(f"{application.http_url}/v1/rejects").json()["rejects"]
    assert (refused["source"], refused["code"]) == ("asterix:group", "MALFORMED_BLOCK")
    assert refused["raw"] == bad.hex()
    assert refused["reason"].startswith(f"group, datagram {len(whole) + 1}, octet 0: ")
    metrics = httpx.get(f"{application.http_url}/metrics").text
    line = 'multiradar_asterix_octets_total{listener="group",result="quarantined"}'
    assert f"{line} {len(bad):.1f}" in metrics
