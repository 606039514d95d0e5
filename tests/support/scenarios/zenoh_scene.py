"""A service that publishes the events of a test, behind a real Zenoh session on a free port."""

import socket
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from multiradar.ingest.zenoh.gateway import ZenohGateway
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.ingest.zenoh.session import ZenohBus
from multiradar.runtime.stream.events import Event, EventRing, Subscription
from support.fakes.fake_service import FakeService, FakeView
from support.processes.waiting import pause, wait_until


def free_endpoint() -> str:
    """A free TCP endpoint on this host."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@dataclass
class StreamingView(FakeView):
    """A view whose events are track updates and biases with ascending numbers."""

    ring: EventRing = field(default_factory=lambda: EventRing(200_000))
    updates_published: int = 0

    def status(self) -> dict[str, Any]:
        return {"event_sequence": self.ring.head, "output_sequence": self.updates_published}

    def subscribe(self, after: int | None, depth: int) -> Subscription:
        return self.ring.subscribe(after, depth)

    def publish_updates(self, tracks: Sequence[int], padding: int = 300) -> None:
        """Publish one update of each track."""
        first, update = self.ring.head + 1, self.updates_published + 1
        self.updates_published += len(tracks)
        filler = b"x" * padding

        def encode() -> list[Event]:
            return [
                Event(
                    first + place,
                    "track",
                    str(track),
                    b'{"track_id":%d,"sequence":%d,"filler":"%s"}'
                    % (track, update + place, filler),
                )
                for place, track in enumerate(tracks)
            ]

        self.ring.append(len(tracks), lambda begin, end: encode()[begin:end])

    def publish_event(self, kind: str, key: str, payload: bytes) -> None:
        """Publish one event of another kind."""
        number = self.ring.head + 1
        self.ring.append(1, lambda _begin, _end: [Event(number, kind, key, payload)])

    def stream(
        self, count: int, tracks: int, per_s: float, joined: threading.Event | None = None
    ) -> None:
        """Publish updates of some tracks in turn, at a rate; the last half once others joined."""
        started_s, published, chunk = time.monotonic(), 0, 50
        while published < count:
            if joined is not None and 2 * published >= count and not joined.is_set():
                wait_until(joined.is_set, "subscribers that joined")
                started_s = time.monotonic() - published / per_s
            size = min(chunk, count - published)
            self.publish_updates([1 + (published + place) % tracks for place in range(size)])
            published += size
            ahead_s = started_s + published / per_s - time.monotonic()
            pause(max(ahead_s, 0.0))


def connections(running: ZenohGateway) -> int:
    """Return how many sessions are connected to a gateway."""
    bus = running._bus
    assert isinstance(bus, ZenohBus)
    return len(bus._session.info.transports())


@contextmanager
def gateway(
    view: StreamingView, service: FakeService | None = None, **options: Any
) -> Iterator[ZenohGateway]:
    """Run the Zenoh side on a free port of this host."""
    given = {"listen": (free_endpoint(),), **options}
    running = ZenohGateway(service or FakeService(view=view), ZenohOptions(**given))
    running.start()
    try:
        yield running
    finally:
        running.stop()
