"""A display on a multicast group: receives system tracks and the status of the service."""

import socket
from typing import Any

import numpy as np

from multiradar_converters.asterix.layout.catalogue import layout_of
from multiradar_converters.asterix.layout.fields import record_fields
from multiradar_converters.asterix.layout.program import program_of, walk
from support.processes.waiting import WAIT_TIMEOUT_S

EDITIONS = {62: "1.21", 63: "1.7", 65: "1.6"}


def display(group: str, port: int) -> socket.socket:
    """Return a socket that receives a group on loopback."""
    found = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    found.bind((group, port))
    member = socket.inet_aton(group) + socket.inet_aton("127.0.0.1")
    found.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, member)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 1 << 20)
    found.settimeout(WAIT_TIMEOUT_S)
    return found


def heard(listener: socket.socket) -> dict[int, list[dict[str, Any]]]:
    """Read datagrams until the service reports its end."""
    records: dict[int, list[dict[str, Any]]] = {62: [], 63: [], 65: []}
    while not any("050" in one for one in records[65]):
        data = np.frombuffer(bytearray(listener.recv(2000)), np.uint8)
        category = int(data[0])
        program = program_of(layout_of(category, EDITIONS[category]))
        walked = walk(program, data, np.array([3]), np.array([len(data)]))
        assert not walked.faults[0, 0]
        records[category] += [record_fields(program, data, one) for one in walked.starts]
    return records
