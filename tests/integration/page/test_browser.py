"""The page in a real browser, against a running service."""

import re
from typing import Any

import polars as pl
import pytest
from playwright.sync_api import Page, Route, expect

from integration.page.conftest import Air
from support.processes.waiting import wait_until

STORE = "window.multiradar.store"
PICTURE = "window.multiradar.picture"


class Watch:
    """What a page wrote to its console, and the addresses that it asked for."""

    def __init__(self, page: Page) -> None:
        self.messages: list[str] = []
        self.addresses: set[str] = set()
        page.on("console", lambda message: self.messages.append(message.text))
        page.on("pageerror", lambda error: self.messages.append(str(error)))
        page.on("request", lambda request: self.addresses.add(request.url))


def opened(page: Page, air: Air, address: str = "/") -> Watch:
    """Open the page, and wait for its picture; from then on it leaves the map where it is put."""
    watch = Watch(page)
    page.goto(air.url + address)
    settled(page, f"{STORE}.tracks.length >= 30 && {PICTURE}.drawn > 2 && {PICTURE}.centred")
    return watch


def settled(page: Page, condition: str) -> None:
    # The policy of the page forbids what `wait_for_function` does.
    wait_until(lambda: page.evaluate(f"Boolean(window.multiradar && {condition})"), condition)


def pixels(page: Page) -> int:
    """Return the number of painted pixels of the canvas."""
    count: int = page.evaluate(
        """() => {
          const canvas = document.querySelector(".picture canvas.moving");
          const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
          let painted = 0;
          for (let at = 3; at < data.length; at += 4) if (data[at] > 0) painted += 1;
          return painted;
        }"""
    )
    return count


def test_an_address_cannot_make_the_page_ask_without_a_pause(page: Page, air: Air) -> None:
    """Browsers take a wait of more than 2³¹ ms for none."""
    opened(page, air, "/#tick=9999999999")
    page.evaluate("window.multiradar.actions.units()")
    settled(page, "location.hash.includes('tick=60000')")


def test_the_picture_has_the_tracks_of_the_service_and_asks_no_other_host(
    page: Page, air: Air
) -> None:
    watch = opened(page, air)
    expect(page.locator("#bar").get_by_text("30 confirmed")).to_be_visible()
    assert pixels(page) > 1_000
    assert watch.messages == []
    assert all(address.startswith((air.url, "data:")) for address in watch.addresses)


def test_the_first_picture_shows_all_tracks_also_when_the_sites_come_first(
    page: Page, air: Air
) -> None:
    held = [True]

    def later(route: Route) -> None:
        if held[0]:
            route.fulfill(status=503, json={"detail": "starting"})
        else:
            route.continue_()

    page.route("**/v1/picture*", later)
    page.goto(air.url)
    # A map of the sites alone: one far from the aircraft would hide them.
    settled(page, f"{PICTURE}.fitted === 1")
    held[0] = False
    settled(page, f"{PICTURE}.fitted === 2 && {PICTURE}.seenOnCanvas.length === 30")
    inside = page.evaluate(f"{STORE}.tracks.filter((one) => {PICTURE}.contains(one)).length")
    assert inside == 30
    # From now on it stays where the user puts it.
    page.evaluate(f"{PICTURE}.map.getView().setZoom(11)")
    settled(page, "location.hash.includes('zoom=11')")
    settled(page, f"Math.abs({PICTURE}.map.getView().getZoom() - 11) < 0.01")


def test_a_map_moved_when_the_sites_come_stays_where_the_user_put_it(page: Page, air: Air) -> None:
    page.route("**/v1/sensors*", lambda route: route.fulfill(json={"sensors": []}))
    page.goto(air.url)
    settled(page, f"{PICTURE}.fitted === 1")
    site = {
        "id": "far", "kind": "radar", "latitude_deg": 10, "longitude_deg": 10, "updates": 0,
        "health": None, "biases": [], "diagnoses": [],
    }  # fmt: skip
    page.evaluate(
        f"""(site) => {{
          window.multiradar.feed.sensors = [{{ ...site, range_max_m: null }}];
          {PICTURE}.map.getView().setZoom(11);
        }}""",
        site,
    )
    settled(page, "location.hash.includes('zoom=11')")
    assert page.evaluate(f"{PICTURE}.map.getView().getZoom()") == pytest.approx(11)


