"""Measures the memory of a service that receives hostile bodies of the largest allowed size.

::

    python -m validation.service.check_bodies --requests 39 --impatient
    python -m validation.service.check_bodies --requests 10000 --clients 4 --impatient

A client that is not impatient waits as a 429 says, up to a minute: its source is in quarantine most
of the time. Each request has 16 MiB: rows without sense, few huge ones, a hundred thousand that are
rejected for their time, deep nesting, escapes, a million keys, random bytes. Each client has its
own loopback address, so its own limits. The service is small and has nothing else to do; its memory
is that of the process (resident set). The exit status is 1 if too much of it remains. At the end
the service is killed and started again on its journal.
"""

import argparse
import http.client
import itertools
import os
import random
import statistics
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import urlsplit

from multiradar.report.content import Table
from multiradar.report.markdown import markdown_table
from validation.service.traffic import Traffic

#: A little less than the limit of a body.
OCTETS = 16 * 1024 * 1024 - 1024
_ROWS = 99_000
_JSON, _LINES = "application/json", "application/x-ndjson"
_ARROW = "application/vnd.apache.arrow.stream"
_TIMEOUT_S = 600.0
#: The service returns unused memory within this time.
_SETTLE_S = 12.0
#: Memory that may remain, MB.
_LIMIT_MB = 600.0
_BUSY = 429


