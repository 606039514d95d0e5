"""The panels beside the map, in a browser; one page for all tests of this module."""

import json
import re
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
from playwright.sync_api import Browser, Locator, Page, Route, expect

from integration.page.conftest import Air, received, window
from integration.page.test_browser import STORE, Watch, opened, settled
from multiradar.runtime.picture.frames import encoded
from support.inputs.picture_frames import decoded
from support.processes import clients

VIEW = "window.multiradar.view"
ACTIONS = "window.multiradar.actions"
NO_FILTERS = '{ text: "", fromM: null, toM: null, sensor: "", state: "", area: false }'
MARKUP = "<img src=x onerror=window.harmed=1>"


@pytest.fixture(scope="module")
def shared(browser: Browser, air: Air) -> Iterator[tuple[Page, Watch]]:
    with window(browser) as context:
        page = context.new_page()
        watch = opened(page, air)
        # The panels are drawn at most twice a second: not yet with the first frame.
        expect(rows(page)).to_have_count(30)
        yield page, watch


@pytest.fixture
def page(shared: tuple[Page, Watch], air: Air) -> Iterator[Page]:
    """The page with its first view; it must have written nothing to the console."""
    page, watch = shared
    watch.messages.clear()
    yield page
    page.unroute_all(behavior="wait")
    page.emulate_media(media="screen")
    page.set_viewport_size({"width": 1280, "height": 720})
    page.evaluate(f"""() => {{
        for (const dialog of document.querySelectorAll("dialog[open]")) dialog.close();
        document.activeElement?.blur();
        {ACTIONS}.filter({NO_FILTERS});
        {ACTIONS}.select(null);
        {ACTIONS}.sensor(null);
        if ({VIEW}.theme !== "dark") {ACTIONS}.theme();
        {VIEW}.open = true;
        {VIEW}.tab = "tracks";
        {ACTIONS}.changed();
    }}""")
    assert watch.messages == []
    assert all(address.startswith((air.url, "data:")) for address in watch.addresses)


def rows(page: Page) -> Locator:
    return page.locator("#tracks tbody tr[data-id]")


def shown_ids(page: Page) -> list[int]:
    return [int(one) for one in page.evaluate(
        '[...document.querySelectorAll("#tracks tbody tr[data-id]")].map((row) => row.dataset.id)'
    )]  # fmt: skip


def names_on_map(page: Page) -> set[int]:
    return set(page.evaluate("window.multiradar.picture.seenOnCanvas.map((one) => one.id)"))


# ------------------------------------------------------------------ the table of tracks


def test_arrows_select_in_the_table_and_on_the_map_and_enter_opens_the_sheet(page: Page) -> None:
    order = page.evaluate(
        f"""() => [...{STORE}.tracks].sort((a, b) => (a.code < b.code ? -1 : 1))
        .map((one) => one.id)"""
    )
    page.keyboard.press("/")
    expect(page.get_by_label("Search tracks")).to_be_focused()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("Home")
    for place in (1, 2, 3):
        page.keyboard.press("ArrowDown")
        assert page.evaluate(f"{VIEW}.selected") == order[place]
    expect(page.locator("#tracks tr[aria-selected=true]")).to_have_attribute(
        "data-id", str(order[3])
    )
    page.keyboard.press("End")
    assert page.evaluate(f"{VIEW}.selected") == order[-1]
    expect(page.locator(f"#tracks tr[data-id='{order[-1]}']")).to_be_in_viewport()
    page.keyboard.press("Enter")
    expect(page.get_by_role("tab", name="Track", exact=True)).to_have_attribute(
        "aria-selected", "true"
    )
    expect(page.locator("#sheet").get_by_text("Contributing sensors")).to_be_visible()


def test_the_least_certain_track_is_first_by_sigma_and_named(page: Page) -> None:
    page.get_by_role("button", name="Sigma").click()
    expect(page.locator("#tracks th").nth(3)).to_have_attribute("aria-sort", "descending")
    worst = page.evaluate(f"{STORE}.tracks.toSorted((a, b) => b.sigmaNowM - a.sigmaNowM)[0].id")
    assert shown_ids(page)[0] == worst
    page.get_by_role("button", name="Least certain").click()
    assert page.evaluate(f"{VIEW}.selected") == worst
    page.keyboard.press("1")
    page.get_by_role("button", name="Track ▲").or_(
        page.get_by_role("button", name="Track", exact=True)
    ).click()


