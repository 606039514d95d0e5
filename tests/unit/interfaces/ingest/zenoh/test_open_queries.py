"""Queries with measurements that wait for their answer: bounded, and without their content."""

import json
import sys
from collections.abc import Callable

import pytest

from multiradar.access.security_log import RepeatedEvents
from multiradar.clock import FixedClock
from multiradar.ingest.zenoh import measurements
from multiradar.ingest.zenoh.bus import JSON, Request
from multiradar.ingest.zenoh.counts import ZenohCounts
from multiradar.ingest.zenoh.measurements import MeasurementInlet
from multiradar.ingest.zenoh.payload import PayloadBounds
from support.fakes.fake_service import FakeService, FakeView

KEY = "multiradar/v1/measurements/41-10"
PLOTS = json.dumps([{"time_s": 1.0, "kind": "radar", "range_m": 5e4, "azimuth_deg": 1.0}]).encode()


class Scene:
    """An inlet whose answers wait until they are sent."""

    def __init__(self) -> None:
        self.service = FakeService(view=FakeView())
        self.counts = ZenohCounts()
        self.waiting: list[Callable[[], None]] = []
        self.inlet = MeasurementInlet(
            self.service,
            self.counts,
            PayloadBounds(1 << 20, 1000),
            self.waiting.append,
            events=RepeatedEvents(FixedClock()),
        )

    def ask(self, payload: bytes) -> list[bytes]:
        """Send a query; return what it is answered."""
        answers: list[bytes] = []
        self.inlet.on_query(
            Request(
                KEY, {}, payload, JSON, b"",
                reply=lambda _key, content, _attachment: answers.append(content),
                reply_error=answers.append,
                finish=lambda: answers.append(b"end"),
            )
        )  # fmt: skip
        return answers

    def send(self) -> None:
        """Send the answers."""
        while self.waiting:
            self.waiting.pop(0)()


@pytest.fixture
def scene(monkeypatch: pytest.MonkeyPatch) -> Scene:
    monkeypatch.setattr(measurements, "OPEN_QUERIES_MAX", 3)
    monkeypatch.setattr(measurements, "OPEN_OCTETS_MAX", 1000)
    return Scene()


def code(answers: list[bytes]) -> str:
    assert answers[1:] == [b"end"]
    found: str = json.loads(answers[0])["code"]
    return found


@pytest.mark.parametrize("payload", [b"nothing", PLOTS])
def test_queries_whose_answers_wait_are_bounded(scene: Scene, payload: bytes) -> None:
    """Regression: a querier that did not read could make any number of answers wait."""
    asked = [scene.ask(payload) for _ in range(3)]
    more = scene.ask(payload)
    assert code(more) == "QUEUE_FULL"
    assert json.loads(more[0])["retry_after_s"] > 0.0
    assert len(scene.waiting) == 3
    assert asked == [[], [], []]
    scene.send()
    assert all(len(one) == 2 for one in asked)
    assert scene.ask(payload) == []
    counted = [scene.counts.number(f"messages_{one}") for one in ("read", "refused")]
    assert counted == [5, 1]


def test_their_content_is_bounded_too(scene: Scene) -> None:
    # Alone, a query may have any size.
    first = scene.ask(b"x" * 2000)
    assert code(scene.ask(b"x")) == "QUEUE_FULL"
    scene.send()
    assert code(first) == "MALFORMED_JSON"
    assert [scene.ask(b"x" * 500) for _ in range(2)] == [[], []]
    assert code(scene.ask(b"x")) == "QUEUE_FULL"


@pytest.mark.parametrize("content", [b"nothing", PLOTS])
def test_what_waits_for_its_answer_keeps_no_content(scene: Scene, content: bytes) -> None:
    before = sys.getrefcount(content)
    scene.ask(content)
    assert len(scene.waiting) == 1
    assert sys.getrefcount(content) == before


def test_a_fault_of_the_service_leaves_no_query_open(scene: Scene) -> None:
    def fail(*_: object) -> None:
        msg = "a fault"
        raise RuntimeError(msg)

    scene.service.answer = fail
    for _ in range(9):
        with pytest.raises(RuntimeError):
            scene.ask(PLOTS)
