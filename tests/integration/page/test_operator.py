"""What an operator who sees the page for the first time must not be puzzled by."""

import math
import re
from collections import Counter
from functools import partial
from typing import Any

from playwright.sync_api import Page, Route, expect

from integration.page.conftest import Air, received
from integration.page.test_browser import PICTURE, STORE, opened, settled
from integration.page.test_panels import pictured, sensors_with
from multiradar.report.times import clock_text
from support.processes.waiting import wait_until

MAP = "JSON.stringify(document.getElementById('map').getBoundingClientRect())"
CLOCK = "window.multiradar.clock"

#: A store of its own, and what gives it a frame without tracks, of a data time at a moment.
EMPTY_STORE = f"""
          const store = new {STORE}.constructor();
          const none = {{ rows: 0, column: () => new Float64Array(0) }};
          const header = {{ skipped: 0, total: 0, sensors: [], states: [] }};
          const take = (time, ms) => store.update(
            {{ header: {{ ...header, data_time_s: time }},
               tracks: none, plots: none, path: none }}, ms);
"""


def test_a_service_out_of_reach_is_explained_and_moves_nothing(page: Page, air: Air) -> None:
    opened(page, air)
    box = page.evaluate(MAP)
    page.route("**/v1/**", lambda route: route.abort())
    alert = page.get_by_role("alert")
    expect(alert).to_contain_text("The service cannot be reached. Check that it is running")
    expect(alert).to_contain_text("The page retries automatically.")
    expect(alert).not_to_contain_text("fetch")
    assert page.evaluate(MAP) == box
    page.unroute("**/v1/**")
    expect(alert).to_have_count(0)
    assert page.evaluate(MAP) == box


def test_a_data_time_that_goes_back_is_announced(page: Page, air: Air) -> None:
    opened(page, air)
    now_s: float = page.evaluate(f"{STORE}.dataTimeS")

    def earlier(header: dict[str, Any], tracks: dict[str, Any]) -> None:
        header["data_time_s"] -= 100.0

    pictured(page, earlier)
    alert = page.get_by_role("alert")
    expect(alert).to_contain_text(
        f"jumped back from {clock_text(now_s)} to {clock_text(now_s - 100.0)} UTC"
    )
    # Until it was read, also when the picture goes on.
    page.unroute_all(behavior="wait")
    settled(page, f"{STORE}.dataTimeS === {now_s}")
    alert.get_by_role("button", name="Close").click()
    expect(alert).to_have_count(0)


def test_five_minutes_ago_is_the_start_of_a_shorter_history(page: Page, air: Air) -> None:
    opened(page, air)
    box = page.evaluate(MAP)
    first_s, now_s = page.evaluate(f"[{CLOCK}.span[0], {STORE}.dataTimeS]")
    assert now_s - first_s < 300.0
    page.evaluate(f"window.multiradar.actions.select({STORE}.tracks[0].id)")
    settled(page, "window.multiradar.selection.updates.length > 0")
    page.keyboard.press("a")
    said = page.locator("#time p[role=status]")
    expect(said).to_contain_text(
        f"{clock_text(now_s - 300.0)} is before the earliest retained time. "
    )
    expect(said).to_contain_text(" at ")
    assert page.evaluate(f"{STORE}.dataTimeS") < now_s - 100.0
    assert page.evaluate(MAP) == box


def test_the_bias_correction_is_a_switch(page: Page, air: Air) -> None:
    opened(page, air)
    switch = page.get_by_role("switch", name="Bias correction")
    expect(switch).to_be_checked()
    expect(switch).to_contain_text("on")
    switch.press("Enter")
    expect(switch).not_to_be_checked()
    expect(switch).to_contain_text("off")
    page.keyboard.press("b")
    expect(switch).to_be_checked()