def spread(page: Page) -> float:
    """Return the median distance of plots from those of other radars of the track, map units."""
    found: float = page.evaluate(
        f"""() => {{
          const corrected = window.multiradar.view.shown.biases;
          const distances = [];
          const byTrack = new Map();
          for (const plot of {STORE}.plots) {{
            const track = {STORE}.track(plot.track);
            if (track === undefined) continue;
            const at = corrected ? [plot.correctedX, plot.correctedY] : [plot.x, plot.y];
            // Across the track: the plots are of different times.
            const speed = Math.hypot(track.vx, track.vy);
            const across = ((at[0] - track.x) * track.vy - (at[1] - track.y) * track.vx) / speed;
            distances.push(Math.abs(across));
          }}
          distances.sort((a, b) => a - b);
          return distances[Math.floor(distances.length / 2)];
        }}"""
    )
    return found


def test_the_bias_switch_moves_the_plots_onto_the_tracks(page: Page, air: Air) -> None:
    opened(page, air)
    without = spread(page)
    page.keyboard.press("b")
    expect(page.get_by_label("Correct plots for biases")).not_to_be_checked()
    assert spread(page) > 2.0 * without
    assert "off=biases" in page.url
    # The plots move to the other place, and the canvas with them.
    settled(page, f"{PICTURE}.corrected === 0")
    # Over the whole area they move by less than a pixel: the page offers to zoom.
    page.get_by_role("button", name="Zoom to an aircraft").click()
    shift = f"""(() => {{
      const all = [...{STORE}.plots].map((one) =>
        {PICTURE}.scene.a * Math.hypot(one.correctedX - one.x, one.correctedY - one.y));
      return all.sort((a, b) => a - b)[Math.floor(all.length / 2)];
    }})()"""
    settled(page, f"{shift} > 15")
    expect(page.get_by_text("too little to be visible")).to_have_count(0)
    page.keyboard.press("b")
    settled(page, f"{PICTURE}.corrected === 1")


def test_a_track_is_selected_on_the_map_and_its_sheet_and_past_are_shown(
    page: Page, air: Air
) -> None:
    opened(page, air)
    settled(page, f"{PICTURE}.seenOnCanvas.length > 10")
    at: dict[str, Any] = page.evaluate(
        f"""() => {{
          const box = document.getElementById("map").getBoundingClientRect();
          const one = {PICTURE}.seenOnCanvas.find((seen) => seen.x > 20 && seen.y > 20
            && seen.x < box.width - 20 && seen.y < box.height - 20);
          return {{ id: one.id, x: box.left + one.x, y: box.top + one.y }};
        }}"""
    )
    page.mouse.click(at["x"], at["y"])
    settled(page, "window.multiradar.view.selected !== null")
    sheet = page.locator("#sheet")
    expect(sheet.get_by_text("Position sigma")).to_be_visible()
    settled(page, "window.multiradar.selection.past.length > 10")
    settled(page, "window.multiradar.selection.forecast.length > 3")
    page.keyboard.press("Escape")
    expect(sheet.get_by_text("Select a track")).to_be_visible()


def test_the_table_is_sorted_and_filtered_from_the_keyboard(page: Page, air: Air) -> None:
    opened(page, air)
    page.get_by_role("button", name="Sigma").click()
    header = page.locator("#tracks th").nth(3)
    expect(header).to_have_attribute("aria-sort", "descending")
    sigmas = page.evaluate(f"{STORE}.tracks.map((one) => one.sigmaNowM)")
    first = page.locator("#tracks tbody tr").first
    expect(first).to_contain_text(f"{round(max(sigmas))} m")
    page.keyboard.press("/")
    page.keyboard.type("no such aircraft")
    expect(page.get_by_text("0 shown, 30 hidden by filters")).to_be_visible()


