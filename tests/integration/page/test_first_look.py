"""What somebody tries first: the wheel, keys, addresses; and what is at the ends of the world."""

from typing import Any

import pytest
from playwright.sync_api import Page, expect

from integration.page.conftest import Air, received
from integration.page.test_browser import PICTURE, STORE, opened, settled
from integration.page.test_map import overlaps
from integration.page.test_panels import pictured, sensors_with

VIEW = f"{PICTURE}.map.getView()"
DAY_S = 86_400.0


def test_the_wheel_zooms_without_a_click_and_the_page_does_not_scroll(page: Page, air: Air) -> None:
    opened(page, air)
    assert page.evaluate("document.documentElement.scrollHeight === innerHeight")
    zoom: float = page.evaluate(f"{VIEW}.getZoom()")
    page.mouse.move(400, 300)
    page.mouse.wheel(0, -300)
    settled(page, f"{VIEW}.getZoom() > {zoom}")
    assert page.evaluate("scrollY") == 0


def test_keys_work_while_the_slider_has_the_focus(page: Page, air: Air) -> None:
    opened(page, air)
    page.get_by_label("Time", exact=True).and_(page.locator("input")).click()
    page.keyboard.press("3")
    settled(page, "window.multiradar.view.tab === 'sensors'")
    page.keyboard.press("n")
    settled(page, "window.multiradar.clock.isLive")


@pytest.mark.parametrize("address", ["lon=999&lat=-400&zoom=1e9", "lon=200&lat=95&zoom=-3"])
def test_an_address_off_the_map_shows_the_map(page: Page, air: Air, address: str) -> None:
    page.goto(f"{air.url}/#{address}")
    settled(page, f"{STORE}.tracks.length > 0")
    west, south, east, north = page.evaluate(f"{VIEW}.calculateExtent()")
    assert -4e7 < west < east < 4e7
    assert -4e7 < south < north < 4e7


@pytest.mark.parametrize("address", ["at=1e30", "track=-1", "track=1.5", "at=1e12&track=1e30"])
def test_a_number_that_cannot_be_is_left_out(page: Page, air: Air, address: str) -> None:
    watch = opened(page, air, f"/#{address}")
    assert page.evaluate("window.multiradar.clock.isLive")
    assert page.evaluate("window.multiradar.view.selected") is None
    assert watch.messages == []


def test_the_end_of_a_fast_replay_is_shown_where_the_data_end(page: Page, air: Air) -> None:
    opened(page, air)
    # Hundred seconds of data in a second, and nothing since.
    ahead_s: list[float] = page.evaluate(
        f"""(() => {{
          const {{ constructor }} = {STORE};
          const store = new constructor();
          [store.dataTimeS, store.rate, store.receivedMs] = [1000, 100, 0];
          return [1000, 7900, 8100, 60000].map((ms) => store.timeAt(ms) - 1000);
        }})()"""
    )
    assert ahead_s == [10, 10, 0, 0]


def test_a_track_that_never_existed_is_asked_for_once(page: Page, air: Air) -> None:
    asked: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.goto(f"{air.url}/#track=999999&tab=track")
    expect(page.locator("#sheet")).to_contain_text("no retained track with number 999999")
    frames: int = page.evaluate(f"{STORE}.frames")
    # In this time it would have been asked for again.
    settled(page, f"{STORE}.frames > {frames + 6}")
    assert sum("/tracks/999999/" in one for one in asked) == 1


def test_a_track_that_the_service_has_again_after_a_start_has_its_details(
    page: Page, air: Air
) -> None:
    """While it reads its journal, the picture has tracks that it does not know yet."""
    opened(page, air)
    unknown = {"detail": "no track with number"}
    page.route("**/v1/tracks/*/*", lambda route: route.fulfill(status=404, json=unknown))
    page.evaluate(f"window.multiradar.actions.select({STORE}.tracks[0].id)")
    page.get_by_role("tab", name="Track", exact=True).click()
    contributing = page.get_by_role("region", name="Contributing sensors")
    expect(contributing).to_contain_text("no track with number")
    page.unroute_all(behavior="wait")
    expect(contributing).to_contain_text("in the last minute")
    expect(page.get_by_role("region", name="Track history")).to_be_visible()