def test_the_export_menu_closes_with_escape_and_a_click_elsewhere(page: Page, air: Air) -> None:
    opened(page, air)
    menu = page.locator("details.menu")
    track = page.evaluate(f"{STORE}.tracks[0].id")
    page.evaluate(f"window.multiradar.actions.select({track})")
    menu.locator("summary").press("Enter")
    menu.get_by_role("button", name="CSV").focus()
    page.keyboard.press("Escape")
    expect(menu).not_to_have_attribute("open", "")
    expect(menu.locator("summary")).to_be_focused()
    # The first Escape does nothing else.
    assert page.evaluate("window.multiradar.view.selected") == track
    menu.locator("summary").click()
    expect(menu).to_have_attribute("open", "")
    page.mouse.click(400, 300)
    expect(menu).not_to_have_attribute("open", "")


def test_the_words_of_estimation_are_explained_where_they_stand(page: Page, air: Air) -> None:
    def untouched(sensors: list[dict[str, Any]]) -> None:
        for one in sensors:
            one["biases"][0] |= {"estimate": 0.0, "prior_ratio": 1.0}

    sensors_with(page, untouched)
    opened(page, air)
    page.keyboard.press("3")
    expect(page.locator("#sensors")).to_contain_text(
        "Of prior: sigma as a percentage of the sigma before the first plot"
    )
    # The estimate would be that of the prior.
    first = page.locator("#sensors .sheet tbody tr").first.locator("td")
    expect(first).to_have_text(["–", re.compile("."), "100 %"])
    assert (
        page.locator("#sensors table.sensors tbody tr").first.locator("td").nth(3).inner_text()
        == "–"
    )
    page.evaluate(f"window.multiradar.actions.select({STORE}.tracks[0].id)")
    why = page.get_by_role("region", name="Contributing sensors")
    expect(why).to_contain_text("Weight: the sensor's relative influence on the position.")


def test_the_map_names_the_radars_that_are_faulty_and_silent(page: Page, air: Air) -> None:
    def wrong(sensors: list[dict[str, Any]]) -> None:
        by_name = {one["id"]: one for one in sensors}
        by_name["north"]["health"]["alarms"] = "silent"
        by_name["north"]["clock_lead_s"] = 5.0
        by_name["west"]["health"] |= {"alarms": "noise,site", "range_sigma_ratio": 2.7}
        by_name["west"]["diagnoses"] = [{"code": "site", "sentence": "west: its site is 300 m off"}]

    sensors_with(page, wrong)
    received(page, 1.0)
    opened(page, air)
    settled(page, f"{PICTURE}.layers.layers[1].names.length === 3")
    names = page.evaluate(f"{PICTURE}.layers.layers[1].names")
    assert "north SILENT" in names
    # The same in the table; what was measured before says nothing of the present.
    north = page.locator("#sensors table.sensors tbody tr", has_text="north")
    page.keyboard.press("3")
    expect(north.locator("td")).to_have_text(["SILENT", "–", "–", *2 * [re.compile("m|°")]])
    sheet = page.get_by_role("region", name="Sensor north")
    north.click()
    expect(sheet).to_contain_text(re.compile(r"no plots at present; previously: \d+\.\d % of"))
    expect(sheet).to_contain_text("Do not use these biases: the clock of this sensor is wrong")
    page.evaluate("window.multiradar.actions.sensor('west')")
    assert "west FAULT" in names
    # A fault is in the estimates, too.
    expect(page.get_by_role("region", name="Sensor west")).not_to_contain_text("of 95 %")
    expect(page.locator("#sensors tbody tr", has_text="west").first).to_contain_text("°?")
    expect(page.locator("#sensors .summary")).to_contain_text("300 m off. 1 more to check.")
    # Those of the others absorb part of it.
    expect(page.locator("#sensors tbody tr", has_text="east").first).to_contain_text("°?")
    page.get_by_role("button", name="east").click()
    east = page.get_by_role("region", name="Sensor east")
    expect(east).to_contain_text("Do not use these biases: the positions from west are wrong")
    expect(east).not_to_contain_text("of 95 %")
    page.get_by_role("button", name="west").click()
    # What the cause and the figure say is not repeated.
    reasons = page.get_by_role("region", name="Sensor west").locator("p.alarm")
    noise = "The noise of the range is 2.7 times the configured noise."
    expect(reasons).to_have_text([noise, re.compile("Do not use these biases")])
    expect(page.locator("#sensors .summary")).to_contain_text("west: its site is 300 m off")


