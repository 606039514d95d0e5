"""Snapshots that are requested or read again and again: `aircraft.json`."""

import http.client
import ssl
import zlib
from collections.abc import Callable
from pathlib import Path

from multiradar.clock import Clock
from multiradar.ingest.feeds.connections import WAIT_S
from multiradar.settings.feeds import HTTPS, FeedAddress
from multiradar_converters.feeds.recorded import SNAPSHOT_BYTES_MAX

#: Maximum time of an answer in timeouts.
ANSWER_FACTOR = 4.0

_OK = 200
_PIECE_OCTETS = 1 << 16
_GZIP_WINDOW = 31
_HEADERS = {
    "Accept": "application/json",
    "Accept-Encoding": "gzip",
    "Cache-Control": "no-cache",
    "User-Agent": "multiradar",
}


class PolledSnapshots:
    """Fetches a snapshot at intervals, in place of a connection.

    Parameters
    ----------
    endpoint : str
        Its address.
    fetch : callable
        Returns the snapshot, None if it has not changed; raises OSError.
    interval_s : float
        Interval, s.
    clock : Clock
        Measures the interval.
    wait : callable
        Waits for a time, s, or for the stop.
    """

    whole = True

    def __init__(
        self,
        endpoint: str,
        fetch: Callable[[], bytes | None],
        interval_s: float,
        clock: Clock,
        wait: Callable[[float], object],
    ) -> None:
        self.endpoint = endpoint
        self._fetch, self._interval_s, self._clock, self._wait = fetch, interval_s, clock, wait
        self._due_s = clock.monotonic_s()
        self._first: bytes | None = None

    def open(self) -> bool:
        """Fetch the first snapshot: connected means that it was answered."""
        self._due_s = self._clock.monotonic_s() + self._interval_s
        self._first = self._fetch()
        return True

    def receive(self) -> bytes | None:
        """Wait a moment; return the next snapshot when it is due."""
        if self._first is not None:
            first, self._first = self._first, None
            return first or None
        now_s = self._clock.monotonic_s()
        left_s = self._due_s - now_s
        if left_s > 0.0:
            self._wait(min(left_s, WAIT_S))
            return None
        self._due_s += self._interval_s
        if self._due_s <= now_s:
            # Intervals that were missed are not made up for.
            self._due_s = now_s + self._interval_s
        # An empty one is that of a file which is just written.
        return self._fetch() or None

    def close(self) -> None:
        """Discard what was fetched."""
        self._first = None

    release = close


def http_fetch(address: FeedAddress, timeout_s: float, clock: Clock) -> Callable[[], bytes | None]:
    """Return the function that requests a snapshot.

    Parameters
    ----------
    address : FeedAddress
        Its address, of the scheme `http` or `https`.
    timeout_s : float
        Maximum time to connect and between two pieces of the answer, s; the whole answer may take
        `ANSWER_FACTOR` times as long.
    clock : Clock
        Measures it.
    """
    scheme, host, port, path = address
    context = ssl.create_default_context() if scheme == HTTPS else None

    def fetch() -> bytes:
        connection = (
            http.client.HTTPConnection(host, port, timeout=timeout_s)
            if context is None
            else http.client.HTTPSConnection(host, port, timeout=timeout_s, context=context)
        )
        try:
            connection.request("GET", path, headers=_HEADERS)
            answer = connection.getresponse()
            if answer.status != _OK:
                msg = f"expected status 200, was {answer.status} {answer.reason}"
                raise OSError(msg)
            body = _body(answer, clock, clock.monotonic_s() + ANSWER_FACTOR * timeout_s)
        except http.client.HTTPException as error:
            msg = f"not a valid HTTP response: {type(error).__name__}"
            raise OSError(msg) from error
        finally:
            connection.close()
        return _plain(body, answer.getheader("Content-Encoding", ""))

    return fetch


def file_fetch(path: Path) -> Callable[[], bytes | None]:
    """Return the function that reads a snapshot, and returns None while the file is the same."""
    known: tuple[int, int] | None = None

    def fetch() -> bytes | None:
        nonlocal known
        with path.open("rb") as file:
            found = path.stat()
            state = found.st_mtime_ns, found.st_ino
            if state == known:
                return None
            body = file.read(SNAPSHOT_BYTES_MAX + 1)
        if len(body) > SNAPSHOT_BYTES_MAX:
            raise _too_large()
        known = state
        return body

    return fetch


def _body(answer: http.client.HTTPResponse, clock: Clock, until_s: float) -> bytes:
    body = bytearray()
    while piece := answer.read1(_PIECE_OCTETS):
        body += piece
        if len(body) > SNAPSHOT_BYTES_MAX:
            raise _too_large()
        if clock.monotonic_s() > until_s:
            msg = "the response timed out"
            raise TimeoutError(msg)
    return bytes(body)


def _plain(body: bytes, encoding: str) -> bytes:
    if encoding.lower() == "gzip":
        unpacking = zlib.decompressobj(_GZIP_WINDOW)
        try:
            body = unpacking.decompress(body, SNAPSHOT_BYTES_MAX + 1)
        except zlib.error as error:
            msg = f"not a valid gzip response: {error}"
            raise OSError(msg) from error
    if len(body) > SNAPSHOT_BYTES_MAX:
        raise _too_large()
    return body


def _too_large() -> OSError:
    return OSError(f"expected at most {SNAPSHOT_BYTES_MAX >> 20} MiB, found more")