def test_a_wrong_clock_makes_biases_doubtful_and_an_end_of_data_does_not(
    page: Page, air: Air
) -> None:
    code = "clock"

    def wrong(sensors: list[dict[str, Any]]) -> None:
        west = next(one for one in sensors if one["id"] == "west")
        west["diagnoses"] = [{"code": code, "sentence": "west: wrong"}]

    sensors_with(page, wrong)
    opened(page, air, "/#tab=radars")
    table = page.locator("#sensors table.sensors tbody tr")
    expect(table.get_by_text("FAULT")).to_have_count(1)
    expect(table.filter(has_text="?")).to_have_count(3)
    page.get_by_role("button", name="east").click()
    east = page.get_by_role("region", name="Sensor east")
    expect(east).to_contain_text("Do not use these biases: the positions from west are wrong")
    code = "ends_early"
    expect(table.filter(has_text="?")).to_have_count(0)
    expect(table.get_by_text("FAULT")).to_have_count(1)
    expect(east).to_contain_text("of 95 %")


def test_times_in_the_reasons_of_rejects_have_a_date(page: Page, air: Air) -> None:
    reason = "expected a time at most 6 s before the data time 1785600370.98 s, was 1785513970 s"
    row = {"number": 1, "source": "http", "code": "TIME_LATE", "reason": reason, "raw": "{}"}
    page.route("**/v1/rejects*", lambda route: route.fulfill(json={"rejects": [row]}))
    page.route(
        "**/v1/status",
        lambda route: route.fulfill(json=route.fetch().json() | {"rejected_by_code": {"LATE": 1}}),
    )
    opened(page, air, "/#tab=system")
    page.get_by_text("LATE 1").click()
    expect(page.get_by_role("region", name="Rejects")).to_contain_text(
        "at most 6 s before the data time 2026-08-01 16:06:10 UTC, was 2026-07-31 16:06:10 UTC"
    )


def test_land_does_not_run_around_the_world(page: Page, air: Air) -> None:
    opened(page, air)
    land = f"{PICTURE}.land.getSource().getFeatures()"
    settled(page, f"{land}.length > 100")
    # Edges across the map would be of polygons that cross the antimeridian. That along its southern
    # end closes Antarctica.
    longest, beyond = page.evaluate(
        f"""(() => {{
          const longest = [0];
          let beyond = 0;
          for (const one of {land}) {{
            const [west, , east] = one.getGeometry().getExtent();
            beyond += east > 20037600 || west < -20037600 ? 1 : 0;
            for (const ring of one.getGeometry().getCoordinates()) {{
              ring.slice(1).forEach(([x, y], at) => {{
                if (y > -19e6) longest.push(Math.abs(x - ring[at][0]));
              }});
            }}
          }}
          return [Math.max(...longest), beyond];
        }})()"""
    )
    assert longest < 1e7
    # Chukotka is on both sides.
    assert beyond >= 2


def test_earlier_positions_come_again_after_a_gap(page: Page, air: Air) -> None:
    opened(page, air)
    settled(page, f"{STORE}.tracks.some((one) => one.trail.length > 10)")
    known = f"{STORE}.tracks.map((one) => one.trail.length)"
    before = page.evaluate(known)
    # As if nothing had come for a minute: the page asks for all of it.
    page.evaluate(
        f"""(() => {{
          for (const one of {STORE}.tracks) one.trail.clear();
          {STORE}.dataTimeS -= 60;
        }})()"""
    )
    settled(page, f"JSON.stringify({known}) === '{str(before).replace(' ', '')}'")
    # Older than two minutes they are not drawn.
    ages = page.evaluate(
        f"""{STORE}.tracks.map((one) => [...one.trailAt({STORE}.dataTimeS + 60)]
          .map((at) => {STORE}.dataTimeS + 60 - one.trail.timeS[at]))"""
    )
    assert any(len(one) > 3 for one in ages)
    assert all(age < 120.0 for one in ages for age in one)


