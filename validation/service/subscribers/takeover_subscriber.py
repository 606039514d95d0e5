"""A Zenoh subscriber of a pair of services, which does what the documents advise after a restart.

It discards updates with known numbers, and queries those that are missing.
"""

import json
import queue
import socket
import threading
from collections.abc import Callable
from typing import Any

import zenoh

_TRACKS = "multiradar/v1/tracks/*"
#: Interval between attempts to connect, and between queries of missing updates, s.
_RETRY_S = 0.05
_TIMEOUT_S = 60.0


def free_endpoint() -> str:
    """Return a free TCP endpoint of this host."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


class Subscriber:
    """Receives all track updates at one endpoint, whichever service has it.

    Parameters
    ----------
    endpoint : str
        The endpoint of both services; one of them listens.

    Attributes
    ----------
    updates : dict of int to dict
        The updates by number, without what depends on the time of reception.
    received, queried : int
        Updates that came as samples, and those that were missing and had to be queried.
    """

    def __init__(self, endpoint: str) -> None:
        self.updates: dict[int, dict[str, Any]] = {}
        self.received = self.queried = self._received_before = 0
        self._samples: queue.SimpleQueue[zenoh.Sample | None] = queue.SimpleQueue()
        self._session = zenoh.open(_config(endpoint))
        self._session.declare_subscriber(_TRACKS, self._samples.put)
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def connect(self) -> None:
        """Wait until one of the services serves it; what comes from then on is to be received."""
        info = self._session.info
        _wait(lambda: bool(info.peers_zid() or info.routers_zid()), "a connection")
        self._received_before = self.received

    def receive(self) -> None:
        """Wait for an update that came as a sample."""
        _wait(lambda: self.received > self._received_before, "an update")

    def stop(self, last: int) -> None:
        """Stop; then there are all updates up to the last one, if the service still has them."""
        self._samples.put(None)
        self._thread.join()
        self._query(last)
        self._session.close()  # type: ignore[no-untyped-call]  # so in its stubs

    def retained(self, last: int) -> dict[int, dict[str, Any]]:
        """Stop, and return the updates that the service still has, up to the last one."""
        self._samples.put(None)
        self._thread.join()
        self.updates.clear()
        after = 0
        while after < last:
            self._query_after(after, last - after)
            after = max(self.updates, default=after)
        self._session.close()  # type: ignore[no-untyped-call]  # so in its stubs
        return self.updates

    def _run(self) -> None:
        while (sample := self._samples.get()) is not None:
            number = int(bytes(sample.attachment or b"0"))
            if number in self.updates:
                continue
            # Those before it may be with a service that has not started.
            self._query(number - 1)
            self._note(sample)
            self.received += 1

    # Query what is missing up to a number.
    def _query(self, last: int) -> None:
        _wait(lambda: len(self.updates) >= last or self._is_queried(last), "missing update")

    def _is_queried(self, last: int) -> bool:
        self._query_after(len(self.updates), last - len(self.updates))
        return len(self.updates) >= last

    def _query_after(self, after: int, count: int) -> None:
        for reply in self._session.get(
            f"{_TRACKS}?after={after};limit={count}",
            consolidation=zenoh.ConsolidationMode.NONE,
            timeout=_TIMEOUT_S,
        ):
            if reply.ok is not None:
                self._note(reply.ok)
                self.queried += 1

    def _note(self, sample: zenoh.Sample) -> None:
        update = json.loads(sample.payload.to_bytes())
        update.pop("data_delay_s", None)
        self.updates[update["sequence"]] = update


def _wait(condition: Callable[[], bool], what: str) -> None:
    for _ in range(round(_TIMEOUT_S / _RETRY_S)):
        if condition():
            return
        threading.Event().wait(_RETRY_S)
    raise SystemExit(f"no {what} over Zenoh within {_TIMEOUT_S:.0f} s")


def _config(endpoint: str) -> zenoh.Config:
    config = zenoh.Config()
    for key, value in {
        "mode": "client",
        "connect/endpoints": [endpoint],
        "connect/timeout_ms": -1,
        "connect/retry": dict.fromkeys(("period_init_ms", "period_max_ms"), round(1e3 * _RETRY_S)),
        "scouting/multicast/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    return config
