"""Structured logs: one event per line on standard error, with named values.

Events of the service and of libraries that use the standard logging have the same format: text,
coloured on a terminal, or JSON.
"""

import logging
import sys
import threading
from collections.abc import MutableMapping
from datetime import UTC, datetime
from math import inf
from typing import Any, TextIO

import structlog

from multiradar.clock import Clock

LEVELS = ("debug", "info", "warning", "error")

#: Libraries that log every request or connection; only their warnings and errors are logged.
_VERBOSE = ("uvicorn.access", "uvicorn.error", "httpx", "httpcore", "asyncio", "websockets")


# Records of these libraries with one text, within an interval, s: clients may cause them without
# credentials. The texts are few, but an error of asyncio may name objects.
_RECORDS_MAX = 10
_INTERVAL_S = 1.0
_TEXTS_MAX = 64


class _Bound(logging.Filter):
    # Passes the first records of each interval; the next one states how many did not pass.
    def __init__(self, clock: Clock) -> None:
        super().__init__()
        self._clock = clock
        self._seen: dict[str, tuple[float, int]] = {}
        self._lock = threading.Lock()

    def filter(self, record: logging.LogRecord) -> bool:
        text, now_s = str(record.msg).partition("\n")[0], self._clock.monotonic_s()
        with self._lock:
            since_s, count = self._seen.get(text, (-inf, 0))
            if now_s - since_s < _INTERVAL_S:
                self._seen[text] = since_s, count + 1
                return count < _RECORDS_MAX
            if text not in self._seen and len(self._seen) >= _TEXTS_MAX:
                self._seen.clear()
            self._seen[text] = now_s, 1
        if count > _RECORDS_MAX:
            record.msg = f"{record.getMessage()} ({count - _RECORDS_MAX} more not logged)"
            record.args = None
        return True


class _TimeStamper:
    # Adds the time, ISO 8601 with microseconds.
    def __init__(self, clock: Clock) -> None:
        self._clock = clock

    def __call__(
        self, _logger: Any, _method: str, event: MutableMapping[str, Any]
    ) -> MutableMapping[str, Any]:
        now = datetime.fromtimestamp(self._clock.now_s(), UTC)
        event["time"] = now.isoformat(timespec="microseconds").replace("+00:00", "Z")
        return event


def configure_logs(level: str, form: str, clock: Clock, stream: TextIO | None = None) -> None:
    """Send all logs of the process to one stream.

    Parameters
    ----------
    level : str
        Minimum level, of `LEVELS`.
    form : str
        `text` or `json`.
    clock : Clock
        Time of the events.
    stream : TextIO, optional
        Destination; standard error when absent.
    """
    stream = sys.stderr if stream is None else stream
    shared: list[structlog.typing.Processor] = [
        structlog.contextvars.merge_contextvars,
        structlog.stdlib.add_log_level,
        structlog.stdlib.add_logger_name,
        structlog.stdlib.PositionalArgumentsFormatter(),
        _TimeStamper(clock),
    ]
    structlog.configure(
        processors=[
            structlog.stdlib.filter_by_level,
            *shared,
            structlog.stdlib.ProcessorFormatter.wrap_for_formatter,
        ],
        logger_factory=structlog.stdlib.LoggerFactory(),
        wrapper_class=structlog.stdlib.BoundLogger,
        cache_logger_on_first_use=False,
    )
    handler = logging.StreamHandler(stream)
    handler.setFormatter(
        structlog.stdlib.ProcessorFormatter(
            foreign_pre_chain=shared,
            processors=[
                structlog.stdlib.ProcessorFormatter.remove_processors_meta,
                *_renderers(form, stream),
            ],
        )
    )
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(level.upper())
    bound = _Bound(clock)
    for name in _VERBOSE:
        library = logging.getLogger(name)
        library.filters[:] = [bound]
        library.handlers.clear()
        library.propagate = True
        library.setLevel(max(logging.WARNING, root.level))


# Names and contents come from clients: they must neither begin a line nor control a terminal.
# JSON escapes them itself.
def _escaped(
    _logger: Any, _method: str, event: MutableMapping[str, Any]
) -> MutableMapping[str, Any]:
    for name, value in event.items():
        if isinstance(value, str) and not value.isprintable():
            event[name] = "".join(
                one if one.isprintable() else one.encode("unicode_escape").decode() for one in value
            )
    return event


def _renderers(form: str, stream: TextIO) -> list[structlog.typing.Processor]:
    if form == "text":
        return [
            _escaped,
            structlog.dev.ConsoleRenderer(
                timestamp_key="time",
                colors=stream.isatty(),
                # The default logs all local variables: secrets, and seconds of work.
                exception_formatter=structlog.dev.plain_traceback,
            ),
        ]
    return [structlog.processors.format_exc_info, structlog.processors.JSONRenderer()]
