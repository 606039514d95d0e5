"""The page of `multiradar view`: two runs, exports, the user's GeoJSON, the measuring line."""

import csv
import io
import json
import struct
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, Route, expect
from pyproj import Geod

from integration.page.conftest import Air, window
from integration.page.test_browser import STORE, Watch, settled
from integration.page.test_map import overlaps
from multiradar.app import view_server
from multiradar.cli.main import EXIT_DONE, run
from multiradar.cli.playback.view import run_files
from multiradar.runtime.recorded.run import RecordedRun
from multiradar.storage.overlays import read_overlays

KML = "{http://www.opengis.net/kml/2.2}"
WGS84 = Geod(ellps="WGS84")
SECTOR = {
    "type": "Feature",
    "properties": {"name": "<b>N1</b>"},
    "geometry": {"type": "Polygon", "coordinates": [[[60, 56], [62, 56], [62, 57], [60, 56]]]},
}
MEASURE = "window.multiradar.measure"
#: Of longitude, in map units.
METRES_PER_DEGREE = 6_378_137.0 * 3.141592653589793 / 180.0


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    folder = tmp_path_factory.mktemp("runs")
    air = Air(folder)
    air.application.stop()
    air.measurements.write_parquet(folder / "measurements.parquet")
    (folder / "sensors.toml").write_text(air.sensors)
    (folder / "shapes").mkdir()
    # Not cut at the antimeridian.
    airway = {
        "type": "LineString",
        "coordinates": [[178.5, 51.0], [-179.5, 52.0], [-179.3, 53.0], [-178.5, 53.0]],
    }
    airways = {"type": "Feature", "properties": {}, "geometry": airway}
    # Cut there, as RFC 7946 recommends.
    cut = {"type": "MultiPolygon", "coordinates": [
        [[[179, 64], [180, 64], [180, 66], [179, 66], [179, 64]]],
        [[[-180, 64], [-179, 64], [-179, 66], [-180, 66], [-180, 64]]],
    ]}  # fmt: skip
    sector = {"type": "Feature", "properties": {}, "geometry": cut}
    nowhere = {"type": "Feature", "properties": {"name": "nowhere"}, "geometry": None}
    shapes = {"type": "FeatureCollection", "features": [SECTOR, airways, sector, nowhere]}
    (folder / "shapes" / "sectors.geojson").write_text(json.dumps(shapes))
    (folder / "shapes" / "broken.geojson").write_text('{"type": "Feature"')
    given = [str(folder / "measurements.parquet"), "--sensors", str(folder / "sensors.toml")]
    for name in ("imm", "two-stage"):
        assert run(["track", *given, "--out", str(folder / name), "--filter", name]) == EXIT_DONE
    both = [folder / "imm", folder / "two-stage"]
    runs = [
        RecordedRun(run_files(one, folder / "measurements.parquet", both), folder) for one in both
    ]
    server = view_server(runs, read_overlays(folder / "shapes"), 0, lambda: None)
    server.start()
    yield server.url
    server.stop()


def opened(page: Page, url: str, address: str = "") -> Watch:
    """Open the page 150 s after the first update, and wait for its picture."""
    watch = Watch(page)
    page.goto(f"{url}/#{address}")
    settled(page, "window.multiradar.clock.span !== null")
    page.evaluate(
        "(() => { const { clock } = window.multiradar;"
        " clock.pause(); clock.seek(clock.span[0] + 150); })()"
    )
    settled(page, f"{STORE}.tracks.length >= 20 && window.multiradar.feed.second.tracks.length > 5")
    return watch


def geodesic(start: Sequence[float], end: Sequence[float]) -> tuple[float, float]:
    """Return azimuth, degrees, and distance, m, between two places [longitude, latitude]."""
    azimuth, _, metres = WGS84.inv(start[0], start[1], end[0], end[1])
    return float(azimuth), float(metres)


