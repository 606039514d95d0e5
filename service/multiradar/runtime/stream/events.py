"""Numbered events, the bounded ring that keeps them, and the subscribers that read it.

The engine's thread only appends. A chunk is encoded as JSON once, when the first subscriber reads
it, in the thread of that subscriber. An output has several chunks, so that its first events do not
wait for the encoding of its last ones. Readers never block the engine.
"""

import threading
from bisect import bisect_left
from collections import deque
from collections.abc import Callable, Container, Iterator, Sequence
from itertools import compress, islice
from typing import NamedTuple, overload

#: Events that are encoded together, at most.
CHUNK_EVENTS = 500

TRACK = "track"
BIAS = "bias"
ENDED = "ended"
STATUS = "status"
SENSOR = "sensor"
#: Not in the ring: notifies one subscriber of events that are no longer available.
GAP = "gap"


class Event(NamedTuple):
    """One event for subscribers.

    Attributes
    ----------
    sequence : int
        Number of the event, 1, 2, 3, …; depends only on the journal, the same after a restart. A
        gap notice has the last number that it covers.
    kind : str
        `track`, `bias`, `ended`, `status`, `sensor` or `gap`.
    key : str
        Track identifier or sensor identifier; empty for status and gap.
    payload : bytes
        A JSON object, encoded once for all subscribers.
    """

    sequence: int
    kind: str
    key: str
    payload: bytes


def gap_notice(first: int, last: int) -> Event:
    """Return the notice that the events from `first` to `last` are no longer available."""
    return Event(last, GAP, "", b'{"gap":{"from":%d,"to":%d}}' % (first, last))


class EventTable(Sequence[Event]):
    """Events in columns: of many retained objects, each collection of garbage looks at all.

    Parameters
    ----------
    numbers : sequence of int
        Sequence number of each.
    kinds, keys : list of str
        Its kind and key.
    payloads : list of bytes
        Its JSON object.
    """

    def __init__(
        self, numbers: Sequence[int], kinds: list[str], keys: list[str], payloads: list[bytes]
    ) -> None:
        #: Sequence number of each event.
        self.numbers = numbers
        #: Its kind.
        self.kinds = kinds
        #: Its key.
        self.keys = keys
        #: Its JSON object.
        self.payloads = payloads

    @classmethod
    def of(cls, events: Sequence[Event]) -> "EventTable":
        """Return events in columns."""
        if isinstance(events, EventTable):
            return events
        return cls(
            [one.sequence for one in events], [one.kind for one in events],
            [one.key for one in events], [one.payload for one in events],
        )  # fmt: skip

    @classmethod
    def joined(cls, parts: Sequence["EventTable"]) -> "EventTable":
        """Return the events of all parts, one part after the other."""
        if len(parts) == 1:
            return parts[0]
        joined = EventTable([], [], [], [])
        numbers: list[int] = []
        for part in parts:
            numbers += part.numbers
            joined.kinds += part.kinds
            joined.keys += part.keys
            joined.payloads += part.payloads
        joined.numbers = numbers
        return joined

    def between(self, begin: int, end: int) -> "EventTable":
        """Return the events at places begin…end."""
        some = slice(begin, end)
        return EventTable(
            self.numbers[some], self.kinds[some], self.keys[some], self.payloads[some]
        )

    def of_kinds(self, kinds: Container[str]) -> "EventTable":
        """Return the events of some kinds."""
        chosen = [kind in kinds for kind in self.kinds]
        if all(chosen):
            return self
        return EventTable(
            list(compress(self.numbers, chosen)), list(compress(self.kinds, chosen)),
            list(compress(self.keys, chosen)), list(compress(self.payloads, chosen)),
        )  # fmt: skip

    def __len__(self) -> int:
        return len(self.kinds)

    def __iter__(self) -> Iterator[Event]:
        return map(Event, self.numbers, self.kinds, self.keys, self.payloads)

    @overload
    def __getitem__(self, place: int) -> Event: ...
    @overload
    def __getitem__(self, place: slice) -> list[Event]: ...
    def __getitem__(self, place: int | slice) -> Event | list[Event]:
        if isinstance(place, slice):
            begin, end, step = place.indices(len(self))
            return list(self.between(begin, end))[::step]
        return Event(self.numbers[place], self.kinds[place], self.keys[place], self.payloads[place])


#: Returns the events of an output at places begin…end.
Encode = Callable[[int, int], Sequence[Event]]


