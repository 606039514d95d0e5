"""Answers that do not come: what was read stays, and what is missing is requested again."""

import time
from typing import Any

import numpy as np
from playwright.sync_api import Page, Route

from integration.page.conftest import Air
from integration.page.test_browser import PICTURE, STORE, opened, settled
from integration.page.test_panels import pictured
from support.processes.waiting import pause, wait_until

ENCOUNTERS = "window.multiradar.encounters"
SELECTION = "window.multiradar.selection"


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


def test_the_trajectory_set_ends_with_its_track(page: Page, air: Air) -> None:
    opened(page, air)
    settled(page, f"{STORE}.bundles.length > 0")
    track = page.evaluate(f"{STORE}.bundles[0]")
    page.evaluate(f"window.multiradar.actions.select({track})")
    settled(page, f"{SELECTION}.bundle !== null")

    def without(_header: dict[str, Any], tracks: dict[str, Any]) -> None:
        kept = np.asarray(tracks["track_id"]) != track
        for name, values in tracks.items():
            tracks[name] = values[kept]

    pictured(page, without)
    settled(page, f"{STORE}.track({track}) === undefined")
    read = page.evaluate(f"{SELECTION}.revision")
    settled(page, f"{SELECTION}.revision > {read}")
    assert page.evaluate(f"{SELECTION}.forecast.length") == 0
    assert page.evaluate(f"{SELECTION}.bundle") is None


def test_the_trajectory_set_ends_if_its_track_is_not_answered_for(page: Page, air: Air) -> None:
    opened(page, air)
    settled(page, f"{STORE}.bundles.length > 0")
    track = page.evaluate(f"{STORE}.bundles[0]")
    page.evaluate(f"window.multiradar.actions.select({track})")
    settled(page, f"{SELECTION}.bundle !== null")
    page.route(f"**/v1/tracks/{track}/history*", lambda route: route.fulfill(status=404, body="{}"))
    read = page.evaluate(f"{SELECTION}.revision")
    settled(page, f"{SELECTION}.revision > {read + 1}")
    assert page.evaluate(f"{SELECTION}.bundle") is None


def test_the_coastlines_are_requested_again(page: Page, air: Air) -> None:
    asked: list[Route] = []

    def first(route: Route) -> None:
        asked.append(route)
        if len(asked) == 1:
            route.abort()
        elif len(asked) == 2:
            route.fulfill(status=502, body="bad gateway")
        else:
            route.continue_()

    page.route("**/page/land.json", first)
    opened(page, air)
    settled(page, f"{PICTURE}.land.getSource().getFeatures().length > 100")
    assert len(asked) == 3
