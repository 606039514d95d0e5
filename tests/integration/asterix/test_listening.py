"""ASTERIX over UDP on loopback: multicast in, tracks over REST, every octet in a count."""

import json
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from multiradar.app import Application
from multiradar.cli.main import EXIT_DONE, EXIT_FAILED, EXIT_USAGE, run
from multiradar.errors import ConfigurationError
from multiradar.settings.service import load_settings
from support.asterix import scene as asterix_scene
from support.asterix.listening import address, sender, settled
from support.asterix.octets import block, datagram, pcap, plot_048
from support.processes import clients
from support.processes.waiting import WAIT_TIMEOUT_S
from support.scenarios import live_scene

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
    application.service.flush(source="test").result(WAIT_TIMEOUT_S)
    application.service.settled().result(WAIT_TIMEOUT_S)
    answer = clients.get(f"{application.http_url}/v1/tracks").raise_for_status().json()
    confirmed = [one for one in answer["tracks"] if one["state"] == "confirmed"]
    assert {one["mode_s_address"] for one in confirmed} == asterix_scene.addresses()
    assert len(answer["tracks"]) == asterix_scene.AIRCRAFT
    (reject,) = clients.get(f"{application.http_url}/v1/rejects").json()["rejects"]
    assert (reject["source"], reject["code"]) == ("asterix/group", "MALFORMED_BLOCK")
    assert reject["raw"] == bad.hex()
    assert reject["reason"].startswith(f"group, datagram {len(whole) + 1}, octet 0: ")
    metrics = clients.get(f"{application.http_url}/metrics").text
    line = 'multiradar_asterix_octets_total{listener="group",result="quarantined"}'
    assert f"{line} {len(bad):.1f}" in metrics


