"""Areas of regions, tracks that match, and messages of neighbours that are not used."""

import json
from concurrent.futures import Future
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.errors import InputError, JournalFullError
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.ingest.zenoh.bus import JSON, Message
from multiradar.ingest.zenoh.handovers import RegionExchange
from multiradar.ingest.zenoh.keys import HANDOVERS
from multiradar.ingest.zenoh.memory_bus import MemoryBus
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.runtime.live.receipt import Receipt
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.regions.areas import Areas, Centre
from multiradar.runtime.memory.regions.board import RegionBoard, RegionRules
from multiradar.runtime.memory.regions.matching import match
from multiradar.runtime.memory.regions.messages import (
    TIME_APART_MAX_S,
    other_rows,
    packed,
    read_handover,
    unpacked,
)
from multiradar.runtime.memory.regions.outgoing import handover_tracks
from multiradar.runtime.memory.regions.responsibility import Claim, Position, decide
from multiradar.runtime.memory.regions.rows import OTHER_DTYPE, OWN_DTYPE
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.outputs import EndedTracks, TrackStates
from multiradar.tracking.settings import TrackingSettings
from support.fakes.fake_engine import FakeEngine
from support.fakes.fake_service import FakeService
from support.inputs.timed_batches import timed_batch
from support.scenarios.live_scene import sensors
from support.scenarios.region_scene import ManualClock

AREAS = Areas(Centre("west", 49.0, 8.0), [Centre("east", 49.0, 14.0)])


def test_areas_meet_in_the_middle_at_the_antimeridian_and_at_the_pole() -> None:
    fiji = Areas(Centre("a", 0.0, 178.0), [Centre("b", 0.0, -178.0)])
    longitude = np.radians([179.0, 180.0, -180.0, -179.0])
    depth_m = fiji.depth_m(np.zeros(4), longitude)
    assert depth_m == pytest.approx([111_195.0, 0.0, 0.0, -111_195.0], abs=1.0)
    pole = Areas(Centre("a", 80.0, 0.0), [Centre("b", 80.0, 180.0)])
    assert pole.depth_m([np.pi / 2], [0.0]) == pytest.approx([0.0], abs=1e-3)
    assert fiji.home(np.zeros(2), longitude[[0, 3]]).tolist() == [-1, 0]


def test_both_sides_agree_on_the_boundary() -> None:
    other = Areas(Centre("east", 49.0, 14.0), [Centre("west", 49.0, 8.0)])
    places = np.radians([48.0, 49.5, 52.0]), np.radians([9.0, 11.01, 12.0])
    assert AREAS.depth_m(*places) == pytest.approx(-other.depth_m(*places))


def rows(kind: np.dtype[np.void], *north_m: float, address: int = -1) -> NDArray[np.void]:
    """Tracks that fly east, with their distances to the north."""
    found = np.zeros(len(north_m), kind)
    found["track_id"] = np.arange(len(north_m)) + 1
    found["latitude_rad"] = np.radians(49.0) + np.array(north_m) / 6_371_008.8
    found["longitude_rad"], found["east_mps"] = np.radians(11.0), 200.0
    found["position_m2"][:, [0, 2]], found["velocity_m2ps2"] = 2500.0, 25.0
    found["height_m"], found["mode_3a"], found["mode_s_address"] = np.nan, -1, address
    return found


def test_tracks_match_one_with_one_by_their_states_at_the_same_time() -> None:
    own, others = rows(OWN_DTYPE, 0.0, 1500.0), rows(OTHER_DTYPE, 1450.0, 20.0, 300.0)
    # The neighbour's states are 5 s older: there, the aircraft were 1 km farther west.
    own["time_s"] = 5.0
    own["longitude_rad"] += 1000.0 / 6_371_008.8 / np.cos(np.radians(49.0))
    match(own, others)
    assert others["own_id"].tolist() == [2, 1, 0]


@pytest.mark.parametrize(
    ("name", "value"), [("mode_s_address", 0x4B0001), ("mode_3a", 0o1000), ("height_m", 9000.0)]
)
def test_contradicting_tracks_do_not_match(name: str, value: float) -> None:
    own, others = rows(OWN_DTYPE, 0.0), rows(OTHER_DTYPE, 10.0)
    own[name], others[name] = value, value
    match(own, others)
    assert others["own_id"].tolist() == [1]
    others["own_id"], others[name] = 0, value + 1000
    match(own, others)
    assert others["own_id"].tolist() == [0]


