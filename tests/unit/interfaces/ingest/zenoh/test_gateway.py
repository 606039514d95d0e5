"""The Zenoh interface over the bus in memory: answers, rejections and counters."""

import json
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Future
from typing import Any

import pytest
from structlog.testing import capture_logs

from multiradar.clock import SystemClock
from multiradar.errors import (
    IdempotencyConflictError,
    JournalError,
    JournalFullError,
    PipelineError,
    QueueFullError,
    TrajectoryError,
)
from multiradar.ingest.zenoh.bus import Message
from multiradar.ingest.zenoh.gateway import ZenohGateway
from multiradar.ingest.zenoh.keys import is_sensor_id, sensor_key, track_id
from multiradar.ingest.zenoh.memory_bus import MemoryAnswer, MemoryBus
from multiradar.ingest.zenoh.options import ZenohOptions
from multiradar.runtime.live.receipt import Receipt
from multiradar.runtime.queries.deadline import check_deadline
from multiradar.runtime.queries.parameters import PATH_STEP_DEFAULT_S
from multiradar.settings.access import AccessSettings
from support.access import clients
from support.fakes.fake_service import FakeService
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.scenarios.zenoh_scene import StreamingView

KEY = "multiradar/v1/measurements/41-10"
PLOT = {"time_s": 1.0, "kind": "radar", "range_m": 5e4, "azimuth_deg": 1.0}
PAYLOAD = json.dumps([PLOT]).encode()


class Scene:
    def __init__(self, options: ZenohOptions | None = None) -> None:
        self.bus = MemoryBus()
        self.view = StreamingView()
        self.service = FakeService(view=self.view)
        self.gateway = ZenohGateway(
            self.service, options or ZenohOptions(), open_bus=lambda _: self.bus
        )

    def count(self, name: str) -> int:
        return self.gateway.counts.number(name)


@pytest.fixture
def scene() -> Iterator[Scene]:
    running = Scene()
    running.gateway.start()
    yield running
    running.gateway.stop()


def settled(scene: Scene, answer: MemoryAnswer) -> MemoryAnswer:
    """Everything that was asked is answered when the gateway has stopped."""
    scene.gateway.stop()
    assert answer.finished == 1
    return answer


def test_publishing_pauses_for_a_new_connection(scene: Scene) -> None:
    for connected in scene.bus.watchers:
        connected()
    answer = settled(scene, scene.bus.ask("multiradar/v1/status"))
    ((_, document, _),) = answer.replies
    assert json.loads(document)["zenoh"]["joins_waited_for"] == 1


def test_events_from_before_the_session_are_published_if_no_service_before_had_them() -> None:
    """A session may wait for its port while the service already accepts measurements."""
    running = Scene()
    running.view.publish_updates([7, 7])
    running.view.ring.lead()
    running.view.publish_updates([7])
    running.view.publish_event("sensor", "41-10", b'{"added":false}')
    running.gateway.start()
    running.gateway.stop()
    sent = [one.attachment for one in running.bus.sent if one.attachment]
    assert (sent, running.count("published_tracks")) == ([b"3", b"4"], 3)


@pytest.mark.fault(31)
def test_a_lost_router_is_a_reason_not_to_be_ready(scene: Scene) -> None:
    assert scene.gateway.lost() is None
    scene.bus.unreachable = ("tcp/router:7447", "tcp/router:7448")
    reason = scene.gateway.lost()
    # Anybody may ask: the endpoints are in the log and the status only.
    assert reason == (
        "ZENOH_LOST", "no Zenoh link to 2 of the configured endpoints; still retrying",
    )  # fmt: skip


