"""Logs: one way, one form, the level asked for."""

import io
import json
import logging

import pytest
import structlog

from multiradar.clock import FixedClock
from multiradar.observability.logs import LEVELS, configure_logs


def _records(stream: io.StringIO) -> list[dict[str, object]]:
    return [json.loads(line) for line in stream.getvalue().splitlines()]


def test_events_of_the_service_and_of_libraries_share_a_format() -> None:
    stream = io.StringIO()
    configure_logs("info", "json", FixedClock(1533110400.25), stream)
    structlog.get_logger("multiradar.test").info("journal_opened", entries=3)
    logging.getLogger("somebody.else").warning("slow: %d ms", 12)
    ours, theirs = _records(stream)
    assert ours == {
        "event": "journal_opened",
        "entries": 3,
        "level": "info",
        "logger": "multiradar.test",
        "time": "2018-08-01T08:00:00.250000Z",
    }
    assert theirs["event"] == "slow: 12 ms"
    assert theirs["logger"] == "somebody.else"


@pytest.mark.parametrize("level", LEVELS)
def test_what_is_below_the_level_is_not_written(level: str) -> None:
    stream = io.StringIO()
    configure_logs(level, "json", FixedClock(), stream)
    logger = structlog.get_logger("multiradar.test")
    for name in LEVELS:
        getattr(logger, name)(name)
    assert [record["event"] for record in _records(stream)] == list(LEVELS[LEVELS.index(level) :])


@pytest.mark.fault(40)
@pytest.mark.parametrize("form", ["text", "json"])
@pytest.mark.parametrize("hostile", ["a\nforged", "a\rb", "\x1b[2Ja", "a\x9b2J", "a\u2028b"])
def test_what_a_client_sent_begins_no_line_and_controls_no_terminal(
    form: str, hostile: str
) -> None:
    stream = io.StringIO()
    configure_logs("info", form, FixedClock(), stream)
    structlog.get_logger("multiradar.test").warning("rejected", sensor=hostile, more=[hostile])
    logging.getLogger("somebody.else").warning("unknown sensor %s", hostile)
    lines = stream.getvalue().split("\n")
    assert len(lines) == 3
    assert all(one.isprintable() for one in lines)


def test_every_request_is_not_logged_but_failures_are() -> None:
    stream = io.StringIO()
    configure_logs("info", "json", FixedClock(), stream)
    logging.getLogger("uvicorn.error").info("started")
    logging.getLogger("uvicorn.error").error("broken")
    assert [record["event"] for record in _records(stream)] == ["broken"]


def test_warnings_of_libraries_that_clients_cause_are_bounded_and_counted() -> None:
    """A host without credentials could fill the disk with them."""
    stream, clock = io.StringIO(), FixedClock()
    configure_logs("info", "json", clock, stream)
    library = logging.getLogger("uvicorn.error")
    for _ in range(100):
        library.warning("Invalid HTTP request received.")
    library.error("another")
    clock.advance(1.0)
    library.warning("Invalid HTTP request received.")
    library.warning("Invalid HTTP request received.")
    assert [record["event"] for record in _records(stream)] == [
        *["Invalid HTTP request received."] * 10,
        "another",
        "Invalid HTTP request received. (90 more not logged)",
        "Invalid HTTP request received.",
    ]
    # Those of the service have bounds of their own.
    for _ in range(100):
        structlog.get_logger("multiradar.test").warning("event")
    assert len(_records(stream)) == 113


def test_an_exception_is_one_record() -> None:
    stream = io.StringIO()
    configure_logs("info", "json", FixedClock(), stream)
    logger = structlog.get_logger("multiradar.test")
    try:
        raise ValueError("42")
    except ValueError:
        logger.exception("failed")
    (record,) = _records(stream)
    assert "ValueError: 42" in str(record["exception"])


def test_an_exception_in_text_contains_no_variables() -> None:
    """They may be secrets, and were millions of numbers that took seconds to print."""
    stream = io.StringIO()
    configure_logs("info", "text", FixedClock(), stream)
    password = "".join(["open", "sesame"])
    try:
        raise ValueError(str(len(password)))
    except ValueError:
        structlog.get_logger("multiradar.test").exception("failed")
    assert "ValueError: 10" in stream.getvalue()
    assert password not in stream.getvalue()


def test_text_is_for_people_and_without_colours_when_no_terminal_reads_it() -> None:
    stream = io.StringIO()
    configure_logs("info", "text", FixedClock(), stream)
    structlog.get_logger("multiradar.test").info("started", http="http://127.0.0.1:1")
    assert "started" in stream.getvalue()
    assert "\x1b[" not in stream.getvalue()
