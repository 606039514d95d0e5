"""Measures how fast one client is served while another one attacks.

::

    python -m validation.service.check_shares --seconds 20

A service is fed in real time. A client asks for one track again and again, each time when the last
answer has come. Meanwhile another client, with an address of its own, does the following in turn:
nothing; 64 bodies of which an octet arrives each second; 100 streams that it does not read; four
continuous queries for all encounters of the next ten minutes; nothing. The exit status is 1 if a
query of the first client was not answered, or if the median of one row is above `--median-max`. The
bound is that of a machine without other work.
"""

import argparse
import socket
import tempfile
import threading
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import numpy as np

from multiradar.clock import SystemClock
from multiradar.report.content import Table
from multiradar.report.markdown import markdown_table
from validation.service.traffic import Traffic

CLOCK = SystemClock()
_ADDRESS = "127.0.0.2"
_BODIES, _STREAMS, _QUERIES = 64, 100, 4
_TRICKLE_S = 1.0
_TIMEOUT_S = 60.0
_SETTLE_S = 2.0
_POST = (
    b"POST /v1/measurements HTTP/1.1\r\nHost: localhost\r\nContent-Type: application/json\r\n"
    b"Content-Length: 1000000\r\n\r\n["
)
_STREAM = b"GET /v1/events HTTP/1.1\r\nHost: localhost\r\n\r\n"
_ENCOUNTERS = "/v1/encounters?horizon_s=600&distance_m=100000&height_m=20000&limit=10000"


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--aircraft", type=int, default=500)
    parser.add_argument("--seconds", type=float, default=20.0, help="duration of each attack")
    parser.add_argument("--median-max", type=float, default=100.0, help="ms; above it, status 1")
    options = parser.parse_args()
    rows, medians_ms, unanswered = [], [], 0
    with tempfile.TemporaryDirectory() as folder, Traffic(Path(folder), options.aircraft) as sky:
        sky.live()
        for name, attack in (
            ("nothing", _nothing),
            (f"{_BODIES} slow bodies", _bodies),
            (f"{_STREAMS} streams that are not read", _streams),
            (f"{_QUERIES} continuous queries for encounters", _queries),
            ("nothing", _nothing),
        ):
            ended, seen = threading.Event(), Counter[str]()
            with ThreadPoolExecutor(1) as thread:
                attacking = thread.submit(attack, sky.url, ended, seen)
                threading.Event().wait(_SETTLE_S)
                times_ms, failed = _asked(sky.url, options.seconds)
                ended.set()
                attacking.result()
            medians_ms.append((name, float(np.median(times_ms))))
            parts = (f"{one:.0f}" for one in np.quantile(times_ms, (0.5, 0.99, 1.0)))
            theirs = ", ".join(f"{what}: {number}" for what, number in sorted(seen.items()))
            rows.append((name, f"{len(times_ms)}", *parts, theirs))
            unanswered += failed
    names = ("another client does", "answers", "median, ms", "99 %, ms", "longest, ms", "it gets")
    print(markdown_table(Table("One track", names, tuple(rows))))
    print(f"{unanswered} queries for a track were not answered")
    slow = slowest(medians_ms, options.median_max)
    print(slow or f"all medians are at most {options.median_max:.0f} ms")
    return int(unanswered > 0 or slow is not None)


def slowest(medians_ms: Sequence[tuple[str, float]], bound_ms: float) -> str | None:
    """Return a sentence on the largest median if it is above a bound, ms; else None.

    Parameters
    ----------
    medians_ms : sequence of (str, float)
        What another client does, and the median of the answers, ms.
    bound_ms : float
        The bound, ms.
    """
    name, median_ms = max(medians_ms, key=lambda one: one[1])
    if median_ms <= bound_ms:
        return None
    return (
        f"{name}: median {median_ms:.0f} ms, above {bound_ms:.0f} ms "
        "(bound for a machine without other work)"
    )


def _asked(url: str, duration_s: float) -> tuple[list[float], int]:
    """Ask for one track for some time; return the times of the answers, ms, and the failures."""
    times_ms, failed = [], 0
    with httpx.Client(base_url=url, timeout=_TIMEOUT_S) as client:
        number = client.get("/v1/tracks?limit=1").json()["tracks"][0]["track_id"]
        end_s = CLOCK.monotonic_s() + duration_s
        while CLOCK.monotonic_s() < end_s:
            began_s = CLOCK.monotonic_s()
            failed += client.get(f"/v1/tracks/{number}").status_code != httpx.codes.OK
            times_ms.append(1e3 * (CLOCK.monotonic_s() - began_s))
    return times_ms, failed


def _nothing(_url: str, ended: threading.Event, _seen: Counter[str]) -> None:
    ended.wait()


def _bodies(url: str, ended: threading.Event, seen: Counter[str]) -> None:
    opened = [_connected(url, _POST) for _ in range(_BODIES)]
    while not ended.wait(_TRICKLE_S):
        for number, one in enumerate(opened):
            try:
                one.sendall(b" ")
            except OSError:
                # Ended by the service: another takes its place.
                seen["ended"] += 1
                one.close()
                opened[number] = _connected(url, _POST)
    for one in opened:
        one.close()


def _streams(url: str, ended: threading.Event, seen: Counter[str]) -> None:
    opened = [_connected(url, _STREAM) for _ in range(_STREAMS)]
    for one in opened:
        one.settimeout(_TIMEOUT_S)
        status = one.recv(12).decode("ascii", "replace")
        seen[status[9:] or "closed"] += 1
    ended.wait()
    for one in opened:
        one.close()


def _queries(url: str, ended: threading.Event, seen: Counter[str]) -> None:
    transport = httpx.HTTPTransport(local_address=_ADDRESS)

    def ask(_number: int) -> None:
        while not ended.is_set():
            seen[str(client.get(_ENCOUNTERS).status_code)] += 1

    with (
        httpx.Client(base_url=url, timeout=_TIMEOUT_S, transport=transport) as client,
        ThreadPoolExecutor(_QUERIES) as threads,
    ):
        list(threads.map(ask, range(_QUERIES)))


def _connected(url: str, begin: bytes) -> socket.socket:
    place = urlsplit(url)
    opened = socket.create_connection(
        (place.hostname, place.port), _TIMEOUT_S, source_address=(_ADDRESS, 0)
    )
    opened.sendall(begin)
    return opened


if __name__ == "__main__":
    raise SystemExit(main())
