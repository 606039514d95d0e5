"""Subscribers of several services, which note when updates arrive; in a process of their own.

    python -m validation.service.subscribers.world_subscribers FILE COUNT picture|stream URL...

The line `end` on the standard input ends it. The file then has the rows of `ARRIVALS`.
"""

import asyncio
import json
import re
import sys
from pathlib import Path

import httpx
import numpy as np
import websockets

from multiradar.clock import SystemClock

#: A message or a frame: when it arrived (monotonic, s), the oldest and the newest data time in it,
#: its octets, and the events that it reports as lost.
ARRIVALS = np.dtype(
    [("region", "i4"), ("at_s", "f8"), ("oldest_s", "f8"), ("newest_s", "f8"), ("octets", "i8"),
     ("lost", "i8")]
)  # fmt: skip
#: Interval at which the page reads the picture, s.
PICTURE_S = 1.0
_TIME = re.compile(rb'"time_s":([0-9.]+)')
_GAP = re.compile(rb'"gap":\{"from":(\d+),"to":(\d+)\}')
_CLOCK = SystemClock()

Rows = list[tuple[int, float, float, float, int, int]]


async def stream(region: int, url: str, rows: Rows) -> None:
    """Read every track update over a WebSocket."""
    address = url.replace("http:", "ws:") + "/v1/stream?kinds=track"
    async with websockets.connect(address, max_size=None, compression=None) as socket:
        while True:
            try:
                text = await socket.recv(decode=False)
            except websockets.ConnectionClosedOK:
                return
            first, last = _TIME.search(text), _TIME.search(text, max(text.rfind(b'"time_s":'), 0))
            lost = sum(int(b) - int(a) + 1 for a, b in _GAP.findall(text[:2000]))
            if first is not None and last is not None:
                times = float(first[1]), float(last[1])
                now_s = _CLOCK.monotonic_s()
                rows.append((region, now_s, min(times), max(times), len(text), lost))


async def picture(region: int, url: str, rows: Rows) -> None:
    """Read the air picture as the page does."""
    after: int | None = None
    async with httpx.AsyncClient(base_url=url, timeout=60.0, trust_env=False) as client:
        while True:
            begin_s = _CLOCK.monotonic_s()
            parameters: dict[str, int] = {} if after is None else {"after": after}
            answer = await client.get("/v1/picture", params=parameters)
            content = answer.content
            if answer.status_code == httpx.codes.OK:
                begin = 8 + int.from_bytes(content[4:8], "little")
                header = json.loads(content[8:begin])
                after = header["next"]
                tracks = header["tables"]["tracks"]
                offset = begin + tracks["columns"]["time_s"][1]
                time_s = np.frombuffer(content, "<f8", tracks["rows"], offset)
                if len(time_s):
                    newest_s, now_s = float(time_s.max()), _CLOCK.monotonic_s()
                    row = (region, now_s, newest_s, newest_s, len(content), header["skipped"])
                    rows.append(row)
            await asyncio.sleep(max(0.0, begin_s + PICTURE_S - _CLOCK.monotonic_s()))


async def _run(count: int, kind: str, urls: list[str], rows: Rows) -> None:
    read = {"stream": stream, "picture": picture}[kind]
    tasks = [
        asyncio.create_task(read(region, url, rows))
        for _ in range(count)
        for region, url in enumerate(urls)
    ]
    await asyncio.get_running_loop().run_in_executor(None, sys.stdin.readline)
    for task in tasks:
        task.cancel()
    ended = await asyncio.gather(*tasks, return_exceptions=True)
    failed = [one for one in ended if isinstance(one, Exception)]
    if failed:
        print(f"{len(failed)} of {len(tasks)} subscribers failed: {failed[0]!r}", file=sys.stderr)


def main() -> int:
    """Subscribe until the standard input ends."""
    path, count, kind, *urls = sys.argv[1:]
    rows: Rows = []
    asyncio.run(_run(int(count), kind, urls, rows))
    np.save(Path(path), np.array(rows, ARRIVALS))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
