"""Publishing pauses for joins, for a bounded time and a bounded fraction of the time."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import pytest

from multiradar.clock import FixedClock
from multiradar.ingest.zenoh.bus import Request
from multiradar.ingest.zenoh.joining import (
    ALLOWANCE_MAX_S,
    ANSWER_S,
    QUERY_GAP_MAX_S,
    QUERY_GAP_S,
    WAIT_MAX_S,
    JoinGate,
)

EVERY = "multiradar/v1/tracks/*/@adv/**"


@dataclass
class Scene:
    clock: FixedClock = field(default_factory=FixedClock)
    finished: int = 0

    def __post_init__(self) -> None:
        self.gate = JoinGate(self.clock)

    def ask(self, key: str = EVERY, parameters: Mapping[str, str] | None = None) -> None:
        def finish() -> None:
            self.finished += 1

        request = Request(
            key=key,
            parameters=parameters or {},
            payload=None,
            media_type="",
            attachment=b"",
            reply=lambda *_: None,
            reply_error=lambda _: None,
            finish=finish,
        )
        self.gate.on_query(request)

    def waited_s(self) -> float:
        began_s = self.clock.now_s()
        self.gate.wait_for_joins(self.clock.advance)
        return self.clock.now_s() - began_s


def test_a_query_for_all_histories_is_held_open_until_there_are_no_more_queries() -> None:
    scene = Scene()
    scene.ask()
    assert scene.gate.closed
    assert scene.finished == 0
    scene.clock.advance(0.04)
    scene.ask("multiradar/v1/tracks/7/@adv/pub/a/1/**", {"_sn": "3.."})
    assert scene.finished == 1
    assert abs(scene.waited_s() - 2 * QUERY_GAP_S) < 1e-9
    assert scene.finished == 2
    assert not scene.gate.closed


def test_nothing_is_sent_until_a_subscriber_has_the_end_of_its_query() -> None:
    scene = Scene()
    scene.ask()
    closed_when_finished: list[bool] = []

    def pause(duration_s: float) -> None:
        if scene.finished:
            closed_when_finished.append(scene.gate.closed)
        scene.clock.advance(duration_s)

    scene.gate.wait_for_joins(pause)
    assert closed_when_finished == [True]


def test_full_caches_are_given_time_to_answer() -> None:
    scene = Scene()
    scene.gate.samples = 20_000
    scene.ask()
    assert abs(scene.waited_s() - (2 * QUERY_GAP_S + 20_000 * ANSWER_S)) < 1e-9
    scene.gate.samples = 10_000_000
    scene.ask()
    assert abs(scene.waited_s() - QUERY_GAP_MAX_S - QUERY_GAP_S) < 1e-9


def test_a_new_connection_starts_a_pause() -> None:
    scene = Scene()
    # Most connections do not query the history, so their pause is shorter.
    scene.gate.samples = 20_000
    scene.gate.on_arrival()
    closed_before = scene.gate.closed
    assert abs(scene.waited_s() - QUERY_GAP_S) < 1e-9
    closed_after = scene.gate.closed
    assert (closed_before, closed_after) == (True, False)
    scene.gate.on_arrival()
    scene.clock.advance(QUERY_GAP_S / 2)
    scene.ask()
    assert abs(scene.waited_s() - (2 * QUERY_GAP_S + 20_000 * ANSWER_S)) < 1e-9
    assert scene.finished == 1


def test_endless_connections_cause_a_bounded_pause() -> None:
    scene = Scene()
    waited_s = 0.0
    for _ in range(1000):
        scene.gate.on_arrival()
        waited_s += scene.waited_s()
        scene.clock.advance(0.01)
    assert waited_s <= ALLOWANCE_MAX_S + 0.2 * scene.clock.now_s() + WAIT_MAX_S


def test_queries_for_one_track_or_from_a_number_on_cause_no_pause() -> None:
    scene = Scene()
    scene.ask("multiradar/v1/tracks/7/@adv/pub/a/1/**")
    scene.ask(EVERY, {"_sn": "3.."})
    assert not scene.gate.closed
    assert scene.finished == 2


@pytest.mark.fault(34)
def test_endless_queries_cause_a_bounded_pause() -> None:
    scene = Scene()

    def ask_and_advance(duration_s: float) -> None:
        scene.clock.advance(min(duration_s, 0.01))
        scene.ask(EVERY, {"_sn": "1.."})

    scene.ask()
    scene.gate.wait_for_joins(ask_and_advance)
    assert WAIT_MAX_S <= scene.clock.now_s() < WAIT_MAX_S + 0.02
    assert not scene.gate.closed


def test_continuous_joins_pause_a_bounded_fraction_of_the_time() -> None:
    scene = Scene()
    waited_s = 0.0
    while scene.clock.now_s() < 300.0:
        scene.ask()
        waited_s += scene.waited_s()
        scene.clock.advance(0.01)
    assert waited_s < ALLOWANCE_MAX_S + 0.25 * scene.clock.now_s()


def test_successive_joins_extend_the_pause() -> None:
    scene = Scene()
    for _ in range(10):
        scene.ask()
        assert scene.gate.closed
        scene.waited_s()
    assert scene.gate.waits == 10
