"""Event streams over real sockets: order, resume, filters, gaps, and clients that do not read."""

import contextlib
import itertools
import json
import socket
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection
from websockets.typing import Origin

from multiradar.api.factory import create_api
from multiradar.runtime.stream.events import EventRing
from multiradar.settings.limits import HttpLimits
from support.fakes.fake_service import FakeService, FakeView
from support.processes import clients
from support.processes.live_server import RawClient, dropped_connections, serving
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until

LIMITS = HttpLimits(
    send_deadline_s=WAIT_TIMEOUT_S,
    streams_max=60,
    stream_heartbeat_s=0.2,
    stream_batch_interval_s=0.02,
    stream_batch_events_max=500,
)


@pytest.fixture(scope="module")
def view() -> FakeView:
    return FakeView(ring=EventRing(3_000))


@pytest.fixture(scope="module")
def port(view: FakeView) -> Iterator[int]:
    with serving(create_api(FakeService(view), LIMITS), LIMITS) as port:
        yield port


@pytest.fixture(scope="module")
def hasty(view: FakeView) -> Iterator[int]:
    """A service that disconnects clients soon that do not read."""
    limits = replace(LIMITS, send_deadline_s=1.0)
    with serving(create_api(FakeService(view), limits), limits) as port:
        yield port


@pytest.fixture(autouse=True)
def _empty_ring(view: FakeView) -> None:
    view.ring.clear()


def _socket(port: int, query: str = "") -> ClientConnection:
    return clients.event_socket(f"ws://127.0.0.1:{port}/v1/stream{query}")


def _messages(stream: ClientConnection) -> Iterator[dict[str, Any]]:
    while True:
        message: dict[str, Any] = json.loads(stream.recv(timeout=WAIT_TIMEOUT_S))
        if message["type"] == "events":
            yield message


def _events(stream: ClientConnection) -> Iterator[dict[str, Any]]:
    for message in _messages(stream):
        yield from message["events"]


def _numbers(events: Iterator[dict[str, Any]], count: int) -> list[int]:
    return [event["sequence"] for event in itertools.islice(events, count)]


def _wait_for_subscribers(view: FakeView, count: int) -> None:
    wait_until(lambda: view.ring.subscriber_count == count, f"{count} subscribers")


def _read_lines(response: httpx.Response) -> Iterator[dict[str, str]]:
    block: dict[str, str] = {}
    for line in response.iter_lines():
        if line:
            name, _, value = line.partition(":")
            block[name] = value.strip()
        else:
            yield block
            block = {}


def test_a_socket_gets_every_event_once_in_order_in_batches(port: int, view: FakeView) -> None:
    with _socket(port, "?after=0") as stream:
        _wait_for_subscribers(view, 1)
        for _ in range(100):
            view.add_events(12)
        messages = _messages(stream)
        received: list[dict[str, Any]] = []
        batches = 0
        while len(received) < 1200:
            message = next(messages)
            assert message["first"] == message["events"][0]["sequence"]
            assert message["last"] == message["events"][-1]["sequence"]
            received += message["events"]
            batches += 1
    assert [event["sequence"] for event in received] == list(range(1, 1201))
    assert received[4] == {
        "sequence": 5,
        "kind": "track",
        "key": "7",
        "data": {"number": 5, "padding": ""},
    }
    assert batches < 100


def test_after_0_starts_with_the_oldest_retained_event(port: int, view: FakeView) -> None:
    view.add_events(5)
    with _socket(port, "?after=0") as stream:
        assert _numbers(_events(stream), 5) == [1, 2, 3, 4, 5]


