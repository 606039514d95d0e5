"""Senders of datagrams: who may send, and what one of them can fill."""

import socket

import pytest
from structlog.testing import capture_logs

from multiradar.access.security_log import RepeatedEvents
from multiradar.clock import FixedClock
from multiradar.errors import ConfigurationError
from multiradar.ingest.asterix_queue import DatagramQueue, Received
from multiradar.ingest.asterix_source import UdpSource
from multiradar.settings.service import load_settings
from support.processes.waiting import wait_until


def listener(*senders: str) -> UdpSource:
    return UdpSource(
        "127.0.0.1", 0, "127.0.0.1", 1 << 20, senders=senders, events=RepeatedEvents(FixedClock())
    )


def send(source: UdpSource, address: str, datagram: bytes) -> None:
    host, _, port = source.endpoint.removeprefix("udp/").rpartition(":")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.bind((address, 0))
        sender.sendto(datagram, (host, int(port)))


def next_of(source: UdpSource) -> bytes:
    found: list[bytes] = []

    def received() -> bool:
        octets = source.receive()
        found.extend([] if octets is None else [octets])
        return bool(found)

    wait_until(received, "a datagram")
    return found[0]


@pytest.mark.fault(20)
def test_datagrams_of_other_senders_are_dropped_counted_and_logged() -> None:
    source = listener("127.0.0.2", "127.1.0.0/16")
    with capture_logs() as logs:
        send(source, "127.0.0.1", b"forged")
        send(source, "127.0.0.1", b"forged")
        send(source, "127.0.0.2", b"first")
        send(source, "127.1.2.3", b"second")
        assert (next_of(source), source.sender) == (b"first", "127.0.0.2")
        assert (next_of(source), source.sender) == (b"second", "127.1.2.3")
    assert source.status == {"datagrams_not_allowed": 2}
    (logged,) = logs
    assert (logged["event"], logged["origin"]) == ("datagram_not_allowed", "127.0.0.1")
    source.close()


def test_without_a_list_every_sender_is_received() -> None:
    source = listener()
    send(source, "127.0.0.9", b"any")
    assert next_of(source) == b"any"
    assert source.status == {}
    source.close()


def test_the_flood_of_one_address_leaves_half_of_the_queue_to_others() -> None:
    queue = DatagramQueue(100, 1 << 20)
    flood = [queue.put(Received(0, k, 0.0, b"x", "192.0.2.66")) for k in range(1000)]
    assert sum(flood) == 50
    assert all(queue.put(Received(0, k, 0.0, b"x", "192.0.2.1")) for k in range(50))
    assert not queue.put(Received(0, 0, 0.0, b"x", "192.0.2.2"))
    # What was taken makes room for both.
    assert len(queue.pop(100)) == 100
    assert queue.put(Received(0, 0, 0.0, b"x", "192.0.2.66"))


def test_the_octets_of_one_address_are_bounded_too() -> None:
    queue = DatagramQueue(1000, 1000)
    flood = [queue.put(Received(0, k, 0.0, bytes(100), "192.0.2.66")) for k in range(10)]
    assert sum(flood) == 5
    assert queue.put(Received(0, 0, 0.0, bytes(500), "192.0.2.1"))


@pytest.mark.parametrize("wrong", ["10.20.0.0/33", "host.example.org", "10.20.1.1/16"])
def test_other_forms_of_senders_are_rejected(wrong: str) -> None:
    listen = [{"port": 1, "senders": [wrong]}]
    with pytest.raises(ConfigurationError, match="IPv4 address or network"):
        load_settings(None, {"asterix": {"listen": listen}})