def test_causes_begin_with_a_capital_and_alarms_have_words(page: Page, air: Air) -> None:
    def wrong(sensors: list[dict[str, Any]]) -> None:
        by_name = {one["id"]: one for one in sensors}
        by_name["west"]["diagnoses"] = [
            {"sentence": f"west: {text}"}
            for text in ("its site is 1.99 km south", "its clock is wrong", "range_max_m is small")
        ]
        by_name["north"]["health"]["alarms"] = "bias_jump"

    sensors_with(page, wrong)
    opened(page, air, "/#tab=sensors")
    expect(page.locator("#sensors .summary")).to_contain_text("west: its site is 1.99 km south.")
    sheet = page.get_by_role("region", name="Sensor west")
    # The first one is above the list, where it follows the name of the sensor.
    causes = ["Its clock is wrong.", "range_max_m is small."]
    expect(sheet.locator("p.alarm")).to_have_text([*causes, re.compile("^Do not use")])
    expect(page.locator("#announcer")).to_contain_text("Alarm for sensor north: bias jump.")
    page.unroute_all(behavior="wait")
    expect(page.locator("#announcer")).to_contain_text("Alarm for sensor north: bias jump cleared.")


def test_long_names_and_badges_leave_all_tabs_and_columns_in_sight(page: Page, air: Air) -> None:
    def named(sensors: list[dict[str, Any]]) -> None:
        for one in sensors:
            one["id"] = f"Great-{one['id']}-Fell"
            one["diagnoses"] = [{"sentence": "wrong"}]

    def warned(route: Route) -> None:
        route.fulfill(json=route.fetch().json() | {"warnings": ["one"]})

    sensors_with(page, named)
    page.route("**/v1/status", warned)
    opened(page, air, "/#tab=sensors&q=0")
    expect(page.locator("#tab-system .badge")).to_have_text("1 warning")
    expect(page.locator("#tab-sensors .badge")).to_have_text("3 FAULT")
    for part in ("#tabs", "#panel-sensors"):
        hidden: float = page.locator(part).evaluate("(one) => one.scrollWidth - one.clientWidth")
        assert hidden <= 0.0


def test_an_emergency_an_estimated_level_and_a_single_plot_are_seen_as_such(
    page: Page, air: Air
) -> None:
    def changed(header: dict[str, Any], tracks: dict[str, Any]) -> None:
        header["sensors"] = list(header["sensors"])
        tracks["mode_3a"][0] = 0o7700
        tracks["height_sigma_m"][1], tracks["vertical_rate_mps"][1] = 200.0, math.nan
        tracks["state"][2], tracks["speed_mps"][2] = 0, 0.0
        tracks["sigma_now_m"][2] = 9000.0

    pictured(page, changed)
    opened(page, air)
    rows = page.locator("#tracks tbody tr")
    names = f"{STORE}.tracks.slice(0, 3).map((one) => one.id)"
    emergency, estimated, single = page.evaluate(names)
    expect(rows.and_(page.locator(f"[data-id='{emergency}']"))).to_contain_text("EMERGENCY")
    expect(rows.and_(page.locator(f"[data-id='{estimated}']"))).to_contain_text("~F")
    speed = rows.and_(page.locator(f"[data-id='{single}']")).locator("td").nth(2)
    expect(speed).to_have_text("–")
    summary = page.locator("#tracks .summary")
    expect(summary).to_contain_text("(tentative), 4.9 NM; confirmed: ")
    page.evaluate(f"window.multiradar.actions.select({estimated})")
    expect(page.locator("#sheet")).to_contain_text("± 1310 ft, estimated: not received")
    page.evaluate(f"window.multiradar.actions.select({emergency})")
    expect(page.locator("#sheet .head")).to_contain_text("EMERGENCY")
    # Its word and its name have room on a tablet.
    page.keyboard.press("Escape")
    page.keyboard.press("1")
    page.set_viewport_size({"width": 1024, "height": 768})
    name = rows.and_(page.locator(f"[data-id='{emergency}']")).locator("td.name")
    expect(name).to_be_visible()
    width, height = name.evaluate(
        "(cell) => [cell.scrollWidth - cell.clientWidth, cell.parentElement.offsetHeight]"
    )
    assert width <= 1
    assert height <= 27