def test_several_days_have_their_dates(page: Page, air: Air) -> None:
    begin_s = 1.7e9

    def dated(header: dict[str, Any], tracks: dict[str, Any]) -> None:
        header["data_time_s"] = begin_s + DAY_S
        header["span_s"] = [begin_s, begin_s + DAY_S]

    pictured(page, dated)
    page.goto(air.url)
    ends = page.locator("#time .span span")
    expect(ends.first).to_have_text("2023-11-14 22:13:20")
    expect(ends.last).to_have_text("2023-11-15 22:13:20")
    expect(page.locator("#time time")).to_contain_text("2023-11-15")
    page.unroute_all(behavior="wait")


def test_print_says_that_there_are_no_data(page: Page, air: Air) -> None:
    age_s = received(page, 1.0)
    opened(page, air)
    state = page.locator("#bar strong.print-only")
    expect(state).not_to_be_visible()
    page.emulate_media(media="print")
    expect(state).to_be_visible()
    expect(state).to_have_text("Live")
    age_s[0] = 600.0
    expect(state).to_have_text("No data for 10 min")


def test_a_conflict_in_progress_is_drawn_with_its_present_distance(page: Page, air: Air) -> None:
    opened(page, air)
    settled(page, "window.multiradar.encounters.found.length > 0")
    # In one task: neither an answer nor a picture comes between the drawings.
    before, now, same, apart, old, said = page.evaluate(
        f"""(() => {{
          const {{ actions, encounters, picture, store }} = window.multiradar;
          const layer = {PICTURE}.layers.encounters;
          const texts = () => {{
            picture.touch();
            picture.map.renderSync();
            return [...layer.texts];
          }};
          const [found] = encounters.found;
          const before = encounters.found.length;
          encounters.found = [found];
          encounters.total = 2127;
          const [first, second] = [found.first_track_id, found.second_track_id]
            .map((id) => store.track(id));
          const timeS = store.timeAt(performance.now());
          store.timeAt = () => timeS;
          Object.assign(found, {{ time_s: timeS - 1, closest_time_s: timeS - 1,
            time_to_closest_s: 0, probability: 1, probability_both: 1, distance_m: 1 }});
          const [x, y] = store.placeOf(first, timeS);
          Object.assign(second, {{ x: x + 2.3 * 1852 * first.scale, y, timeS }});
          const now = texts();
          const {{ address }} = second;
          first.address = second.address = "3c6444";
          const same = texts();
          first.address = second.address = null;
          second.x += 10000 * first.scale;
          const apart = texts();
          second.x -= 10000 * first.scale;
          found.time_s -= 60;
          const old = texts();
          delete store.timeAt;
          second.address = address;
          actions.changed();
          const said = document.querySelector("#switches .encounters").textContent;
          return [before, now, same, apart, old, said];
        }})()"""
    )
    assert before > 0
    assert now == ["now 2.3 NM, > 99 %"]
    # Rather a duplicate track than a conflict.
    assert same == ["now 2.3 NM, both have address 3c6444: duplicate track?"]
    # It has ended since the answer; the answer is old.
    assert apart == old == []
    assert "1 of 2127 encounters" in said
    settled(page, "window.multiradar.encounters.total < 2127")
    expect(page.locator("#switches .encounters")).not_to_contain_text(" of ")


