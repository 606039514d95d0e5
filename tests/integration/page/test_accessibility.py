"""No violation of the rules of axe-core (WCAG 2.2 A and AA) in any view and either theme."""

from importlib.resources import files
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from integration.page.conftest import Air
from integration.page.test_browser import STORE, opened
from support.processes.waiting import WAIT_TIMEOUT_S

ACTIONS = "window.multiradar.actions"
AXE = files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8")
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]


@pytest.fixture(scope="module")
def page(browser: Browser, air: Air) -> Any:
    context = browser.new_context(viewport={"width": 1280, "height": 720}, reduced_motion="reduce")
    context.set_default_timeout(WAIT_TIMEOUT_S * 1000.0)
    expect.set_options(timeout=WAIT_TIMEOUT_S * 1000.0)
    page = context.new_page()
    opened(page, air)
    page.evaluate(AXE)
    yield page
    context.close()


def violations(page: Page) -> list[str]:
    found: list[dict[str, Any]] = page.evaluate(
        f"axe.run(document, {{ runOnly: {RULES} }}).then((result) => result.violations)"
    )
    return [
        f"{one['id']}: {node['html'][:200]} {node['failureSummary']}"
        for one in found
        for node in one["nodes"]
    ]


@pytest.mark.parametrize("theme", ["dark", "light"])
@pytest.mark.parametrize("tab", ["tracks", "track", "sensors", "system", "map"])
def test_a_tab_has_no_violation(page: Page, tab: str, theme: str) -> None:
    page.set_viewport_size({"width": 1280, "height": 720})
    if page.evaluate("window.multiradar.view.theme") != theme:
        page.evaluate(f"{ACTIONS}.theme()")
    if tab == "track":
        page.evaluate(f"{ACTIONS}.show({STORE}.tracks[0].id)")
        expect(page.locator("#sheet mr-chart").first).to_be_visible()
    else:
        page.evaluate(f'window.multiradar.view.tab = "{tab}", {ACTIONS}.changed()')
    if tab == "sensors":
        expect(page.locator("#sensors svg.bars").first).to_be_visible()
    assert violations(page) == []


def test_the_tablet_and_the_help_sheet_have_no_violation(page: Page) -> None:
    page.set_viewport_size({"width": 768, "height": 1024})
    page.evaluate(f'window.multiradar.view.tab = "tracks", {ACTIONS}.changed()')
    assert violations(page) == []
    page.evaluate(f"{ACTIONS}.help()")
    assert violations(page) == []