def test_the_clock_runs_as_the_data_also_when_frames_come_in_bunches(page: Page, air: Air) -> None:
    opened(page, air)
    ahead, back, moves, last = page.evaluate(
        f"""() => {{
          {EMPTY_STORE}
          // Three times real time, a frame for each half second; two come together.
          const ahead = [];
          let [back, shown] = [0, 0];
          for (let pair = 0; pair < 40; pair++) {{
            const ms = 1000 * pair;
            take(3 * pair, ms);
            take(3 * pair + 1.5, ms + 20);
            back = Math.min(back, store.timeAt(ms + 20) - shown);
            for (let later = 0; later < 980; later += 20) {{
              const now = ms + 20 + later;
              if (pair > 10) ahead.push(store.timeAt(now) - (3 * pair + 1.5) - (3 * later) / 1000);
              shown = store.timeAt(now);
            }}
          }}
          // The data end: the picture stands, does not slide, and then is that of the last data.
          const moves = [];
          let before = store.timeAt(42000);
          for (let ms = 42000; ms < 60000; ms += 500) {{
            take(3 * 39 + 1.5, ms);
            moves.push(store.timeAt(ms) - before);
            before = store.timeAt(ms);
          }}
          return [[Math.min(...ahead), Math.max(...ahead)], back, moves, before - (3 * 39 + 1.5)];
        }}"""
    )
    assert ahead[0] > -1.0
    assert ahead[1] < 1.0
    # Data that come later than expected stop the picture; they do not turn it back.
    assert back == 0.0
    assert moves.count(0.0) == len(moves) - 1
    assert abs(min(moves) + 6.0) < 1e-9
    assert last == 0.0


def test_the_present_does_not_run_at_the_speed_of_the_history_before(page: Page, air: Air) -> None:
    opened(page, air)
    ahead = page.evaluate(
        f"""() => {{
          {EMPTY_STORE}
          store.pace = 300;
          for (let ms = 0; ms < 5000; ms += 500) take(0.3 * ms, ms);
          store.pace = null;
          store.clear();
          take(1500, 5500);
          take(1500, 6500);
          return store.timeAt(7000) - 1500;
        }}"""
    )
    assert ahead == 0.0


def test_the_clocks_show_the_time_of_the_map(page: Page, air: Air) -> None:
    opened(page, air)
    page.evaluate(f"{STORE}.timeAt = () => 45296.5")
    settled(page, f"{PICTURE}.scene.timeS === 45296.5")
    for clock in (page.locator("#bar time"), page.locator("#time time")):
        expect(clock).to_contain_text("12:34:56")


