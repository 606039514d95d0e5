"""The example of `deploy/`: measurements in, system tracks out to a display by multicast."""

import socket
from pathlib import Path
from typing import Any

import numpy as np

from multiradar.app import Application
from multiradar.settings import load_settings
from multiradar_converters.asterix.catalogue import layout_of
from multiradar_converters.asterix.fields import record_fields
from multiradar_converters.asterix.program import program_of, walk
from support.live_scene import cut, recording, sensors

EXAMPLE = Path(__file__).parents[3] / "deploy" / "asterix-display.toml"
GROUP, PORT = "239.192.62.1", 8662
EDITIONS = {62: "1.21", 63: "1.7", 65: "1.6"}


def listener() -> socket.socket:
    found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    found.bind((GROUP, PORT))
    member = socket.inet_aton(GROUP) + socket.inet_aton("127.0.0.1")
    found.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    found.settimeout(20.0)
    return found


def heard(display: socket.socket) -> dict[int, list[dict[str, Any]]]:
    """Read datagrams until the service says that it ended."""
    records: dict[int, list[dict[str, Any]]] = {62: [], 63: [], 65: []}
    while not any("050" in one for one in records[65]):
        data = np.frombuffer(display.recv(2000), np.uint8)
        category = int(data[0])
        program = program_of(layout_of(category, EDITIONS[category]))
        walked = walk(program, data, np.array([3]), np.array([len(data)]))
        assert not walked.faults[0, 0]
        records[category] += [record_fields(program, data, one) for one in walked.starts]
    return records


def test_a_display_gets_system_tracks(tmp_path: Path) -> None:
    with listener() as display:
        settings = load_settings(
            EXAMPLE,
            {
                "server": {"port": 0},
                "zenoh": {"enabled": False},
                "journal": {"path": tmp_path / "journal.sqlite"},
            },
        )
        first, second = cut(recording(1600), [800])[:2]
        for frame in (first, second):
            # The second start plays the journal, and tells of what is new alone.
            application = Application(settings, sensors(), lambda: None)
            application.start()
            try:
                application.service.submit(frame, source="test").result(20)
                application.service.flush(source="test").result(20)
                application.service.settled().result(20)
                status = application.service.view.status()
            finally:
                application.stop()
            records = heard(display)
            assert {one["010"]["SIC"] for one in records[62]} == {250}
            assert len({one["040"] for one in records[62]}) == 12
            assert {one["380"]["ADR"] >> 8 for one in records[62]} == {0x4B00}
            times = [one["070"] for one in records[62]]
            assert times == sorted(times)
            # 40 s each, by 4 s.
            assert len(set(times)) >= 9
            assert status["asterix_output"]["failure"] is None
            numbers = {one["380"]["ADR"]: one["040"] for one in records[62]}
        # Biases have settled by then.
        assert "081" in records[63][-1]
    # The same numbers at both starts: a number follows from the track alone.
    assert sorted(numbers.values()) == list(range(1, 13))
