"""Processor time of a service by thread, with subscribers of one interface.

    POLARS_MAX_THREADS=1 python -m validation.service.live_stages [--readers 10]
        [--interface websocket] [--seconds 30] [--warm 10] [--speed 1] [-- options of serve]

The service has the region Europe of the worldwide scenario: 3900 aircraft, 104 radars and ADS-B. It
receives a message for each 0.8 s of data time. The output has microseconds of CPU time per
measurement, from the clocks of its threads in Linux, and the digest of all updates.
"""

import argparse
import http.client
import json
import re
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any

from multiradar.clock import SystemClock
from validation.service.check_world import Fed, Service
from validation.service.engine_stages import EUROPE, MESSAGE_S, messages
from validation.service.subscribers.plain_readers import POLLED, STREAMS
from validation.service.world_scene import WORLD, World

CLOCK = SystemClock()
_NUMBER = re.compile(r"[-_]?\d+$")
#: Names of threads in the system have at most so many characters.
_NAMES = {"multiradar-api": "workers of the interfaces"}


def spent_ns(pid: int) -> Counter[str]:
    """Return the processor time of the threads of a process, by name, ns."""
    found: Counter[str] = Counter()
    for task in Path(f"/proc/{pid}/task").iterdir():
        name = _NUMBER.sub("", (task / "comm").read_text(encoding="utf-8").strip())
        used = (task / "schedstat").read_text(encoding="utf-8").split()[0]
        found[_NAMES.get(name.rstrip("_"), name)] += int(used)
    return found


def main() -> int:
    """Run, and print the figures."""
    parser = argparse.ArgumentParser(prog="python -m validation.service.live_stages")
    parser.add_argument("--readers", type=int, default=10)
    parser.add_argument("--interface", choices=(*STREAMS, *POLLED), default="websocket")
    parser.add_argument("--seconds", type=float, default=30.0, help="of data time")
    parser.add_argument("--warm", type=float, default=10.0, help="of data time, not counted")
    parser.add_argument("--speed", type=float, default=1.0, help="times real time")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("serve", nargs="*", help="after --: further options of serve")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        figures = _run(options, Path(name))
    if options.json:
        print(json.dumps(figures))
        return 0
    print(f"{options.readers} clients of {options.interface}, {figures['rate']:,.0f} "
          f"measurements/s, {figures['octets_per_s']:,.0f} octets/s")  # fmt: skip
    for thread, spent in figures["threads"].items():
        print(f"{thread:28s} {spent:6.2f} µs per measurement")
    print(f"output_sha256 {figures['output_sha256']}")
    return 0


def _run(options: argparse.Namespace, folder: Path) -> dict[str, Any]:
    world = World(15_000, 400, WORLD, 0.5)
    count = round(options.seconds / MESSAGE_S)
    bodies = [
        (one.write_ipc_stream(None, compression="uncompressed").getvalue(), len(one))
        for one in messages(world, count)
    ]
    service = Service(
        folder / "europe", world.sensors_text(EUROPE), options.serve,
        "validation.service.named_threads",
    )  # fmt: skip
    service.listen()
    readers = subprocess.Popen(
        [sys.executable, "-m", "validation.service.subscribers.plain_readers", options.interface,
         str(options.readers), service.url],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip
    time.sleep(1.0)
    connection = http.client.HTTPConnection(service.address)
    fed, rows, before = Fed(), 0, Counter[str]()
    begin_s = counted_s = CLOCK.monotonic_s()
    for number, (body, length) in enumerate(bodies):
        due_s = begin_s + number * MESSAGE_S / options.speed
        time.sleep(max(0.0, due_s - CLOCK.monotonic_s()))
        if number == round(options.warm / MESSAGE_S):
            before, rows, counted_s = spent_ns(service.pid), 0, CLOCK.monotonic_s()
        service.send(connection, body, fed)
        rows += length
    # Until the last message would be followed by another.
    due_s = begin_s + count * MESSAGE_S / options.speed
    time.sleep(max(0.0, due_s - CLOCK.monotonic_s()))
    spent = spent_ns(service.pid) - before
    duration_s = CLOCK.monotonic_s() - counted_s
    status = service.settled()
    time.sleep(1.0)
    octets = json.loads(readers.communicate("end\n")[0])
    service.stop()
    threads = {name: 1e-3 * used / rows for name, used in spent.most_common()}
    return {
        "rate": rows / duration_s,
        "octets_per_s": sum(octets) / (CLOCK.monotonic_s() - begin_s),
        "octets": octets,
        "rejected": fed.rejected,
        "threads": {**threads, "all": sum(threads.values())},
        "output_sha256": status["output_sha256"],
    }


if __name__ == "__main__":
    raise SystemExit(main())
