"""What the map draws: symbols, labels, encounters, sweeps, forecasts, trajectory sets."""

import itertools
from collections.abc import Iterator
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from integration.page.conftest import Air, window
from integration.page.test_browser import PICTURE, STORE, Watch, opened, settled
from integration.page.test_panels import pictured
from support.processes import clients
from support.processes.waiting import wait_until

LAYERS = f"{PICTURE}.layers"
BOXES = f"{LAYERS}.labels.boxes"


class Shown:
    """The page of this module: opened once, the same for all tests."""

    def __init__(self, page: Page, watch: Watch, requests: list[str]) -> None:
        self.page, self.watch, self.requests = page, watch, requests

    def value(self, expression: str) -> Any:
        return self.page.evaluate(expression)

    def until(self, condition: str) -> None:
        settled(self.page, condition)


@pytest.fixture(scope="module")
def shown(browser: Browser, air: Air) -> Iterator[Shown]:
    with window(browser) as context:
        page = context.new_page()
        requests: list[str] = []
        page.on("request", lambda request: requests.append(request.url))
        yield Shown(page, opened(page, air), requests)


def test_uncertainty_has_the_axes_of_the_covariance(shown: Shown) -> None:
    tracks = shown.value(
        f"{STORE}.tracks.map((one) => [one.majorM, one.minorM, one.axisDeg, one.sigmaNowM])"
    )
    assert len(tracks) >= 30
    for major_m, minor_m, axis_deg, sigma_m in tracks:
        assert 0.0 < minor_m <= major_m
        assert 0.0 <= axis_deg <= 180.0
        assert (major_m**2 + minor_m**2) ** 0.5 == pytest.approx(sigma_m, rel=0.02)
    # Not circles: a radar measures ranges better than azimuths.
    assert max(major_m / minor_m for major_m, minor_m, _, _ in tracks) > 1.2


def test_identities_are_written_as_the_service_writes_them(shown: Shown, air: Air) -> None:
    with clients.client(air.url) as client:
        tracks = client.get("/v1/tracks").json()["tracks"]
    expected = {
        one["track_id"]: [one["callsign"], one["mode_3a"], one["mode_s_address"]] for one in tracks
    }
    found = shown.value(
        f"{STORE}.tracks.map((one) => [one.id, [one.callsign, one.code, one.address]])"
    )
    assert dict(found) == expected


def overlaps(boxes: list[dict[str, float]]) -> int:
    """Return the number of pairs of labels that cover each other."""
    return sum(
        one["left"] < two["right"] and two["left"] < one["right"]
        and one["top"] < two["bottom"] and two["top"] < one["bottom"]
        for at, one in enumerate(boxes) for two in boxes[:at]
    )  # fmt: skip


def test_labels_do_not_cover_each_other_and_keep_their_slots(shown: Shown) -> None:
    shown.until(f"{BOXES}.length > 10")
    # So far out that the aircraft crowd. Moved a little, hardly a label has to jump: a few at once
    # where rounding to pixels closes a gap. Nothing else happens between drawings in one task.
    drawings = shown.value(
        f"""(() => {{
          const {{ map }} = {PICTURE};
          map.getView().setZoom(map.getView().getZoom() - 1.5);
          map.renderSync();
          const drawings = [{BOXES}];
          for (let step = 0; step < 8; step++) {{
            map.getView().adjustCenter([500, 500]);
            map.renderSync();
            drawings.push({BOXES});
          }}
          return drawings;
        }})()"""
    )
    kept = []
    for boxes, after in itertools.pairwise(drawings):
        assert len(boxes) > 5
        assert overlaps(boxes) == 0
        assert any(one["slot"] >= 8 for one in boxes)
        moved = {one["id"]: one["slot"] for one in after}
        kept += [moved.get(one["id"]) == one["slot"] for one in boxes]
    assert sum(kept) >= 0.9 * len(kept)
    # The selected track always has one.
    last = shown.value(
        f"{PICTURE}.seenOnCanvas.find((one) => !{BOXES}.some((box) => box.id === one.id))?.id"
        f" ?? {PICTURE}.seenOnCanvas[0].id"
    )
    shown.value(f"window.multiradar.actions.select({last})")
    shown.until(f"{BOXES}.some((box) => box.id === {last})")
    shown.value("window.multiradar.actions.select(null)")
    shown.value(f"{PICTURE}.fit()")


