"""Notifications reach the socket that the supervisor names."""

import socket
from pathlib import Path

import pytest

from multiradar.observability.supervisor import Supervisor
from support.processes.waiting import WAIT_TIMEOUT_S


@pytest.mark.parametrize("is_abstract", [False, True])
def test_a_path_and_an_abstract_name_are_notified(tmp_path: Path, is_abstract: bool) -> None:
    name = str(tmp_path / "notify")
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as listening:
        listening.bind(f"\0{name}" if is_abstract else name)
        listening.settimeout(WAIT_TIMEOUT_S)
        address = f"@{name}" if is_abstract else name
        supervisor = Supervisor({"NOTIFY_SOCKET": address}, lambda: "")
        supervisor.ready()
        assert listening.recv(100) == b"READY=1"
        supervisor.stop()
        supervisor.stop()
        assert listening.recv(100) == b"STOPPING=1"
        listening.setblocking(False)
        with pytest.raises(BlockingIOError):
            listening.recv(100)
