"""Batches of events for stream clients, encoded once for all clients."""

import asyncio
import math
from collections import OrderedDict
from collections.abc import AsyncGenerator, Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from multiradar.access.shares import CLIENT, Shares
from multiradar.access.workers import Workers
from multiradar.observability.metrics import STREAM_CLIENTS, STREAM_EVENTS, STREAM_GAPS
from multiradar.runtime.ports import EventSource, StreamEvents, View
from multiradar.settings.limits import HttpLimits

#: Kinds of events that a client can select; gap notices are always sent.
KINDS = ("track", "bias", "ended", "status", "sensor")
GAP = "gap"

# The ring of events bounds how far a client may lag behind, not the stream.
_WHOLE_RING = 2**31

# Clients that keep up get the same batches within one interval, so the last few are cached: as many
# as two messages of 8000 measurements.
_RETAINED_BATCHES = 32


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
    gaps : int
        Notices of lost events among them.
    """

    last: int
    count: int
    text: bytes
    gaps: int = 0


Encoder = Callable[[StreamEvents], bytes]
# Encoder, kinds, edition of the stream, and the number before the batch.
_Key = tuple[Encoder, frozenset[str], int, int]


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
        # Used on the thread of the event loop only.
        self._retained: OrderedDict[_Key, asyncio.Task[Batch | None]] = OrderedDict()

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
        """Yield batches for one client until the service is drained; an empty one: a heartbeat.

        None of them while the journal is replayed: there is no number yet to resume after.
        """
        # Not on another thread: a client that disconnects meanwhile would leak its subscription.
        subscription = self._view.subscribe(after, _WHOLE_RING)
        bell = _Wakeup()
        subscription.set_wakeup(bell.set)
        last, waiting = subscription.after, subscription.waiting
        # Tick in which a batch was sent that was not full.
        sent_tick = -1
        try:
            while True:
                bell.clear()
                if waiting and not subscription.waiting:
                    last, waiting = subscription.after, False
                # Before the poll, so that events before the end are sent.
                ended = subscription.ended
                batch = await self._next(subscription, kinds, encode)
                if batch is None and ended:
                    return
                if batch is None:
                    rung = await bell.wait(self._limits.stream_heartbeat_s)
                    if not rung and not waiting:
                        yield Batch(last, 0, b"")
                    elif rung:
                        await self._after_tick(sent_tick)
                    continue
                if batch.last - last < self._limits.stream_batch_events_max:
                    sent_tick = self._tick()
                last = batch.last
                STREAM_EVENTS.labels(transport=transport).inc(batch.count)
                STREAM_GAPS.labels(transport=transport).inc(batch.gaps)
                yield batch
        finally:
            subscription.close()

    async def _next(
        self, subscription: EventSource, kinds: frozenset[str], encode: Encoder
    ) -> Batch | None:
        # Nothing but the event loop is needed by a client that is not the first of its batch.
        if subscription.is_idle():
            return None
        after = subscription.after
        key = (encode, kinds, subscription.edition, after)
        shared = self._retained.get(key)
        if shared is not None:
            batch = await asyncio.shield(shared)
            if batch is not None and not batch.gaps and subscription.skip(after + 1, batch.last):
                return batch
            return await self._workers.run(self._read, subscription, kinds, encode)
        work = self._workers.run(self._read, subscription, kinds, encode)
        # Not cancelled with the first client: others may wait for it.
        shared = asyncio.create_task(work)
        self._retained[key] = shared
        while len(self._retained) > _RETAINED_BATCHES:
            self._retained.popitem(last=False)
        shared.add_done_callback(lambda ended: self._drop_unusable(key, ended))
        return await asyncio.shield(shared)

    def _read(
        self, subscription: EventSource, kinds: frozenset[str], encode: Encoder
    ) -> Batch | None:
        polled = subscription.poll_table(self._limits.stream_batch_events_max)
        if not polled.numbers:
            return None
        chosen = polled.of_kinds(kinds | {GAP})
        count = len(chosen.kinds)
        text = encode(chosen) if count else b""
        return Batch(polled.numbers[-1], count, text, chosen.kinds.count(GAP))

    # Of a client that had left, of one with a gap of its own, or of a failure.
    def _drop_unusable(self, key: _Key, ended: "asyncio.Task[Batch | None]") -> None:
        failed = ended.cancelled() or ended.exception() is not None
        batch = None if failed else ended.result()
        if (batch is None or batch.gaps) and self._retained.get(key) is ended:
            del self._retained[key]

    def _tick(self) -> int:
        now_s = asyncio.get_running_loop().time()
        return math.floor(now_s / self._limits.stream_batch_interval_s)

    # The first events after a pause are sent at once, and those that follow are collected. All
    # clients wait for the same tick, so that they get the same events and share them.
    async def _after_tick(self, tick: int) -> None:
        begin_s = (tick + 1) * self._limits.stream_batch_interval_s
        await asyncio.sleep(max(0.0, begin_s - asyncio.get_running_loop().time()))


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
