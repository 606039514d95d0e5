"""Delay of the output while one radar sends plots of ever new aircraft.

::

    python -m validation.service.check_storm --plots 25000

Three radars observe simulated aircraft in real time. The last one begins to send further plots,
each with a new Mode S address, from a client of its own. The delay of a track update is the time
from its measurement until a subscriber has it: it includes the interval of the messages and the
time for which the service sorts measurements. How far the output is behind is the difference to the
median delay before.
"""

import argparse
import asyncio
import contextlib
import json
import multiprocessing
import tempfile
import threading
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import polars as pl
import websockets

from multiradar.clock import SystemClock
from multiradar.report.content import Table
from multiradar.report.markdown import markdown_table
from validation.service.traffic import SITES, Traffic

CLOCK = SystemClock()
_MESSAGE_S = 0.5
#: Data time before the measurement, s.
_WARM_S = 24.0
_RADAR = list(SITES)[-1]
_RANGE_M = (10_000.0, 200_000.0)
_ADDRESSES = 0x800000
_ARROW = {"content-type": "application/vnd.apache.arrow.stream"}
_TIMEOUT_S = 60.0
_LIMIT_S = 2.0
_PHASES = ("before", "during", "after")


def main() -> int:
    """Measure and print; the exit status is 1 if the output was delayed too long."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--plots", type=int, default=25_000, help="additional plots per second")
    parser.add_argument("--aircraft", type=int, default=200)
    parser.add_argument("--seconds", type=float, default=60.0, help="duration of the storm")
    parser.add_argument("--margin-seconds", type=float, default=20.0, help="before and after it")
    options = parser.parse_args()
    with (
        tempfile.TemporaryDirectory() as folder,
        Traffic(Path(folder), options.aircraft, _WARM_S, past_s=_WARM_S) as sky,
    ):
        storm = _Storm(sky.url, options.plots)
        ours, theirs = multiprocessing.Pipe()
        context = multiprocessing.get_context("spawn")
        reader = context.Process(target=_subscriber, args=(sky.url, theirs))
        reader.start()
        ours.recv()
        edges_s = np.cumsum([options.margin_seconds, options.seconds, options.margin_seconds])
        begin_s = CLOCK.monotonic_s()
        data_s = _fed(sky, storm, edges_s.tolist(), begin_s)
        status = _settled(sky.url)
        ours.send("end")
        updates = np.array(ours.recv())
        reader.join()
        start_s = sky.restart()
    at_s, time_s, radar = updates.T
    since_s, delay_s = time_s - data_s, at_s - begin_s - (time_s - data_s)
    others = (radar != list(SITES).index(_RADAR)) & (since_s >= 0.0)
    phase = np.searchsorted(edges_s, since_s, side="right")
    behind_s = delay_s - np.median(delay_s[others & (phase == 0)])
    rows = []
    for number, name in enumerate(_PHASES):
        kept = behind_s[others & (phase == number)]
        parts = np.quantile(kept, (0.5, 0.99, 1.0)).tolist()
        rows.append((name, f"{len(kept)}", *(f"{part:.2f}" for part in parts)))
    names = ("storm", "updates of other radars", "behind: median, s", "99 %, s", "longest, s")
    print(markdown_table(Table("Delay", names, tuple(rows))))
    print(
        f"{options.plots} plots per second for {options.seconds:.0f} s: {storm.accepted} accepted, "
        f"{storm.unsent} not sent after 429, rejected {dict(storm.rejected)}; "
        f"{status['tracks']} tracks, alarms {status['sensor_alarms']}; killed and started again in "
        f"{start_s:.1f} s"
    )
    return int(behind_s[others].max() > _LIMIT_S)


class _Storm:
    """The plots of aircraft that do not exist."""

    def __init__(self, url: str, rate: int) -> None:
        transport = httpx.HTTPTransport(local_address="127.0.0.2")
        self._client = httpx.Client(base_url=url, timeout=_TIMEOUT_S, transport=transport)
        self._rate, self._made = rate, 0
        self._random = np.random.Generator(np.random.PCG64(17))
        self._waits_until_s = 0.0
        self.accepted = self.unsent = 0
        self.rejected: Counter[str] = Counter()

    def send(self, from_s: float, to_s: float) -> None:
        """Send those of an interval of data time, unless it must wait."""
        count = round(self._rate * (to_s - from_s))
        if CLOCK.monotonic_s() < self._waits_until_s:
            self.unsent += count
            return
        answer = self._client.post(
            "/v1/measurements", content=self._plots(count, from_s, to_s), headers=_ARROW
        )
        if answer.status_code == httpx.codes.TOO_MANY_REQUESTS:
            self.unsent += count
            self._waits_until_s = CLOCK.monotonic_s() + float(answer.headers["retry-after"])
            return
        document: dict[str, Any] = answer.json()
        self.accepted += document["accepted"]
        self.rejected.update(one["code"] for one in document["rejected"])

    def _plots(self, count: int, from_s: float, to_s: float) -> bytes:
        first, self._made = self._made, self._made + count
        frame = pl.DataFrame(
            {
                "time_s": np.linspace(from_s, to_s, count, endpoint=False),
                "sensor_id": [_RADAR] * count,
                "kind": ["radar"] * count,
                "range_m": self._random.uniform(*_RANGE_M, count),
                "azimuth_deg": self._random.uniform(0.0, 360.0, count),
                "height_m": self._random.uniform(2000.0, 9000.0, count),
                "mode_s_address": [f"{_ADDRESSES + one:06x}" for one in range(first, self._made)],
            }
        )
        return frame.write_ipc_stream(None).getvalue()


def _fed(sky: Traffic, storm: _Storm, edges_s: list[float], begin_s: float) -> float:
    """Feed in real time, and return the data time of the start."""
    first_s = sky.data_time_s
    with ThreadPoolExecutor(1) as thread:
        for end_s in np.arange(_MESSAGE_S, edges_s[-1] + _MESSAGE_S / 2.0, _MESSAGE_S).tolist():
            frame = sky.prepared(_MESSAGE_S)
            threading.Event().wait(max(0.0, begin_s + end_s - CLOCK.monotonic_s()))
            if edges_s[0] < end_s <= edges_s[1]:
                thread.submit(storm.send, first_s + end_s - _MESSAGE_S, first_s + end_s)
            if len(frame):
                sky.post(frame)
    return first_s


def _settled(url: str) -> dict[str, Any]:
    """Wait until all messages are processed, and return the status."""
    while True:
        found: dict[str, Any] = httpx.get(f"{url}/v1/status", timeout=_TIMEOUT_S).json()
        if found["processed_sequence"] == found["journal_sequence"]:
            return found
        threading.Event().wait(_MESSAGE_S)


def _subscriber(url: str, pipe: "Connection[Any, Any]") -> None:
    asyncio.run(_received(url, pipe))


async def _received(url: str, pipe: "Connection[Any, Any]") -> None:
    radars = {name: number for number, name in enumerate(SITES)}
    updates: list[tuple[float, float, int]] = []
    address = url.replace("http:", "ws:") + "/v1/stream?kinds=track"
    async with websockets.connect(address, max_size=None, compression=None) as socket:
        pipe.send("connected")
        while not pipe.poll():
            with contextlib.suppress(TimeoutError):
                text = await asyncio.wait_for(socket.recv(), _MESSAGE_S)
                now_s = CLOCK.monotonic_s()
                for event in json.loads(text).get("events", ()):
                    data = event["data"]
                    if int(data["mode_s_address"] or "0", 16) < _ADDRESSES:
                        updates.append((now_s, data["time_s"], radars[data["sensor_id"]]))
    pipe.send(updates)


if __name__ == "__main__":
    raise SystemExit(main())
