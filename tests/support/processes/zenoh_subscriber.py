"""A subscriber in a process of its own, as somebody outside the project would write it.

It takes one JSON object of options, prints a line `ready`, then one JSON object with what it
received: as soon as it has `expect` updates, or when its time is over. With the option `sleep_at`
it reads nothing after so many updates until it is woken by a line on standard input.
"""

import json
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import zenoh
import zenoh.ext

from support.paths import TESTS
from support.processes.certificates import Authority
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until


def client_config(endpoint: str) -> zenoh.Config:
    """A client of one router or peer only."""
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


def certified_config(
    endpoint: str, authority: Authority, name: str, signer: Authority | None = None
) -> zenoh.Config:
    """A client with a certificate of this common name, signed by an authority or another one."""
    certificate, key = (signer or authority).issue(name)
    config = client_config(endpoint)
    for item, value in {
        "connect/timeout_ms": 1500,
        "connect/exit_on_failure": True,
        "transport/link/tls/enable_mtls": True,
        "transport/link/tls/root_ca_certificate": str(authority.certificate),
        "transport/link/tls/connect_certificate": str(certificate),
        "transport/link/tls/connect_private_key": str(key),
    }.items():
        config.insert_json5(item, json.dumps(value))
    return config


class SubscriberProcess:
    """The subscriber as its parent sees it."""

    def __init__(self, endpoint: str, expect: int, **options: Any) -> None:
        given = {"endpoint": endpoint, "expect": expect, **options}
        self.process = subprocess.Popen(
            [sys.executable, "-m", "support.processes.zenoh_subscriber", json.dumps(given)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            cwd=TESTS,
        )
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self._stdin, self._stdout = self.process.stdin, self.process.stdout
        assert self._stdout.readline() == b"ready\n"

    def __enter__(self) -> "SubscriberProcess":
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait(WAIT_TIMEOUT_S)
        self._stdin.close()
        self._stdout.close()

    def wake(self) -> None:
        """Wake it."""
        self._stdin.write(b"\n")
        self._stdin.flush()

    def result(self) -> dict[str, Any]:
        """Wait for what it received."""
        text = self._stdout.read()
        assert self.process.wait(WAIT_TIMEOUT_S) == 0
        found: dict[str, Any] = json.loads(text)
        return found


@dataclass
class _Received:
    numbers: Counter[int] = field(default_factory=Counter)
    last_of_key: dict[str, int] = field(default_factory=dict)
    out_of_order: int = 0
    mismatched: int = 0
    samples: int = 0


def _answered(session: zenoh.Session) -> bool:
    return any(reply.ok for reply in session.get("multiradar/v1/status", timeout=WAIT_TIMEOUT_S))


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
            sys.stdin.readline()

    subscriber = zenoh.ext.declare_advanced_subscriber(
        session,
        options.get("key", "multiradar/v1/tracks/*"),
        on_sample,
        history=zenoh.ext.HistoryConfig(detect_late_publishers=options.get("detect", True)),
        recovery=zenoh.ext.RecoveryConfig(periodic_queries=None, heartbeat=True),
    )
    # Replies after the declaration come from peers that know the subscription.
    wait_until(lambda: _answered(session), "an answer of the service")
    _say("ready\n")
    wait_until(lambda: len(received.numbers) >= options["expect"], "all updates", fail=False)
    # Whatever comes twice comes before the answer to a question asked now.
    _answered(session)
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
