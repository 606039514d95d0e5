"""Datagrams are sent when they are due, and never into the future."""

import math
import socket

import numpy as np
import pytest

from multiradar.clock import FixedClock
from multiradar.errors import PeerError
from multiradar.ingest.replay.datagrams import (
    MemorySink,
    UdpSink,
    begin_s,
    send_all,
    wall_times,
)
from multiradar.ingest.replay.replaying import FIRST_CONTACT_S, SILENCE_MAX_S
from multiradar_converters.asterix.framing.datagrams import Datagrams
from multiradar_converters.asterix.writing.sending import Sending
from support.processes.waiting import WAIT_TIMEOUT_S


def sending(*due_s: float) -> Sending:
    """Datagrams of one octet each, numbered from 0."""
    count = len(due_s)
    places = np.arange(count, dtype=np.int64)
    datagrams = Datagrams(places.astype(np.uint8), places, places + 1, np.array(due_s))
    return Sending(datagrams, np.array(due_s), 0.0, 0)


def sent_at(speed: float, *due_s: float) -> tuple[list[float], list[bytes]]:
    clock, sink = FixedClock(), MemorySink()
    moments = []

    def pause(duration_s: float) -> None:
        clock.advance(duration_s)

    class Noting(MemorySink):
        def send(self, octets: bytes) -> None:
            moments.append(clock.now_s())
            sink.send(octets)

    octets = send_all(sending(*due_s), Noting(), speed, clock=clock, pause=pause)
    assert octets == len(due_s)
    return moments, sink.sent


@pytest.mark.parametrize("speed", [0.5, 1.0, 10.0])
def test_datagrams_are_sent_in_data_time(speed: float) -> None:
    moments, sent = sent_at(speed, 0.0, 1.0, 1.0, 4.0)
    assert moments == pytest.approx([0.0, 1.0 / speed, 1.0 / speed, 4.0 / speed])
    assert sent == [b"\x00", b"\x01", b"\x02", b"\x03"]


def test_a_long_silence_is_cut() -> None:
    assert wall_times(np.array([0.0, 1e6, 1e6 + 1.0]), 2.0).tolist() == [
        0.0,
        SILENCE_MAX_S / 2.0,
        (SILENCE_MAX_S + 1.0) / 2.0,
    ]


def test_at_the_highest_speed_the_listener_gets_moments_to_read() -> None:
    moments, sent = sent_at(math.inf, *range(100))
    assert len(sent) == 100
    assert 0.0 < moments[-1] < 0.1


@pytest.mark.parametrize("speed", [0.5, 1.0, 10.0, math.inf])
def test_no_time_that_is_sent_lies_in_the_future(speed: float) -> None:
    due_s = np.array([0.0, 10.0, 500.0, 505.0])
    ahead = begin_s(due_s, speed, 1000.0) + due_s - (1000.0 + wall_times(due_s, speed))
    assert ahead.max() == pytest.approx(0.0)


def test_what_cannot_be_sent_is_reported() -> None:
    sink = UdpSink("127.0.0.1", 9, "127.0.0.1")
    try:
        with pytest.raises(PeerError, match=r"udp:127\.0\.0\.1:9: cannot send to this address"):
            sink.send(bytes(70_000))
    finally:
        sink.close()


def test_a_missing_interface_is_reported() -> None:
    with pytest.raises(PeerError, match=r"cannot send via 192\.0\.2\.1"):
        UdpSink("239.192.0.1", 8600, "192.0.2.1")


def test_a_port_without_listener_is_reported_at_once_and_abandoned_after_seconds() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    clock, reported = FixedClock(), []
    sink = UdpSink("127.0.0.1", port, "127.0.0.1")
    try:
        with pytest.raises(
            PeerError, match="no listener at this address: 6 of 6 datagrams were rejected"
        ):
            send_all(
                sending(*range(100)),
                sink,
                1.0,
                clock=clock,
                pause=clock.advance,
                on_rejected=lambda: reported.append(clock.now_s()),
            )
    finally:
        sink.close()
    assert reported == [0.0]
    assert clock.now_s() == FIRST_CONTACT_S


def test_a_listener_that_comes_later_gets_the_rest() -> None:
    listener = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with listener, socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", 0))
        port = taken.getsockname()[1]
        taken.close()
        sink, clock = UdpSink("127.0.0.1", port, "127.0.0.1"), FixedClock()

        def pause(duration_s: float) -> None:
            clock.advance(duration_s)
            if clock.now_s() == 2.0:
                listener.bind(("127.0.0.1", port))

        octets = send_all(sending(*range(6)), sink, 1.0, clock=clock, pause=pause)
        listener.settimeout(WAIT_TIMEOUT_S)
        assert [listener.recv(1) for _ in range(4)] == [b"\x02", b"\x03", b"\x04", b"\x05"]
        assert (octets, sink.rejected()) == (6, 2)
        sink.close()


def test_rejections_are_counted_without_polling() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    sink = UdpSink("127.0.0.1", port, "127.0.0.1")
    try:
        for octet in range(3):
            sink.send(bytes([octet]))
        assert sink.rejected() == 3
    finally:
        sink.close()