def claim(since_s: float, *, fresh: bool = True, hears: bool = True) -> Claim:
    return Claim(since_s, "east", b"east/7", b"east/7", fresh, hears)


@pytest.mark.parametrize("since_s", [5.0, 20.0])
@pytest.mark.parametrize("other_since_s", [5.0, 20.0])
@pytest.mark.parametrize("inside", [(True, False), (False, True), (False, False)])
def test_two_that_are_responsible_agree_on_one(
    since_s: float, other_since_s: float, inside: tuple[bool, bool]
) -> None:
    here = Position("west", True, since_s, inside[0], True)
    there = Position("east", True, other_since_s, inside[1], True)
    for _ in range(3):
        theirs = Claim(there.since_s, "east", b"east/7", b"east/7", True, True)
        ours = Claim(here.since_s, "west", b"west/4", b"west/4", True, True)
        found = decide(here, [theirs] if there.responsible else [], 30.0)
        other = decide(there, [ours] if here.responsible else [], 30.0)
        here = here._replace(responsible=found.responsible, since_s=found.since_s)
        there = there._replace(responsible=other.responsible, since_s=other.since_s)
    # The later one stays, by name if both are equal, unless the other has the aircraft inside its
    # area: that one takes over now.
    later = since_s >= other_since_s
    stays = inside[0] if any(inside) else later
    assert (here.responsible, there.responsible) == (stays, not stays)
    one, began_s = (here, since_s) if stays else (there, other_since_s)
    assert one.since_s == (began_s if stays == later else 30.0)


def test_a_region_takes_over_from_a_coasting_track_but_not_from_one_that_does_not_hear_it() -> None:
    own = Position("west", False, 0.0, False, True)
    assert not decide(own, [claim(5.0)], 30.0).responsible
    assert decide(own, [claim(5.0, fresh=False)], 30.0).responsible
    inside = own._replace(inside=True)
    assert decide(inside, [claim(5.0)], 30.0) == (True, 30.0, claim(5.0))
    assert not decide(inside, [claim(5.0, hears=False)], 30.0).responsible
    # The later one stays, also if the neighbour is ahead in time.
    assert decide(inside, [claim(31.0)], 30.0).since_s > 31.0


@pytest.mark.parametrize(
    ("own", "expected"),
    [
        (Position("west", True, 5.0, False, True), (True, 5.0, None)),
        (Position("west", False, 5.0, False, True), (True, 30.0, None)),
        (Position("west", False, 5.0, False, True, waits=True), (False, 30.0, None)),
    ],
)
def test_a_region_is_responsible_if_no_other_is_unless_it_waits(
    own: Position, expected: tuple[bool, float, None]
) -> None:
    assert decide(own, [], 30.0) == expected


