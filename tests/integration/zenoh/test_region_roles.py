"""The session between regions: a neighbour puts under its own name, and strangers put nothing."""

from functools import partial
from pathlib import Path
from typing import Any

import zenoh

from multiradar.ingest.zenoh.handovers import RegionExchange
from multiradar.ingest.zenoh.keys import HANDOVERS, MEASUREMENTS
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import ZenohBus
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.regions.areas import Areas, Centre
from multiradar.runtime.memory.regions.board import RegionBoard, RegionRules
from multiradar.settings.access import AccessSettings
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.settings import TrackingSettings
from support.access import clients
from support.fakes.fake_service import FakeService
from support.processes.certificates import Authority
from support.processes.waiting import wait_until
from support.processes.zenoh_subscriber import certified_config
from support.scenarios.live_scene import sensors
from support.scenarios.zenoh_scene import free_endpoint


class _Noting(RegionExchange):
    """Notes who was received, by the attachment, under which key."""

    def on_message(self, message: Any) -> None:
        received.append((message.payload.decode(), message.key.rpartition("/")[2]))


received: list[tuple[str, str]] = []


def test_a_neighbour_puts_and_receives_only_what_is_its_own(tmp_path: Path) -> None:
    authority, endpoint = Authority(tmp_path), free_endpoint().replace("tcp/", "tls/")
    certificate, private_key = authority.issue("west")
    access = AccessSettings(
        clients=clients(), certificate=certificate, private_key=private_key,
        client_authority=authority.certificate,
    )  # fmt: skip
    areas = Areas(Centre("west", 49.0, 8.0), [Centre("east", 49.0, 14.0), Centre("n", 55.0, 9.0)])
    options = ZenohOptions(
        listen=(endpoint,), access=access, region="west", neighbours=tuple(areas.neighbours)
    )
    buses: list[ZenohBus] = []

    def opened(given: ZenohOptions) -> ZenohBus:
        buses.append(ZenohBus(given))
        return buses[0]

    exchange = _Noting(
        FakeService(),  # type: ignore[arg-type]  # nothing is submitted
        Knowledge(sensors(), TrackingSettings(), RuntimeLimits()),
        RegionBoard(areas, RegionRules()), options, period_s=1.0, open_bus=opened,
    )  # fmt: skip
    exchange.open()
    received.clear()
    heard: dict[str, list[str]] = {}
    try:
        # The neighbours come last: what the others put would be there before.
        for caller in ("stranger", "operate", "n", "east"):
            with zenoh.open(certified_config(endpoint, authority, caller)) as session:
                heard[caller] = []
                session.declare_subscriber(f"{HANDOVERS}/west", partial(_note, heard[caller]))
                for key in ("n", "east", "west"):
                    session.put(f"{HANDOVERS}/{key}", caller.encode())
                session.put(f"{MEASUREMENTS}/41-10", b"[]")
                for _ in range(2):
                    buses[0].put(f"{HANDOVERS}/west", b"{}", b"")
                if caller in areas.neighbours:
                    wait_until(
                        partial(received.__contains__, (caller, caller)), f"that of {caller}"
                    )
                    wait_until(partial(_sent, buses[0], heard[caller]), "its own")
            wait_until(lambda: exchange.document()["links"] == 0, "the end of the connection")
    finally:
        exchange.stop()
    assert received == [("n", "n"), ("east", "east")]
    assert {caller for caller, keys in heard.items() if "{}" in keys} == {"n", "east"}


def _sent(bus: ZenohBus, heard: list[str]) -> bool:
    bus.put(f"{HANDOVERS}/west", b"{}", b"")
    return "{}" in heard


def _note(heard: list[str], sample: zenoh.Sample) -> None:
    heard.append(sample.payload.to_string())