def test_a_router_that_is_not_reached_is_logged_once(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", logger="multiradar")
    running = Scene(ZenohOptions(status_period_s=0.05))
    running.bus.unreachable = ("tcp/router:7447",)
    running.gateway.start()
    wait_until(lambda: "no Zenoh link to tcp/router:7447; still" in caplog.text, "the warning")
    sent = len(running.bus.sent)
    wait_until(lambda: len(running.bus.sent) > sent + 3, "further status")
    assert caplog.text.count("no Zenoh link") == 1
    running.bus.unreachable = ()
    wait_until(lambda: "Zenoh link to tcp/router:7447\n" in caplog.text, "the warning")
    running.gateway.stop()


def test_a_sample_becomes_a_submission_under_its_key(scene: Scene) -> None:
    scene.bus.deliver(Message(KEY, PAYLOAD, "application/json", b"batch-7"))
    (submission,) = scene.service.submissions
    assert submission.frame["sensor_id"].to_list() == ["41-10"]
    assert (submission.source, submission.idempotency_key) == ("zenoh", "batch-7")
    assert (scene.count("messages_taken"), scene.count("rows_accepted")) == (1, 1)
    scene.bus.deliver(Message(KEY, PAYLOAD, "application/json", b"batch-7"))
    assert (scene.count("rows_accepted"), scene.count("rows_duplicate")) == (1, 1)


@pytest.mark.parametrize("attachment", [b"\xff", b"a\nb", b" k", b"k" * 129])
def test_an_attachment_that_is_no_key_is_rejected(scene: Scene, attachment: bytes) -> None:
    scene.bus.deliver(Message(KEY, PAYLOAD, "application/json", attachment))
    answer = settled(scene, scene.bus.ask(KEY, payload=PAYLOAD, attachment=attachment))
    assert json.loads(answer.errors[0])["code"] == "ENCODING"
    assert scene.count("messages_malformed") == 2
    assert not scene.service.submissions


def test_what_cannot_be_read_counts_for_the_quarantine(scene: Scene) -> None:
    scene.bus.deliver(Message(KEY, b"[{", "application/json"))
    answer = settled(scene, scene.bus.ask(KEY, payload=b"[{{"))
    assert json.loads(answer.errors[0])["code"] == "MALFORMED_JSON"
    assert scene.service.unreadable == [("zenoh", 2), ("zenoh", 3)]
    scene.service.quarantined_sources = ("zenoh",)
    answer = settled(scene, scene.bus.ask(KEY, payload=b"[{"))
    assert json.loads(answer.errors[0])["code"] == "SOURCE_QUARANTINED"
    assert len(scene.service.unreadable) == 2


def test_a_sensor_of_a_client_is_a_source_of_its_own() -> None:
    """All feeds were one source: one of them put all into quarantine."""
    running = Scene(ZenohOptions(access=AccessSettings(clients=clients())))
    running.gateway.start()
    # The client `radar` sends for 41-10 only; two others send for any sensor.
    for sensor in ("41-10", "41-20", "x1"):
        payload = json.dumps([PLOT | {"sensor_id": sensor}]).encode()
        running.bus.deliver(Message(f"multiradar/v1/measurements/{sensor}", payload, ""))
        running.bus.deliver(Message(f"multiradar/v1/measurements/{sensor}", b"[{", ""))
    running.service.quarantined_sources = ("zenoh",)
    asked = [running.bus.ask(KEY.replace("41-10", one), payload=PAYLOAD) for one in ("41-10", "x")]
    running.gateway.stop()
    sources = [one.source for one in running.service.submissions]
    assert sources == ["zenoh/41-10", "zenoh", "zenoh", "zenoh/41-10"]
    assert [one for one, _ in running.service.unreadable] == sources[:3]
    assert [len(one.replies) for one in asked] == [1, 0]
    assert json.loads(asked[1].errors[0])["code"] == "SOURCE_QUARANTINED"


def rejected(error: Exception) -> Callable[[Any, "Future[Receipt]"], None]:
    def answer(_submission: Any, _future: "Future[Receipt]") -> None:
        raise error

    return answer


def failed(error: Exception) -> Callable[[Any, "Future[Receipt]"], None]:
    return lambda _submission, future: future.set_exception(error)


@pytest.mark.parametrize(
    ("answer", "code", "retry_after_s"),
    [
        (rejected(QueueFullError("intake", 9, 2.0)), "QUEUE_FULL", 2.0),
        (rejected(JournalError("no")), "JOURNAL_FAILED", None),
        (failed(JournalError("no")), "JOURNAL_FAILED", None),
    ],
)
def test_a_query_that_cannot_be_taken_is_rejected_with_a_code(
    scene: Scene,
    answer: Callable[[Any, "Future[Receipt]"], None],
    code: str,
    retry_after_s: float | None,
) -> None:
    scene.service.answer = answer
    found = settled(scene, scene.bus.ask(KEY, payload=PAYLOAD))
    document = json.loads(found.errors[0])
    assert (document["code"], document.get("retry_after_s")) == (code, retry_after_s)
    assert not found.replies


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        (rejected(QueueFullError("intake", 9, 2.0)), "QUEUE_FULL"),
        (rejected(PipelineError("stopping")), "NOT_READY"),
        (failed(JournalFullError("no space left")), "JOURNAL_FULL"),
        (failed(JournalError("no")), "JOURNAL_FAILED"),
        (failed(RuntimeError("a fault")), "INTERNAL"),
    ],
)
def test_a_sample_that_cannot_be_taken_is_counted_as_lost(
    scene: Scene, answer: Callable[[Any, "Future[Receipt]"], None], code: str
) -> None:
    scene.service.answer = answer
    scene.bus.deliver(Message(KEY, PAYLOAD, "application/json"))
    assert (scene.count("messages_lost_upstream"), scene.count("messages_refused")) == (1, 0)
    assert scene.gateway.counts.document()["alarms"][-1]["code"] == code