def handover(**changes: Any) -> bytes:
    """A message of the neighbour, with one track."""
    track = {
        "track_id": 7, "time_s": 10.0, "latitude_deg": 49.0, "longitude_deg": 11.0,
        "velocity_east_mps": 200.0, "velocity_north_mps": 0.0,
        "covariance": [2500.0, 0, 0, 0, 2500.0, 0, 0, 25.0, 0, 25.0], "height_m": None,
        "height_sigma_m": None, "mode_s_address": "4b0001", "mode_3a": None, "callsign": None,
        "turn_right_probability": None, "turn_left_probability": None,
        "speed_change_probability": None, "state": "confirmed", "responsible": True,
        "since_s": 1.0, "aircraft": "east/7",
    }  # fmt: skip
    track |= {name: value for name, value in changes.items() if name in track}
    message = {
        "region": "east", "latitude_deg": 49.0, "longitude_deg": 14.0, "time_s": 10.0,
        "heard": ["west"], "tracks": [track], "biases": [],
    }  # fmt: skip
    message |= {name: value for name, value in changes.items() if name not in track}
    return json.dumps(message).encode()


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b"{", "not a handover message"),
        (handover(region="north"), "expected a message from east, was from 'north'"),
        (handover(covariance=[-1.0] * 10), "track 7: expected a positive definite covariance"),
        (handover(since_s=float("nan")), "not a handover message"),
        (handover(since_s=1e300), "not a handover message: tracks.0.since_s"),
        (handover(time_s=10.5), "track 7: expected a time up to that of the message"),
        (handover(more=1), "not a handover message: more"),
        (handover().replace(b'"longitude_deg": 14.0', b'"longitude_deg": 15.0'), "would overlap"),
        (b" " * (4 * 1024 * 1024 + 1), "at most 4194304 octets"),
    ],
)
def test_a_message_that_is_not_valid_is_rejected(payload: bytes, reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        read_handover(payload, AREAS)


def test_a_later_responsibility_can_always_be_exceeded() -> None:
    (row,) = other_rows(read_handover(handover(since_s=9e10), AREAS))
    assert row["since_s"] == 10.0 + TIME_APART_MAX_S


@pytest.mark.parametrize("axes", [20.0, 1000.0, 1e8])
def test_covariances_are_positive_definite_for_any_axes(axes: float) -> None:
    """Rounding to five digits made a third of those with an axis ratio of 1000 indefinite."""
    turn = np.radians(np.arange(0.0, 180.0, 2.5))
    along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])
    covariance = np.zeros((len(turn), 4, 4))
    position_m2 = np.einsum("in,jn->nij", along, along) * (20.0 * axes) ** 2
    covariance[:, :2, :2] = position_m2 + np.einsum("in,jn->nij", across, across) * 20.0**2
    covariance[:, 2:, 2:] = np.eye(2) * 25.0
    own = rows(OWN_DTYPE, *turn.tolist())
    count, track = len(own), json.loads(handover())["tracks"][0]
    states = TrackStates(
        own["track_id"].copy(), own["time_s"].copy(), np.zeros((count, 4)), covariance,
        np.full(count, np.nan),
    )  # fmt: skip
    shown = [track | {"track_id": number} for number in own["track_id"].tolist()]
    plane = SystemPlane(np.radians(49.0), np.radians(11.0))
    tracks = handover_tracks("east", own, shown, (states, plane))
    message = json.loads(handover()) | {"tracks": tracks}
    found = read_handover(json.dumps(message).encode(), AREAS)
    assert len(found.tracks) == count
    if axes < 1e6:
        trace = [one.covariance[0] + one.covariance[4] for one in found.tracks]
        assert trace == pytest.approx([(1.0 + axes**2) * 20.0**2] * count, rel=1e-4)


def test_a_journalled_message_is_bounded_and_what_is_unusable_there_is_counted() -> None:
    assert unpacked(packed(handover())) == handover()
    board = RegionBoard(AREAS, RegionRules())
    for payload in (b"no zlib", packed(b" " * (5 * 1024 * 1024)), packed(handover())[:-4]):
        board.hand_over(payload)
    assert board.figures()["unusable"] == 3
    board.hand_over(packed(handover()))
    (neighbour,) = board.figures()["neighbours"]
    assert (neighbour["tracks"], neighbour["messages"]) == (1, 1)


def test_no_region_is_silent_before_there_is_a_data_time() -> None:
    """After a step back each neighbour was silent until the next update, with an alarm."""
    board, engine = RegionBoard(AREAS, RegionRules()), FakeEngine()

    def states() -> list[str]:
        return [one["state"] for one in board.figures()["neighbours"]]

    assert states() == ["expected"]
    board.hand_over(packed(handover()))
    assert (board.silent(), states()) == ([], ["alive"])
    board.absorb(engine.push(timed_batch([10.0])))
    board.hand_over(packed(handover()))
    assert (board.silent(), states()) == ([], ["alive"])
    board.set_back()
    assert (board.silent(), states()) == ([], ["alive"])
    board.hand_over(packed(handover()))
    board.absorb(engine.push(timed_batch([5.0])))
    board.hand_over(packed(handover()))
    # The message came at some time before this update.
    board.absorb(engine.push(timed_batch([500.0])))
    assert (board.silent(), states()) == ([], ["alive"])
    board.absorb(engine.push(timed_batch([503.5])))
    assert (board.silent(), states()) == (["east"], ["silent"])


