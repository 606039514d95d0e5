"""Measures what pages cost the service: its ingest rate with and without readers.

::

    python -m validation.page.check_readers            # 20 pages, 2000 aircraft

Readers ask as the page does, in a process of their own. Rounds alternate; each posts the same
amount of measurements as fast as the service takes them. `processor of a second` is what readers
cost while nothing is ingested but the traffic of real time; on an idle machine it is the fraction
of the ingest rate that they take, as long as the service computes on one core.
"""

import argparse
import asyncio
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx

from multiradar.report.content import Table
from multiradar.report.markdown import markdown_table
from validation.page.traffic import CLOCK, Traffic

#: As in `page/src/feed.ts`: seconds between frames, and between the documents.
FRAME_S, DOCUMENTS_S = 0.5, 4.0
DOCUMENTS = ("v1/sensors", "v1/status")
_SETTLE_S = 3.0
_STEADY_S = 15.0


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--pages", type=int, default=20)
    parser.add_argument("--aircraft", type=int, default=2000)
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--seconds", type=float, default=40.0, help="data time posted in a round")
    parser.add_argument("--read", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.read is not None:
        asyncio.run(_read(options.read, options.pages))
        return
    with tempfile.TemporaryDirectory() as folder, Traffic(Path(folder), options.aircraft) as sky:
        rates: dict[bool, list[float]] = {False: [], True: []}
        used: dict[bool, list[float]] = {False: [], True: []}
        for number in range(2 * options.rounds):
            pages = number % 2 == 1
            with _readers(sky.url, options.pages if pages else 0):
                rate, used_us = _ingest(sky, options.seconds)
            rates[pages].append(rate)
            used[pages].append(used_us)
        sky.live()
        steady: dict[int, float] = {}
        for count in (0, options.pages):
            with _readers(sky.url, count):
                before_s, began_s = sky.processor_s(), CLOCK.monotonic_s()
                time.sleep(_STEADY_S)
                steady[count] = (sky.processor_s() - before_s) / (CLOCK.monotonic_s() - began_s)
    pairs = zip(rates[False], rates[True], strict=True)
    lost = statistics.median(1.0 - with_pages / without for without, with_pages in pairs)
    rows = [
        [name, f"{statistics.median(rates[pages]):,.0f}", f"{statistics.median(used[pages]):.1f}",
         f"{100.0 * steady[options.pages if pages else 0]:.1f} %"]
        for name, pages in (("no page", False), (f"{options.pages} pages", True))
    ]  # fmt: skip
    heading = ("readers", "plots/s", "processor per plot, µs", "processor of a second")
    print(markdown_table(Table("Readers", heading, tuple(map(tuple, rows)))))
    cost = steady[options.pages] - steady[0]
    print(f"ingest rate with {options.pages} pages: {-100.0 * lost:+.1f} % here (limit -15)")
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
def _readers(url: str, pages: int) -> Iterator[None]:
    if pages == 0:
        time.sleep(_SETTLE_S)
        yield
        return
    command = [sys.executable, "-m", "validation.page.check_readers", "--read", url]
    process = subprocess.Popen([*command, "--pages", str(pages)])
    try:
        time.sleep(_SETTLE_S)
        yield
    finally:
        process.terminate()
        process.wait()


async def _read(url: str, pages: int) -> None:
    limits = httpx.Limits(max_connections=4 * pages)
    async with httpx.AsyncClient(base_url=url, timeout=60.0, limits=limits) as client:
        loops = []
        for page in range(pages):
            loops.append(_frames(client, page * FRAME_S / pages))
            loops.append(_documents(client, page * DOCUMENTS_S / pages))
        await asyncio.gather(*loops)


async def _frames(client: httpx.AsyncClient, first_s: float) -> None:
    await asyncio.sleep(first_s)
    given: dict[str, int] = {}
    while True:
        began_s = CLOCK.monotonic_s()
        content = (await client.get("/v1/picture", params=given)).content
        length = struct.unpack_from("<I", content, 4)[0]
        given = {"after": httpx.Response(200, content=content[8 : 8 + length]).json()["next"]}
        await asyncio.sleep(max(0.05, FRAME_S - (CLOCK.monotonic_s() - began_s)))


async def _documents(client: httpx.AsyncClient, first_s: float) -> None:
    await asyncio.sleep(first_s)
    while True:
        for address in DOCUMENTS:
            await client.get(f"/{address}")
        await asyncio.sleep(DOCUMENTS_S)


if __name__ == "__main__":
    main()