def test_a_handler_that_fails_is_reported_and_the_query_is_rejected(scene: Scene) -> None:
    scene.service.answer = rejected(RuntimeError("a fault"))
    answer = settled(scene, scene.bus.ask(KEY, payload=PAYLOAD))
    assert json.loads(answer.errors[0])["code"] == "INTERNAL"
    assert scene.bus.counts.handler_errors == 1


def test_a_view_that_fails_is_an_error_and_not_an_empty_answer(scene: Scene) -> None:
    scene.view.failure = RuntimeError("a fault")
    answer = settled(scene, scene.bus.ask("multiradar/v1/tracks/*"))
    assert json.loads(answer.errors[0])["code"] == "INTERNAL"
    assert not answer.replies


def test_the_end_of_a_stream_can_be_marked(scene: Scene) -> None:
    settled(scene, scene.bus.ask("multiradar/v1/measurements/*", parameters={"flush": ""}))
    assert scene.service.flushes == ["zenoh"]


@pytest.mark.parametrize(
    ("key", "parameters", "code"),
    [
        ("clock", {"time_s": "1700000000.5"}, None),
        ("clock", {}, "INVALID_PARAMETER"),
        ("clock", {"time_s": "nan"}, "INVALID_PARAMETER"),
        ("clock", {"time_s": "1_000"}, "INVALID_PARAMETER"),
        ("clock", {"time_s": " 1"}, "INVALID_PARAMETER"),
        ("clock", {"time_s": "1", "force": "true"}, "UNKNOWN_PARAMETER"),
        ("flush", {}, "STREAM_IS_LIVE"),
        ("flush", {"force": "yes"}, "INVALID_PARAMETER"),
        ("flush", {"force": "true"}, None),
    ],
)
def test_operators_set_the_data_clock_and_end_a_live_stream(
    scene: Scene, key: str, parameters: dict[str, str], code: str | None
) -> None:
    scene.service.live = ("41-10",)
    with capture_logs() as logs:
        asked = settled(scene, scene.bus.ask(f"multiradar/v1/{key}", parameters=parameters))
    assert [json.loads(one)["code"] for one in asked.errors] == ([] if code is None else [code])
    # Only what was executed.
    found = [one["event"] for one in logs if one["event"] in {"clock_set", "operated"}]
    assert found == ([] if code else ["clock_set" if key == "clock" else "operated"])
    done = scene.service.flushes or scene.service.clocks
    assert bool(done) == (code is None)


def test_stopping_closes_the_session_and_may_be_repeated(scene: Scene) -> None:
    assert scene.bus.announced
    scene.gateway.stop()
    scene.gateway.stop()
    assert scene.bus.closed


@pytest.mark.parametrize(
    "text", ["", "a/b", "*", "**", "a*", "$*", "a?b", "a#b", "@adv", "ä", "a b"]
)
@pytest.mark.fault(40)
def test_nothing_that_means_something_in_a_key_can_be_a_sensor(text: str) -> None:
    assert not is_sensor_id(text)
    with pytest.raises(ValueError, match="expected a sensor identifier"):
        sensor_key("multiradar/v1/biases", text)


@pytest.mark.parametrize("text", ["", "0", "-1", "1.0", "1_0", "٣", "*", "1" * 20])
def test_only_the_number_of_a_track_names_one(text: str) -> None:
    assert track_id(text) is None
    assert track_id("120") == 120