def test_a_recording_is_sent_with_present_times(
    serving: Callable[..., Application], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """It was recorded over midnight, long ago."""
    recording = tmp_path / "recording.pcap"
    whole = asterix_scene.datagrams(1_000_080_000.0 - 20.0, TURNS)
    recording.write_bytes(pcap((when, datagram(octets)) for when, octets in whole))
    application = serving({"address": "127.0.0.1", "port": 0})
    host, port = address(application.asterix_endpoints[0])
    command = ["replay", str(recording), "--to", f"udp:{host}:{port}", "--times", "now"]
    capsys.readouterr()
    started_s = time.time()
    assert run([*command, "--speed", "max", "--json"]) == EXIT_DONE
    octets = sum(len(one) for _, one in whole)
    assert json.loads(capsys.readouterr().out) == {
        "datagrams": len(whole),
        "octets": octets,
        "octets_left_out": 0,
    }
    document = settled(application, octets)
    assert document["accepted"] == asterix_scene.records(TURNS)
    assert document["rejected"] == 0
    assert started_s - 60.0 < document["data_time_s"] < time.time()
    assert document["tracks"] == asterix_scene.AIRCRAFT


def test_a_replayed_recording_is_rejected_for_its_time(
    serving: Callable[..., Application], tmp_path: Path
) -> None:
    recording = tmp_path / "recording.ast"
    half_a_day_ago_s = (time.time() - 43_200.0) % 86_400.0
    recording.write_bytes(block(48, plot_048(half_a_day_ago_s, source="290a")))
    application = serving({"port": 0})
    host, port = address(application.asterix_endpoints[0])
    assert run(["replay", str(recording), "--to", f"udp:{host}:{port}"]) == EXIT_DONE
    settled(application, len(recording.read_bytes()))
    (reject,) = clients.get(f"{application.http_url}/v1/rejects").json()["rejects"]
    assert "a time of day more than 3600 s before reception" in reject["reason"]


@pytest.mark.parametrize(
    "content",
    [b"", b"\x30", bytes(65_507), b"\xff" * 65_507, b"\x30\x00\x20" + bytes(9)],
    ids=("empty", "one octet", "64 KB of nothing", "64 KB of ones", "cut"),
)
def test_a_hostile_datagram_is_quarantined_and_the_next_one_is_read(
    serving: Callable[..., Application], content: bytes
) -> None:
    application = serving({"name": "one", "port": 0})
    good = block(48, plot_048((time.time() - 1.0) % 86_400.0, source="290a"))
    with sender() as out:
        for octets in (content, good):
            out.sendto(octets, address(application.asterix_endpoints[0]))
        document = settled(application, len(content) + len(good))
    heard = document["asterix"]["listeners"]["one"]
    assert (heard["datagrams"], heard["rows_accepted"]) == (2, 1)
    assert heard["octets_quarantined"] == len(content)
    (reject,) = clients.get(f"{application.http_url}/v1/rejects").json()["rejects"]
    assert reject["reason"].startswith("one, datagram 1, octet 0: ")
    # Of long ones the beginning is kept.
    assert content.startswith(bytes.fromhex(reject["raw"].partition("…")[0]))


@pytest.mark.fault(8, 20)
def test_forged_times_of_one_radar_cost_the_other_nothing(
    serving: Callable[..., Application],
) -> None:
    """A datagram names its radar, and anyone on the network of the radars may send it."""
    application = serving({"name": "group", "address": GROUP, "port": 0})
    now_s, forged = time.time(), 0
    whole = asterix_scene.datagrams(now_s - 4.0 * (TURNS + 1), TURNS)
    with sender() as out:
        for number, (_, octets) in enumerate(whole):
            # Almost a minute ahead, as far as a measurement may be ahead of this machine.
            times = [(now_s + 50.0 + 0.1 * number + 0.02 * one) % 86_400.0 for one in range(5)]
            false = block(48, *[plot_048(one, source="290a") for one in times])
            for one in (false, octets):
                out.sendto(one, address(application.asterix_endpoints[0]))
            forged += len(false)
    document = settled(application, forged + sum(len(octets) for _, octets in whole))
    assert document["rejected_by_code"] == {}
    other = document["arrivals"]["41-20"]
    assert (other["received"], other["late"]) == (asterix_scene.records(TURNS) / 2, 0)
    # The data time did not follow.
    assert now_s - 10.0 < document["data_time_s"] < now_s
    # The radar is named.
    assert document["asterix"]["clocks"]["41-10"]["clock_offset_s"] > 10.0


def test_an_unavailable_address_is_reported(serving: Callable[..., Application]) -> None:
    with pytest.raises(ConfigurationError, match=r"udp 192\.0\.2\.1:8600 on .*: cannot"):
        serving({"address": "192.0.2.1", "port": 8600, "senders": ["192.0.2.0/24"]})


def test_an_unknown_edition_is_reported(serving: Callable[..., Application]) -> None:
    with pytest.raises(ConfigurationError, match=r"asterix\.editions: expected a known edition"):
        serving({"port": 0}, editions=["048=9.9"])


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (("--to", "udp:127.0.0.1"), "--to: expected udp:ADDRESS:PORT, was"),
        (("--to", "udp:127.0.0.1:0"), "--to: expected udp:ADDRESS:PORT, was"),
        (("--to", "udp:300.0.0.1:8600"), "--to: expected an IPv4 address, was '300.0.0.1'"),
        (
            ("--to", "udp:239.0.0.1:86", "--interface", "lo"),
            "--interface: expected an IPv4 address, was 'lo'",
        ),
        (
            ("--to", "udp:127.0.0.1:86", "--kinds", "radar", "--no-flush", "--batch", "10"),
            "--kinds and --batch and --no-flush do not apply with --to udp:",
        ),
        (("--times", "now"), "--times apply with --to udp: only"),
    ],
)
def test_a_wrong_address_is_reported(
    options: tuple[str, ...], sentence: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = tmp_path / "recording.ast"
    recording.write_bytes(block(48, plot_048(1.0)))
    assert run(["replay", str(recording), *options]) == EXIT_USAGE
    assert sentence in " ".join(capsys.readouterr().err.split())


def test_a_file_without_a_block_is_reported(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recording = tmp_path / "recording.ast"
    recording.write_bytes(b"nothing")
    assert run(["replay", str(recording), "--to", "udp:127.0.0.1:8600"]) == EXIT_FAILED
    assert "recording.ast: no ASTERIX data blocks" in capsys.readouterr().err
