"""A subscriber in a process of its own, as somebody outside the project would write it.

It takes one JSON object of options, prints a line `ready`, then one JSON object with what it
received: as soon as it has `expect` updates, or when its time is over.
"""

import json
import subprocess
import sys
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import zenoh
import zenoh.ext

TESTS = Path(__file__).parents[1]


def client_config(endpoint: str) -> zenoh.Config:
    """A client of one router or peer, and of nobody else."""
    config = zenoh.Config()
    for key, value in {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "listen/endpoints": [],
        "connect/timeout_ms": -1,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return config


class SubscriberProcess:
    """The subscriber as its parent sees it."""

    def __init__(self, endpoint: str, expect: int, **options: Any) -> None:
        given = {"endpoint": endpoint, "expect": expect, **options}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "support.zenoh_subscriber", json.dumps(given)],
            stdout=subprocess.PIPE,
            cwd=TESTS,
        )
        assert self.process.stdout is not None
        self._stdout = self.process.stdout
        assert self._stdout.readline() == b"ready\n"

    def __enter__(self) -> "SubscriberProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait(10)
        self._stdout.close()

    def result(self) -> dict[str, Any]:
        """Wait for what it received."""
        text = self._stdout.read()
        assert self.process.wait(10) == 0
        found: dict[str, Any] = json.loads(text)
        return found


@dataclass
class _Received:
    numbers: Counter[int] = field(default_factory=Counter)
    last_of_key: dict[str, int] = field(default_factory=dict)
    out_of_order: int = 0
    mismatched: int = 0
    samples: int = 0


def _say(text: str) -> None:
    sys.stdout.write(text)
    sys.stdout.flush()


def _main(options: dict[str, Any]) -> None:
    config = client_config(options["endpoint"])
    if "lease_ms" in options:
        config.insert_json5("transport/link/tx/lease", json.dumps(options["lease_ms"]))
    session = zenoh.open(config)
    received = _Received()

    def on_sample(sample: zenoh.Sample) -> None:
        document = json.loads(sample.payload.to_bytes())
        number = int(document["sequence"])
        attached = sample.attachment
        if attached is None or int(attached.to_bytes()) != number:
            received.mismatched += 1
        key = str(sample.key_expr)
        if number <= received.last_of_key.get(key, 0):
            received.out_of_order += 1
        received.last_of_key[key] = number
        received.numbers[number] += 1
        received.samples += 1
        if received.samples == options.get("sleep_at"):
            time.sleep(options["sleep_s"])

    subscriber = zenoh.ext.declare_advanced_subscriber(
        session,
        options.get("key", "multiradar/v1/tracks/*"),
        on_sample,
        history=zenoh.ext.HistoryConfig(detect_late_publishers=options.get("detect", True)),
        recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
    )
    # A client of a router knows what the router knows only after a moment.
    time.sleep(0.3)
    _say("ready\n")
    end_s = time.monotonic() + options.get("patience_s", 20.0)
    while time.monotonic() < end_s and len(received.numbers) < options["expect"]:
        time.sleep(0.02)
    # Whatever comes twice would come now.
    time.sleep(0.2)
    _say(
        json.dumps(
            {
                "distinct": len(received.numbers),
                "missing": [
                    number
                    for number in range(1, max(received.numbers, default=0))
                    if number not in received.numbers
                ][:20],
                "twice": sum(1 for count in received.numbers.values() if count > 1),
                "greatest": max(received.numbers, default=0),
                "out_of_order": received.out_of_order,
                "mismatched": received.mismatched,
                "keys": len(received.last_of_key),
            }
        )
    )
    subscriber.undeclare()  # type: ignore[no-untyped-call]  # so in its stubs
    session.close()  # type: ignore[no-untyped-call]  # so in its stubs


if __name__ == "__main__":
    _main(json.loads(sys.argv[1]))