def test_every_message_is_accounted_for(scene: Scene) -> None:
    scene.bus.deliver(Message(KEY, PAYLOAD, "application/json"))
    scene.bus.deliver(Message(KEY, b"[{", "application/json"))
    scene.service.answer = rejected(QueueFullError("intake", 9, 2.0))
    scene.bus.deliver(Message(KEY, PAYLOAD, "application/json"))
    for error in (JournalError("no"), IdempotencyConflictError("k", 1)):
        scene.service.answer = failed(error)
        scene.bus.deliver(Message(KEY, PAYLOAD, "application/json"))
    ends = ("taken", "malformed", "lost_upstream", "refused")
    assert [scene.count(f"messages_{end}") for end in ends] == [1, 1, 2, 1]
    assert scene.count("messages_read") == 5


@pytest.mark.parametrize(
    ("selector", "code"),
    [
        ("99", "NOT_FOUND"),
        ("0", "OUT_OF_RANGE"),
        ("*", "OUT_OF_RANGE"),
        ("3?points=601", "OUT_OF_RANGE"),
        ("3?points=-1", "NOT_A_NUMBER"),
        ("3?points=9999999999999999999999", "NOT_A_NUMBER"),
        ("3?step_s=0", "OUT_OF_RANGE"),
        ("3?step_s=61", "OUT_OF_RANGE"),
        ("3?step_s=0.5", "NOT_A_NUMBER"),
        ("3?step_s=nan", "NOT_A_NUMBER"),
        ("3?horizon_s=5", "UNKNOWN_PARAMETER"),
    ],
)
def test_trajectories_that_do_not_exist_are_rejected(
    scene: Scene, selector: str, code: str
) -> None:
    name, _, asked = selector.partition("?")
    parameters = dict([asked.split("=")]) if asked else {}
    key = f"multiradar/v1/trajectories/{name}"
    answer = settled(scene, scene.bus.ask(key, parameters=parameters))
    assert not answer.replies
    assert json.loads(answer.errors[0])["code"] == code


def test_trajectories_are_answered_or_the_reason_why_not(scene: Scene) -> None:
    key = "multiradar/v1/trajectories/3"
    reported = scene.bus.ask(key, parameters={"points": "7"})
    ((replied, document, _),) = settled(scene, reported).replies
    assert replied == key
    assert json.loads(document) == {"track_id": 3, "points": 7, "step_s": PATH_STEP_DEFAULT_S}


def test_a_track_without_trajectories_says_why(scene: Scene) -> None:
    scene.view.failures["trajectories"] = TrajectoryError("NO_ROOM", "track 3 waits for room")
    answer = settled(scene, scene.bus.ask("multiradar/v1/trajectories/3"))
    assert json.loads(answer.errors[0]) == {"code": "NO_ROOM", "reason": "track 3 waits for room"}


@pytest.mark.slow
def test_expensive_queries_have_a_deadline_and_threads_of_their_own() -> None:
    free = threading.Event()
    held = threading.Barrier(3)

    def slow(*_: Any, **__: Any) -> dict[str, Any]:
        held.wait(WAIT_TIMEOUT_S)
        free.wait(WAIT_TIMEOUT_S)
        check_deadline()
        return {}

    scene = Scene(ZenohOptions(query_threads=2, query_deadline_s=0.5))
    scene.view.ask = slow  # type: ignore[method-assign]
    scene.gateway.start()
    asked = [scene.bus.ask("multiradar/v1/encounters") for _ in range(2)]
    held.wait(WAIT_TIMEOUT_S)
    waiting = [scene.bus.ask("multiradar/v1/encounters") for _ in range(64)]
    # Answers of others do not wait for them.
    tracks = scene.bus.ask("multiradar/v1/tracks/*")
    wait_until(lambda: tracks.finished == 1, "the answer about tracks")
    started_s = SystemClock().monotonic_s()
    wait_until(lambda: SystemClock().monotonic_s() - started_s > 0.5, "the deadline")
    free.set()
    settled(scene, waiting[0])
    codes = [json.loads(one.errors[0])["code"] for one in (*asked, *waiting)]
    assert codes == [*["QUERY_TIMEOUT"] * 64, "BUSY", "BUSY"]


def test_rejections_are_in_the_security_log(scene: Scene) -> None:
    with capture_logs() as logs:
        for _ in range(3):
            scene.bus.ask(KEY, payload=b"nothing")
        scene.bus.deliver(Message(KEY, b"nothing", "application/json"))
    found = [one for one in logs if one["event"] == "rejected"]
    assert [(one["origin"], one["path"], one["unlogged"]) for one in found] == [("zenoh", KEY, 0)]
    assert found[0]["code"] == "MALFORMED_JSON"