def coloured(page: Page, colour: str) -> int:
    """Return how many pixels of the moving plane have a colour, nearly."""
    count: int = page.evaluate(
        """(colour) => {
          const canvas = document.querySelector(".picture canvas.moving");
          const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
          const wanted = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
          let found = 0;
          for (let at = 0; at < data.length; at += 4) {
            const near = wanted.every((one, k) => Math.abs(data[at + k] - one) < 12);
            if (data[at + 3] > 200 && near) found += 1;
          }
          return found;
        }""",
        colour,
    )
    return count


def test_a_run_plays_from_its_start_without_a_service(page: Page, shown: str) -> None:
    watch = Watch(page)
    # The run lasts 18 s: what the page says meanwhile is written down.
    page.add_init_script(
        """window.modes = [];
        new MutationObserver(() => window.modes.push(document.querySelector(".mode")?.innerText))
          .observe(document, { childList: true, subtree: true, characterData: true });"""
    )
    page.goto(shown)
    settled(page, f"{STORE}.tracks.length >= 20")
    settled(page, "window.modes.some((one) => /recorded ▶ ×10/i.test(one))")
    page.evaluate("window.multiradar.clock.pause()")
    expect(page.locator("#time .mode")).to_have_text("Recorded paused")
    page.keyboard.press(" ")
    settled(page, "window.multiradar.clock.playing")
    page.keyboard.press(" ")
    expect(page.locator("#time .mode")).to_have_text("Recorded paused")
    page.get_by_role("button", name="+10 s").click()
    expect(page.get_by_role("button", name="Go live")).to_have_count(0)
    page.keyboard.press("3")
    expect(page.locator("#sensors .summary").first).to_contain_text("causes from the whole run")
    assert watch.messages == []
    assert all(address.startswith((shown, "data:")) for address in watch.addresses)
    # A run has no present, and the alarms at its end are not news at its start.
    sensors = f"{shown}/v1/sensors"
    assert any(address.startswith(f"{sensors}?at=") for address in watch.addresses)
    assert sensors not in watch.addresses


def test_the_map_shows_where_the_whole_run_is(page: Page, shown: str) -> None:
    opened(page, shown)
    settled(
        page,
        """(() => {
          const { feed, picture } = window.multiradar;
          const { scene } = picture;
          const mercator = (latitude) =>
            6378137 * Math.log(Math.tan(Math.PI / 4 + (latitude * Math.PI) / 360));
          const [west, south, east, north] = feed.extent;
          const x = [west, east].map((one) => scene.px((one * Math.PI * 6378137) / 180));
          const y = [south, north].map((one) => scene.py(mercator(one)));
          return [...x.map((one) => one / scene.width), ...y.map((one) => one / scene.height)]
            .every((one) => one > 0 && one < 1);
        })()""",
    )