def test_the_end_of_a_track_without_updates_removes_it() -> None:
    board, engine = RegionBoard(AREAS, RegionRules()), FakeEngine()
    output = engine.push(timed_batch([10.0]))
    assert len(board.absorb(output)) == 1
    figures = board.figures()
    assert figures["responsible"] + figures["duplicates"] == 1
    track = output.updates.track_id
    ended = EndedTracks(track, np.array([10.0]), np.zeros(1, np.int8), np.full(1, -1))
    silent = engine.flush()
    assert len(board.absorb(replace(silent, ended=ended))) == 0
    figures = board.figures()
    assert figures["responsible"] + figures["duplicates"] == 0


def test_a_track_loses_the_name_of_another_aircraft_when_its_address_is_known() -> None:
    """It kept the name, which the track of the other aircraft then had, too."""
    board, engine = RegionBoard(AREAS, RegionRules()), FakeEngine()

    def update(time_s: float, number: int, address: int) -> None:
        batch = replace(
            timed_batch([time_s]), track_number=np.array([number - 1]),
            mode_s_address=np.array([address]),
        )  # fmt: skip
        output = engine.push(batch)
        row = output.updates
        place = {"latitude_rad": np.radians([49.001]), "longitude_rad": np.radians([11.0])}
        row = replace(row, **place, speed_mps=np.array([200.0]), heading_rad=np.radians([90.0]))
        board.absorb(replace(output, updates=row))

    def names() -> list[tuple[str | None, str | None]]:
        found = board.fields(np.array([7, 8]))
        return list(zip(found["continues"], found["duplicate_of"], strict=True))

    other: dict[str, Any] = {"track_id": 4, "aircraft": "north/4", "since_s": 12.0}
    update(10.0, 7, -1)
    board.hand_over(packed(handover(**other)))
    assert names()[0] == ("north/4", "east/4")
    update(11.0, 7, 0x111111)
    update(11.0, 8, 0x4B0001)
    board.hand_over(packed(handover(**other)))
    assert names() == [(None, None), ("north/4", "east/4")]
    # A name stays when the other track has ended, and when nothing contradicts it.
    board.hand_over(packed(handover(**other | {"mode_s_address": None})))
    board.hand_over(packed(handover(track_id=5, aircraft="east/5", mode_s_address="4b0005")))
    assert names()[1][0] == "north/4"


class _Sink(FakeService):
    """Collects messages."""

    def __init__(self) -> None:
        super().__init__()
        self.messages: list[tuple[bytes, str]] = []
        self.receipt: Future[Receipt] = Future()

    def hand_over(self, message: bytes, *, source: str) -> Future[Receipt]:
        self.messages.append((unpacked(message), source))
        return self.receipt


def test_the_exchange_counts_what_it_does_not_use() -> None:
    sink, bus, clock = _Sink(), MemoryBus(), ManualClock()
    known = Knowledge(sensors(), TrackingSettings(), RuntimeLimits())
    exchange = RegionExchange(
        sink, known, RegionBoard(AREAS, RegionRules()), ZenohOptions(), period_s=1.0,
        open_bus=lambda _: bus, clock=clock,
    )  # fmt: skip
    exchange.open()

    def put(payload: bytes, after_s: float = 1.0) -> None:
        clock.time_s += after_s
        bus.deliver(Message(f"{HANDOVERS}/east", payload, JSON))

    put(handover())
    put(handover(), after_s=0.1)
    put(b"{}")
    # Of another region than its key.
    put(handover().replace(b'"east", "lat', b'"west", "lat'))
    counts = exchange.document()["messages"]["east"]
    assert sink.messages == [(handover(), "region east")]
    assert (counts["received"], counts["too_frequent"], counts["malformed"]) == (4, 1, 2)
    assert [one["code"] for one in exchange.document()["alarms"]] == ["HANDOVER_MALFORMED"] * 2
    assert counts["lost"] == 0
    sink.receipt.set_exception(JournalFullError("/path: no space left"))
    assert exchange.document()["messages"]["east"]["lost"] == 1
    lost = exchange.document()["alarms"][-1]
    assert lost["code"] == "HANDOVER_LOST"
    assert lost["reason"] == "the journal disk is full; nothing was ingested"
    assert bus.counts.handler_errors == 0