def paused(shown: Shown) -> None:
    # Space is of a button that an earlier test has focused by keyboard.
    shown.value("document.activeElement.blur()")
    shown.page.keyboard.press(" ")
    shown.until("!window.multiradar.clock.isLive && window.multiradar.feed.isCurrent")
    shown.until(f"{PICTURE}.seenOnCanvas.length === 30")


def resumed(shown: Shown) -> None:
    shown.page.keyboard.press("n")
    shown.until("window.multiradar.clock.isLive && window.multiradar.feed.isCurrent")


def test_a_label_leaves_an_aircraft_that_stays_under_it(shown: Shown) -> None:
    paused(shown)
    try:
        # Selected, its label is placed first; the picture is read for it once more.
        label = shown.value(f"{STORE}.tracks[0].id")
        shown.value(f"window.multiradar.actions.select({label})")
        shown.until(f"window.multiradar.feed.pastOf.endsWith(' {label}')")
        other, slot, after = shown.value(
            f"""(() => {{
              const {{ store, picture }} = window.multiradar;
              const {{ scene }} = picture;
              picture.map.renderSync();
              const box = {BOXES}.find((one) => one.id === {label});
              const other = store.tracks.find((one) => one.id !== box.id);
              other.x = ((box.left + box.right) / 2 - scene.e) / scene.a;
              other.y = ((box.top + box.bottom) / 2 - scene.f) / scene.d;
              [other.vx, other.vy] = [0, 0];
              picture.touch();
              picture.map.renderSync();
              const after = {BOXES}.find((one) => one.id === box.id);
              return [other.id, box.slot, after.slot];
            }})()"""
        )
        # It does not jump from one that passes.
        assert after == slot
        shown.until(
            f"""(() => {{
              window.multiradar.picture.map.renderSync();
              window.multiradar.picture.layers.labels.placedS = -Infinity;
              const box = {BOXES}.find((one) => one.id === {label});
              const symbol = {PICTURE}.seenOnCanvas.find((one) => one.id === {other});
              return symbol.x < box.left || symbol.x > box.right
                || symbol.y < box.top || symbol.y > box.bottom;
            }})()"""
        )
    finally:
        shown.value("window.multiradar.actions.select(null)")
        resumed(shown)


def test_the_path_of_the_selected_track_ends_at_its_symbol(shown: Shown) -> None:
    paused(shown)
    try:
        track = shown.value(f"Math.min(...{STORE}.tracks.map((one) => one.id))")
        shown.value(f"window.multiradar.actions.select({track})")
        shown.until("window.multiradar.selection.past.length > 20")
        shown.value("window.multiradar.selection.settled()")
        # The past as it was read 30 s ago; so far in that it ends beyond the canvas.
        alone = """for (const name of ["trails", "plots", "sites", "tracks", "uncertainty"])
          view.shown[name] = false;
          const { selection } = window.multiradar;
          const one = store.track(view.selected);
          picture.map.getView().setCenter([one.x, one.y]);
          picture.map.getView().setZoom(15);
          selection.forecast = [];
          selection.past = selection.past.filter((point) => point.timeS < one.timeS - 30)"""
        whole, cut = painted(shown, "ground", alone, "view.selected = null")
        assert whole - cut > 100
    finally:
        shown.value(
            """for (const name of ["trails", "plots", "sites", "tracks", "uncertainty"])
              window.multiradar.view.shown[name] = true"""
        )
        shown.value("window.multiradar.actions.select(null)")
        shown.value(f"{PICTURE}.fit()")
        resumed(shown)


