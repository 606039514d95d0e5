"""Answers that do not come: what was read stays, and what is missing is requested again."""

import time

from playwright.sync_api import Page, Route

from integration.page.conftest import Air
from integration.page.test_browser import opened, settled
from support.processes.waiting import pause, wait_until

ENCOUNTERS = "window.multiradar.encounters"


def test_encounters_stay_after_a_time_out_and_are_requested_again_soon(
    page: Page, air: Air
) -> None:
    opened(page, air)
    settled(page, f"{ENCOUNTERS}.found.length > 0")
    asked_s: list[float] = []

    def late(route: Route) -> None:
        asked_s.append(time.monotonic())
        pause(0.5)
        route.abort("timedout")

    page.route("**/v1/encounters?*", late)
    wait_until(lambda: page.evaluate("1") and len(asked_s) > 1, "the next request")
    assert page.evaluate(f"{ENCOUNTERS}.found.length") > 0
    # As after an answer, and not twenty times as long as none came.
    assert asked_s[1] - asked_s[0] < 9.0
