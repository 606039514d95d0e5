"""More than one answer has: many tracks, long tables, and sensors of tracks without plots."""

from collections.abc import Callable
from typing import Any
from urllib.parse import parse_qs, urlsplit

import numpy as np
from playwright.sync_api import Page, Route, expect

from integration.page.conftest import Air
from integration.page.test_browser import PICTURE, STORE, opened, settled
from multiradar.runtime.picture.frames import encoded
from support.inputs.picture_frames import Tables, decoded

#: More tracks than a frame has whatever the area shown.
TOTAL = 5000
ACTIONS = "window.multiradar.actions"
UPDATES = "window.multiradar.selection.updates"


def framed(page: Page, change: Callable[[dict[str, Any], Tables], Tables]) -> None:
    """Change the frames on their way to the page."""

    def fulfil(route: Route) -> None:
        header, tables = decoded(route.fetch().body())
        del header["tables"]
        tables = change(header, tables)
        route.fulfill(body=encoded(header, tables))

    page.route("**/v1/picture*", fulfil)


def asked(page: Page) -> list[dict[str, str]]:
    """Return the parameters of requests for frames; the list grows."""
    found: list[dict[str, str]] = []

    def note(address: str) -> None:
        parts = urlsplit(address)
        if parts.path.endswith("/v1/picture"):
            found.append({name: one[0] for name, one in parse_qs(parts.query).items()})

    page.on("request", lambda request: note(request.url))
    return found


def pan(page: Page) -> str:
    """Move the map by half of it, and return the area that it shows then."""
    before = page.evaluate("window.multiradar.feed.area")
    page.evaluate(
        f"""(() => {{
          const view = {PICTURE}.map.getView();
          const [west, , east] = view.calculateExtent();
          view.adjustCenter([(east - west) / 2, 0]);
        }})()"""
    )
    settled(page, f"window.multiradar.feed.area !== '{before}'")
    area: str = page.evaluate("window.multiradar.feed.area")
    return area


def plots(page: Page) -> list[str]:
    found: list[str] = page.evaluate(
        f"[...{STORE}.plots].map((one) => `${{one.timeS}} ${{one.sensor}} ${{one.track}}"
        " ${one.x} ${one.y}`)"
    )
    return found


def of_more(header: dict[str, Any], tables: Tables) -> Tables:
    header["total"] = TOTAL
    return tables


def continued(requests: list[dict[str, str]], area: str, name: str) -> list[bool]:
    """Return of each request for an area whether it continues the frame before."""
    return [name in one for one in requests if one.get("bbox") == area]


def test_with_all_tracks_a_pan_continues_the_picture(page: Page, air: Air) -> None:
    requests = asked(page)
    opened(page, air)
    area = pan(page)
    settled(page, f"{STORE}.frames > {page.evaluate(f'{STORE}.frames')} + 2")
    assert all(continued(requests, area, "after"))


def test_with_the_tracks_of_an_area_a_pan_reads_its_plots(page: Page, air: Air) -> None:
    framed(page, of_more)
    requests = asked(page)
    opened(page, air)
    settled(page, f"{STORE}.tracks.some((one) => one.trail.length > 9)")
    known = plots(page)
    area = pan(page)
    settled(page, f"{STORE}.frames > {page.evaluate(f'{STORE}.frames')} + 3")
    first, *later = continued(requests, area, "after")
    assert not first
    assert later
    assert all(later)
    # The plots of the new area, each of them once.
    assert sorted(plots(page)) == sorted(known)
    # A paused picture as well: it stands, but not its area.
    page.get_by_role("button", name="Pause").click()
    settled(page, "window.multiradar.feed.isCurrent && !window.multiradar.clock.isLive")
    settled(page, f"{STORE}.plots.length > 0")
    known = plots(page)
    area = pan(page)
    settled(page, f"{STORE}.frames > {page.evaluate(f'{STORE}.frames')}")
    assert not continued(requests, area, "since")[0]
    assert sorted(plots(page)) == sorted(known)
    assert page.evaluate(f"{STORE}.tracks.some((one) => one.trail.length > 9)")


def test_that_tracks_are_missing_is_said(page: Page, air: Air) -> None:
    framed(page, of_more)
    opened(page, air)
    expect(page.locator("#bar")).to_contain_text(f"(30 of {TOTAL})")
    expect(page.locator("#tracks .summary")).to_contain_text(
        f"30 of {TOTAL} tracks received: the search covers the visible area"
    )
    page.evaluate(f"{ACTIONS}.filter({{ text: 'nosuch' }})")
    expect(page.locator("#tracks")).to_contain_text("No track in the visible area matches")