def main() -> int:
    """Measure and print; the exit status is 1 if more memory remains than the limit."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--requests", type=int, default=3 * len(KINDS))
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--clients", type=int, default=1, help="clients that send at the same time")
    parser.add_argument(
        "--impatient", action="store_true", help="do not wait when the service answers 429"
    )
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder, Traffic(Path(folder), 10) as sky:
        attack = _Attack(sky.url, sky.pid, options.seed, options.requests, options.impatient)
        before_mb = resident_mb(sky.pid)
        with ThreadPoolExecutor(options.clients) as clients:
            list(clients.map(attack.send, range(options.clients)))
        time.sleep(_SETTLE_S)
        after_mb = resident_mb(sky.pid)
        disk_mb = (
            sum(file.stat().st_size for file in Path(folder).rglob("*") if file.is_file()) / 1e6
        )
        start_s = sky.restart()
        start_mb = resident_mb(sky.pid)
    rows = [
        (kind, " ".join(f"{status}: {number}" for status, number in sorted(counts.items())),
         f"{statistics.median(attack.memory_mb[kind]):.0f}")
        for kind, counts in attack.answers.items() if counts
    ]  # fmt: skip
    print(markdown_table(Table("Bodies", ("body", "answers", "memory after it, MB"), tuple(rows))))
    most_mb = max(mb for those in attack.memory_mb.values() for mb in those)
    print(
        f"{options.requests} bodies of 16 MiB: {before_mb:.0f} MB before, at most {most_mb:.0f} MB "
        f"after an answer, {after_mb:.0f} MB {_SETTLE_S:.0f} s after the last (limit "
        f"{_LIMIT_MB:.0f}); {disk_mb:.0f} MB on disk; started again in {start_s:.1f} s, "
        f"{start_mb:.0f} MB"
    )
    return int(after_mb > _LIMIT_MB)


class _Attack:
    """Sends bodies of all kinds in turn, from several addresses."""

    def __init__(self, url: str, pid: int, seed: int, requests: int, impatient: bool) -> None:
        place = urlsplit(url)
        self._host, self._port, self._pid = place.hostname or "", place.port, pid
        self._impatient = impatient
        self._bodies = itertools.islice(_bodies(seed), requests)
        self._lock = threading.Lock()
        self.answers: dict[str, Counter[int]] = {kind: Counter() for kind in KINDS}
        self.memory_mb: dict[str, list[float]] = {kind: [] for kind in KINDS}

    def send(self, client: int) -> None:
        """Send bodies until there are no more."""
        while True:
            with self._lock:
                kind, media_type, body = next(self._bodies, ("", "", b""))
            if not kind:
                return
            status = self._post(f"127.0.0.{client + 1}", media_type, body)
            with self._lock:
                self.answers[kind][status] += 1
                self.memory_mb[kind].append(resident_mb(self._pid))

    def _post(self, address: str, media_type: str, body: bytes) -> int:
        while True:
            client = http.client.HTTPConnection(
                self._host, self._port, timeout=_TIMEOUT_S, source_address=(address, 0)
            )
            try:
                client.request("POST", "/v1/measurements", body, {"Content-Type": media_type})
                answer = client.getresponse()
                answer.read()
                if answer.status != _BUSY or self._impatient:
                    return answer.status
                time.sleep(float(answer.getheader("Retry-After", "1")))
            except ConnectionError:
                # Rejected before the body was read.
                return 0
            finally:
                client.close()


def resident_mb(pid: int) -> float:
    """Return the resident set of a process, MB."""
    pages = int(Path(f"/proc/{pid}/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def _bodies(seed: int) -> Iterator[tuple[str, str, bytes]]:
    chance = random.Random(seed)
    # Making a body costs more than sending it: each is used again, all in another order.
    made = [(kind, media, make(chance)[:OCTETS]) for kind, (media, make) in KINDS.items()]
    while True:
        yield from made
        chance.shuffle(made)


def _array(row: bytes, rows: int = _ROWS) -> bytes:
    return b"[" + b",".join([row] * min(rows, OCTETS // (len(row) + 1) - 1)) + b"]"


def _lines(make: Callable[[int], bytes]) -> bytes:
    return b"\n".join(make(number) for number in range(_ROWS))


def _future(chance: random.Random) -> bytes:
    return _lines(
        lambda number: (
            b'{"time_s": %d.5, "sensor_id": "R1", "kind": "radar", "range_m": 50000, '
            b'"azimuth_deg": 10, "height_m": 1000, "mode_s_address": "%06x"}'
            % (4_000_000_000 + number, chance.randrange(1, 1 << 24))
        )
    )


#: Media type and maker of each kind of body.
KINDS: dict[str, tuple[str, Callable[[random.Random], bytes]]] = {
    "more rows than allowed": (_JSON, lambda _: _array(b'{"range_m": -5}', 10 * _ROWS)),
    "rows with an invalid time": (
        _JSON, lambda _: _array(b'{"time_s": -1, "sensor_id": "%s"}' % (b"y" * 120)),
    ),
    "one long text": (_JSON, lambda _: b'[{"sensor_id": "' + b"z" * (OCTETS - 32) + b'"}]'),
    "114 long lines": (
        _LINES, lambda _: b"\n".join([b'{"a": "%s"}' % (b"q" * (OCTETS // 114 - 16))] * 114),
    ),
    "deep nesting": (_JSON, lambda _: b"[" * OCTETS),
    "escapes": (_JSON, lambda _: b'["' + b"\\u00e9" * (OCTETS // 6 - 1) + b'"]'),
    "a million keys": (
        _JSON,
        lambda _: b"[{" + b",".join(b'"k%d":1' % one for one in range(1_000_000)) + b"}]",
    ),
    "random octets": (_JSON, lambda chance: chance.randbytes(OCTETS)),
    "empty lines": (_LINES, lambda _: b"\n" * OCTETS),
    "rows with an impossible range": (
        _LINES,
        lambda _: _lines(
            lambda number: b'{"time_s": %d.5, "sensor_id": "R1", "kind": "radar", "range_m": 1e300}'
            % number
        ),
    ),
    "Arrow of random octets": (_ARROW, lambda chance: b"\xff" * 4 + chance.randbytes(OCTETS - 4)),
    "a number of 16 million digits": (
        _JSON, lambda _: b'[{"time_s": ' + b"9" * (OCTETS - 32) + b"}]",
    ),
    "rows of the future": (_LINES, _future),
}  # fmt: skip

if __name__ == "__main__":
    raise SystemExit(main())