def test_texts_of_paths_and_encounters_do_not_cover_each_other(page: Page, air: Air) -> None:
    opened(page, air)
    page.evaluate(f"window.multiradar.actions.select({STORE}.tracks[0].id)")
    settled(page, "window.multiradar.selection.past.length > 20")
    settled(page, f"{PICTURE}.layers.encounters.texts.length > 0")
    page.evaluate(f"{VIEW}.setZoom({VIEW}.getZoom() - 2)")
    page.evaluate(f"{PICTURE}.map.renderSync()")
    moving: list[float] = page.evaluate(f"{PICTURE}.scene.reservedMoving")
    boxes = [
        {"left": x, "top": y, "right": x + width, "bottom": y + height}
        for x, y, width, height in zip(*[iter(moving)] * 4, strict=True)
    ]
    assert boxes
    assert overlaps(boxes) == 0
    # The weights of a trajectory set stand beside the minutes, also where the track circles.
    free = page.evaluate(
        f"""(() => {{
          const {{ scene, map, layers }} = {PICTURE};
          const {{ selection }} = scene;
          const {{ past, bundle }} = selection;
          const timeS = scene.timeS;
          const at = (x, y, agoS) => (
            {{ timeS: timeS - agoS, x: (x - scene.e) / scene.a, y: (y - scene.f) / scene.d }});
          const ring = [[440, 320], [470, 345], [440, 260], [360, 345], [340, 240]];
          selection.past = ring.map(([x, y], k) => at(x, y, 301 - 60 * k));
          const of = {{ kind: "left", sinceS: timeS }};
          const lines = [0.6, 0.3, 0.1].map((weight) => ({{ ...of, weight }}));
          const last = at(400, 300, 0);
          selection.bundle = {{ hypotheses: lines, best: [last], weighted: [], members: [] }};
          {PICTURE}.touch();
          map.renderSync();
          const [left, top, width, height] = layers.bundle.box;
          let touching = 0;
          for (let k = 0; k < scene.reserved.length; k += 4) {{
            const [x, y, w, h] = scene.reserved.slice(k, k + 4);
            if (left < x + w && x < left + width && top < y + h && y < top + height) touching += 1;
          }}
          const count = layers.bundle.lines.length;
          Object.assign(selection, {{ past, bundle }});
          {PICTURE}.touch();
          map.renderSync();
          return [count, touching];
        }})()"""
    )
    # It touches itself alone.
    assert free == [3, 1]
    # A symbol under the first text: it moves.
    tops = page.evaluate(
        f"""(() => {{
          const {{ seen, reservedMoving: boxes }} = {PICTURE}.scene;
          const timeS = {STORE}.timeAt(performance.now());
          {STORE}.timeAt = () => timeS;
          const topOf = () => ({PICTURE}.map.renderSync(), boxes[1]);
          const before = topOf();
          seen.touches = (left, top) => Math.abs(top - before) < 1;
          return [before, topOf()];
        }})()"""
    )
    assert abs(tops[1] - tops[0]) > 10


def test_the_bias_hint_names_the_sensor_that_biases_move_most(page: Page, air: Air) -> None:
    opened(page, air)
    most = page.evaluate(
        f"""(() => {{
          const of = new Map();
          for (const one of {STORE}.plots) {{
            const name = {STORE}.sensors[one.sensor];
            const far = Math.hypot(one.correctedX - one.x, one.correctedY - one.y);
            of.set(name, [...(of.get(name) ?? []), far].sort((a, b) => a - b));
          }}
          const middle = ([, all]) => all[Math.floor(all.length / 2)];
          return [...of].sort((a, b) => middle(b) - middle(a))[0][0];
        }})()"""
    )
    page.evaluate(f"{VIEW}.setZoom(5)")
    page.keyboard.press("b")
    hint = page.locator("#banner .note")
    expect(hint).to_contain_text(f"The biases of {most} move its plots by")
    hint.get_by_role("button", name="Zoom to an aircraft").click()
    # A plot of it is in the middle.
    settled(
        page,
        f"""(() => {{
          const {{ scene }} = {PICTURE};
          const [x, y] = [scene.width / 2, scene.height / 2];
          return [...{STORE}.plots].some((one) => {STORE}.sensors[one.sensor] === '{most}'
            && Math.hypot(scene.px(one.x) - x, scene.py(one.y) - y) < 60);
        }})()""",
    )
