"""Batches of events for stream clients, encoded once for all clients."""

import asyncio
import math
import threading
from collections import OrderedDict
from collections.abc import AsyncGenerator, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from multiradar.access.shares import CLIENT, Shares
from multiradar.api.workers import Workers
from multiradar.observability.metrics import STREAM_CLIENTS, STREAM_EVENTS, STREAM_GAPS
from multiradar.runtime.ports import EventSource, StreamEvents, View
from multiradar.settings.limits import HttpLimits

#: Kinds of events that a client can select; gap notices are always sent.
KINDS = ("track", "bias", "ended", "status", "sensor")
GAP = "gap"

# The ring of events bounds how far a client may lag behind, not the stream.
_WHOLE_RING = 2**31

# Clients that keep up get the same batches within one interval, so the last few are cached.
_RETAINED_BATCHES = 16


@dataclass(frozen=True, slots=True)
class Batch:
    """Events sent to a client together.

    Attributes
    ----------
    last : int
        Sequence number to resume after.
    count : int
        Events in it; 0 makes it a heartbeat.
    text : bytes
        The encoded batch, ready for the wire; empty in a heartbeat.
    """

    last: int
    count: int
    text: bytes


Encoder = Callable[[StreamEvents], bytes]


class StreamHub:
    """The open streams of one process; their number is bounded and their batches are shared.

    Parameters
    ----------
    view : View
        Source of events.
    workers : Workers
        Threads that poll and encode.
    limits : HttpLimits
        Bounds of streams.
    """

    def __init__(self, view: View, workers: Workers, limits: HttpLimits) -> None:
        self._view = view
        self._workers = workers
        self._limits = limits
        self._shares = Shares(
            "streams open", "TOO_MANY_STREAMS", limits.streams_max, limits.client_streams_max,
            retry_after_s=5,
        )  # fmt: skip
        self._retained: OrderedDict[tuple[object, ...], _Shared] = OrderedDict()
        self._lock = threading.Lock()

    @contextmanager
    def slot(self, transport: str) -> Iterator[None]:
        """Hold a slot for a stream.

        Raises
        ------
        RequestError
            503 when all slots are in use, 429 when those of the client are.
        """
        client = CLIENT.get()
        self._shares.add(client)
        STREAM_CLIENTS.labels(transport=transport).inc()
        try:
            yield
        finally:
            self._shares.remove(client)
            STREAM_CLIENTS.labels(transport=transport).dec()

    async def batches(
        self, transport: str, after: int | None, kinds: frozenset[str], encode: Encoder
    ) -> AsyncGenerator[Batch, None]:
        """Yield batches for one client until the service is drained; an empty one: a heartbeat."""
        # Not on another thread: a client that disconnects meanwhile would leak its subscription.
        subscription = self._view.subscribe(after, _WHOLE_RING)
        bell = _Wakeup()
        subscription.set_wakeup(bell.set)
        last = subscription.after
        try:
            while True:
                bell.clear()
                # Before the poll, so that events before the end are sent.
                ended = subscription.ended
                batch = await self._workers.run(self._next, subscription, kinds, encode, transport)
                if batch is None and ended:
                    return
                if batch is None:
                    rung = await bell.wait(self._limits.stream_heartbeat_s)
                    if not rung:
                        yield Batch(last, 0, b"")
                    else:
                        await self._next_tick()
                    continue
                last = batch.last
                STREAM_EVENTS.labels(transport=transport).inc(batch.count)
                yield batch
        finally:
            subscription.close()

    def _next(
        self, subscription: EventSource, kinds: frozenset[str], encode: Encoder, transport: str
    ) -> Batch | None:
        polled = subscription.poll_table(self._limits.stream_batch_events_max)
        numbers = polled.numbers
        if not numbers:
            return None
        gaps = polled.kinds.count(GAP)
        STREAM_GAPS.labels(transport=transport).inc(gaps)
        key = (transport, kinds, numbers[0], numbers[-1], gaps, len(numbers))
        with self._lock:
            shared = self._retained.setdefault(key, _Shared())
            while len(self._retained) > _RETAINED_BATCHES:
                self._retained.popitem(last=False)
        return shared.batch(polled, kinds, encode)

    async def _next_tick(self) -> None:
        # All clients wait for the same tick, so that they get the same events and share them.
        interval_s = self._limits.stream_batch_interval_s
        now_s = asyncio.get_running_loop().time()
        await asyncio.sleep((math.floor(now_s / interval_s) + 1) * interval_s - now_s)


class _Shared:
    # A batch of several clients; they ask for it at the same tick, and one of them encodes it.

    def __init__(self) -> None:
        self._batch: Batch | None = None
        self._lock = threading.Lock()

    def batch(self, polled: StreamEvents, kinds: frozenset[str], encode: Encoder) -> Batch:
        with self._lock:
            if self._batch is None:
                chosen = polled.of_kinds(kinds | {GAP})
                count = len(chosen.kinds)
                self._batch = Batch(polled.numbers[-1], count, encode(chosen) if count else b"")
            return self._batch


class _Wakeup:
    # An event of the loop that any thread may set; setting it twice costs one call.

    def __init__(self) -> None:
        self._loop = asyncio.get_running_loop()
        self._event = asyncio.Event()
        self._pending = False

    def set(self) -> None:
        if not self._pending:
            self._pending = True
            self._loop.call_soon_threadsafe(self._event.set)

    def clear(self) -> None:
        self._event.clear()
        self._pending = False

    async def wait(self, timeout_s: float) -> bool:
        try:
            async with asyncio.timeout(timeout_s):
                await self._event.wait()
        except TimeoutError:
            return False
        return True