class EventChunk:
    """Consecutive events of one output, encoded when first read.

    Parameters
    ----------
    first : int
        Sequence number of the first event.
    begin, end : int
        Places of the events in the output.
    encode : callable
        Returns the events at places begin…end; called at most once.
    """

    def __init__(self, first: int, begin: int, end: int, encode: Encode) -> None:
        self.first = first
        self.count = end - begin
        self._span = begin, end
        self._encode: Encode | None = encode
        self._events: Sequence[Event] = ()
        self._lock = threading.Lock()

    @property
    def last(self) -> int:
        """Sequence number of the last event."""
        return self.first + self.count - 1

    def events(self) -> Sequence[Event]:
        """Return the events, encoding them at the first call."""
        with self._lock:
            if self._encode is not None:
                self._events = self._encode(*self._span)
                # The arrays behind the encoder are not needed any more.
                self._encode = None
            return self._events


class EventRing:
    """The last events, in order.

    Parameters
    ----------
    events_max : int
        Number of retained events; whole chunks are discarded.
    """

    def __init__(self, events_max: int) -> None:
        self._events_max = events_max
        self._chunks: deque[EventChunk] = deque()
        self._held = 0
        self._head = 0
        self._lock = threading.Lock()
        self._subscriptions: set[Subscription] = set()
        #: Whether no further events come.
        self.ended = False
        #: Number of the content: another one after all events were discarded.
        self.edition = 0
        #: Whether readers may have events that come here later; see `lead`.
        self.following = False
        self._is_settled = False  # whether readers without a number can begin
        self._newest = 0  # number of the newest event so far while it is following
        #: Number of the last event at the first `lead`: another service may have sent those.
        self.sent_before = 0
        self._has_led = False
        self._asleep: list[Subscription] = []

    @property
    def head(self) -> int:
        """Sequence number of the last event; 0 before the first."""
        return self._head

    @property
    def subscriber_count(self) -> int:
        """Number of open subscriptions."""
        return len(self._subscriptions)

    def append(self, count: int, encode: Encode) -> None:
        """Add the next `count` events, to be encoded when read, and wake readers.

        Parameters
        ----------
        count : int
            Number of events.
        encode : callable
            Returns those at places begin…end of them; called once for each part.
        """
        with self._lock:
            for begin in range(0, count, CHUNK_EVENTS):
                end = min(begin + CHUNK_EVENTS, count)
                self._chunks.append(EventChunk(self._head + 1 + begin, begin, end, encode))
            self._head += count
            self._held += count
            while self._held - self._chunks[0].count >= self._events_max:
                self._held -= self._chunks.popleft().count
            woken, self._asleep = self._asleep, []
        for subscription in woken:
            subscription.wake()

    def end(self) -> None:
        """Wake all readers: no further events come."""
        with self._lock:
            self.ended = True
            woken, self._asleep = self._asleep, []
        for subscription in woken:
            subscription.wake()

    def clear(self, head: int = 0) -> None:
        """Discard all events and continue after a number; subscribers wait for theirs."""
        with self._lock:
            self._chunks.clear()
            self._held = 0
            self._head = head
            self.edition += 1

    def subscribe(self, after: int | None, depth: int) -> "Subscription":
        """Return a reader of the events after a number (None: from now on)."""
        with self._lock:
            newest = max(self._head, self._newest)
            subscription = Subscription(self, newest if after is None else after, depth)
            subscription.waiting = after is None and self.following and not self._is_settled
            if not self.following:
                subscription.require(self._head)
            self._subscriptions.add(subscription)
            return subscription

    def follow(self) -> None:
        """Expect readers that have later events: all that were here, or those of others."""
        with self._lock:
            self.following = True
            self._newest = max(self._newest, self._head)

    def settle(self) -> None:
        """Let readers without a number begin: the events from before the start are here."""
        with self._lock:
            self._is_settled = True
            placed = [one for one in self._subscriptions if one.waiting]
            for subscription in placed:
                subscription.require(self._head)
        for subscription in placed:
            subscription.wake()

    def lead(self) -> None:
        """Continue: all events that readers of this journal may have are here."""
        self.settle()
        with self._lock:
            self.following, self._newest = False, 0
            if not self._has_led:
                self._has_led, self.sent_before = True, self._head
            for subscription in self._subscriptions:
                subscription.require(self._head)
            woken, self._asleep = self._asleep, []
        for subscription in woken:
            subscription.wake()

    def discard(self, subscription: "Subscription") -> None:
        """Remove a subscription."""
        with self._lock:
            self._subscriptions.discard(subscription)
            if subscription in self._asleep:
                self._asleep.remove(subscription)

    def sleep(self, subscription: "Subscription", after: int) -> bool:
        """Arrange to wake a reader that has read up to `after`; False if there is more already."""
        with self._lock:
            if self._head > after:
                return False
            if subscription in self._subscriptions and subscription not in self._asleep:
                self._asleep.append(subscription)
            return True

    def after(self, sequence: int, depth: int, events_max: int) -> tuple[int, list[EventChunk]]:
        """Return the events available to a reader that has read up to a number.

        Parameters
        ----------
        sequence : int
            Last event that was read.
        depth : int
            A reader farther behind than this loses the older events.
        events_max : int
            Number of events; no further chunks are returned.

        Returns
        -------
        next : int
            Number of the first event that is available; greater than `sequence` + 1 after a gap.
        chunks : list of EventChunk
            The chunks from `next` on; the first may start earlier.
        """
        with self._lock:
            oldest = max(self._head - self._held, self._head - depth) + 1
            first = max(sequence + 1, oldest)
            start = bisect_left(self._chunks, first, key=lambda chunk: chunk.last)
            chunks: list[EventChunk] = []
            for chunk in islice(self._chunks, start, None):
                if chunk.first >= first + events_max:
                    break
                chunks.append(chunk)
            return first, chunks


