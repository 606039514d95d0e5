"""Spans of messages for OpenTelemetry: received and journalled, queued, stepped, published.

The packages of OpenTelemetry are an extra, and imported only if traces are configured.
"""

from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import Any, NamedTuple, Protocol

from multiradar.clock import Clock
from multiradar.errors import ConfigurationError

#: Spans that wait for the collector at most; more are dropped, which the log names.
SPANS_MAX = 4096
#: Messages that wait for the engine at most; the traces of more are left out.
MESSAGES_MAX = 65_536
_NS_PER_S = 1e9
#: Names of the spans within that of a message, in the order of time.
STAGES = ("journal", "queue", "step", "publish")


class Message(Protocol):
    """A message in the journal."""

    @property
    def sequence(self) -> int:
        """Its entry."""
        ...

    @property
    def source(self) -> str:
        """Its sender."""
        ...

    @property
    def received_s(self) -> float | None:
        """Time of reception, UTC, s."""
        ...

    @property
    def batch(self) -> Any:
        """Its measurements."""
        ...


#: Called with the attributes of a message and the times, s, that its stages part.
Emit = Callable[[Mapping[str, Any], tuple[float, ...]], None]


class _Waiting(NamedTuple):
    attributes: Mapping[str, Any]
    received_s: float
    journalled_s: float


class MessageTraces:
    """Notes the times of messages, and emits the spans of each when its output is published.

    Parameters
    ----------
    emit : callable
        Makes the spans.
    clock : Clock
        The clock of the machine.
    """

    def __init__(self, emit: Emit, clock: Clock) -> None:
        self._emit = emit
        self._clock = clock
        self._waiting: dict[int, _Waiting] = {}
        self._current: list[_Waiting] = []
        self._started_s = self._stepped_s = 0.0

    def journalled(self, message: Message) -> None:
        """Note that a message is in the journal, and queued for the engine."""
        if len(self._waiting) < MESSAGES_MAX:
            now_s = self._clock.now_s()
            received_s = now_s if message.received_s is None else min(message.received_s, now_s)
            attributes = {
                "multiradar.sequence": message.sequence, "multiradar.source": message.source,
                "multiradar.measurements": len(message.batch),
            }  # fmt: skip
            self._waiting[message.sequence] = _Waiting(attributes, received_s, now_s)

    def started(self, messages: Iterable[Message]) -> None:
        """Note that the engine processes messages, in one call."""
        self._started_s = self._stepped_s = self._clock.now_s()
        found = (self._waiting.pop(one.sequence, None) for one in messages)
        self._current = [one for one in found if one is not None]

    def stepped(self) -> None:
        """Note that the call of the engine has ended, and its output is being published."""
        self._stepped_s = self._clock.now_s()

    def published(self) -> None:
        """Emit the spans of the messages of the call."""
        now_s = self._clock.now_s()
        for one in self._current:
            times_s = (one.received_s, one.journalled_s, self._started_s, self._stepped_s, now_s)
            self._emit(one.attributes, times_s)
        self._current = []


def open_traces(
    endpoint: str, fraction: float, clock: Clock, exporter: Any = None
) -> tuple[MessageTraces, Callable[[], None]]:
    """Return traces that are sent to a collector, and what ends them.

    Parameters
    ----------
    endpoint : str
        Address of the collector, OTLP over HTTP.
    fraction : float
        Fraction of the messages that are traced.
    clock : Clock
        The clock of the machine.
    exporter : SpanExporter, optional
        In place of that to the collector.

    Raises
    ------
    ConfigurationError
        The packages of OpenTelemetry are not installed.
    """
    try:
        import requests
        from opentelemetry import trace
        from opentelemetry.exporter.otlp.proto.http.trace_exporter import OTLPSpanExporter
        from opentelemetry.sdk.resources import Resource
        from opentelemetry.sdk.trace import TracerProvider
        from opentelemetry.sdk.trace.export import BatchSpanProcessor
        from opentelemetry.sdk.trace.sampling import TraceIdRatioBased
    except ImportError as error:
        raise ConfigurationError(
            "traces.endpoint: requires the OpenTelemetry packages; in the source directory: "
            "pip install --require-hashes -r requirements/traces.txt"
        ) from error
    if exporter is None:
        session = requests.Session()
        # A proxy of the environment is not for this host.
        session.trust_env = False
        exporter = OTLPSpanExporter(endpoint=f"{endpoint}/v1/traces", session=session)
    provider = TracerProvider(
        resource=Resource.create({"service.name": "multiradar"}),
        sampler=TraceIdRatioBased(fraction),
        shutdown_on_exit=False,
    )
    provider.add_span_processor(BatchSpanProcessor(exporter, max_queue_size=SPANS_MAX))
    tracer = provider.get_tracer("multiradar")

    def emit(attributes: Mapping[str, Any], times_s: tuple[float, ...]) -> None:
        times_ns = [int(one * _NS_PER_S) for one in times_s]
        message = tracer.start_span("message", attributes=attributes, start_time=times_ns[0])
        if message.is_recording():
            within = trace.set_span_in_context(message)
            for name, begin_ns, end_ns in zip(STAGES, times_ns, times_ns[1:], strict=False):
                span = tracer.start_span(name, context=within, start_time=begin_ns)
                span.end(end_ns)
        message.end(times_ns[-1])

    def close() -> None:
        # A collector that is gone must not prevent the end of the service.
        with suppress(Exception):
            provider.shutdown()

    return MessageTraces(emit, clock), close