def test_a_paused_picture_does_not_change(page: Page, air: Air) -> None:
    opened(page, air)
    page.evaluate(f"window.multiradar.actions.select({STORE}.tracks[0].id)")
    asked: Counter[str] = Counter()
    page.on("request", lambda request: asked.update([request.url]))
    page.keyboard.press(" ")
    settled(page, f"{STORE}.dataTimeS !== null && window.multiradar.encounters.found.length > 0")
    # The map shows all, and the picture is that of its area.
    settled(page, "window.multiradar.picture.centred")
    settled(page, "window.multiradar.feed.pastOf.includes(` ${window.multiradar.feed.area} `)")
    known = f"JSON.stringify({STORE}.tracks.map((one) => [one.id, one.speedMps, one.x]))"
    before = page.evaluate(known)
    reads = [0]

    def faster(header: dict[str, Any], tracks: dict[str, Any]) -> None:
        tracks["speed_mps"] += 50.0
        reads[0] += 1

    pictured(page, faster)

    def past(name: str = "/v1/") -> list[int]:
        # Requests are answered in the meantime.
        page.evaluate("1")
        others = {one: count for one, count in asked.items() if "/v1/picture" not in one}
        return [count for one, count in others.items() if "at=" in one and name in one]

    for name in ("/encounters?", "/forecast?", "/plots?", "/sensors?"):
        wait_until(partial(past, name), f"the question {name}")
    read = reads[0]
    # Two seconds each: in this time all else would have been read three times.
    wait_until(lambda: bool(past()) and reads[0] >= read + 6, "reads of a time that stands")
    page.unroute_all(behavior="wait")
    assert page.evaluate(known) == before
    assert max(past()) <= 2


def test_rings_have_distances_and_the_knob_of_the_present_is_at_the_end(
    page: Page, air: Air
) -> None:
    opened(page, air)
    site = f"{PICTURE}.layers.layers[1]"
    settled(page, f"{site}.distances.includes('50 NM')")
    page.keyboard.press("m")
    settled(page, f"{site}.distances.includes('93 km')")
    slider = page.get_by_label("Time", exact=True).and_(page.locator("input"))
    missing: float = slider.evaluate("(one) => Number(one.max) - Number(one.value)")
    assert abs(missing) < 0.01


def test_forecast_regions_have_minutes_and_are_no_larger_than_the_map(page: Page, air: Air) -> None:
    opened(page, air)
    forecast = f"{PICTURE}.layers.forecast"
    page.evaluate(f"window.multiradar.actions.select({STORE}.tracks[0].id)")
    settled(page, f"{forecast}.names.join() === '+1 min,+2 min' && {forecast}.large === 0")
    page.evaluate(f"{PICTURE}.map.getView().setZoom(16)")
    settled(page, f"{forecast}.names.length === 0 && {forecast}.large === 2")


def test_names_on_the_axes_of_bars_do_not_run_together(page: Page, air: Air) -> None:
    opened(page, air)
    page.keyboard.press("3")
    settled(page, "document.querySelectorAll('svg.bars').length >= 4")
    gaps = page.evaluate(
        """() => [...document.querySelectorAll("svg.bars")].flatMap((one) => {
          const boxes = [...one.querySelectorAll("g text")].map((each) => each.getBBox());
          return boxes.slice(1).map((box, at) => box.x - boxes[at].x - boxes[at].width);
        })"""
    )
    assert len(gaps) > 0
    assert min(gaps) > 3.0


def test_space_is_of_the_focused_button_and_else_pauses(page: Page, air: Air) -> None:
    opened(page, air)
    back = page.get_by_role("button", name="−1 min")
    back.click()
    mode = page.locator("#time .mode")
    expect(mode).to_have_text("History paused")
    shown: float = page.evaluate(f"{CLOCK}.at(0)")
    # Clicked with the mouse, it does not keep Space, which plays.
    page.keyboard.press(" ")
    expect(mode).to_contain_text("History ▶")
    page.keyboard.press(" ")
    expect(mode).to_have_text("History paused")
    assert page.evaluate(f"{CLOCK}.at(0)") >= shown
    # Reached with the keyboard, it does, and the picture stays paused.
    back.focus()
    before: float = page.evaluate(f"{CLOCK}.at(0)")
    page.keyboard.press(" ")
    settled(page, f"{CLOCK}.at(0) < {before}")
    expect(back).to_be_focused()
    expect(mode).to_have_text("History paused")
    # Held down, it is pressed once.
    page.evaluate("document.activeElement.blur()")
    for _ in range(2):
        page.keyboard.down(" ")
    page.keyboard.up(" ")
    expect(mode).to_contain_text("History ▶")


