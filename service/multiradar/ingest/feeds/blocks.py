"""ASTERIX over TCP: data blocks one after another, as readsb sends category 021."""

import threading

from multiradar.clock import Clock
from multiradar.ingest.feeds.connections import WAIT_S, FeedConnection
from multiradar.ingest.feeds.counts import CONNECTED, STARTING, WAITING

#: Octets of a category and a length.
_HEAD_OCTETS = 3


class BlockStream:
    """Whole blocks of a stream in place of datagrams; connects again when the stream ends.

    Parameters
    ----------
    connection : FeedConnection
        The stream.
    clock : Clock
        Measures pauses.
    reconnect_min_s, reconnect_max_s : float
        Pause before the first new attempt, and maximum pause, s; it doubles with each attempt that
        brings no data.
    """

    can_wait = True

    def __init__(
        self,
        connection: FeedConnection,
        clock: Clock,
        reconnect_min_s: float = 1.0,
        reconnect_max_s: float = 30.0,
    ) -> None:
        self.lost = 0
        self._connection, self._clock = connection, clock
        self._pauses_s = reconnect_min_s, reconnect_max_s
        self._pause_s = reconnect_min_s
        self._due_s = clock.monotonic_s()
        self._buffer = b""
        self._never = threading.Event()
        self._state, self._last_error = STARTING, ""

    @property
    def endpoint(self) -> str:
        """Its address."""
        return self._connection.endpoint

    @property
    def sender(self) -> str:
        """Its address, too: of the queue of all listeners one sender has a part only."""
        return self._connection.endpoint

    @property
    def status(self) -> dict[str, object]:
        """State of the connection, and why the last one failed or ended."""
        return {"state": self._state, "last_error": self._last_error or None}

    def receive(self) -> bytes | None:
        """Wait a moment for blocks.

        Raises
        ------
        Exception
            The connection failed or ended, mostly an OSError, and nothing is left of it; a later
            call connects again.
        """
        left_s = self._due_s - self._clock.monotonic_s()
        if left_s > 0.0:
            self._never.wait(min(left_s, WAIT_S))
            return None
        try:
            if self._state != CONNECTED:
                self._state = CONNECTED if self._connection.open() else WAITING
                return None
            text = self._connection.receive()
        except Exception as error:
            return self._ended(error)
        if text == b"":
            return self._ended(ConnectionError("the connection was closed by the peer"))
        if text is None:
            return None
        self._pause_s = self._pauses_s[0]
        self._buffer += text
        return self._blocks()

    def close(self) -> None:
        """Close the stream."""
        self._connection.release()

    def _blocks(self) -> bytes | None:
        """Return the whole blocks; of what is none the end of the stream."""
        begin, size = 0, len(self._buffer)
        while begin + _HEAD_OCTETS <= size:
            octets = int.from_bytes(self._buffer[begin + 1 : begin + _HEAD_OCTETS], "big")
            if octets < _HEAD_OCTETS:
                reason = "expected ASTERIX blocks, found a block length below 3"
                return self._ended(ConnectionError(reason))
            if begin + octets > size:
                break
            begin += octets
        whole, self._buffer = self._buffer[:begin], self._buffer[begin:]
        return whole or None

    def _ended(self, error: Exception) -> bytes:
        """End the connection; what is left is quarantined by the decoder."""
        left, self._buffer = self._buffer, b""
        self._connection.close()
        self._state, self._last_error = WAITING, str(error) or type(error).__name__
        self._due_s = self._clock.monotonic_s() + self._pause_s
        self._pause_s = min(2.0 * self._pause_s, self._pauses_s[1])
        if not left:
            raise error
        return left
