"""Bundles are a function of what the engine puts out, however it is cut into outputs."""

from collections.abc import Sequence
from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from multiradar.runtime.trajectories.roster import PushPlots, Roster, Sampled
from support.fakes.engine_outputs import Bias, End, Event, Sample, Update, output_of
from support.scenarios import live_scene

TABLE = live_scene.sensors()
EPOCH_S = 4.0
_STEPS = st.lists(
    st.tuples(st.integers(0, 3), st.integers(1, 6), st.booleans()), min_size=1, max_size=40
)


def events_of(steps: Sequence[tuple[int, int, bool]]) -> list[Event]:
    """Updates at ascending times; at the ends of epochs biases and samples, and tracks end."""
    found: list[Event] = []
    ended: set[int] = set()
    time_s, sequence = 0.5, 0
    for wait, track, confirmed in steps:
        before, time_s = time_s, time_s + 0.75 * wait
        if time_s // EPOCH_S > before // EPOCH_S:
            at = EPOCH_S * (time_s // EPOCH_S)
            found += [Bias(at, at), Bias(at, at + 1.0), Sample(at, int(at / EPOCH_S))]
            gone = sequence % 6 + 1
            if gone not in ended:
                ended.add(gone)
                found.append(End(at, gone))
        if track not in ended:
            sequence += 1
            found.append(Update(sequence, time_s, track, confirmed))
    return found


def orders(outputs: Sequence[Sequence[Event]], room: int) -> dict[int, list[object]]:
    roster = Roster(room, TABLE)
    found: dict[int, list[object]] = {}
    for events in outputs:
        for order in roster.push(output_of(events)):
            if isinstance(order, Sampled):
                # All tracks have had their plots before it, and none after.
                for own in found.values():
                    own.append(order.epoch)
                continue
            own = found.setdefault(order.track_id, [])
            if isinstance(order, PushPlots):
                bias = float(order.published.estimate[0, 0])
                own += [(time_s, bias) for time_s in order.plots["time_s"].tolist()]
            else:
                own.append("gone")
    return found


@given(steps=_STEPS, room=st.integers(1, 4), data=st.data())
def test_batches_leave_no_trace(
    steps: list[tuple[int, int, bool]], room: int, data: st.DataObject
) -> None:
    events = events_of(steps)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(events)), max_size=6)))
    ends = [0, *cuts, len(events)]
    parts = [events[begin:end] for begin, end in pairwise(ends)]
    assert orders(parts, room) == orders([events], room)
    # Never more bundles than there is room for.
    held: set[int] = set()
    roster = Roster(room, TABLE)
    for event in events:
        for order in roster.push(output_of([event])):
            if isinstance(order, PushPlots):
                held.add(order.track_id)
            elif not isinstance(order, Sampled):
                held.discard(order.track_id)
            assert len(held) <= room