@pytest.mark.parametrize("path", ["stream", "events"])
def test_a_stream_without_a_number_to_resume_after_sends_no_heartbeat(path: str) -> None:
    """While the journal is replayed, `last` or `id` would be 0: the client would get it all."""
    view = FakeView(ring=EventRing(3_000))
    view.ring.follow()
    with serving(create_api(FakeService(view), LIMITS), LIMITS) as port:
        if path == "stream":
            with _socket(port) as stream:
                with pytest.raises(TimeoutError):
                    stream.recv(timeout=5 * LIMITS.stream_heartbeat_s)
                view.add_events(5)
                view.ring.lead()
                assert json.loads(stream.recv(timeout=WAIT_TIMEOUT_S)) == {
                    "type": "heartbeat",
                    "last": 5,
                }
        else:
            url = f"http://127.0.0.1:{port}/v1/events"
            with httpx.stream("GET", url, timeout=WAIT_TIMEOUT_S) as response:
                view.add_events(5)
                wait_until(lambda: view.ring.subscriber_count == 1, "the subscriber")
                view.ring.lead()
                blocks = (block for block in _read_lines(response) if "id" in block)
                assert next(blocks)["id"] == "5"


def test_without_after_only_new_events_come(port: int, view: FakeView) -> None:
    view.add_events(5)
    with _socket(port) as stream:
        _wait_for_subscribers(view, 1)
        view.add_events(2)
        assert _numbers(_events(stream), 2) == [6, 7]


def test_a_reconnecting_client_misses_no_event(port: int, view: FakeView) -> None:
    view.add_events(10)
    with _socket(port, "?after=0") as stream:
        last = _numbers(_events(stream), 10)[-1]
    view.add_events(10)
    with _socket(port, f"?after={last}") as stream:
        assert _numbers(_events(stream), 10) == list(range(11, 21))


def test_kinds_are_filtered_and_the_position_advances(port: int, view: FakeView) -> None:
    view.add_events(3)
    view.add_events(2, kind="bias")
    view.add_events(4)
    with _socket(port, "?after=0&kinds=bias") as stream:
        assert _numbers(_events(stream), 2) == [4, 5]
        while True:
            message = json.loads(stream.recv(timeout=WAIT_TIMEOUT_S))
            assert message["type"] == "heartbeat"
            if message["last"] == 9:
                break


def test_clients_with_other_filters_do_not_get_each_others_batches(
    port: int, view: FakeView
) -> None:
    view.add_events(3)
    view.add_events(3, kind="bias")
    view.add_events(1)
    url = f"http://127.0.0.1:{port}/v1/events?after=0&kinds=bias"
    with (
        _socket(port, "?after=0&kinds=bias") as biases,
        _socket(port, "?after=0&kinds=status") as nothing,
        _socket(port, "?after=0") as everything,
        clients.event_source(url) as source,
    ):
        assert _numbers(_events(biases), 3) == [4, 5, 6]
        assert _numbers(_events(everything), 7) == [1, 2, 3, 4, 5, 6, 7]
        assert json.loads(nothing.recv(timeout=WAIT_TIMEOUT_S))["type"] == "heartbeat"
        blocks = itertools.islice(_read_lines(source), 1, 4)
        assert [block["id"] for block in blocks] == ["4", "5", "6"]
    with (
        _socket(port, "?after=1&kinds=track") as tracks,
        _socket(port, "?after=1&kinds=bias") as biases,
    ):
        # As many of each kind between the same numbers.
        assert _numbers(_events(tracks), 3) == [2, 3, 7]
        assert _numbers(_events(biases), 3) == [4, 5, 6]


def test_silence_is_filled_with_heartbeats(port: int) -> None:
    with _socket(port) as stream:
        assert json.loads(stream.recv(timeout=WAIT_TIMEOUT_S)) == {"type": "heartbeat", "last": 0}


def test_events_lost_from_the_ring_are_reported_as_a_gap(port: int, view: FakeView) -> None:
    view.add_events(3_000)
    view.add_events(3_000)
    with _socket(port, "?after=10") as stream:
        events = _events(stream)
        gap = next(events)
        assert gap["kind"] == "gap"
        assert gap["data"] == {"gap": {"from": 11, "to": 3_000}}
        assert next(events)["sequence"] == 3_001


