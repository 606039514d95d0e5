"""Measures what pages cost the service: its ingest rate with and without readers.

::

    python -m validation.page.check_readers            # 20 pages, 2000 aircraft

Readers ask as the page does, in a process of their own: what they compute themselves does not
count. Rounds with and without readers alternate; each posts the same amount of measurements as fast
as the service takes them. The figure is the processor time of the service per ingested plot: a rate
in seconds depends on what else the machine does, this does not. Its increase is the fraction of the
ingest rate that pages cost, 1 - without / with: the service is bound by its processor. For the same
reason the seconds between two questions of a reader are those of the processor of the service: as
often as on a machine where it has a core for itself. The first frames, with all earlier positions,
are read before a round begins: a page is opened once. The service takes no snapshots: one would
fall into some rounds and not into others.
`processor of a second` is what readers cost beside the traffic of real time.
"""

import argparse
import asyncio
import json
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import pairwise
from pathlib import Path

import httpx

from multiradar.api.pages import PAGE_HEADER
from multiradar.report.content import Table
from multiradar.report.markdown import markdown_table
from validation.service.traffic import CLOCK, Traffic, processor_s

#: As in `page/src/service/feed.ts`: seconds between frames, and between the documents.
FRAME_S, DOCUMENTS_S = 0.5, 4.0
DOCUMENTS = ("v1/sensors", "v1/status")
_SETTLE_S = 3.0
#: The time of the processor is read so often.
_POLL_S = 0.02
_STEADY_S = 15.0
_NO_SNAPSHOTS = {"MULTIRADAR_JOURNAL__SNAPSHOT_INTERVAL_S": "0"}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--pages", type=int, default=20)
    parser.add_argument("--aircraft", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--seconds", type=float, default=200.0, help="data time posted in a round")
    parser.add_argument("--read", help=argparse.SUPPRESS)
    parser.add_argument("--pid", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.read is not None:
        asyncio.run(_read(options.read, options.pages, _Time(options.pid)))
        return
    with (
        tempfile.TemporaryDirectory() as folder,
        Traffic(Path(folder), options.aircraft, settings=_NO_SNAPSHOTS) as sky,
    ):
        rates: dict[bool, list[float]] = {False: [], True: []}
        used: dict[bool, list[float]] = {False: [], True: []}
        for number in range(2 * options.rounds + 1):
            pages = number % 2 == 1
            with _readers(sky.url, options.pages if pages else 0, sky.pid) as frames:
                rate, used_us = _ingest(sky, options.seconds)
            rates[pages].append(rate)
            used[pages].append(used_us)
            read = f", {frames[0]} frames" if pages else ""
            print(f"  {'with' if pages else 'without'} pages: {used_us:.1f} µs per plot{read}")
        sky.live()
        steady: dict[int, float] = {}
        for count in (0, options.pages):
            with _readers(sky.url, count):
                before_s, began_s = sky.processor_s(), CLOCK.monotonic_s()
                time.sleep(_STEADY_S)
                steady[count] = (sky.processor_s() - before_s) / (CLOCK.monotonic_s() - began_s)
    # Each round with readers lies between two without, of which the mean counts: drifts cancel.
    around = [(before + after) / 2.0 for before, after in pairwise(used[False])]
    lost = [1.0 - without / beside for without, beside in zip(around, used[True], strict=True)]
    rows = [
        [name, f"{statistics.median(rates[pages]):,.0f}", f"{statistics.median(used[pages]):.1f}",
         f"{100.0 * steady[options.pages if pages else 0]:.1f} %"]
        for name, pages in (("no page", False), (f"{options.pages} pages", True))
    ]  # fmt: skip
    heading = ("readers", "plots/s", "processor per plot, µs", "processor of a second")
    print(markdown_table(Table("Readers", heading, tuple(map(tuple, rows)))))
    cost = steady[options.pages] - steady[0]
    print(
        f"{options.pages} pages cost {100.0 * statistics.median(lost):.1f} % of the ingest rate "
        f"({', '.join(f'{100.0 * one:.1f}' for one in lost)}; limit 15)"
    )
    print(f"processor of {options.pages} pages: {100.0 * cost:.1f} % of a core")


def _ingest(sky: Traffic, seconds: float) -> tuple[float, float]:
    frame = sky.prepared(seconds)
    before_s, began_s = sky.processor_s(), CLOCK.monotonic_s()
    for part in frame.iter_slices(5000):
        sky.post(part)
    sky.flush()
    took_s = CLOCK.monotonic_s() - began_s
    return len(frame) / took_s, 1e6 * (sky.processor_s() - before_s) / len(frame)


@contextmanager
def _readers(url: str, pages: int, pid: int | None = None) -> Iterator[list[int]]:
    # The number of frames read is known at the end.
    frames: list[int] = []
    if pages == 0:
        time.sleep(_SETTLE_S)
        yield frames
        return
    command = [sys.executable, "-m", "validation.page.check_readers", "--read", url]
    clock = [] if pid is None else ["--pid", str(pid)]
    command += ["--pages", str(pages), *clock]
    process = subprocess.Popen(command, stdout=subprocess.PIPE)
    try:
        time.sleep(_SETTLE_S)
        yield frames
    finally:
        process.terminate()
        frames.append(len(process.communicate()[0]))


class _Time:
    """Seconds of the clock, or of the processor of a process."""

    def __init__(self, pid: int | None) -> None:
        self._pid = pid

    def now_s(self) -> float:
        return CLOCK.monotonic_s() if self._pid is None else processor_s(self._pid)

    async def wait(self, until_s: float) -> None:
        # There is no event of processor time.
        while (left_s := until_s - self.now_s()) > 0.0:  # noqa: ASYNC110
            await asyncio.sleep(left_s if self._pid is None else _POLL_S)


async def _read(url: str, pages: int, time_: _Time) -> None:
    limits = httpx.Limits(max_connections=4 * pages)
    async with httpx.AsyncClient(base_url=url, timeout=60.0, limits=limits) as client:
        loops = []
        for page in range(pages):
            loops.append(_frames(client, time_, f"{page}", page * FRAME_S / pages))
            loops.append(_documents(client, time_, page * DOCUMENTS_S / pages))
        await asyncio.gather(*loops)


async def _frames(client: httpx.AsyncClient, time_: _Time, name: str, first_s: float) -> None:
    # By the clock: the processor of a service without traffic hardly advances.
    await asyncio.sleep(first_s)
    given: dict[str, int] = {}
    while True:
        began_s = time_.now_s()
        answer = await client.get("/v1/picture", params=given, headers={PAGE_HEADER: name})
        # An answer that says too busy is asked for again with the next tick, as by the page.
        if answer.status_code == 200:
            length = struct.unpack_from("<I", answer.content, 4)[0]
            given = {"after": json.loads(answer.content[8 : 8 + length])["next"]}
            # Counted by the parent.
            print(".", end="", flush=True)
        await time_.wait(began_s + FRAME_S)


async def _documents(client: httpx.AsyncClient, time_: _Time, first_s: float) -> None:
    await time_.wait(time_.now_s() + first_s)
    while True:
        for address in DOCUMENTS:
            await client.get(f"/{address}")
        await time_.wait(time_.now_s() + DOCUMENTS_S)


if __name__ == "__main__":
    main()