def test_encounters_are_those_of_the_service_and_have_a_switch(shown: Shown, air: Air) -> None:
    shown.until("window.multiradar.encounters.revision > 0")
    first = next(at for at, one in enumerate(shown.requests) if "/v1/encounters?" in one)
    # Asked as soon as there are tracks: pictures are read every half second.
    assert sum("/v1/picture?" in one for one in shown.requests[:first]) < 4
    with clients.client(air.url) as client:
        asked: dict[str, str | int | float] = {
            "horizon_s": 120, "distance_m": 9260, "height_m": 305, "order": "probability",
            "probability_min": 0.01, "limit": 30,
        }  # fmt: skip
        expected = client.get("/v1/encounters", params=asked).json()["encounters"]
    found = shown.value("window.multiradar.encounters.found")
    assert [one["probability"] for one in found] == [one["probability"] for one in expected]
    assert len(expected) > 0
    shown.until(f"{LAYERS}.encounters.texts.length > 0")
    text = shown.value(f"{LAYERS}.encounters.texts[0]")
    assert " in " in text
    assert text.endswith("%")
    # The texts of encounters and the names of radars are not covered either.
    texts, labels = shown.value(
        f"[[...{PICTURE}.scene.reserved, ...{PICTURE}.scene.reservedMoving], {BOXES}]"
    )
    assert len(texts) % 4 == 0
    for left, top, width, height in zip(*[iter(texts)] * 4, strict=True):
        box = {"left": left, "top": top, "right": left + width, "bottom": top + height}
        assert all(overlaps([box, label]) == 0 for label in labels)
    # Of a picture that is behind the answer: closer than two minutes in the answer alone.
    late = shown.value(
        f"""(() => {{
          const {{ map }} = {PICTURE};
          for (const one of window.multiradar.encounters.found) one.closest_time_s += 500;
          {PICTURE}.touch();
          map.renderSync();
          return {LAYERS}.encounters.texts.length;
        }})()"""
    )
    assert late == 0
    shown.until(f"{LAYERS}.encounters.texts.length > 0")
    shown.page.keyboard.press("e")
    shown.until(f"{LAYERS}.encounters.texts.length === 0")
    assert "off=encounters" in shown.page.url
    shown.page.keyboard.press("e")
    shown.until(f"{LAYERS}.encounters.texts.length > 0")


def test_a_sweep_turns_while_its_radar_sends_and_stands_without_data(shown: Shown) -> None:
    beams = shown.value(
        f"""() => {{
          const {{ feed }} = window.multiradar;
          const {{ scans }} = {PICTURE};
          const at = {STORE}.dataTimeS;
          return feed.sensors.filter((one) => one.rotation_period_s).map((one) =>
            [one.rotation_period_s, scans.azimuth(one, at), scans.azimuth(one, at + 1),
             scans.azimuth(one, at + 60)]);
        }}"""
    )
    turning = [beam for beam in beams if beam[1] is not None]
    assert turning
    for period_s, now, later, silent in turning:
        assert later - now == pytest.approx(2.0 * 3.141592653589793 / period_s)
        assert silent is None


def painted(shown: Shown, plane: str, *steps: str) -> list[int]:
    """Return the number of painted pixels of a plane after each step.

    All in one task, at the time of the data: nothing moves and nothing comes between the drawings.
    """
    counts: list[int] = shown.value(
        f"""(() => {{
          const {{ picture, store, view }} = window.multiradar;
          const canvas = document.querySelector(".picture canvas.{plane}");
          const count = () => {{
            picture.map.renderSync();
            const copy = new OffscreenCanvas(canvas.width, canvas.height);
            const context = copy.getContext("2d", {{ willReadFrequently: true }});
            context.drawImage(canvas, 0, 0);
            const {{ data }} = context.getImageData(0, 0, canvas.width, canvas.height);
            return data.reduce((sum, value, at) => sum + (at % 4 === 3 && value > 0 ? 1 : 0), 0);
          }};
          const {{ pace }} = store;
          store.pace = 0;
          const counts = [];
          {" ".join(f"{step}; counts.push(count());" for step in steps)}
          store.pace = pace;
          return counts;
        }})()"""
    )
    return counts


def test_plots_of_a_sensor_are_switched_off(shown: Shown) -> None:
    # Without rings, which are switched off with the sensor, too.
    whole = painted(shown, "ground", "")
    shown.page.keyboard.press("r")
    shown.until("!window.multiradar.view.shown.sites")
    before = painted(shown, "ground", "")
    assert before < whole
    shown.page.keyboard.press("5")
    box = shown.page.get_by_label("Plots by sensor").get_by_role("checkbox").first
    box.uncheck()
    assert "hide=" in shown.page.url
    assert painted(shown, "ground", "") < before
    box.check()
    assert painted(shown, "ground", "") == before
    shown.page.keyboard.press("r")
    shown.until("window.multiradar.view.shown.sites")