def test_a_gap_is_reported_with_any_filter(port: int, view: FakeView) -> None:
    view.add_events(3_000)
    view.add_events(3_000)
    with _socket(port, "?after=10&kinds=status") as stream:
        assert next(_events(stream))["kind"] == "gap"


@pytest.mark.parametrize(
    "query", ["?after=x", "?after=-1", "?kinds=all", "?depth=3", "?after=1&after=2", "?after=1_0"]
)
def test_wrong_parameters_close_the_socket_with_a_reason(port: int, query: str) -> None:
    with _socket(port, query) as stream:
        with pytest.raises(ConnectionClosed) as closed:
            stream.recv(timeout=WAIT_TIMEOUT_S)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1008
        assert "expected" in closed.value.rcvd.reason


def test_a_client_that_talks_is_closed(port: int) -> None:
    with _socket(port) as stream:
        stream.send("hello")
        with pytest.raises(ConnectionClosed) as closed:
            _numbers(_events(stream), 1)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1008


def test_a_page_of_another_origin_gets_no_stream(port: int) -> None:
    with (
        pytest.raises(InvalidStatus, match="403"),
        clients.event_socket(
            f"ws://127.0.0.1:{port}/v1/stream", origin=Origin("https://elsewhere.example")
        ),
    ):
        pytest.fail("the socket was accepted")


@pytest.mark.fault(34)
def test_fifty_clients_get_the_same_events(port: int, view: FakeView) -> None:
    with contextlib.ExitStack() as crowd:
        streams = [crowd.enter_context(_socket(port, "?after=0")) for _ in range(50)]
        for _ in range(20):
            view.add_events(50)
        for stream in streams:
            assert _numbers(_events(stream), 1000) == list(range(1, 1001))
    _wait_for_subscribers(view, 0)


@pytest.mark.fault(34)
def test_streams_beyond_the_limit_are_asked_to_retry_later(port: int, view: FakeView) -> None:
    with contextlib.ExitStack() as crowd:
        for _ in range(LIMITS.streams_max):
            crowd.enter_context(_socket(port))
        _wait_for_subscribers(view, LIMITS.streams_max)
        with _socket(port) as late, pytest.raises(ConnectionClosed) as closed:
            late.recv(timeout=WAIT_TIMEOUT_S)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 1013
        answer = clients.get(f"http://127.0.0.1:{port}/v1/events")
        assert (answer.status_code, answer.json()["code"]) == (503, "TOO_MANY_STREAMS")
    _wait_for_subscribers(view, 0)


@pytest.mark.fault(33)
def test_a_socket_that_is_not_read_is_closed_and_delays_no_other(
    hasty: int, view: FakeView
) -> None:
    stalled = RawClient(hasty, receive_buffer_bytes=4096)
    stalled.send(
        b"GET /v1/stream?after=0 HTTP/1.1\r\nHost: 127.0.0.1\r\nUpgrade: websocket\r\n"
        b"Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
        b"Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n"
    )
    stalled.until(b"\r\n\r\n")
    with _socket(hasty, "?after=0") as reader:
        _wait_for_subscribers(view, 2)
        events = _events(reader)
        for first in range(1, 8_001, 500):
            # In all some MB more than the sockets hold.
            view.add_events(500, padding=1_000)
            assert _numbers(events, 500) == list(range(first, first + 500))
        _wait_for_subscribers(view, 1)
    stalled.close()


