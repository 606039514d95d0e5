"""What a region is responsible for, and sends, while its data or tracks have ceased."""

import json
from concurrent.futures import Future
from dataclasses import replace

import numpy as np
import pytest

from multiradar.ingest.zenoh.bus import JSON, Message
from multiradar.ingest.zenoh.handovers import RegionExchange
from multiradar.ingest.zenoh.keys import HANDOVERS
from multiradar.ingest.zenoh.memory_bus import MemoryBus
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.runtime.live.receipt import Receipt
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.regions import outgoing
from multiradar.runtime.memory.regions.areas import Areas, Centre
from multiradar.runtime.memory.regions.board import RegionBoard, RegionRules
from multiradar.runtime.memory.regions.messages import packed
from multiradar.runtime.memory.regions.outgoing import handover_message
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.outputs import NO_OUTPUT
from multiradar.tracking.settings import TrackingSettings
from support.fakes.fake_engine import FakeEngine
from support.fakes.fake_service import FakeService
from support.inputs.timed_batches import timed_batch
from support.scenarios.live_scene import sensors

CENTRES = {"west": Centre("west", 49.0, 8.0), "east": Centre("east", 49.0, 14.0)}
TRACKING = TrackingSettings(reorder_horizon_s=6.0)
#: One aircraft in the area of each region, both tracked by both regions: tracks 1 and 2.
LONGITUDES_DEG = np.array([10.7, 11.3])
#: From one update of all tracks to the next, s.
SCAN_S = 4.0


class Side:
    """A region whose tracks are updated by the test."""

    def __init__(self, name: str) -> None:
        areas = Areas(CENTRES[name], [one for one in CENTRES.values() if one.name != name])
        self.board = RegionBoard(areas, RegionRules())
        self.known = Knowledge(sensors(), TRACKING, RuntimeLimits())
        self._engine = FakeEngine()

    def update(self, time_s: float, *, addresses: bool = True) -> None:
        """Update both tracks."""
        tracks = np.arange(2)
        batch = replace(
            timed_batch([time_s, time_s]), track_number=tracks,
            mode_s_address=0x4B0000 + tracks if addresses else np.full(2, -1),
        )  # fmt: skip
        output = self._engine.push(batch)
        place = {
            "latitude_rad": np.radians([49.0, 49.0]), "longitude_rad": np.radians(LONGITUDES_DEG)
        }  # fmt: skip
        output = replace(output, updates=replace(output.updates, **place))
        self.board.absorb(output)
        self.known.absorb(output, time_s + TRACKING.reorder_horizon_s)

    def responsible(self) -> set[int]:
        """Return the tracks for which the region is responsible."""
        marks = self.board.marks(np.array([1, 2]))
        return set((np.flatnonzero(marks["responsible"]) + 1).tolist())


def exchange(*sides: Side) -> None:
    """Hand over from each region to the other, both as they are before."""
    messages = [handover_message(one.board, one.known) for one in sides]
    for side, message in zip(sides, reversed(messages), strict=True):
        assert message is not None
        side.board.hand_over(packed(message.payload))


@pytest.fixture
def pair() -> tuple[Side, Side]:
    """West and East, 20 s after the start; each is responsible for the aircraft in its area."""
    west, east = Side("west"), Side("east")
    for second in range(21):
        for side in (west, east):
            if second % SCAN_S == 0.0:
                side.update(float(second))
        exchange(west, east)
    assert (west.responsible(), east.responsible()) == ({1}, {2})
    return west, east


def test_a_region_without_data_gives_up_its_aircraft(pair: tuple[Side, Side]) -> None:
    """Its tracks stood still with its data time, and so were as recent as ever."""
    west, east = pair
    taken_s: dict[str, float] = {}
    for second in range(21, 120):
        if second % SCAN_S == 0.0:
            west.update(float(second))
        exchange(west, east)
        assert 1 in west.responsible()
        if 2 in west.responsible():
            taken_s.setdefault("west", second)
        if 2 not in east.responsible():
            taken_s.setdefault("east", second)
    # Its data time may be 12 s behind, and its tracks be updated 12 s before that.
    assert 44.0 <= taken_s["west"] <= taken_s["east"] <= 50.0
    assert (west.responsible(), east.responsible()) == ({1, 2}, set())
    # The data of East return: it takes over what is in its area, and nothing else.
    east.update(120.0)
    assert 1 not in east.responsible()
    west.update(120.0)
    for _ in range(2):
        exchange(west, east)
    assert (west.responsible(), east.responsible()) == ({1}, {2})