def test_each_sensor_has_a_form_of_its_own(shown: Shown) -> None:
    def eight(header: dict[str, Any], tracks: dict[str, Any]) -> None:
        header["sensors"] = [*header["sensors"], *(f"more-{number}" for number in range(5))]

    page = shown.page
    pictured(page, eight)
    shown.until(f"{STORE}.sensors.length === 8")
    page.keyboard.press("5")
    forms = page.locator(".switches.sensors svg.swatch path")
    expect(forms).to_have_count(8)
    assert len(set(forms.evaluate_all("(all) => all.map((one) => one.getAttribute('d'))"))) == 8
    page.unroute_all(behavior="wait")
    shown.until(f"{STORE}.sensors.length === 3")


def test_two_sensors_are_two_layers(shown: Shown) -> None:
    page = shown.page
    page.keyboard.press("5")
    sensors = shown.value(f"{STORE}.sensors")
    page.get_by_role("button", name=f"Show only {sensors[0]}").click()
    page.get_by_role("checkbox", name=sensors[1], exact=True).check()
    page.keyboard.press("s")
    page.keyboard.press("i")
    shown.until(f"{PICTURE}.seenOnCanvas.length === 0")
    # Their plots are joined, each aircraft for itself; the third sensor is hidden.
    shown.until(f"{LAYERS}.joined.lines[0] > 30 && {LAYERS}.joined.lines[1] > 30")
    assert shown.value(f"{LAYERS}.joined.lines[2]") == 0
    assert "on=joined" in page.url
    assert "off=tracks" in page.url
    page.keyboard.press("s")
    page.keyboard.press("i")
    page.get_by_role("button", name=f"Show only {sensors[0]}").click()
    page.get_by_role("button", name="Show all sensors").click()
    assert shown.value("window.multiradar.view.hiddenSensors.size") == 0


def test_plots_slide_between_both_positions(shown: Shown) -> None:
    # A loaded machine may draw no picture in the third of a second that it takes.
    slid = """async () => {
      const { picture, actions } = window.multiradar;
      const found = new Set();
      actions.toggle("biases");
      while (picture.corrected > 0) {
        found.add(picture.corrected);
        await new Promise((done) => requestAnimationFrame(done));
      }
      actions.toggle("biases");
      while (picture.corrected < 1) await new Promise((done) => requestAnimationFrame(done));
      return [...found];
    }"""
    steps: list[float] = []

    def between() -> bool:
        steps[:] = shown.value(slid)
        assert steps == sorted(steps, reverse=True)
        return any(0.0 < one < 1.0 for one in steps)

    wait_until(between, "plots between both positions")


def test_the_forecast_says_what_its_regions_held(shown: Shown, air: Air) -> None:
    with clients.client(air.url) as client:
        status = client.get("/v1/status").json()
    assert status["forecast_probability"] == 0.95
    assert 0 <= status["forecasts_held"] <= status["forecasts_counted"]
    shown.value(f"window.multiradar.actions.select({STORE}.tracks[0].id)")
    shown.until(f"{LAYERS}.forecast.text.includes('nominal 95 %')")
    text = shown.value(f"{LAYERS}.forecast.text")
    if status["forecasts_counted"]:
        part = 100.0 * status["forecasts_held"] / status["forecasts_counted"]
        assert text == f"containment {part:.1f} % (nominal 95 %)"
    else:
        assert text == "nominal 95 %, not calibrated yet"
    shown.value("window.multiradar.actions.select(null)")


def test_the_trajectory_set_of_the_selected_track_has_weights(shown: Shown, air: Air) -> None:
    # Sets are made beside the tracker, some time after the plots.
    shown.until(f"{STORE}.bundles.length > 0")
    track = shown.value(f"{STORE}.bundles[0]")
    shown.value(f"window.multiradar.actions.show({track})")

    def same() -> bool:
        with clients.client(air.url) as client:
            first = client.get(f"/v1/tracks/{track}/trajectories").json()["trajectories"][0]
        line = shown.value(f"{LAYERS}.bundle.lines[0] ?? ''")
        weight = f"{round(100.0 * first['weight'])} % {first['segments'][-1]['kind']}"
        return bool(line.startswith(weight))

    wait_until(same, "the trajectory set of the service")
    assert shown.value("window.multiradar.selection.bundle.members.length") > 0
    shown.page.keyboard.press("y")
    shown.until(f"{LAYERS}.bundle.lines.length === 0")
    shown.page.keyboard.press("y")
    shown.value("window.multiradar.actions.select(null)")


