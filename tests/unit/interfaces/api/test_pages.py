"""Open pages are counted by client, for as long as they ask."""

from multiradar.api.pages import OPEN_S, PAGES_MAX, Pages
from multiradar.clock import FixedClock


def test_pages_are_counted_by_client_until_they_stop_asking() -> None:
    clock = FixedClock()
    pages = Pages(clock.monotonic_s)
    for client, name in (("tower", "a"), ("tower", "b"), ("tower", "a"), ("10.0.0.1", "c")):
        pages.note(client, name)
    pages.note("10.0.0.1", None)
    assert pages.connected() == {"10.0.0.1": 1, "tower": 2}
    clock.advance(0.8 * OPEN_S)
    pages.note("tower", "b")
    clock.advance(0.8 * OPEN_S)
    assert pages.connected() == {"tower": 1}


def test_a_client_that_changes_its_name_takes_bounded_memory() -> None:
    pages = Pages(lambda: 0.0)
    for number in range(2 * PAGES_MAX):
        pages.note("10.0.0.1", f"{number:064d}"[::-1])
    assert sum(pages.connected().values()) <= PAGES_MAX
