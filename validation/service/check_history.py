"""Queries of a day-old hour of a history on disk, over HTTP.

    python -m validation.service.check_history [--hours 25] [--queries 40]

A service with `[history]` follows simulated traffic of 119 measurements per second of data time,
as fast as it accepts them. Then each query is asked for random times within the first hour, on one
connection. Memory retains one to two hours of this traffic, so use `--hours 3` at least.
"""

import argparse
import http.client
import itertools
import json
import tempfile
from collections.abc import Callable
from io import BytesIO
from pathlib import Path

import numpy as np
import polars as pl

from multiradar.clock import SystemClock
from validation.service.check_world import Fed, Service
from validation.service.world_scene import START_S, World, continent

CLOCK = SystemClock()
_AIRCRAFT, _RADARS, _ADSB_PERIOD_S = 230, 6, 2.0
_PLACE = (49.0, 10.0)
_HOUR_S = 3600.0
#: Blocks in one message.
_GATHERED = 15
_OK = 200
_LIMIT_MS = 300.0


def main() -> int:
    """Run and print the figures; the exit status is 1 if a query took longer than the limit."""
    parser = argparse.ArgumentParser(prog="python -m validation.service.check_history")
    parser.add_argument("--hours", type=float, default=25.0, help="of data in the history")
    parser.add_argument("--queries", type=int, default=40, help="of each kind")
    parser.add_argument("--folder", type=Path, help="for journal and history")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory(dir=options.folder) as name:
        folder = Path(name)
        settings = folder / "service.toml"
        settings.write_text(f'[history]\nfolder = "{folder / "history"}"\n', encoding="utf-8")
        world = World(_AIRCRAFT, _RADARS, (continent(*_PLACE),), _ADSB_PERIOD_S)
        text = world.sensors_text(0)
        service = Service(folder / "service", text, ["--config", str(settings)])
        try:
            service.listen()
            _feed(service, world, options.hours * _HOUR_S)
            return _asked(service, world, options)
        finally:
            service.stop()


def _feed(service: Service, world: World, duration_s: float) -> None:
    begin_s, fed = CLOCK.monotonic_s(), Fed()
    connection = http.client.HTTPConnection(service.address, timeout=120.0)
    blocks = world.blocks(duration_s)
    while gathered := list(itertools.islice(blocks, _GATHERED)):
        frames = [frame for (frame,) in gathered]
        content = BytesIO()
        pl.concat(frames, rechunk=True).write_ipc_stream(content)
        service.send(connection, content.getvalue(), fed)
    connection.close()
    status = service.settled()
    print(f"{fed.accepted:,} measurements accepted, {fed.rejected:,} rejected in "
          f"{CLOCK.monotonic_s() - begin_s:.0f} s; {status['history']}")  # fmt: skip


def _asked(service: Service, world: World, options: argparse.Namespace) -> int:
    random = np.random.Generator(np.random.PCG64(1))
    connection = http.client.HTTPConnection(service.address, timeout=120.0)
    moments = START_S + random.uniform(0.25 * _HOUR_S, _HOUR_S, options.queries)
    document = json.loads(_answer(connection, f"/v1/tracks?at={moments[0]:.1f}")[1])
    numbers = [one["track_id"] for one in document["tracks"]]
    radars = [one.name for one in world.radars]
    past = f"since={START_S:.1f}&limit=1000"
    kinds: dict[str, Callable[[float], str]] = {
        "tracks": lambda at: f"/v1/tracks?at={at:.1f}",
        "sensors": lambda at: f"/v1/sensors?at={at:.1f}",
        "air picture": lambda at: f"/v1/picture?at={at:.1f}",
        "path of a track": lambda _: f"/v1/tracks/{random.choice(numbers)}/history?{past}",
        "biases of a radar": lambda _: (
            f"/v1/sensors/{random.choice(radars)}/bias?history=true&{past}"
        ),
    }
    worst_ms = 0.0
    print(f"query                  median   worst  octets   ({options.queries} each)")
    for name, address in kinds.items():
        taken, size = [], 0
        for at in moments.tolist():
            begin_s = CLOCK.monotonic_s()
            status, content = _answer(connection, address(at))
            taken.append(1e3 * (CLOCK.monotonic_s() - begin_s))
            if status != _OK:
                raise SystemExit(f"{address(at)}: {status}, {content[:200]!r}")
            size = max(size, len(content))
        worst_ms = max(worst_ms, max(taken))
        print(f"{name:20s} {np.median(taken):6.0f} ms {max(taken):5.0f} ms  {size:,}")
    return int(worst_ms > _LIMIT_MS)


def _answer(connection: http.client.HTTPConnection, path: str) -> tuple[int, bytes]:
    connection.request("GET", path)
    answer = connection.getresponse()
    return answer.status, answer.read()


if __name__ == "__main__":
    raise SystemExit(main())