def test_the_view_is_that_of_the_address(page: Page, air: Air) -> None:
    opened(page, air, "/#off=labels,plots&units=si&theme=light&lon=61&lat=56&zoom=7")
    assert page.evaluate("document.documentElement.dataset.theme") == "light"
    expect(page.get_by_label("Labels")).not_to_be_checked()
    expect(page.get_by_label("Speed vectors")).to_be_checked()
    assert abs(page.evaluate(f"{PICTURE}.map.getView().getZoom()") - 7.0) < 0.01
    expect(page.locator("#tracks tbody tr").first).to_contain_text("m/s")
    # Another address in the open page.
    track = page.evaluate(f"{STORE}.tracks[0].id")
    page.evaluate(f"location.hash = 'off=trails&lon=62&lat=57&zoom=8&tab=map&track={track}'")
    settled(page, f"Math.abs({PICTURE}.map.getView().getZoom() - 8) < 0.01")
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"
    expect(page.get_by_label("Labels")).to_be_checked()
    expect(page.get_by_label("Earlier positions")).not_to_be_checked()
    assert page.evaluate(f"window.multiradar.feed.track === {track}")
    assert page.evaluate("window.multiradar.view.tab") == "map"
    # What the page writes into it is no command.
    page.keyboard.press("m")
    settled(page, "location.hash.includes('units=si') && location.hash.includes('zoom=8')")
    now_s = page.evaluate(f"{STORE}.dataTimeS")
    page.evaluate(f"location.hash = 'at={now_s - 30:.1f}'")
    settled(page, f"Math.abs({STORE}.dataTimeS - {now_s - 30.0}) < 0.1")
    expect(page.locator("#time .mode")).to_have_text("History paused")
    page.evaluate("location.hash = ''")
    settled(page, f"window.multiradar.clock.isLive && {STORE}.dataTimeS === {now_s}")


def test_units_and_theme_change_with_a_key(page: Page, air: Air) -> None:
    opened(page, air)
    speed = page.locator("#tracks tbody tr").first.locator("td").nth(2)
    expect(speed).to_contain_text("kt")
    page.keyboard.press("m")
    expect(speed).to_contain_text("m/s")
    page.keyboard.press("d")
    assert page.evaluate("document.documentElement.dataset.theme") == "light"
    assert "units=si" in page.url
    assert "theme=light" in page.url
    page.keyboard.press("m")
    page.keyboard.press("d")
    expect(page.locator("#bar time")).to_contain_text("UTC")


def test_names_with_markup_are_text(page: Page, air: Air) -> None:
    opened(page, air)
    page.evaluate(
        f"""() => {{
          const track = {STORE}.tracks[0];
          track.callsign = "<img src=x onerror=alert(1)>";
          window.multiradar.actions.select(track.id);
        }}"""
    )
    expect(page.locator("#sheet .name")).to_have_text("<img src=x onerror=alert(1)>")
    assert page.locator("#sheet img").count() == 0


def test_an_answer_that_is_no_frame_and_a_silent_service_are_announced(
    page: Page, air: Air
) -> None:
    opened(page, air)
    page.route("**/v1/picture*", lambda route: route.fulfill(body=b"<html>"))
    alert = page.get_by_role("alert")
    expect(alert).to_contain_text("not an air picture")
    settled(page, f"{STORE}.malformed > 0")
    page.unroute("**/v1/picture*")
    page.route("**/v1/**", lambda route: route.abort())
    expect(alert).to_contain_text("Air picture not updated since")
    expect(page.locator(".picture.lost")).to_have_count(1)
    page.unroute("**/v1/**")
    expect(alert).to_have_count(0)
    expect(page.locator(".picture.lost")).to_have_count(0)


def test_an_empty_sky_is_shown_as_one(page: Page, tmp_path: Any) -> None:
    empty = Air(tmp_path)
    try:
        watch = Watch(page)
        page.goto(empty.url)
        expect(page.locator("#bar").get_by_text("no tracks")).to_be_visible()
        expect(page.get_by_text("No tracks: there are no aircraft")).to_be_visible()
        page.keyboard.press("3")
        expect(page.locator("#sensors .badge")).to_have_text(["NO DATA"] * 3)
        expect(page.locator("#bar time")).to_contain_text("no data")
        assert watch.messages == []
        empty.send(empty.measurements.filter(pl.col("time_s") < 60.0))
        settled(page, f"{STORE}.tracks.length > 10")
    finally:
        empty.application.stop()


def test_total_silence_is_said_and_seen(page: Page, air: Air) -> None:
    silent = {"alarms": ["no_data"], "silence_s": 75.4}

    def without_data(route: Route) -> None:
        route.fulfill(json={**route.fetch().json(), **silent})

    page.route("**/v1/status", without_data)
    opened(page, air)
    alert = page.get_by_role("alert")
    expect(alert).to_have_text(
        re.compile(r"No measurements from any sensor for (7[5-9]|[89]\d) s: ")
    )
    expect(alert).to_contain_text("all tracks are stale.")
    expect(page.locator(".picture.lost")).to_have_count(1)
    silent["alarms"] = []
    expect(alert).to_have_count(0)
    expect(page.locator(".picture.lost")).to_have_count(0)
