"""Tracks and biases out: one thread that reads the service's events and never waits for anybody."""

import re
import threading
from collections.abc import Callable
from dataclasses import dataclass

from multiradar.clock import Clock
from multiradar.ingest.zenoh.bus import Outlet, Stream
from multiradar.ingest.zenoh.catch_up import CatchUp, NumberedUpdate
from multiradar.ingest.zenoh.counts import ZenohCounts
from multiradar.ingest.zenoh.joining import JoinGate
from multiradar.ingest.zenoh.keys import BIASES, ENDED, TRACKS, sensor_key
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.runtime.ports import EventSource, StreamEvent

#: Updates that a cache keeps at least, however many tracks there are.
CACHE_SAMPLES_MIN = 64
#: Estimates kept of one sensor.
BIAS_SAMPLES = 1024
#: Events read at a time; the gate for those who join is looked at before each.
_EVENTS_AT_A_TIME = 512
#: Longest sleep without an event, so that joins and retired tracks are looked after.
_IDLE_S = 0.02
#: A heartbeat tells who missed the last update of a stream; 1 s for few streams, and one second
#: more for every so many, because thousands of timers cost more than the updates.
_STREAMS_PER_SECOND = 500.0
_SEQUENCE = re.compile(rb'"sequence":\s*([0-9]+)')


@dataclass(slots=True)
class _Kept:
    stream: Stream
    depth: int
    count: int = 0


class Publisher:
    """Publishes the events of the service.

    Parameters
    ----------
    outlet : Outlet
        Where to.
    source : EventSource
        What.
    known_until : int
        Events up to this number were there before: they fill the caches and are not sent again.
    gate : JoinGate
        Waited for before each update.
    catch_up : CatchUp
        Gets every track update.
    counts : ZenohCounts
        Told of everything.
    options : ZenohOptions
        Depth of caches, retention.
    clock : Clock
        For the retention.
    """

    def __init__(
        self,
        *,
        outlet: Outlet,
        source: EventSource,
        known_until: int,
        gate: JoinGate,
        catch_up: CatchUp,
        counts: ZenohCounts,
        options: ZenohOptions,
        clock: Clock,
    ) -> None:
        self._outlet = outlet
        self._source = source
        self._known_until = known_until
        self._gate = gate
        self._catch_up = catch_up
        self._counts = counts
        self._options = options
        self._clock = clock
        self._streams: dict[str, _Kept] = {}
        # By time of retirement: a dictionary keeps the order in which keys were added.
        self._retired: dict[str, float] = {}
        self._something = threading.Event()
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        """Begin to publish."""
        self._source.set_wakeup(self._something.set)
        self._thread = threading.Thread(target=self._run, name="zenoh-publisher", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Publish what is there, then stop."""
        self._stopping.set()
        self._something.set()
        if self._thread is not None:
            self._thread.join()
        self._source.close()
        for stream in self._streams.values():
            stream.stream.close()
        self._streams.clear()

    def step(self) -> bool:
        """Publish the next events; False when there was none."""
        events = self._source.poll(_EVENTS_AT_A_TIME)
        for event in events:
            if self._gate.closed:
                self._gate.open_when_quiet(self._pause)
            self._publish(event)
        self._retire()
        return bool(events)

    # ---------------------------------------------------------------- inside

    def _run(self) -> None:
        while True:
            # Looked at before the poll, so that what came before the stop is still published.
            stopping = self._stopping.is_set()
            self._something.clear()
            if self.step():
                continue
            if stopping:
                return
            self._gate.open_when_quiet(self._pause)
            self._something.wait(_IDLE_S)

    def _pause(self, duration_s: float) -> None:
        self._stopping.wait(duration_s)

    def _publish(self, event: StreamEvent) -> None:
        if event.kind == "track":
            self._track(event)
        elif event.kind == "bias":
            self._bias(event)
        elif event.kind == "ended":
            self._ended(event)
        elif event.kind == "gap":
            self._counts.add(published_gaps=1)
            self._counts.alarm("PUBLICATION_GAP", event.payload.decode(), TRACKS)

    def _track(self, event: StreamEvent) -> None:
        found = _SEQUENCE.search(event.payload)
        number = int(found[1]) if found else event.sequence
        key = f"{TRACKS}/{event.key}"
        self._catch_up.append(NumberedUpdate(number, key, event.payload))
        self._emit(key, event, event.payload, number, self._cache_depth)
        self._counts.add(published_tracks=1)

    def _bias(self, event: StreamEvent) -> None:
        key = sensor_key(BIASES, event.key)
        payload = event.payload[:-1] + b',"sequence":%d}' % event.sequence
        self._emit(key, event, payload, event.sequence, lambda: BIAS_SAMPLES)
        self._counts.add(published_biases=1)

    def _ended(self, event: StreamEvent) -> None:
        key = f"{TRACKS}/{event.key}"
        self._retired[key] = self._clock.monotonic_s()
        if event.sequence > self._known_until:
            self._outlet.put(f"{ENDED}/{event.key}", event.payload, b"%d" % event.sequence)
            self._counts.add(published_ended=1)

    def _emit(
        self,
        key: str,
        event: StreamEvent,
        payload: bytes,
        number: int,
        depth: Callable[[], int],
    ) -> None:
        kept = self._streams.get(key)
        if kept is None:
            heartbeat_s = 1.0 + len(self._streams) / _STREAMS_PER_SECOND
            room = depth()
            kept = _Kept(self._outlet.stream(key, room, heartbeat_s), room)
            self._streams[key] = kept
            self._counts.add(streams=1)
        self._retired.pop(key, None)
        if kept.count < kept.depth:
            kept.count += 1
            self._gate.samples += 1
        if event.sequence > self._known_until:
            kept.stream.send(payload, b"%d" % number)
        else:
            kept.stream.remember(payload, b"%d" % number)

    def _cache_depth(self) -> int:
        share = self._options.cache_samples_total // (len(self._streams) + 1)
        return min(max(share, CACHE_SAMPLES_MIN), self._options.cache_samples_max)

    def _retire(self) -> None:
        before_s = self._clock.monotonic_s() - self._options.retention_s
        while self._retired:
            key, since_s = next(iter(self._retired.items()))
            if since_s > before_s:
                return
            del self._retired[key]
            kept = self._streams.pop(key, None)
            if kept is not None:
                kept.stream.close()
                self._gate.samples -= kept.count
                self._counts.add(streams=-1)
