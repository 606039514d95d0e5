"""A stream of ASTERIX blocks: whole blocks, and a new connection after each end."""

import pytest

from multiradar.clock import FixedClock
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
