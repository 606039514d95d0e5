"""The example of `deploy/`: input from two multicast networks on loopback, system tracks out."""

import time
from pathlib import Path

from multiradar.app import Application
from multiradar.settings.service import load_settings
from support.asterix import display as asterix_display
from support.asterix import scene as asterix_scene
from support.asterix.listening import address, sender, settled
from support.paths import ROOT
from support.processes import clients
from support.scenarios import live_scene

EXAMPLE = ROOT / "deploy/asterix.toml"
TURNS = 8
#: The display of the example.
DISPLAY = ("239.192.62.1", 8662)


def test_duplicates_from_two_networks_count_once(tmp_path: Path) -> None:
    output = {
        "server": {"port": 0},
        "journal": {"path": tmp_path / "journal.sqlite"},
        "zenoh": {"enabled": False},
    }
    application = Application(load_settings(EXAMPLE, output), live_scene.sensors(), lambda: None)
    with asterix_display.display(*DISPLAY) as screen:
        try:
            application.start()
            first, second = map(address, application.asterix_endpoints)
            assert (first[0], second[0]) == ("239.192.48.1", "239.192.48.2")
            whole = asterix_scene.datagrams(time.time() - 4.0 * (TURNS + 1), TURNS)
            with sender() as out:
                for _, octets in whole:
                    out.sendto(octets, first)
                    out.sendto(octets, second)
            document = settled(application, 2 * sum(len(octets) for _, octets in whole))
            heard = document["asterix"]["listeners"]
            assert set(heard) == {"network-a", "network-b"}
            measured, repeated = (
                sum(one[f"records_{name}"] for one in heard.values())
                for name in ("measurement", "duplicate")
            )
            assert measured == repeated == asterix_scene.records(TURNS) == document["accepted"]
            tracks = (
                clients.get(f"{application.http_url}/v1/tracks").raise_for_status().json()["tracks"]
            )
            assert {one["mode_s_address"] for one in tracks} == asterix_scene.addresses()
        finally:
            application.stop()
        out_of_it = asterix_display.heard(screen)
        # Aircraft without an address in the plots of one radar are identified by the other radar.
        assert {f"{one['380']['ADR']:06x}" for one in out_of_it[62] if "380" in one} == (
            asterix_scene.addresses()
        )
        assert {(one["050"]["SAC"], one["050"]["SIC"]) for one in out_of_it[63]} == set(
            asterix_scene.SITES
        )