class Subscription:
    """One reader of the ring: a position in it, and a wake-up function.

    Poll until the answer is empty, then wait for the wake-up: one call when there are new events
    after an empty answer. One thread reads a subscription at a time.
    """

    def __init__(self, ring: EventRing, after: int, depth: int) -> None:
        if after < 0 or depth < 1:
            msg = f"expected after >= 0 and depth >= 1, was {after} and {depth}"
            raise ValueError(msg)
        self._ring = ring
        self._after = after
        self._depth = depth
        self._wakeup: Callable[[], None] | None = None
        self._closed = False
        self._notices: list[Event] = []
        #: Whether it has no position yet: it begins with new events, after the replay of a start.
        self.waiting = False
        #: Events lost because the reader was too slow or subscribed too late.
        self.lost = 0

    @property
    def after(self) -> int:
        """Sequence number of the last event read or reported lost."""
        return self._after

    @property
    def edition(self) -> int:
        """Number of the content of the ring: in another one, a number may have another event."""
        return self._ring.edition

    @property
    def ended(self) -> bool:
        """Whether no further events come: the service has been drained."""
        return self._ring.ended

    @property
    def closed(self) -> bool:
        """True after `close`, also when the ring closed it because its wake-up failed."""
        return self._closed

    def poll(self, max_events: int) -> list[Event]:
        """Return the next events, at most so many; empty when there is nothing new.

        A gap notice counts as one event and precedes the events after the gap.
        """
        return list(self.poll_table(max_events))

    def poll_table(self, max_events: int) -> EventTable:
        """Return the next events in columns: as `poll`."""
        if self._closed or self.waiting:
            return EventTable.of([])
        first, chunks = self._ring.after(self._after, self._depth, max_events)
        notices, self._notices = self._notices, []
        if first > self._after + 1:
            notices.append(gap_notice(self._after + 1, first - 1))
            self.lost += first - 1 - self._after
            self._after = first - 1
        parts, count = [EventTable.of(notices)] if notices else [], len(notices)
        for chunk in chunks:
            if count >= max_events:
                break
            start = self._after + 1 - chunk.first
            end = min(start + max_events - count, chunk.count)
            parts.append(EventTable.of(chunk.events()).between(start, end))
            self._after = chunk.first + end - 1
            count += end - start
        if not parts and not self._ring.sleep(self, self._after):
            # An event arrived before the sleep.
            return self.poll_table(max_events)
        return EventTable.joined(parts)

    def is_idle(self) -> bool:
        """Whether there is nothing to read; if so, the next event wakes the reader, as `poll`."""
        if self._closed or self.waiting:
            return True
        return not self._notices and self._ring.sleep(self, self._after)

    def skip(self, first: int, last: int) -> bool:
        """Continue after a number, if the next events that `poll` would return are those before.

        Parameters
        ----------
        first, last : int
            Numbers of consecutive events that the reader already has.

        Returns
        -------
        bool
            False, and nothing changes, if it is at another event or must have a notice first.
        """
        if self._closed or self._notices or first != self._after + 1:
            return False
        self._after = last
        return True

    def require(self, head: int) -> None:
        """Start over at the last event, with a notice, if after it; begin there if it waits."""
        if self.waiting:
            self._after, self.waiting = head, False
        elif self._after > head:
            # The number is from another journal: the reader lacks all events of this one.
            self._notices.append(gap_notice(1, head))
            self._after = head

    def set_wakeup(self, callback: Callable[[], None]) -> None:
        """Set a function that is called, from the engine's thread, when there are new events.

        It must return at once and not poll. It is called now if there are new events already.
        """
        self._wakeup = callback
        if not self._ring.sleep(self, self._after):
            callback()

    def wake(self) -> None:
        """Notify the reader of new events; it is closed if that fails."""
        if self._wakeup is None:
            return
        try:
            self._wakeup()
        except Exception:
            # Its event loop is closed. One reader must not stop the engine for all.
            self.close()

    def close(self) -> None:
        """Stop reading; closing twice is allowed."""
        self._closed = True
        self._ring.discard(self)