@pytest.mark.parametrize(("lag_s", "scan_s"), [(1, 12), (3, 10), (6, 10), (10, 4)])
def test_regions_whose_data_times_differ_keep_their_aircraft(lag_s: int, scan_s: int) -> None:
    west, east = Side("west"), Side("east")
    for second in range(100):
        for side, now_s in ((west, second), (east, second - lag_s)):
            if now_s >= 0 and now_s % scan_s == 0:
                side.update(float(now_s))
            side.known.absorb(NO_OUTPUT, now_s + TRACKING.reorder_horizon_s)
        if second > lag_s:
            exchange(west, east)
        if second > lag_s + 3:
            assert (west.responsible(), east.responsible()) == ({1}, {2})


def test_the_last_message_before_a_pause_names_no_later_track() -> None:
    """Everything is near to a track of an hour ago."""
    west, east = Side("west"), Side("east")
    east.update(10.0)
    message = handover_message(east.board, east.known)
    assert message is not None
    west.board.hand_over(packed(message.payload))
    west.update(3610.0, addresses=False)
    assert west.board.marks(np.array([1, 2]))["continues"].tolist() == [b"", b""]


def test_a_region_that_continues_with_old_tracks_is_responsible_for_none_of_them(
    pair: tuple[Side, Side],
) -> None:
    """It was again by its second message, and the other gave up what it tracked."""
    west, east = pair
    for second in range(21, 61):
        if second % SCAN_S == 0.0:
            west.update(float(second))
    assert west.responsible() == {1, 2}
    for _ in range(3):
        exchange(west, east)
        assert west.responsible() == {1, 2}
    assert east.responsible() == set()
    # West is not silent, although the data time of East advances by more than `silence_s`.
    east.update(61.0)
    assert (east.responsible(), east.board.silent()) == (set(), [])
    west.update(61.0)
    exchange(west, east)
    exchange(west, east)
    assert (west.responsible(), east.responsible()) == ({1}, {2})


def test_a_region_without_aircraft_sends_messages_of_the_present_time() -> None:
    """Those were of its last track update, and not used after 60 s; before any, none was sent."""
    west, east = Side("west"), Side("east")
    assert handover_message(west.board, west.known) is None
    west.known.absorb(NO_OUTPUT, 2.0)
    east.update(10.0)
    exchange(west, east)
    assert (east.board.figures()["neighbours"][0]["state"], east.responsible()) == ("alive", {1, 2})

    def sent_s() -> float:
        found = handover_message(west.board, west.known)
        assert found is not None
        message = json.loads(found.payload)
        assert message["heard"] == ["east"]
        return float(message["time_s"])

    assert sent_s() == 0.0
    west.update(20.0)
    assert sent_s() == 20.0
    # Measurements are processed when the data time is `reorder_horizon_s` later.
    west.known.absorb(NO_OUTPUT, 107.0)
    exchange(west, east)
    assert sent_s() == 101.0


def exchange_of(side: Side, sink: FakeService, bus: MemoryBus) -> RegionExchange:
    """An exchange that is open."""
    found = RegionExchange(
        sink,  # type: ignore[arg-type]  # it does not answer
        side.known, side.board, ZenohOptions(), period_s=0.0, open_bus=lambda _: bus,
    )  # fmt: skip
    found.open()
    return found


def test_a_region_without_data_uses_messages_that_are_far_ahead() -> None:
    """They were malformed: after 60 s without data it was responsible for old tracks again."""
    west, east, bus = Side("west"), Side("east"), MemoryBus()
    sink = _Sink()
    exchange_of_west = exchange_of(west, sink, bus)
    west.known.silence = lambda: (0.0, False)

    def malformed(time_s: float) -> int:
        east.known.absorb(NO_OUTPUT, time_s + TRACKING.reorder_horizon_s)
        message = handover_message(east.board, east.known)
        assert message is not None
        bus.deliver(Message(f"{HANDOVERS}/east", message.payload, JSON))
        return int(exchange_of_west.document()["messages"]["east"]["malformed"])

    west.update(1000.0)
    assert [malformed(1050.0), malformed(1100.0), malformed(900.0)] == [0, 1, 2]
    west.known.silence = lambda: (100.0, True)
    assert [malformed(1100.0), malformed(900.0)] == [2, 3]
    assert sink.count == 2


class _Sink(FakeService):
    """Counts the messages."""

    count = 0

    def hand_over(self, message: bytes, *, source: str) -> Future[Receipt]:
        self.count += 1
        return Future()


def test_tracks_without_room_in_a_message_are_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(outgoing, "TRACKS_MAX", 1)
    west, bus = Side("west"), MemoryBus()
    exchange_of_west = exchange_of(west, FakeService(), bus)
    west.update(10.0)
    exchange_of_west.step()
    assert len(json.loads(bus.sent[0].payload)["tracks"]) == 1
    counts = exchange_of_west.document()["messages"]["west"]
    assert (counts["published"], counts["tracks_left_out"]) == (1, 1)
