"""Structured logs: one event per line on standard error, with named values.

Events of the service and of libraries that use the standard logging have the same format: text,
coloured on a terminal, or JSON.
"""

import logging
import sys
from collections.abc import MutableMapping
from datetime import UTC, datetime
from typing import Any, TextIO

import structlog

from multiradar.clock import Clock

LEVELS = ("debug", "info", "warning", "error")

#: Libraries that log every request or connection; only their warnings and errors are logged.
_VERBOSE = ("uvicorn.access", "uvicorn.error", "httpx", "httpcore", "asyncio", "websockets")


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
    for name in _VERBOSE:
        library = logging.getLogger(name)
        library.handlers.clear()
        library.propagate = True
        library.setLevel(max(logging.WARNING, root.level))


def _renderers(form: str, stream: TextIO) -> list[structlog.typing.Processor]:
    if form == "text":
        return [
            structlog.dev.ConsoleRenderer(
                timestamp_key="time",
                colors=stream.isatty(),
                # The default logs all local variables: secrets, and seconds of work.
                exception_formatter=structlog.dev.plain_traceback,
            )
        ]
    return [structlog.processors.format_exc_info, structlog.processors.JSONRenderer()]
