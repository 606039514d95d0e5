"""The events of an output: what they keep until they are read, and their encoding in parts."""

import threading
import weakref
from dataclasses import replace

import numpy as np
import pytest

from multiradar.runtime.stream.event_encoding import (
    CHANGE_DTYPE,
    EventEncoder,
    event_order,
    status_marks,
)
from multiradar.runtime.stream.events import CHUNK_EVENTS, EventTable
from multiradar.runtime.stream.output_events import OutputEvents
from multiradar.runtime.stream.region_marks import MARK_DTYPE, RegionMarks
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.outputs import NO_OUTPUT, EndedTracks, EngineOutput
from support.fakes.engine_outputs import Bias, End, Update, output_of
from support.scenarios.live_scene import sensors

#: Updates of a track in a second, with the biases of an epoch and ended tracks between them.
OUTPUT = output_of(
    [
        *(Update(1 + one, 100.0 + one / 400.0, one % 7) for one in range(1300)),
        *(Bias(101.0 + epoch, 0.5 * epoch) for epoch in range(3) for _ in range(40)),
        *(End(101.0 + one, 70 + one) for one in range(3)),
    ]
)


def encoder(output: EngineOutput, regions: RegionMarks | None = None) -> tuple[EventEncoder, int]:
    """Return what encodes the events of an output, and their number."""
    reached_s = np.maximum.accumulate(output.updates.time_s)
    marks, _ = status_marks(reached_s, output.updates.sequence, np.nan, 1.0)
    order, _ = event_order(reached_s, output, marks)
    changes = np.empty(0, CHANGE_DTYPE)
    made = EventEncoder(
        41, output, marks, order, sensors(), changes=changes, delay_s=0.25, regions=regions
    )
    return made, len(order)


def test_unread_events_keep_only_what_they_are_made_of() -> None:
    events = OutputEvents(sensors(), RuntimeLimits())
    ended = EndedTracks(
        np.array([7]), np.array([3.0]), np.zeros(1, np.int8), np.zeros(1, np.int64)
    )  # fmt: skip
    output: EngineOutput | None = replace(NO_OUTPUT, ended=ended, innovations=np.zeros((5, 12)))
    assert output is not None
    innovations = weakref.ref(output.innovations)
    events.publish(output)
    output = None
    assert innovations() is None
    (event,) = events.ring.subscribe(0, 10).poll(10)
    assert (event.kind, event.key) == ("ended", "7")


@pytest.mark.parametrize("length", [1, 3, 64, CHUNK_EVENTS, 1299])
@pytest.mark.parametrize("in_region", [False, True])
def test_events_are_the_same_in_any_parts(length: int, in_region: bool) -> None:
    marks = np.zeros(len(OUTPUT.updates), MARK_DTYPE)
    marks["duplicate_of"] = [b"north/%d" % one for one in range(len(marks))]
    regions = RegionMarks("south", marks) if in_region else None
    whole, count = encoder(OUTPUT, regions)
    expected = whole.part(0, count)
    assert {"track", "bias", "ended"} <= set(expected.kinds)
    assert list(expected.numbers) == list(range(41, 41 + count))
    divided, _ = encoder(OUTPUT, regions)
    parts = [divided.part(one, min(one + length, count)) for one in range(0, count, length)]
    assert list(EventTable.joined(parts)) == list(expected)


def test_the_first_events_of_an_output_do_not_wait_for_the_encoding_of_the_last(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    parts: list[tuple[int, int]] = []
    original = EventEncoder.part

    def noted(self: EventEncoder, begin: int, end: int) -> EventTable:
        parts.append((begin, end))
        return original(self, begin, end)

    monkeypatch.setattr(EventEncoder, "part", noted)
    events = OutputEvents(sensors(), RuntimeLimits())
    events.publish(OUTPUT)
    subscription = events.ring.subscribe(0, 10_000)
    assert len(subscription.poll_table(CHUNK_EVENTS)) == CHUNK_EVENTS
    assert parts == [(0, CHUNK_EVENTS)]
    while subscription.poll_table(CHUNK_EVENTS):
        continue
    assert parts[-1][1] == events.ring.head > 2 * CHUNK_EVENTS


def test_no_threads_are_started_for_the_events_of_an_output(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """polars made the columns of each table with more than 1000 rows in new threads."""

    def fail(thread: threading.Thread) -> None:
        pytest.fail(f"{thread.name} was started")

    monkeypatch.setattr(threading.Thread, "start", fail)
    made, count = encoder(OUTPUT)
    assert len(made.part(0, count)) == count
