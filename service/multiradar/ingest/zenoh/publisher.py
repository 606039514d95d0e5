"""Track and bias output: one thread that publishes events and never waits for a subscriber."""

import re
import threading
from collections.abc import Callable
from dataclasses import dataclass

from multiradar.clock import Clock
from multiradar.ingest.zenoh.bus import Outlet, Stream
from multiradar.ingest.zenoh.catch_up import CatchUp, NumberedUpdate
from multiradar.ingest.zenoh.counts import ZenohCounts
from multiradar.ingest.zenoh.joining import JoinGate
from multiradar.ingest.zenoh.keys import BIASES, ENDED, SENSORS, TRACKS, sensor_key
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.runtime.ports import EventSource, StreamEvent

#: Minimum depth of the cache of a track.
CACHE_SAMPLES_MIN = 64
#: Depth of the cache of a sensor.
BIAS_SAMPLES = 1024
#: Events read at a time; the join gate is checked before each event.
_EVENTS_AT_A_TIME = 512
#: Maximum sleep without an event, after which joins and retired tracks are checked, s.
_IDLE_S = 0.02
#: A heartbeat lets subscribers detect that they missed the last update of a stream. Its period is
#: 1 s for few streams, and 1 s more for every so many streams, because thousands of timers cost
#: more than the updates.
_STREAMS_PER_SECOND = 500.0
_SEQUENCE = re.compile(rb'"sequence":\s*([0-9]+)')


@dataclass(slots=True)
class _CachedStream:
    stream: Stream
    depth: int
    count: int = 0


class Publisher:
    """Publishes events of the service.

    Parameters
    ----------
    outlet : Outlet
        Output.
    source : EventSource
        Events.
    known_until : int
        Events up to this number were published before: they fill the caches and are not sent again.
    gate : JoinGate
        Delays updates while a subscriber joins.
    catch_up : CatchUp
        Receives every track update.
    counts : ZenohCounts
        Counters.
    options : ZenohOptions
        Cache depths and retention.
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
        self._streams: dict[str, _CachedStream] = {}
        # By time of retirement, in order of insertion.
        self._retired: dict[str, float] = {}
        # Since when there was always another event to publish, s; None: nothing is waiting.
        self._behind_since_s: float | None = None
        self._something = threading.Event()
        self._stopping = threading.Event()
        self._thread: threading.Thread | None = None

    @property
    def lag_s(self) -> float:
        """Time since everything was last published, s; 0 if it is."""
        since_s = self._behind_since_s
        return 0.0 if since_s is None else self._clock.monotonic_s() - since_s

    def start(self) -> None:
        """Start publishing."""
        self._source.set_wakeup(self._something.set)
        self._thread = threading.Thread(target=self._run, name="zenoh-publisher", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """Publish pending events, then stop."""
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
        if not events:
            self._behind_since_s = None
        elif self._behind_since_s is None:
            self._behind_since_s = self._clock.monotonic_s()
        for event in events:
            if self._gate.closed:
                self._gate.wait_for_joins(self._pause)
            self._publish(event)
        self._retire()
        return bool(events)

    # ---------------------------------------------------------------- inside

    def _run(self) -> None:
        while True:
            # Read before the poll, so that events before the stop are still published.
            stopping = self._stopping.is_set()
            self._something.clear()
            if self.step():
                continue
            if stopping:
                return
            self._gate.wait_for_joins(self._pause)
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
        elif event.kind == "sensor":
            self._sensor(event)
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

    def _sensor(self, event: StreamEvent) -> None:
        if event.sequence > self._known_until:
            key = sensor_key(SENSORS, event.key)
            self._outlet.put(key, event.payload, b"%d" % event.sequence)
            self._counts.add(published_sensors=1)

    def _emit(
        self,
        key: str,
        event: StreamEvent,
        payload: bytes,
        number: int,
        depth: Callable[[], int],
    ) -> None:
        cached = self._streams.get(key)
        if cached is None:
            heartbeat_s = 1.0 + len(self._streams) / _STREAMS_PER_SECOND
            capacity = depth()
            cached = _CachedStream(self._outlet.stream(key, capacity, heartbeat_s), capacity)
            self._streams[key] = cached
            self._counts.add(streams=1)
        self._retired.pop(key, None)
        if cached.count < cached.depth:
            cached.count += 1
            self._gate.samples += 1
        if event.sequence > self._known_until:
            cached.stream.send(payload, b"%d" % number)
        else:
            cached.stream.cache(payload, b"%d" % number)

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
            cached = self._streams.pop(key, None)
            if cached is not None:
                cached.stream.close()
                self._gate.samples -= cached.count
                self._counts.add(streams=-1)