def test_an_event_source_that_is_not_read_is_closed(hasty: int, view: FakeView) -> None:
    stalled, dropped = RawClient(hasty, receive_buffer_bytes=4096), dropped_connections(hasty)
    stalled.send(b"GET /v1/events?after=0 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
    stalled.until(b"retry")
    _wait_for_subscribers(view, 1)
    view.add_events(2_000, padding=10_000)
    _wait_for_subscribers(view, 0)
    wait_until(lambda: dropped_connections(hasty) > dropped, "it to be counted")
    stalled.close()


def test_a_stalled_socket_that_reads_again_finds_its_close_code(hasty: int, view: FakeView) -> None:
    narrow = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    narrow.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    narrow.connect(("127.0.0.1", hasty))
    url = f"ws://127.0.0.1:{hasty}/v1/stream?after=0"
    with clients.event_socket(url, sock=narrow, max_queue=1) as stalled:
        _wait_for_subscribers(view, 1)

        def disconnected() -> bool:
            # Nothing is read; the buffers fill until the client is disconnected.
            view.add_events(500, padding=1_900)
            return view.ring.subscriber_count == 0

        wait_until(disconnected, "the client to be disconnected")
        with pytest.raises(ConnectionClosed) as closed:
            _numbers(_events(stalled), 100_000)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 4408


def test_a_slow_reader_gets_a_gap_and_continues(view: FakeView) -> None:
    # A reader that pauses for less than the deadline stays and gets a gap for lost events.
    limits = HttpLimits(send_deadline_s=WAIT_TIMEOUT_S, stream_batch_events_max=100)
    slow_view = FakeView(ring=EventRing(500))
    with serving(create_api(FakeService(slow_view), limits), limits) as port:
        source = clients.event_source(f"http://127.0.0.1:{port}/v1/events?after=0")
        with source as response:
            _wait_for_subscribers(slow_view, 1)
            for _ in range(40):
                slow_view.add_events(100, padding=10_000)
            seen, covered = [], set()
            for block in _read_lines(response):
                if block.get("event") == "gap":
                    gap = json.loads(block["data"])["gap"]
                    covered |= set(range(gap["from"], gap["to"] + 1))
                elif "event" in block:
                    seen.append(int(block["id"]))
                if seen and seen[-1] == 4_000:
                    break
    assert covered
    assert seen == sorted(set(seen))
    assert covered | set(seen) == set(range(1, 4_001))
    assert not covered & set(seen)


def test_an_event_source_resumes_by_its_last_event_id(port: int, view: FakeView) -> None:
    view.add_events(6)
    view.add_events(1, kind="status")
    url = f"http://127.0.0.1:{port}/v1/events?after=0"
    with clients.event_source(url, headers={"last-event-id": "4"}) as response:
        # A browser's EventSource accepts only 200.
        assert response.status_code == 200
        assert response.headers["content-type"] == "text/event-stream; charset=utf-8"
        assert "content-length" not in response.headers
        blocks = _read_lines(response)
        assert 2000 <= int(next(blocks)["retry"]) < 4000
        first, second, third = itertools.islice(blocks, 3)
        assert (first["id"], first["event"]) == ("5", "track")
        assert json.loads(first["data"]) == {"number": 5, "padding": ""}
        assert second["id"] == "6"
        assert (third["id"], third["event"]) == ("7", "status")
        assert next(blocks) == {"": "heartbeat", "id": "7"}


@pytest.mark.parametrize("last_event_id", ["x", "-1", "1.0", "9" * 30])
def test_an_invalid_last_event_id_is_rejected(port: int, last_event_id: str) -> None:
    url = f"http://127.0.0.1:{port}/v1/events"
    answer = clients.get(url, headers={"last-event-id": last_event_id})
    assert (answer.status_code, answer.json()["code"]) == (422, "INVALID_PARAMETER")


def test_disconnected_clients_leave_no_subscription(port: int, view: FakeView) -> None:
    for _ in range(10):
        with _socket(port):
            pass
        with clients.event_source(f"http://127.0.0.1:{port}/v1/events"):
            pass
        abrupt = RawClient(port)
        abrupt.send(b"GET /v1/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        abrupt.until(b"retry")
        abrupt.close()
    _wait_for_subscribers(view, 0)
