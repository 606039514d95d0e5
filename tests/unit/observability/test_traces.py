"""Each message has a trace whose spans follow one another from reception to publication."""

from collections.abc import Iterator
from typing import Any

import pytest

from multiradar.clock import FixedClock
from multiradar.errors import ConfigurationError
from multiradar.observability.traces import STAGES, MessageTraces, open_traces
from multiradar.settings.service import load_settings
from support.processes.live_services import Starter, services, settled, submit
from support.scenarios.live_scene import recording


@pytest.fixture
def start() -> Iterator[Starter]:
    """Start services that are stopped at the end."""
    with services() as starter:
        yield starter


def test_the_stages_of_each_message_follow_one_another(start: Starter) -> None:
    service, clock = start(), FixedClock(1_700_000_100.0)
    emitted: list[tuple[Any, tuple[float, ...]]] = []
    traces = MessageTraces(lambda *one: emitted.append(one), clock)
    service.publication.traces = service._backlog.traces = traces
    for _ in range(3):
        submit(service, recording(10))
        clock.advance(1.0)
    settled(service)
    assert [one["multiradar.sequence"] for one, _ in emitted] == [1, 2, 3]
    assert {(one["multiradar.source"], one["multiradar.measurements"]) for one, _ in emitted} == {
        ("test", 10)
    }
    for _, times_s in emitted:
        assert len(times_s) == len(STAGES) + 1
        assert sorted(times_s) == list(times_s)


def test_spans_of_a_message_are_within_its_own() -> None:
    exports = pytest.importorskip("opentelemetry.sdk.trace.export.in_memory_span_exporter")
    pytest.importorskip("opentelemetry.exporter.otlp.proto.http")
    exporter, clock = exports.InMemorySpanExporter(), FixedClock(1000.0)
    traces, close = open_traces("http://127.0.0.1:4318", 1.0, clock, exporter)

    class Message:
        sequence, source, received_s, batch = 7, "radar-feed", 999.5, range(3)

    traces.journalled(Message())
    clock.advance(1.0)
    traces.started([Message()])
    clock.advance(1.0)
    traces.stepped()
    clock.advance(1.0)
    traces.published()
    close()
    spans = exporter.get_finished_spans()
    message = next(one for one in spans if one.name == "message")
    assert (message.start_time, message.end_time) == (999_500_000_000, 1_003_000_000_000)
    assert message.attributes["multiradar.sequence"] == 7
    parts = [one for one in spans if one is not message]
    assert [(one.name, one.end_time) for one in parts] == [
        ("journal", 1_000_000_000_000), ("queue", 1_001_000_000_000),
        ("step", 1_002_000_000_000), ("publish", 1_003_000_000_000),
    ]  # fmt: skip
    assert {one.parent.span_id for one in parts} == {message.context.span_id}


@pytest.mark.parametrize("endpoint", ["http://collector:4318", "https://127.0.0.1:4318", "4318"])
def test_spans_leave_this_host_only_through_a_collector_on_it(endpoint: str) -> None:
    with pytest.raises(ConfigurationError, match=r"traces\.endpoint"):
        load_settings(None, {"traces": {"endpoint": endpoint}})
