"""The document that names a test for each part of the page names tests that exist."""

import re

from support.paths import ROOT

PAGE = ROOT / "docs" / "validation" / "page.md"
TESTS = ROOT / "tests" / "integration" / "page"


def test_the_tests_of_the_page_are_those_of_its_document() -> None:
    named = re.findall(r"`(test_\w+)`", PAGE.read_text(encoding="utf-8"))
    sources = (path.read_text(encoding="utf-8") for path in TESTS.glob("test_*.py"))
    defined = {name for text in sources for name in re.findall(r"^def (test_\w+)", text, re.M)}
    assert len(named) == len(set(named))
    assert set(named) <= defined
    # Without credentials there is no part to show; the console is checked by all.
    assert defined - set(named) == {
        "test_without_credentials_no_key_is_asked_for",
        "test_the_map_wrote_nothing_to_the_console",
        "test_a_track_is_selected_on_the_map_and_its_sheet_and_past_are_shown",
    }
