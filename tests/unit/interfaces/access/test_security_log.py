"""Events that others cause at will: a bounded number of entries, and all of them counted."""

import pytest
from structlog.testing import capture_logs

from multiradar.access.security_log import (
    ENTRIES_MAX,
    INTERVAL_S,
    NOTE_INTERVAL_S,
    RETAINED_MAX,
    RepeatedEvents,
)
from multiradar.clock import FixedClock


@pytest.fixture
def clock() -> FixedClock:
    return FixedClock(100.0)


@pytest.fixture
def events(clock: FixedClock) -> RepeatedEvents:
    return RepeatedEvents(clock)


def test_an_origin_is_logged_once_an_interval_with_what_was_not(
    events: RepeatedEvents, clock: FixedClock
) -> None:
    with capture_logs() as logs:
        for _ in range(3):
            events.warn("rejected", "192.0.2.1", code="X")
        events.note("sent", "192.0.2.1")
        clock.advance(INTERVAL_S)
        events.warn("rejected", "192.0.2.1", code="X")
        events.note("sent", "192.0.2.1")
        clock.advance(NOTE_INTERVAL_S)
        events.note("sent", "192.0.2.1")
    found = [(one["event"], one["unlogged"], one["unlogged_others"]) for one in logs]
    assert found == [("rejected", 0, 0), ("sent", 0, 0), ("rejected", 2, 0), ("sent", 1, 0)]


def test_addresses_of_any_number_do_not_fill_the_log(
    events: RepeatedEvents, clock: FixedClock
) -> None:
    """Regression: every forged address was an origin of its own, with an entry of its own."""
    count, seconds = 20_000, 5
    with capture_logs() as logs:
        for second in range(seconds):
            clock.advance(1.0 if second else 0.0)
            for number in range(count):
                events.warn("datagram_not_allowed", f"{second}.{number}")
        assert len(logs) == seconds * ENTRIES_MAX
        # Those of another event are logged.
        events.warn("rejected", "192.0.2.1")
        assert logs[-1]["event"] == "rejected"
        clock.advance(1.0)
        events.warn("datagram_not_allowed", "192.0.2.1")
    own = [one for one in logs if one["event"] == "datagram_not_allowed"]
    assert logs[-1] is own[-1]
    counted = sum(1 + one["unlogged"] + one["unlogged_others"] for one in own)
    assert counted == seconds * count + 1


def test_what_an_origin_was_not_logged_for_is_counted_after_it_is_discarded(
    events: RepeatedEvents, clock: FixedClock
) -> None:
    with capture_logs() as logs:
        for _ in range(5):
            events.warn("rejected", "192.0.2.1")
        for number in range(RETAINED_MAX + 1):
            clock.advance(2 * INTERVAL_S / ENTRIES_MAX)
            events.warn("rejected", f"host {number}")
    assert sum(1 + one["unlogged"] + one["unlogged_others"] for one in logs) == RETAINED_MAX + 6