def test_the_bias_switch_works_offline(page: Page, shown: str) -> None:
    opened(page, shown)
    moved = page.evaluate(
        f"[...{STORE}.plots].map((one) =>"
        " Math.hypot(one.correctedX - one.x, one.correctedY - one.y))"
    )
    assert len(moved) > 100
    assert sorted(moved)[len(moved) // 2] > 50.0
    assert page.evaluate(f"[...{STORE}.plots].filter((one) => one.track > 0).length") > 100


def test_two_runs_are_two_layers_with_symbols_of_their_own(page: Page, shown: str) -> None:
    opened(page, shown, "tab=map")
    # Both have labels, which do not cover each other.
    labels = "window.multiradar.picture.layers.labels.boxes"
    settled(page, f"[0, 1].every((run) => {labels}.some((box) => box.run === run))")
    second, legend = "#ff9bd2", page.locator("#layers")
    assert coloured(page, second) > 100
    boxes = page.evaluate(labels)
    assert overlaps(boxes) == 0
    expect(legend.get_by_label("▼ two-stage")).to_be_checked()
    legend.get_by_label("▼ two-stage").click()
    settled(page, "location.hash.includes('without=r1')")
    assert page.evaluate("window.multiradar.picture.drawn") > 2
    drawn = page.evaluate("window.multiradar.picture.drawn")
    page.evaluate("window.multiradar.picture.touch()")
    settled(page, f"window.multiradar.picture.drawn > {drawn}")
    assert coloured(page, second) == 0
    # The first run goes as well, and both come back.
    legend.get_by_label("● imm").click()
    settled(page, "window.multiradar.picture.seenOnCanvas.length === 0")
    legend.get_by_label("● imm").click()
    settled(page, "window.multiradar.picture.seenOnCanvas.length > 5")


def test_table_selection_search_and_exports_are_of_the_chosen_run(page: Page, shown: str) -> None:
    watch = opened(page, shown)
    header, run = page.locator("#bar"), page.get_by_role("combobox", name="Run")
    expect(header).to_contain_text("imm: ")
    # A search says what the other run has.
    found = page.evaluate("window.multiradar.feed.second.tracks[0].callsign = 'ONLYHERE'")
    page.get_by_label("Search tracks").fill(found)
    page.get_by_role("button", name="two-stage has 1").click()
    page.get_by_role("button", name="Clear filters").click()
    expect(header).to_contain_text("two-stage: ")
    assert "run=1" in page.url
    settled(page, f"{STORE}.tracks.length > 5 && window.multiradar.feed.second.tracks.length >= 20")
    ids = page.evaluate(f"{STORE}.tracks.map((one) => one.id)")
    name, content = exported(page, "CSV")
    assert name.endswith("-two-stage.csv")
    rows = list(csv.DictReader(io.StringIO(content.decode(), newline="")))
    assert [int(row["track_id"]) for row in rows] == ids
    # The path and the history of a track are those of the run, too.
    page.evaluate(f"window.multiradar.actions.select({ids[0]})")
    settled(page, "window.multiradar.selection.past.length > 5")
    far = page.evaluate(
        f"""(() => {{
          const one = {STORE}.track({ids[0]});
          return window.multiradar.selection.past.some((point) => point.timeS === one.timeS
            && Math.hypot(point.x - one.x, point.y - one.y) < 1);
        }})()"""
    )
    assert far
    expect(page.get_by_role("region", name="Track history")).to_be_visible()
    assert any("/second/v1/tracks/" in one for one in watch.addresses)
    # A click on a symbol of the other run chooses it.
    page.keyboard.press("1")
    page.evaluate("window.multiradar.actions.select(null)")
    settled(page, "window.multiradar.feed.pastOf.endsWith(' null')")
    # Both runs have it at nearly the same place.
    chosen, x, y = page.evaluate(
        """(() => {
          const { feed, picture } = window.multiradar;
          const { scene } = picture;
          const [one] = feed.second.tracks;
          [one.vx, one.vy] = [0, 0];
          one.x = (scene.width - 30 - scene.e) / scene.a;
          one.y = (scene.height - 30 - scene.f) / scene.d;
          picture.touch();
          picture.map.renderSync();
          return [one.id, scene.width - 30, scene.height - 30];
        })()"""
    )
    page.locator("#map").click(position={"x": x, "y": y})
    settled(page, f"window.multiradar.view.selected === {chosen} && {STORE}.track({chosen})")
    expect(header).to_contain_text("imm: ")
    # So does hiding the run of the table.
    page.keyboard.press("5")
    page.get_by_label("● imm").click()
    expect(header).to_contain_text("two-stage: ")
    page.keyboard.press("1")
    expect(run).to_have_value("two-stage")
    expect(page.locator("#tracks tbody tr[data-id]").first).to_be_visible()
    run.select_option("imm")
    expect(header).to_contain_text("imm: ")
    settled(page, "!location.hash.includes('without=')")
    page.evaluate("location.hash = 'without=r0'")
    expect(header).to_contain_text("two-stage: ")
    assert watch.messages == []


def test_own_geojson_is_shown_and_a_broken_file_is_named(page: Page, shown: str) -> None:
    watch = opened(page, shown, "tab=map")
    legend = page.locator("#layers")
    expect(legend).to_contain_text("broken is not shown: not valid JSON")
    expect(legend.get_by_label("sectors")).to_be_checked()
    layer = "window.multiradar.picture.map.getLayers().item(1)"
    assert page.evaluate(f"{layer}.getSource().getFeatures()[0].get('name')") == "<b>N1</b>"
    assert page.evaluate(f"{layer}.getVisible()")
    extents = page.evaluate(
        f"(([, line, cut]) => [line, ...cut.getPolygons()].map((one) => one.getExtent()))"
        f"({layer}.getSource().getFeatures().map((one) => one.getGeometry()))"
    )
    widths_deg = [(east - west) / METRES_PER_DEGREE for west, _, east, _ in extents]
    assert widths_deg == pytest.approx([3.0, 1.0, 1.0])
    # Its name takes part in the placing of labels.
    names = "window.multiradar.picture.layers.overlayNames.drawn.join()"
    page.evaluate("window.multiradar.picture.map.getView().setZoom(8)")
    settled(page, f"{names} === '<b>N1</b>'")
    texts, boxes = page.evaluate(
        "(({ scene, layers }) => [scene.reserved, layers.labels.boxes])(window.multiradar.picture)"
    )
    for left, top, width, height in zip(*[iter(texts)] * 4, strict=True):
        text = {"left": left, "top": top, "right": left + width, "bottom": top + height}
        assert all(overlaps([text, box]) == 0 for box in boxes)
    # It fades with the picture.
    page.route("**/v1/**", lambda route: route.abort())
    faded = "getComputedStyle(document.querySelector('.ol-layers')).opacity < 0.5"
    settled(page, faded)
    page.unroute("**/v1/**")
    settled(page, f"!({faded})")
    watch.messages.clear()
    legend.get_by_label("sectors").click()
    settled(page, f"{names} === ''")
    settled(page, f"!{layer}.getVisible() && location.hash.includes('without=o1')")
    assert watch.messages == []


def test_a_radar_whose_plots_are_drawn_has_data(page: Page, shown: str) -> None:
    def without_updates(route: Route) -> None:
        document = route.fetch().json()
        for one in document["sensors"]:
            one |= {"updates": None, "last_update_s": None, "age_s": None}
        route.fulfill(json=document)

    page.route("**/v1/sensors*", without_updates)
    opened(page, shown, "tab=sensors")
    badges = page.locator("#sensors tbody .badge")
    expect(badges).to_have_count(3)
    settled(page, f"{STORE}.plots.length > 100")
    expect(badges.get_by_text("NO DATA")).to_have_count(0)
    names = "window.multiradar.picture.layers.layers[1].names.join()"
    settled(page, f"{names} !== '' && !{names}.includes('NO DATA')")
    page.get_by_role("button", name="north").click()
    sheet = page.get_by_role("region", name="Sensor north")
    expect(sheet).to_contain_text("none in the last 2 min")


def test_the_system_of_a_recorded_run_has_its_counts(page: Page, shown: str) -> None:
    opened(page, shown, "tab=system")
    system = page.locator("#system")
    measurements = page.get_by_role("region", name="Measurements")
    expect(measurements.locator("dt")).to_have_text(["Read", "Accepted", "Rejected", "Duplicate"])
    counts = [int(one) for one in measurements.locator("dd").all_inner_texts()]
    assert counts[0] == sum(counts[1:]) > 1000
    expect(system.get_by_text("imm", exact=True)).to_be_visible()
    # Nothing is live.
    expect(page.get_by_role("region", name="Connections")).to_have_count(0)
    expect(system).not_to_contain_text("–")


def test_an_address_after_the_end_has_each_plot_of_the_end_once(page: Page, shown: str) -> None:
    opened(page, shown)
    end_s: float = page.evaluate("window.multiradar.clock.span[1]")
    page.goto("about:blank")
    page.goto(f"{shown}/#at={end_s + 5.0:.1f}")
    # The first picture is of the time asked for, the next one of the end.
    settled(page, f"{STORE}.frames > 1 && {STORE}.dataTimeS < {end_s + 0.1}")
    plots = page.evaluate(
        f"[...{STORE}.plots].map((one) => `${{one.timeS}} ${{one.sensor}} ${{one.x}} ${{one.y}}`)"
    )
    assert len(set(plots)) == len(plots) > 50


def exported(page: Page, name: str) -> tuple[str, bytes]:
    page.get_by_text("Export (").click()
    with page.expect_download() as download:
        page.get_by_role("button", name=name).click()
    return download.value.suggested_filename, Path(download.value.path()).read_bytes()


def test_exports_are_of_what_is_shown(page: Page, shown: str) -> None:
    watch = opened(page, shown)
    page.evaluate(f"""{STORE}.tracks[0].callsign = '<a href="x">&]]>,"q"'""")
    tracks: list[Any] = page.evaluate(
        f"{STORE}.tracks.map((one) => [one.id, one.latitude, one.longitude, one.speedMps])"
    )
    name, content = exported(page, "CSV")
    assert name.startswith("multiradar-")
    assert name.endswith(".csv")
    rows = list(csv.DictReader(io.StringIO(content.decode(), newline="")))
    assert {"latitude_deg", "height_m", "speed_mps", "time_utc"} <= set(rows[0])
    assert [int(row["track_id"]) for row in rows] == [one[0] for one in tracks]
    assert rows[0]["callsign"] == '<a href="x">&]]>,"q"'
    for row, track in zip(rows, tracks, strict=True):
        assert abs(float(row["latitude_deg"]) - track[1]) < 1e-6
        # A track of one plot has no speed.
        assert row["speed_mps"] == "" or abs(float(row["speed_mps"]) - track[3]) < 0.01
        assert float(row["velocity_sigma_mps"]) > 0.0
    _, content = exported(page, "GeoJSON")
    found = json.loads(content)
    assert found["type"] == "FeatureCollection"
    for feature, track in zip(found["features"], tracks, strict=True):
        assert feature["geometry"]["type"] == "Point"
        assert abs(feature["geometry"]["coordinates"][0] - track[2]) < 1e-6
    # Radars do not say whether an aircraft is on the ground.
    assert {feature["properties"]["on_ground"] for feature in found["features"]} == {None}
    _, content = exported(page, "KML")
    assert content.decode().count("UTC, Recorded, imm</name>") == 1
    marks = ET.fromstring(content).iter(f"{KML}Placemark")
    names = [mark.findtext(f"{KML}name") for mark in marks]
    assert len(names) == len(tracks)
    assert names[0] == '<a href="x">&]]>,"q"'
    _, content = exported(page, "PNG of the map")
    assert content[:8] == b"\x89PNG\r\n\x1a\n"
    box = page.locator("#map").bounding_box()
    assert box is not None
    assert struct.unpack(">II", content[16:24]) == (round(box["width"]), round(box["height"] + 24))
    assert watch.messages == []


def test_the_selection_is_exported_with_its_path(page: Page, shown: str) -> None:
    opened(page, shown)
    chosen = page.evaluate(f"{STORE}.tracks[3].id")
    page.evaluate(f"window.multiradar.actions.select({chosen})")
    settled(page, "window.multiradar.selection.past.length > 20")
    _, content = exported(page, "GeoJSON")
    point, line = json.loads(content)["features"]
    assert point["id"] == chosen
    assert line["geometry"]["type"] == "LineString"
    ends = line["geometry"]["coordinates"][-1], point["geometry"]["coordinates"][:2]
    assert geodesic(*ends)[1] < 1000.0
    times = line["properties"]["times_s"]
    assert times == sorted(times)
    # The path ends at the time that is shown.
    assert times[-1] <= page.evaluate(f"{STORE}.dataTimeS")


@pytest.mark.parametrize(
    ("start", "end"),
    [
        ((6.0, 46.0), (7.5, 47.25)), ((60.5, 56.0), (60.5, 55.0)), ((10.0, 0.0), (11.0, 0.0)),
        ((179.5, 60.0), (-179.0, 61.0)), ((0.0, 89.0), (120.0, 88.0)),
        ((5.0, -30.0), (100.0, 70.0)),
    ],
)  # fmt: skip
def test_bearing_and_distance_are_those_of_the_ellipsoid(
    measuring: Page, start: tuple[float, float], end: tuple[float, float]
) -> None:
    for place in (start, end):
        measuring.evaluate(f"{MEASURE}.click({list(place)}, window.multiradar)")
    line = measuring.evaluate(f"{MEASURE}.line")
    azimuth, metres = geodesic(start, end)
    assert abs(line["metres"] - metres) < 0.001
    assert abs((line["bearingDeg"] - azimuth + 180.0) % 360.0 - 180.0) < 1e-6


@pytest.fixture(scope="module")
def measuring(browser: Browser, shown: str) -> Iterator[Page]:
    with window(browser, has_touch=True) as context:
        page = context.new_page()
        opened(page, shown)
        page.evaluate(f"{MEASURE}.toggle(window.multiradar)")
        yield page


def lonlat(page: Page, x: float, y: float) -> list[float]:
    """Return the place of a pixel of the map."""
    found: list[float] = page.evaluate(
        f"""(() => {{
          const [x, y] = window.multiradar.picture.map.getCoordinateFromPixel([{x}, {y}]);
          const radius = 6378137, degree = 180 / Math.PI;
          const latitude = 2 * Math.atan(Math.exp(y / radius)) - Math.PI / 2;
          return [x / radius * degree, latitude * degree];
        }})()"""
    )
    return found


def test_the_line_is_drawn_by_mouse_touch_and_keys(measuring: Page) -> None:
    page = measuring
    page.evaluate(f"{MEASURE}.stop(window.multiradar)")
    box = page.locator("#map").bounding_box()
    assert box is not None
    start, end = (200.0, 150.0), (520.0, 330.0)
    azimuth, metres = geodesic(lonlat(page, *start), lonlat(page, *end))
    for press in (page.mouse.click, page.touchscreen.tap):
        page.get_by_role("button", name="Measure").click()
        for x, y in (start, end):
            press(box["x"] + x, box["y"] + y)
        settled(page, f"{MEASURE}.line !== null && !{MEASURE}.following")
        line = page.evaluate(f"{MEASURE}.line")
        assert abs(line["metres"] / metres - 1.0) < 0.001
        assert abs(line["bearingDeg"] - azimuth % 360.0) < 0.1
        assert f"{round(azimuth % 360.0):03d}° true" in page.evaluate(f"{MEASURE}.text")
        # A click of the measuring selects nothing.
        assert page.evaluate("window.multiradar.view.selected") is None
        page.keyboard.press("Escape")
        assert page.evaluate(f"{MEASURE}.active") is False
    chosen = page.evaluate(f"{STORE}.tracks[0].id")
    page.evaluate(f"window.multiradar.actions.select({chosen})")
    page.locator("#map").focus()
    page.keyboard.press("x")
    before = page.evaluate(f"{MEASURE}.end")
    page.keyboard.press("ArrowRight")
    settled(page, f"{MEASURE}.end[0] > {before[0]} + 0.01")
    page.keyboard.press("Enter")
    settled(page, f"!{MEASURE}.following")
    # With the time at the speed of the selected track.
    assert " min " in page.evaluate(f"{MEASURE}.text")
    assert coloured(page, "#ffd24a") > 100
    page.keyboard.press("Escape")
    page.keyboard.press("Escape")
