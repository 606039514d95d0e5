"""Jammed radars and direction finders on the page: what delivers only bearings must be seen."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl
import pytest
from playwright.sync_api import Page, Route, expect

from integration.page.conftest import Air, received
from integration.page.test_browser import PICTURE, STORE, settled
from integration.page.test_panels import sensors_with
from multiradar.cli.main import EXIT_DONE, run
from multiradar.cli.playback.view import run_files
from multiradar.runtime.picture.past import PastAsked
from multiradar.runtime.recorded.run import RecordedRun
from multiradar.runtime.recorded.view import RecordedView
from support.inputs.picture_frames import decoded

LINES = f"{PICTURE}.layers.bearings.lines"
NAMES = f"{PICTURE}.layers.layers[1].names"
FINDERS = ("df-north", "df-south")
RADARS = ("east", "west")
#: Distance of the end of each line of a sensor from the nearest symbol of a track, pixels.
MISSES = f"""(id) => {LINES}[id].map(([, , x, y]) => Math.min(
  ...{PICTURE}.seenOnCanvas.map((one) => Math.hypot(one.x - x, one.y - y))))"""


@pytest.fixture(scope="module")
def jammed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Air]:
    """A service 100 s after the radars lost their ranges."""
    air = Air(tmp_path_factory.mktemp("jammed"), 400.0, "jamming")
    air.send(air.measurements)
    yield air
    air.application.stop()


def opened(page: Page, url: str) -> None:
    """Open the page, and wait for the bearings of all sensors."""
    page.goto(url)
    settled(page, f"{PICTURE}.centred && {STORE}.tracks.length === 15")
    settled(page, f"{[*FINDERS, *RADARS]}.every((id) => {LINES}[id]?.length > 10)")


def test_bearings_are_lines_to_their_tracks_with_the_switches_of_plots(
    page: Page, jammed: Air
) -> None:
    opened(page, jammed.url)
    header = page.locator("header .minor")
    expect(header).to_have_text(re.compile(r"^0 plots, \d{3} bearings in 30 s$"))
    # A pixel is 400 m, in which 30 s are 7 km: the nearest tracks decide.
    for sensor in RADARS:
        assert np.median(page.evaluate(MISSES, sensor)) < 25.0
    expect(page.locator("#switches .sensors")).to_contain_text(re.compile(r"east\s*\d+ bearings"))
    page.evaluate("window.multiradar.view.hiddenSensors.add('east')")
    page.evaluate("window.multiradar.actions.changed()")
    settled(page, f"!('east' in {LINES}) && {LINES}['west'].length > 10")
    page.evaluate("window.multiradar.view.hiddenSensors.clear()")
    page.keyboard.press("p")
    settled(page, f"Object.keys({LINES}).length === 0")


def test_after_a_gap_each_bearing_is_there_once(page: Page, jammed: Air) -> None:
    opened(page, jammed.url)
    trails = f"{STORE}.tracks.map((one) => one.trail.length).join()"
    before = page.evaluate(trails)
    # As if nothing had come for a minute: the page asks for all of it.
    page.evaluate(
        f"""(() => {{
          for (const one of {STORE}.tracks) one.trail.clear();
          {STORE}.dataTimeS -= 60;
        }})()"""
    )
    settled(page, f"{trails} === '{before}'")
    bearings = page.evaluate(
        f"[...{STORE}.bearings].map((one) => `${{one.timeS}} ${{one.sensor}} ${{one.x}}`)"
    )
    assert len(bearings) > 100
    assert len(set(bearings)) == len(bearings)


def test_the_bias_switch_turns_bearings(page: Page, jammed: Air) -> None:
    opened(page, jammed.url)
    # The map fits all once, and is then drawn where it stays.
    settled(
        page, f"{PICTURE}.centred && {PICTURE}.corrected === 1 && {LINES}['df-north']?.length > 10"
    )
    page.evaluate(f"{PICTURE}.map.renderSync()")
    corrected = page.evaluate(f"{LINES}['df-north']")
    page.keyboard.press("b")
    settled(page, f"{PICTURE}.corrected === 0")
    measured = page.evaluate(f"{LINES}['df-north']")
    assert len(measured) == len(corrected)
    for (x, y, right, up), (left, top, east, north) in zip(measured, corrected, strict=True):
        assert (x, y) == (left, top)
        turned_deg = np.degrees(np.arctan2(right - x, y - up) - np.arctan2(east - x, y - north))
        # The true bias is 0.6°.
        assert (turned_deg + 180.0) % 360.0 - 180.0 == pytest.approx(0.6, abs=0.3)


def test_direction_finders_have_sites_and_moving_ones_where_they_were(
    page: Page, jammed: Air
) -> None:
    def moving(sensors: list[dict[str, Any]]) -> None:
        next(one for one in sensors if one["id"] == "df-south")["latitude_deg"] = None

    sensors_with(page, moving)
    # However long ago the traffic was sent: names have no mark.
    received(page, 1.0)
    opened(page, jammed.url)
    settled(page, f"{NAMES}.length === 4")
    names = page.evaluate(f"{NAMES}")
    assert {*FINDERS} <= {*names}
    sites = f"{PICTURE}.layers.sites.all({PICTURE}.scene)"
    place = page.evaluate(
        f"""(() => {{
          const {{ x, y }} = {sites}.find((one) => one.sensor.id === "df-south");
          return [{PICTURE}.scene.px(x), {PICTURE}.scene.py(y)];
        }})()"""
    )
    assert page.evaluate(f"{LINES}['df-south'][0]")[:2] == pytest.approx(place, abs=1.0)


def warned(route: Route) -> None:
    """Let data arrive, and the service have a warning."""
    route.fulfill(json=route.fetch().json() | {"warnings": ["one"], "received_age_s": 1.0})


def test_a_radar_that_delivers_bearings_only_is_marked(page: Page, jammed: Air) -> None:
    page.route("**/v1/status", warned)
    opened(page, jammed.url)
    page.keyboard.press("3")
    states = page.locator("#sensors table.sensors tbody tr")
    for row, sensor in enumerate(RADARS):
        # No probability of detection: that of earlier scans says nothing of the present.
        expect(states.nth(row)).to_contain_text(re.compile(rf"{sensor}\s*BEARINGS ONLY\s*–"))
    expect(page.locator("#sensors .summary")).to_contain_text("east: It delivers bearings only")
    sheet = page.get_by_role("region", name="Sensor east")
    expect(sheet).to_contain_text(re.compile(r"no plots at present; previously: \d+\.\d % of"))
    assert {f"{one} BEARINGS ONLY" for one in RADARS} <= {*page.evaluate(f"{NAMES}")}
    expect(page.locator("#tab-sensors .badge")).to_have_text("2 BEARINGS")
    expect(page.locator("#tab-system .badge")).to_have_text("1 warning")
    hidden: float = page.locator("#tabs").evaluate("(one) => one.scrollWidth - one.clientWidth")
    assert hidden <= 0.0
    # With doubtful biases, too, all columns are in sight, and names stand beside their symbols.
    beyond, high = page.evaluate(
        """(() => {
          const { actions, feed } = window.multiradar;
          for (const one of feed.sensors) {
            if (one.id === "df-north") {
              one.diagnoses = [{ code: "site", sentence: "wrong" }];
            }
            if (one.id === "df-south") one.health = {
              range_sigma_ratio: 1.3, azimuth_sigma_ratio: 1.3, detection_probability: 1 };
            for (const bias of one.biases) bias.prior_ratio = 0.1;
            for (const bias of one.biases) {
              bias.estimate = bias.parameter === "range_offset_m" ? -888 : -0.888;
            }
          }
          actions.changed();
          const panel = document.getElementById("panel-sensors");
          const names = document.querySelectorAll("#sensors tbody th button");
          return [panel.scrollWidth - panel.clientWidth, [...names].map((one) => one.offsetHeight)];
        })()"""
    )
    assert beyond <= 0.0
    assert max(high) < 24.0
    page.get_by_role("button", name="df-north").click()
    expect(page.get_by_role("region", name="Sensor df-north")).to_contain_text("direction finder")
    # Before the jamming, the same radars have plots.
    page.evaluate("window.multiradar.clock.pause(); window.multiradar.clock.seek("
                  "window.multiradar.clock.span[0] + 200)")  # fmt: skip
    expect(page.locator("#sensors table.sensors")).not_to_contain_text("BEARINGS")
    expect(page.locator("header .minor")).to_have_text(re.compile(r"^\d{2,} plots, \d+ bearings"))


def test_a_recorded_run_has_the_bearings_of_the_service(tmp_path: Path, jammed: Air) -> None:
    jammed.measurements.write_parquet(tmp_path / "measurements.parquet")
    (tmp_path / "sensors.toml").write_text(jammed.sensors)
    out = tmp_path / "out"
    given = ["track", str(tmp_path / "measurements.parquet"), "--out", str(out)]
    assert run([*given, "--sensors", str(tmp_path / "sensors.toml")]) == EXIT_DONE
    files = run_files(out, tmp_path / "measurements.parquet", [out])
    viewed = RecordedView([RecordedRun(files, tmp_path)])
    at_s = float(jammed.measurements["time_s"].max())  # type: ignore[arg-type]
    header, live = decoded(jammed.application.service.view.past_picture(PastAsked(at_s)))
    _, recorded = decoded(viewed.past_picture(PastAsked(at_s)))
    by_row = ["time_s", "sensor", "track_id"]
    both = pl.DataFrame(recorded["bearings"]).join(
        pl.DataFrame(live["bearings"]), on=by_row, suffix="_live"
    )
    # Bearings of a finder have one time: they are assigned by direction, with its bias.
    assert len(both) > 0.9 * len(live["bearings"]["time_s"]) > 100
    radars = [header["sensors"].index(one) for one in RADARS]
    exact = both.filter(pl.col("sensor").is_in(radars))
    assert len(exact) == np.isin(live["bearings"]["sensor"], radars).sum() > 50
    for name in live["bearings"].keys() - {*by_row}:
        assert exact[name].to_list() == pytest.approx(exact[f"{name}_live"].to_list(), abs=1e-4)