class Halves:
    """Gives the tables by time in two pages, of which the second has the newest rows."""

    def __init__(self, page: Page) -> None:
        #: Name of the table and cursor of each request.
        self.asked: set[tuple[str, str]] = set()
        #: Times of the first and of the last row of the second page, s.
        self.second_s: dict[str, tuple[float, float]] = {}
        for path in ("tracks/*/history", "tracks/*/transitions", "sensors/*/bias"):
            page.route(f"**/v1/{path}?*", self.answer)

    def answer(self, route: Route) -> None:
        parts = urlsplit(route.request.url)
        name, given = parts.path.rpartition("/")[2], parse_qs(parts.query)
        assert given["limit"] == ["5000"]
        cursor = given.get("cursor", ["first"])[0]
        document = route.fetch(url=route.request.url.replace(f"&cursor={cursor}", "")).json()
        member = {"history": "updates", "bias": "biases"}.get(name, name)
        first, second = np.array_split(np.array(document[member]), 2)
        document[member] = (first if cursor == "first" else second).tolist()
        document["next_cursor"] = "second" if cursor == "first" else None
        self.asked.add((name, cursor))
        self.second_s[name] = second[0]["time_s"], second[-1]["time_s"]
        route.fulfill(json=document)


def selected(page: Page) -> float:
    """Select a confirmed track, and return the time of its last update, s."""
    page.evaluate(f"{ACTIONS}.select({STORE}.tracks.find((one) => one.state === 'confirmed').id)")
    settled(page, f"{UPDATES}.length > 10")
    last_s: float = page.evaluate(f"{UPDATES}.at(-1).time_s")
    return last_s


def test_the_newest_rows_of_long_tables_are_read(page: Page, air: Air) -> None:
    halves = Halves(page)
    opened(page, air)
    assert selected(page) == halves.second_s["history"][1]
    life = page.get_by_role("region", name="Track history")
    expect(life).to_contain_text("enough plots")
    assert ("transitions", "second") in halves.asked
    page.evaluate(f"{ACTIONS}.sensor('north')")
    chart = "document.querySelector(\"mr-chart[aria-label^='Range offset']\")"
    settled(page, f"{chart} !== null")
    assert page.evaluate(f"{chart}.latest.times.at(-1)") > halves.second_s["bias"][0]


def test_rows_after_a_past_time_are_not_read(page: Page, air: Air) -> None:
    halves = Halves(page)
    opened(page, air)
    last_s = selected(page)
    # The rows of the first half of the history are enough.
    page.get_by_role("button", name="Pause").click()
    page.evaluate("window.multiradar.clock.seek(window.multiradar.clock.span[0] + 30)")
    settled(page, "window.multiradar.feed.isCurrent")
    page.evaluate("window.multiradar.selection.settled()")
    halves.asked.clear()
    page.evaluate("window.multiradar.selection.moved()")
    page.evaluate("window.multiradar.selection.settled()")
    assert page.evaluate(f"{UPDATES}.at(-1).time_s") < last_s - 60.0
    assert ("history", "first") in halves.asked
    assert ("history", "second") not in halves.asked


def test_a_sensor_is_chosen_where_there_are_no_plots(page: Page, air: Air) -> None:
    """As of a recorded run without its measurements: the frames have its updates instead."""

    def without_plots(_header: dict[str, Any], tables: Tables) -> Tables:
        tracks = tables["tracks"]
        own = np.arange(len(tracks["track_id"])) % 3 == 0
        heard = {
            "track_id": np.asarray(tracks["track_id"])[own],
            "sensor": np.zeros(int(own.sum()), np.int32),
            "time_s": np.asarray(tracks["time_s"])[own],
        }
        return {"tracks": tracks, "plots": {}, "heard": heard}

    framed(page, without_plots)
    opened(page, air)
    page.evaluate(f"{ACTIONS}.filter({{ sensor: {STORE}.sensors[0] }})")
    ids = [int(one) for one in page.evaluate(f"{STORE}.tracks.map((one) => one.id)")]
    rows = page.locator("#tracks tbody tr[data-id]")
    expect(rows).to_have_count(len(ids[::3]))
    shown = {int(row.get_attribute("data-id") or 0) for row in rows.all()}
    assert shown == set(ids[::3])
