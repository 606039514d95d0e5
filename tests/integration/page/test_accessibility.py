"""No violation of the rules of axe-core (WCAG 2.2 A and AA) in any view and either theme."""

from importlib.resources import files
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from integration.page.conftest import Air, window
from integration.page.test_browser import STORE, opened

ACTIONS = "window.multiradar.actions"
AXE = files("axe_playwright_python").joinpath("axe.min.js").read_text(encoding="utf-8")
RULES = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa", "best-practice"]


@pytest.fixture(scope="module")
def page(browser: Browser, air: Air) -> Any:
    with window(browser, reduced_motion="reduce") as context:
        page = context.new_page()
        opened(page, air)
        page.evaluate(AXE)
        yield page


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


def contrast(one: str, other: str) -> float:
    """Return the contrast of two colours `#rrggbb` by WCAG 2, 1 to 21."""

    def luminance(colour: str) -> float:
        parts = [int(colour[at : at + 2], 16) / 255.0 for at in (1, 3, 5)]
        linear = [v / 12.92 if v <= 0.03928 else ((v + 0.055) / 1.055) ** 2.4 for v in parts]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_the_colours_of_the_map_have_contrast(page: Page, theme: str) -> None:
    """axe-core sees no canvas."""
    if page.evaluate("window.multiradar.view.theme") != theme:
        page.evaluate(f"{ACTIONS}.theme()")
    palette = page.evaluate("window.multiradar.picture.scene.palette")
    for ground in (palette["background"], palette["land"]):
        for name in ("label", "stale", "faint", "selected", "warning", "bundle", "track"):
            assert contrast(palette[name], ground) >= 4.5, name
        for colour in palette["sensors"]:
            assert contrast(colour, ground) >= 3.0, colour


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_the_tablet_and_the_help_sheet_have_no_violation(page: Page, theme: str) -> None:
    page.set_viewport_size({"width": 768, "height": 1024})
    if page.evaluate("window.multiradar.view.theme") != theme:
        page.evaluate(f"{ACTIONS}.theme()")
    page.evaluate(f'window.multiradar.view.tab = "tracks", {ACTIONS}.changed()')
    assert violations(page) == []
    # The time of the history has colours of its own.
    page.evaluate("window.multiradar.clock.seek(window.multiradar.clock.span[1] - 30)")
    expect(page.locator("#time .mode")).to_have_text("History paused")
    assert violations(page) == []
    page.evaluate("window.multiradar.clock.live()")
    page.evaluate(f"{ACTIONS}.help()")
    assert violations(page) == []
    page.evaluate(f"{ACTIONS}.help()")