def test_what_is_filtered_out_of_the_table_is_not_on_the_map(page: Page) -> None:
    page.keyboard.press("f")
    settled(page, "window.multiradar.picture.seenOnCanvas.length === 30")
    page.get_by_label("FL from").fill("300")
    low = page.evaluate(f"{STORE}.tracks.filter((one) => one.heightM < 30000 * 0.3048).length")
    assert 0 < low < 30
    expect(rows(page)).to_have_count(30 - low)
    settled(page, f"window.multiradar.picture.seenOnCanvas.length === {30 - low}")
    assert names_on_map(page) == set(shown_ids(page))
    assert "from=" in page.url
    expect(page.get_by_text(f"filtered: {30 - low} shown")).to_be_visible()
    page.get_by_label("to", exact=True).fill("200")
    expect(page.get_by_text("its lower limit is above its upper limit")).to_be_visible()
    expect(page.get_by_label("FL from")).to_have_attribute("aria-invalid", "true")
    # A level that is shown is in the band of this level alone.
    levels = page.evaluate(
        f"{STORE}.tracks.map((one) => Math.round(one.heightM / 30.48)).filter((one) => one > 300)"
    )
    for name in ("FL from", "to"):
        page.get_by_label(name, exact=True).fill(str(levels[0]))
    expect(rows(page)).to_have_count(levels.count(levels[0]))
    page.get_by_label("FL from").fill("300")
    page.get_by_label("to", exact=True).fill("")
    expect(rows(page)).to_have_count(30 - low)
    page.get_by_role("combobox", name="State").select_option("coasting")
    expect(page.get_by_text("No track matches the filters.")).to_be_visible()
    page.get_by_role("button", name="Clear filters").click()
    expect(rows(page)).to_have_count(30)
    page.get_by_role("combobox", name="Sensor").select_option("north")
    seen = page.evaluate(f"""() => new Set([...{STORE}.plots].filter((one) =>
        {STORE}.sensors[one.sensor] === "north").map((one) => one.track)).size""")
    expect(rows(page)).to_have_count(seen)


def test_only_the_area_of_the_map(page: Page) -> None:
    page.keyboard.press("f")
    settled(page, "window.multiradar.picture.seenOnCanvas.length === 30")
    page.get_by_label("Only the map area").check()
    expect(rows(page)).to_have_count(30)
    page.evaluate("window.multiradar.picture.map.getView().setZoom(9)")
    settled(page, 'document.querySelectorAll("#tracks tbody tr[data-id]").length < 30')
    inside = page.evaluate(
        f"{STORE}.tracks.filter((one) => window.multiradar.picture.contains(one)).length"
    )
    expect(rows(page)).to_have_count(inside)
    page.keyboard.press("Escape")
    page.keyboard.press("f")


def pictured(page: Page, change: Callable[[dict[str, Any], dict[str, Any]], None]) -> None:
    """Change the tracks of each frame on its way to the page."""

    def fulfil(route: Route) -> None:
        header, tables = decoded(route.fetch().body())
        tracks = {name: np.array(values) for name, values in tables["tracks"].items()}
        del header["tables"]
        change(header, tracks)
        route.fulfill(body=encoded(header, {"tracks": tracks, "plots": tables["plots"]}))

    page.route("**/v1/picture*", fulfil)


def answered(page: Page, track: int | str, *transitions: dict[str, Any]) -> None:
    """Answer for a track that the service does not have."""
    document = {
        "time_s": 0.0, "updates": [], "plots": [], "points": [], "probability": 0.95,
        "transitions": list(transitions),
    }  # fmt: skip
    page.route(f"**/v1/tracks/{track}/**", lambda route: route.fulfill(body=json.dumps(document)))


