"""A running service that receives ASTERIX, for tests of senders and readers."""

import socket
from typing import Any

from multiradar.app import Application
from support.processes import clients
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until


def sender() -> socket.socket:
    """Return a socket whose groups are those of loopback."""
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton("127.0.0.1"))
    return made


def address(endpoint: str) -> tuple[str, int]:
    """Return host and port of an endpoint."""
    host, _, port = endpoint.removeprefix("udp/").partition(":")
    return host, int(port)


def status(application: Application) -> dict[str, Any]:
    """Return `GET /v1/status`."""
    found: dict[str, Any] = (
        clients.get(f"{application.http_url}/v1/status").raise_for_status().json()
    )
    return found


def settled(application: Application, octets: int) -> dict[str, Any]:
    """Wait until this many octets were received and all are accounted for."""

    def all_became_something() -> bool:
        heard = status(application)["asterix"]["listeners"].values()
        became = sum(
            one[f"octets_{name}"]
            for one in heard
            for name in ("decoded", "skipped", "quarantined", "dropped")
        )
        rows = sum(one["rows_accepted"] + one["rows_rejected"] for one in heard)
        measured: int = sum(one["records_measurement"] for one in heard)
        return bool(became == octets and rows == measured)

    wait_until(all_became_something, f"{octets} octets and what they become")
    application.service.settled().result(WAIT_TIMEOUT_S)
    return status(application)
