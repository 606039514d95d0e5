"""What the events of an output keep until they are read."""

import weakref
from dataclasses import replace

import numpy as np

from multiradar.runtime.stream.output_events import OutputEvents
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.outputs import NO_OUTPUT, EndedTracks, EngineOutput
from support.scenarios.live_scene import sensors


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