def test_the_whole_heading_of_a_column_sorts(page: Page, air: Air) -> None:
    opened(page, air)
    heading = page.locator("#tracks th").nth(1)
    box = heading.bounding_box()
    assert box is not None
    for place, order in ((1.5, "descending"), (box["width"] - 1.5, "ascending")):
        page.mouse.click(box["x"] + place, box["y"] + 0.5 * box["height"])
        expect(heading).to_have_attribute("aria-sort", order)


def test_long_names_end_with_an_ellipsis_and_are_whole_in_title_and_sheet(
    page: Page, air: Air
) -> None:
    def long(header: dict[str, Any], tracks: dict[str, Any]) -> None:
        header["sensors"] = list(header["sensors"])
        tracks["mode_3a"][:] = 0o7700
        tracks["callsign"][:] = sum(23 << 6 * place for place in range(8))

    pictured(page, long)
    opened(page, air)
    name = page.locator("#tracks tbody tr[data-id] td").first
    expect(name).to_have_attribute("title", "WWWWWWWW EMERGENCY, confirmed")
    assert name.evaluate("(one) => getComputedStyle(one).textOverflow") == "ellipsis"
    hidden: float = page.locator("#tracks .rows").evaluate(
        "(one) => one.scrollWidth - one.clientWidth"
    )
    assert hidden <= 0.0
    page.evaluate(f"window.multiradar.actions.select({STORE}.tracks[0].id)")
    expect(page.locator("#sheet .name")).to_have_text("WWWWWWWW")


def test_messages_stay_on_the_map_and_stay_closed(page: Page, air: Air) -> None:
    opened(page, air)
    page.route("**/v1/**", lambda route: route.abort())
    expect(page.get_by_role("alert")).to_contain_text("Air picture not updated since")
    for width, height in ((1280, 720), (1024, 600), (900, 600), (600, 700)):
        page.set_viewport_size({"width": width, "height": height})
        ends = page.evaluate(
            """() => ["banner", "map"].map((id) =>
              document.getElementById(id).getBoundingClientRect().bottom)"""
        )
        assert ends[0] <= ends[1]
    page.unroute("**/v1/**")
    page.set_viewport_size({"width": 1280, "height": 720})
    expect(page.get_by_role("alert")).to_have_count(0)
    page.keyboard.press("b")
    hint = page.get_by_text("too little to be visible")
    page.locator("#banner").get_by_role("button", name="Close").click()
    expect(hint).to_have_count(0)
    frames = page.evaluate(f"{STORE}.frames")
    settled(page, f"{STORE}.frames > {frames} + 2")
    expect(hint).to_have_count(0)


def test_a_disabled_sensor_is_marked(page: Page, air: Air) -> None:
    def disabled(sensors: list[dict[str, Any]]) -> None:
        for one in sensors:
            one["enabled"] = one["id"] != "north"

    sensors_with(page, disabled)
    opened(page, air)
    settled(page, f"{PICTURE}.layers.layers[1].names.includes('north DISABLED')")
    page.keyboard.press("3")
    row = page.locator("#sensors tbody tr", has_text="north").first
    expect(row.locator(".badge")).to_have_text("DISABLED")
    page.get_by_role("button", name="north").click()
    expect(page.get_by_role("region", name="Sensor north")).to_contain_text("are rejected")


def test_duplicate_plots_and_repeated_messages_are_named_apart(page: Page, air: Air) -> None:
    def counted(route: Route) -> None:
        route.fulfill(json=route.fetch().json() | {"rejected_by_code": {"DUPLICATE": 2}})

    page.route("**/v1/status", counted)
    opened(page, air, "/#tab=system")
    system = page.locator("#system")
    expect(system).to_contain_text("DUPLICATE 2")
    expect(system).to_contain_text("duplicates of other plots (DUPLICATE)")
    expect(system.locator("dt", has_text="Duplicate (repeated messages)")).to_have_count(1)
    expect(system.locator("dt", has_text="Duplicates")).to_have_count(0)
