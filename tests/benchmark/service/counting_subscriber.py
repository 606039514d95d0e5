"""A Zenoh subscriber in a process of its own that only counts updates with different numbers.

It prints `ready`; to each line on standard input it answers with how many different updates have
come and when the last did (`perf_counter`, one clock for all processes of a Linux system). It ends
with its standard input.
"""

import json
import subprocess
import sys
import time
from time import perf_counter

import zenoh
import zenoh.ext

from support.paths import TESTS
from support.processes.zenoh_subscriber import client_config

KEY = "multiradar/v1/tracks/*"
_SETTLE_S = 0.5


class CountingSubscriber:
    """The subscriber, as a context manager for its parent."""

    def __init__(self, endpoint: str) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-m", "benchmark.service.counting_subscriber", endpoint],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            cwd=TESTS,
        )
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._stdin, self._stdout = self._process.stdin, self._process.stdout
        self._stdout.readline()

    def __enter__(self) -> "CountingSubscriber":
        return self

    def __exit__(self, *_: object) -> None:
        self._stdin.close()
        self._process.wait(20)
        self._stdout.close()

    def count(self) -> tuple[int, float]:
        """Return the number of different updates so far, and the time of the last."""
        self._stdin.write("\n")
        self._stdin.flush()
        number, last_s = json.loads(self._stdout.readline())
        return number, last_s

    def wait_for(self, number: int, patience_s: float) -> tuple[int, float]:
        """Return `count` after this many updates, or after this time without one."""
        found, last_s = self.count()
        while found < number and perf_counter() - last_s < patience_s:
            time.sleep(0.02)
            found, last_s = self.count()
        return found, last_s


def main(endpoint: str) -> None:
    """Count until standard input ends."""
    session = zenoh.open(client_config(endpoint))
    numbers: set[bytes] = set()
    last_s = perf_counter()

    def on_sample(sample: zenoh.Sample) -> None:
        nonlocal last_s
        attached = sample.attachment
        if attached is not None:
            numbers.add(attached.to_bytes())
            last_s = perf_counter()

    subscriber = zenoh.ext.declare_advanced_subscriber(
        session,
        KEY,
        on_sample,
        history=zenoh.ext.HistoryConfig(detect_late_publishers=True),
        recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
    )
    time.sleep(_SETTLE_S)
    print("ready", flush=True)
    for _ in sys.stdin:
        print(json.dumps([len(numbers), last_s]), flush=True)
    subscriber.undeclare()  # type: ignore[no-untyped-call]  # so in its stubs
    session.close()  # type: ignore[no-untyped-call]  # so in its stubs


if __name__ == "__main__":
    main(sys.argv[1])