def test_symbols_have_a_form_for_each_source_and_state_and_their_switches(shown: Shown) -> None:
    def various(header: dict[str, Any], tracks: dict[str, Any]) -> None:
        tracks["state"][:2] = [header["states"].index(one) for one in ("tentative", "coasting")]
        tracks["on_ground"][2] = 1
        # Plots of ADS-B, of multilateration and of radars.
        tracks["sources"][3:6] = [1, 2, 4]

    page = shown.page
    pictured(page, various)
    shown.until(f"{STORE}.tracks[0].state === 'tentative'")
    ids = shown.value(f"{STORE}.tracks.slice(0, 6).map((one) => one.id)")
    # States 0 to 2, sources 3 times 0 to 2, on the ground 9.
    forms = f"[...{PICTURE}.layers.pixels.find((one) => one.forms).forms.keys()]"
    shown.until(f"[0, 2, 10, 7, 4, 1].every((key) => {forms}.includes(key))")
    on_map = f"{PICTURE}.seenOnCanvas.map((one) => one.id)"
    for key, hidden in (("t", ids[0]), ("g", ids[2])):
        page.keyboard.press(key)
        shown.until(f"!{on_map}.includes({hidden}) && {on_map}.includes({ids[5]})")
        page.keyboard.press(key)
        shown.until(f"{on_map}.includes({hidden})")
    page.unroute_all(behavior="wait")
    shown.until(f"{STORE}.tracks[0].state !== 'tentative'")


@pytest.mark.parametrize(
    ("key", "name", "plane"),
    [
        ("h", "trails", "ground"),
        ("p", "plots", "ground"),
        ("v", "vectors", "moving"),
        ("u", "uncertainty", "moving"),
    ],
)
def test_history_plots_vectors_and_uncertainty_have_switches(
    shown: Shown, key: str, name: str, plane: str
) -> None:
    drawn = shown.value(f"{PICTURE}.drawn")
    shown.page.keyboard.press(key)
    shown.until(f"!window.multiradar.view.shown.{name} && {PICTURE}.drawn > {drawn}")
    # Close enough for regions that are larger than their symbols.
    there = """const [{ x, y }] = store.tracks;
      picture.map.getView().setCenter([x, y]);
      picture.map.getView().setZoom(13)"""
    off, on, again = painted(
        shown, plane, there, f"view.shown.{name} = true", f"view.shown.{name} = false"
    )
    assert off == again < on
    assert f"off={name}" in shown.page.url
    shown.page.keyboard.press(key)
    shown.until(f"window.multiradar.view.shown.{name}")
    shown.value(f"{PICTURE}.fit()")


def test_after_a_gap_no_older_positions_are_drawn(shown: Shown) -> None:
    lengths = shown.value(
        f"""(() => {{
          const trail = new {STORE}.tracks[0].trail.constructor();
          return [0, 10, 20, 100, 500].map((time) => {{
            trail.extend(time, 0, 0);
            return trail.length;
          }});
        }})()"""
    )
    assert lengths == [1, 2, 3, 4, 1]


def test_the_map_is_north_up(shown: Shown) -> None:
    assert shown.value(f"{PICTURE}.map.getView().getRotation()") == 0
    shown.page.keyboard.press("f")
    x, y = (shown.value(f"{PICTURE}.scene.{axis}") for axis in ("a", "d"))
    assert x > 0 > y


def test_the_map_wrote_nothing_to_the_console(shown: Shown, air: Air) -> None:
    assert shown.watch.messages == []
    assert all(one.startswith((air.url, "data:")) for one in shown.watch.addresses)


def test_names_that_come_later_do_not_cover_labels(shown: Shown) -> None:
    paused(shown)
    try:
        # The picture stands; paths and forecasts of what is selected come all the same.
        for at in range(0, 30, 5):
            track = shown.value(f"{STORE}.tracks[{at}].id")
            shown.value(f"window.multiradar.actions.select({track})")
            shown.until("window.multiradar.selection.past.length > 1")
            shown.until(f"{PICTURE}.ground.includes(` ${{window.multiradar.selection.revision}} `)")
            texts, boxes = shown.value(f"[{PICTURE}.scene.reserved, {BOXES}]")
            for left, top, width, height in zip(*[iter(texts)] * 4, strict=True):
                text = {"left": left, "top": top, "right": left + width, "bottom": top + height}
                assert all(overlaps([text, box]) == 0 for box in boxes)
    finally:
        shown.value("window.multiradar.actions.select(null)")
        resumed(shown)
