"""A stream of ASTERIX blocks: whole blocks, and a new connection after each end."""

import pytest

from multiradar.clock import FixedClock
from multiradar.ingest.asterix_queue import DatagramQueue, Received
from multiradar.ingest.feeds import blocks, connections
from multiradar.ingest.feeds.blocks import BlockStream
from multiradar.ingest.feeds.connections import MemoryConnection
from multiradar.ingest.feeds.counts import CONNECTED, WAITING

ONE, LEAST = bytes([21, 0, 5, 1, 2]), bytes([21, 0, 3])
PAUSE_MIN_S, PAUSE_MAX_S = 1.0, 4.0


@pytest.fixture(autouse=True)
def _without_waits(monkeypatch: pytest.MonkeyPatch) -> None:
    for module in (blocks, connections):
        monkeypatch.setattr(module, "WAIT_S", 0.0)


@pytest.fixture
def clock() -> FixedClock:
    return FixedClock(1000.0)


@pytest.fixture
def connection() -> MemoryConnection:
    return MemoryConnection()


@pytest.fixture
def stream(connection: MemoryConnection, clock: FixedClock) -> BlockStream:
    made = BlockStream(connection, clock, PAUSE_MIN_S, PAUSE_MAX_S)
    # The first attempt is immediate.
    assert made.receive() is None
    assert (connection.opened, made.status) == (1, {"state": CONNECTED, "last_error": None})
    return made


def test_only_whole_blocks_are_returned(stream: BlockStream, connection: MemoryConnection) -> None:
    connection.send(ONE[:2], ONE[2:] + LEAST + ONE[:4], ONE[4:])
    assert [stream.receive() for _ in range(4)] == [None, ONE + LEAST, ONE, None]


def test_a_stream_has_a_sender_so_that_it_leaves_half_of_the_queue_to_others(
    stream: BlockStream, connection: MemoryConnection
) -> None:
    """Regression: a stream without a sender could fill the queue of all listeners."""
    assert stream.sender == connection.endpoint
    queue = DatagramQueue(100, 1 << 20)
    flood = [queue.put(Received(0, k, 0.0, ONE, stream.sender)) for k in range(1000)]
    assert sum(flood) == 50
    assert queue.put(Received(1, 1, 0.0, ONE, "192.0.2.1"))


def test_one_piece_of_a_stream_may_be_more_than_half_of_the_queue() -> None:
    queue = DatagramQueue(100, 100)
    assert queue.put(Received(0, 1, 0.0, bytes(60), "tcp/192.0.2.1:1"))
    assert not queue.put(Received(0, 2, 0.0, bytes(1), "tcp/192.0.2.1:1"))


def test_what_is_no_block_ends_the_connection(
    stream: BlockStream, connection: MemoryConnection
) -> None:
    wrong = bytes([21, 0, 2])
    connection.send(ONE + wrong)
    assert stream.receive() == ONE + wrong
    assert connection.closed == 1
    expected = "expected ASTERIX blocks, found a block length below 3"
    assert stream.status == {"state": WAITING, "last_error": expected}


def test_an_error_that_is_none_of_the_system_ends_the_connection(
    stream: BlockStream, connection: MemoryConnection, clock: FixedClock
) -> None:
    connection.send(UnicodeError("label too long"), ONE)
    with pytest.raises(UnicodeError):
        stream.receive()
    assert stream.status == {"state": WAITING, "last_error": "label too long"}
    clock.advance(PAUSE_MIN_S)
    assert [stream.receive() for _ in range(2)] == [None, ONE]


def test_the_part_of_a_block_before_a_reset_is_returned_as_before_an_end(
    stream: BlockStream, connection: MemoryConnection
) -> None:
    """It was neither counted nor quarantined."""
    connection.send(ONE + ONE[:4], ConnectionResetError("reset by peer"))
    assert [stream.receive() for _ in range(2)] == [ONE, ONE[:4]]
    assert stream.status == {"state": WAITING, "last_error": "reset by peer"}
    assert connection.closed == 1


def test_pauses_double_until_there_is_data(
    stream: BlockStream, connection: MemoryConnection, clock: FixedClock
) -> None:
    opened = 1
    for pause_s in (1.0, 2.0, 4.0, 4.0):
        connection.send(b"")
        with pytest.raises(ConnectionError, match="closed by the peer"):
            stream.receive()
        assert stream.status["state"] == WAITING
        clock.advance(pause_s - 0.001)
        assert stream.receive() is None
        assert connection.opened == opened
        clock.advance(0.001)
        assert stream.receive() is None
        opened += 1
        assert connection.opened == opened
    # Data; then the end within a block, which is returned.
    connection.send(ONE, ONE[:2], b"")
    assert [stream.receive() for _ in range(3)] == [ONE, None, ONE[:2]]
    clock.advance(PAUSE_MIN_S)
    stream.receive()
    assert connection.opened == opened + 1
    stream.close()
    assert connection.released