def test_two_thousand_tracks_cost_few_rows(page: Page) -> None:
    def many(header: dict[str, Any], tracks: dict[str, Any]) -> None:
        times = -(-2000 // len(tracks["track_id"]))
        for name, values in tracks.items():
            tracks[name] = np.tile(values, times)[:2000]
        tracks["track_id"] = np.arange(2000, dtype=np.float64) + 1.0
        header["total"] = 2000

    # The service knows only thirty.
    answered(page, "*")
    pictured(page, many)
    settled(page, f"{STORE}.tracks.length === 2000")
    expect(page.get_by_role("grid")).to_have_attribute("aria-rowcount", "2001")
    assert rows(page).count() < 80
    rows(page).first.focus()
    page.keyboard.press("End")
    expect(page.locator("#tracks tr[aria-rowindex='2001']")).to_be_in_viewport()
    assert rows(page).count() < 80
    page.evaluate(f"{ACTIONS}.select(null)")
    page.unroute_all(behavior="wait")
    settled(page, f"{STORE}.tracks.length === 30")


def test_a_track_without_height_callsign_and_code_says_so(page: Page) -> None:
    def bare(header: dict[str, Any], tracks: dict[str, Any]) -> None:
        for name, values in tracks.items():
            if name in ("height_m", "vertical_rate_mps"):
                values[:] = np.nan
            elif name in ("callsign", "mode_3a", "mode_s_address"):
                values[:] = -1

    pictured(page, bare)
    settled(page, f"{STORE}.tracks.every((one) => Number.isNaN(one.heightM))")
    first = page.evaluate(f"{STORE}.tracks[0].id")
    page.get_by_role("button", name="Level").click()
    expect(rows(page).first).to_contain_text(f"#{first}")
    expect(rows(page).first.locator("td").nth(1)).to_have_text("–")
    rows(page).first.click()
    sheet = page.locator("#sheet")
    expect(sheet.locator("dd").nth(0)).to_contain_text("not received")
    expect(sheet.get_by_text("not received")).to_have_count(4)
    page.unroute_all(behavior="wait")
    page.keyboard.press("1")
    page.get_by_role("button", name="Track", exact=True).click()
    settled(page, f"{STORE}.tracks.every((one) => one.heightM > 0)")


# ------------------------------------------------------------------ the sheet of a track


def test_the_sheet_says_why_the_track_is_where_it_is(page: Page, air: Air) -> None:
    track = page.evaluate(f"{STORE}.tracks[4].id")
    page.evaluate(f"{ACTIONS}.show({track})")
    with clients.client(air.url) as client:
        answer = client.get(f"/v1/tracks/{track}/plots?window_s=60").json()
    sensors = {one["sensor_id"] for one in answer["plots"]}
    why = page.get_by_role("region", name="Contributing sensors")
    expect(
        why.get_by_text(f"{len(answer['plots'])} plots from {len(sensors)} sensors")
    ).to_be_visible()
    shown = why.locator("table").first.locator("tbody tr")
    expect(shown).to_have_count(len(sensors))
    weights = [
        int(text.removesuffix(" %")) for text in shown.locator("td:nth-child(3)").all_inner_texts()
    ]
    assert abs(sum(weights) - 100) <= 2
    assert weights == sorted(weights, reverse=True)
    why.get_by_text("Individual plots").click()
    expect(why.locator("details tbody tr")).to_have_count(len(answer["plots"]))
    for name in ("Motion", "Identity", "Track history"):
        expect(page.get_by_role("region", name=name)).to_be_visible()
    expect(page.get_by_role("region", name="Identity").get_by_text("the same")).to_be_visible()


def test_the_curves_of_a_track_are_drawn_and_described(page: Page) -> None:
    page.evaluate(f"{ACTIONS}.show({STORE}.tracks[2].id)")
    curves = page.locator("#sheet mr-chart")
    expect(curves).to_have_count(4)
    for label in ("Level", "Ground speed", "Along the line of sight", "Across the line of sight"):
        chart = page.locator(f"mr-chart[aria-label^='{label}']")
        expect(chart).to_have_attribute("role", "img")
        expect(chart).to_have_attribute("aria-label", _with_numbers())
        painted = chart.locator("canvas").evaluate(
            """(canvas) => canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height)
              .data.some((value) => value > 0)"""
        )
        assert painted


def _with_numbers() -> Any:
    return re.compile(r"[a-z]+ -?[\d.]+ to -?[\d.]+, last -?[\d.]+")


def test_another_address_in_a_plot_is_an_alarm(page: Page) -> None:
    def other(route: Route) -> None:
        document = route.fetch().json()
        document["updates"][-1]["measured_mode_s_address"] = "abcdef"
        route.fulfill(body=json.dumps(document))

    page.route("**/history*", other)
    page.evaluate(f"{ACTIONS}.show({STORE}.tracks[1].id)")
    expect(page.get_by_role("region", name="Identity").locator(".alarm")).to_contain_text(
        "abcdef from"
    )


def test_an_ended_track_says_so_and_why(page: Page, shared: tuple[Page, Watch]) -> None:
    step = {"time_s": 170.0, "transition": "ended", "reason": "merged", "into_track_id": 7}
    answered(page, 9999, step)
    page.evaluate(f"{ACTIONS}.select(9999)")
    ended = page.get_by_text("Track 9999 was terminated at 00:02:50: duplicate of track 7.")
    expect(ended).to_be_visible()
    settled(page, "window.multiradar.selection.updates.length === 0")
    # The service answers 404 to that, which the browser writes to the console.
    assert not any("/9999/forecast" in one for one in shared[1].addresses)
    page.evaluate(f"{ACTIONS}.select(null)")


# ------------------------------------------------------------------ radars


def sensors_with(page: Page, change: Callable[[list[dict[str, Any]]], None]) -> None:
    """Change the sensors on their way to the page."""

    def fulfil(route: Route) -> None:
        document = route.fetch().json()
        change(document["sensors"])
        route.fulfill(body=json.dumps(document))

    page.route("**/v1/sensors", fulfil)


def test_the_radar_that_is_wrong_is_first_and_announced(page: Page) -> None:
    """Its badge has a word, not only a colour."""

    def wrong(sensors: list[dict[str, Any]]) -> None:
        by_name = {one["id"]: one for one in sensors}
        by_name["north"]["health"]["range_sigma_ratio"] = 1.7
        by_name["west"]["health"]["alarms"] = "noise"
        by_name["west"]["diagnoses"] = [{"sentence": f"west: its site is 300 m off {MARKUP}"}]

    sensors_with(page, wrong)
    received(page, 1.0)
    page.keyboard.press("3")
    states = page.locator("#sensors table.sensors tbody tr")
    expect(states.nth(0)).to_contain_text("west")
    expect(states.nth(0)).to_contain_text("FAULT")
    expect(states.nth(1)).to_contain_text(re.compile(r"north\s*CHECK"))
    expect(states.nth(2)).to_contain_text("OK")
    summary = page.locator("#sensors .summary")
    expect(summary).to_contain_text("west: its site is 300 m off <img")
    expect(summary).not_to_contain_text("west: west")
    expect(page.get_by_role("tab", name="Radars")).to_contain_text("1 FAULT")
    # Each sentence stays: another may follow it at any time.
    expect(page.locator("#announcer")).to_contain_text("Alarm for sensor west: noise.")
    assert page.evaluate("window.harmed") is None
    # A service that replays its journal after a restart has the alarms of earlier times.
    page.route("**/v1/status", replaying)
    settled(page, "window.multiradar.feed.status.state === 'recovering'")
    page.unroute("**/v1/sensors")
    seen = page.evaluate("window.multiradar.feed.revision")
    settled(page, f"window.multiradar.feed.revision > {seen} + 2")
    expect(states.nth(0)).to_contain_text("FAULT")
    expect(page.locator("#announcer")).not_to_contain_text("cleared")
    page.unroute_all(behavior="wait")
    expect(page.locator("#announcer")).to_contain_text("Alarm for sensor west: noise cleared.")


def replaying(route: Route) -> None:
    document = route.fetch().json()
    route.fulfill(body=json.dumps(document | {"state": "recovering", "received_age_s": 1.0}))


def test_a_radar_has_biases_over_time_and_innovations_by_place(page: Page) -> None:
    page.keyboard.press("3")
    page.get_by_role("button", name="north").click()
    sheet = page.get_by_role("region", name="Sensor north")
    row = sheet.locator("table").first.locator("tbody tr").first
    expect(row).to_contain_text("Range offset")
    estimate = next(
        one["estimate"]
        for one in page.evaluate(
            'window.multiradar.feed.sensors.find((one) => one.id === "north").biases'
        )
        if one["parameter"] == "range_offset_m"
    )
    assert f"{abs(estimate):.1f} m" in row.inner_text()
    expect(sheet.locator("mr-chart[aria-label^='Range offset']")).to_be_visible()
    expect(sheet.locator("svg.bars")).to_have_count(4)
    expect(sheet.locator("svg.bars").first).to_have_attribute(
        "aria-label", _labelled("Range by azimuth: largest mean")
    )
    expect(sheet.get_by_text("Detection probability")).to_be_visible()
    expect(sheet.get_by_text("Latency behind data time")).to_be_visible()
    expect(sheet.get_by_text("Clock offset")).to_be_visible()
    assert "sensor=north" in page.url


def test_the_clock_of_a_radar_in_asterix_is_on_its_sheet(page: Page) -> None:
    clock = {
        "messages": 512, "clock_offset_s": 0.25, "latency_min_s": 0.1, "latency_median_s": 0.5,
        "latency_p99_s": 0.75, "alarm": "clock", "reason": f"0.25 s ahead {MARKUP}",
    }  # fmt: skip
    page.route(
        "**/v1/status",
        lambda route: route.fulfill(
            json={**route.fetch().json(), "asterix": {"clocks": {"north": clock}}}
        ),
    )
    page.keyboard.press("3")
    page.get_by_role("button", name="north").click()
    sheet = page.get_by_role("region", name="Sensor north")
    expect(sheet).to_contain_text("+0.250 s: 0.25 s ahead <img")
    expect(sheet).to_contain_text("+0.500 s, 99 %: +0.750 s")
    assert page.evaluate("window.harmed") is None


def _labelled(begin: str) -> Any:
    return re.compile(f"^{begin}")


# ------------------------------------------------------------------ the system


def test_the_system_has_rejects_with_examples(page: Page, air: Air) -> None:
    row = {
        "time_s": 170.0, "sensor_id": "east", "kind": "radar", "azimuth_deg": 10.0,
        "range_m": -5.0, "mode_3a": MARKUP,
    }  # fmt: skip
    with clients.client(air.url) as client:
        assert client.post("/v1/measurements", json=[row]).status_code == 422
    page.keyboard.press("4")
    code = (
        page.locator("#system details")
        .filter(has_text="BAD")
        .or_(page.locator("#system section[aria-label=Rejects] details"))
        .first
    )
    code.locator("summary").click()
    expect(code.locator("code").first).to_contain_text(MARKUP)
    assert page.evaluate("window.harmed") is None
    system = page.locator("#system")
    expect(system.get_by_text("Journal entries processed")).to_be_visible()
    expect(system.get_by_text("imm", exact=True)).to_be_visible()
    expect(system.get_by_text("per s").first).to_be_visible()
    code.locator("summary").click()


# ------------------------------------------------------------------ keys, screens, paper


def test_the_help_sheet_has_every_key(page: Page) -> None:
    page.keyboard.press("?")
    dialog = page.get_by_role("dialog")
    expect(dialog).to_be_visible()
    shown = dialog.locator("kbd").all_inner_texts()
    expect(dialog.locator(".legend li")).to_have_count(18)
    for key in ("1", "5", "b", "t", "f", "/", "j", "m", "d", "?", "Esc"):
        assert key in shown
    page.keyboard.press("Escape")
    expect(dialog).not_to_be_visible()


def test_an_overloaded_service_is_named_and_the_picture_goes_on(
    page: Page, shared: tuple[Page, Watch]
) -> None:
    busy = {"detail": "too many expensive queries in progress", "code": "TOO_MANY_QUERIES"}
    page.route("**/v1/picture*", lambda route: route.fulfill(status=503, json=busy))
    alert = page.get_by_role("alert")
    expect(alert).to_contain_text("too many expensive queries in progress")
    # What it has stays on the map; other answers do not hide what is wrong.
    assert page.evaluate(f"{STORE}.tracks.length") == 30
    read = page.evaluate("window.multiradar.feed.revision")
    settled(page, f"window.multiradar.feed.revision > {read} + 1")
    assert page.evaluate("window.multiradar.feed.problem") == busy["detail"]
    page.unroute_all(behavior="wait")
    expect(alert).to_have_count(0)
    assert all("503" in message for message in shared[1].messages)
    shared[1].messages.clear()


def test_the_panels_are_a_drawer_on_a_tablet_and_everything_can_be_touched(page: Page) -> None:
    page.set_viewport_size({"width": 768, "height": 1024})
    page.evaluate(f"{ACTIONS}.show({STORE}.tracks[0].id)")
    expect(page.locator("#sheet")).to_be_visible()
    map_height = page.locator("#map").bounding_box()
    page.get_by_role("tab", name="Track", exact=True).click()
    expect(page.locator("#sheet")).not_to_be_visible()
    grown = page.locator("#map").bounding_box()
    assert map_height is not None
    assert grown is not None
    assert grown["height"] > map_height["height"] + 200.0
    for tab in ("Tracks", "Radars", "Map"):
        page.get_by_role("tab", name=tab).click()
        small = page.evaluate("""() => [
              ...document.querySelectorAll("button, select, summary, input")]
            .filter((one) => one.checkVisibility() && !one.closest("label") && !one.closest("tr"))
            .map((one) => [one.textContent || one.id, one.getBoundingClientRect().height])
            .filter(([, height]) => height < 43.9)""")
        assert small == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_a_lost_connection_is_announced_once_and_its_return_too(
    page: Page, shared: tuple[Page, Watch]
) -> None:
    page.route("**/v1/**", lambda route: route.fulfill(status=503, body="{}"))
    alert = page.get_by_role("alert")
    expect(alert).to_contain_text("Air picture not updated since")
    text = alert.inner_text()
    settled(page, f"{STORE}.frames > 0")
    assert alert.inner_text() == text
    page.unroute_all(behavior="wait")
    expect(page.locator("#announcer")).to_contain_text("The service is responding again.")
    expect(alert).to_have_count(0)
    assert all("503" in message for message in shared[1].messages)
    shared[1].messages.clear()
