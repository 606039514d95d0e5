"""Time on the page: back through the history of a service, and a service that restarts."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from playwright.sync_api import Page, Route, expect

from integration.page.conftest import Air, received
from integration.page.test_browser import STORE, opened, settled
from multiradar.report.times import clock_text
from support.processes import clients

CLOCK = "window.multiradar.clock"
#: Longer than the five minutes of the question below.
DURATION_S = 400.0


@pytest.fixture(scope="module")
def long(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Air]:
    air = Air(tmp_path_factory.mktemp("long"), DURATION_S)
    air.send(air.measurements)
    yield air
    air.application.stop()


def time_of(page: Page) -> float:
    found: float = page.evaluate(f"{STORE}.dataTimeS")
    return found


def places(page: Page) -> dict[str, list[float]]:
    """Return the places of the tracks by number."""
    found: dict[str, list[float]] = page.evaluate(
        f"Object.fromEntries({STORE}.tracks.map((one) => [one.id, [one.timeS, one.longitude]]))"
    )
    return found


def test_the_history_has_the_picture_of_then_and_goes_back_to_the_present(
    page: Page, long: Air
) -> None:
    received(page, 1.0)
    watch = opened(page, long)
    mode = page.locator("#time .mode")
    expect(mode).to_have_text("Live")
    present, before = time_of(page), places(page)
    page.get_by_role("button", name="Pause").click()
    expect(mode).to_have_text("History paused")
    assert page.evaluate("document.body.dataset.time") == "history"
    page.get_by_role("button", name="−1 min").click()
    settled(page, f"Math.abs({STORE}.dataTimeS - {present - 60.0}) < 0.1")
    then = places(page)
    assert all(one[0] <= present - 60.0 + 0.01 for one in then.values())
    # The same picture: earlier positions and plots of the last half minute.
    settled(page, f"{STORE}.tracks.some((one) => one.trail.length > 10)")
    ages = page.evaluate(f"[...{STORE}.plots].map((one) => {STORE}.dataTimeS - one.timeS)")
    assert len(ages) > 100
    # Rates are those of the service, whose data stand.
    page.keyboard.press("4")
    rates = page.locator("#system section[aria-label=Rates]")
    expect(rates).to_contain_text("s per s")
    assert "0.0 s per s" in rates.inner_text()
    page.keyboard.press("1")
    assert 0.0 <= min(ages) < max(ages) <= 30.0
    for clock in (page.locator("#time time"), page.locator("#bar time")):
        expect(clock).to_contain_text(clock_text(present - 60.0))
    settled(page, f"location.hash.includes('at={present - 60.0:.1f}')")
    page.get_by_role("button", name="Go live").click()
    settled(page, f"{STORE}.dataTimeS === {present}")
    assert places(page) == before
    expect(mode).to_have_text("Live")
    settled(page, "!/[#&]at=/.test(location.hash)")
    assert watch.messages == []
    assert all(address.startswith((long.url, "data:")) for address in watch.addresses)


def test_the_history_has_uncertainty_forecasts_encounters_and_sheets_of_then(
    page: Page, long: Air
) -> None:
    opened(page, long)
    then_s = time_of(page) - 60.0
    page.evaluate(f"{CLOCK}.seek({then_s})")
    settled(page, f"Math.abs({STORE}.dataTimeS - {then_s}) < 0.1")
    known = f"{STORE}.tracks.filter((one) => one.majorM >= one.minorM && one.minorM > 0)"
    assert page.evaluate(f"{known}.length") == page.evaluate(f"{STORE}.tracks.length")
    settled(page, "window.multiradar.encounters.found.length > 0")
    times = page.evaluate("window.multiradar.encounters.found.map((one) => one.time_s)")
    assert all(abs(one - then_s) < 10.0 for one in times)
    settled(page, "window.multiradar.picture.layers.encounters.texts.length > 0")
    track = page.evaluate(f"{STORE}.tracks.find((one) => one.state === 'confirmed').id")
    page.evaluate(f"window.multiradar.actions.show({track})")
    settled(page, "window.multiradar.selection.forecast.length > 3")
    points = page.evaluate("window.multiradar.selection.forecast.map((one) => one.timeS)")
    assert abs(points[0] - then_s) < 5.0
    why = page.get_by_role("region", name="Contributing sensors")
    expect(why.get_by_text("in the last minute")).to_be_visible()
    why.get_by_text("Individual plots").click()
    newest = why.locator("details tbody td").first.inner_text()
    assert newest <= clock_text(then_s)
    page.keyboard.press("3")
    expect(page.locator("#sensors")).to_contain_text(f"{clock_text(then_s)}\xa0")
    page.get_by_role("button", name="north").click()
    expect(page.get_by_role("region", name="Sensor north")).to_contain_text("(now)")
    sensors = page.evaluate("window.multiradar.feed.sensors")
    assert all(one["biases"][0]["time_s"] <= then_s for one in sensors if one["biases"])
    assert all(one["health"]["time_s"] <= then_s for one in sensors if one["health"])
    page.keyboard.press("4")
    expect(page.locator("#system")).to_contain_text("Current state of the service")
    expect(page.get_by_role("region", name="Connections")).to_contain_text("127.0.0.1")


def test_a_copied_address_shows_the_same_time(page: Page, long: Air) -> None:
    at_s = long.measurements["time_s"].min() + 100.5  # type: ignore[operator]  # a number
    opened(page, long, f"/#at={at_s}")
    assert abs(time_of(page) - at_s) < 0.1
    expect(page.locator("#time .mode")).to_have_text("History paused")
    assert page.evaluate(f"{CLOCK}.playing") is False


def test_it_plays_at_any_speed_from_the_keyboard_until_it_is_live(page: Page, long: Air) -> None:
    first_s = long.measurements["time_s"].min()
    assert isinstance(first_s, float)
    received(page, 1.0)
    opened(page, long, f"/#at={first_s + 100.0}")
    page.keyboard.press("ArrowLeft")
    settled(page, f"Math.abs({STORE}.dataTimeS - {first_s + 90.0}) < 0.1")
    slider = page.get_by_label("Time", exact=True).and_(page.locator("input"))
    slider.focus()
    page.keyboard.press("ArrowRight")
    settled(page, f"{STORE}.dataTimeS > {first_s + 90.1}")
    page.keyboard.press("+")
    assert page.evaluate(f"{CLOCK}.speed") == 2
    page.keyboard.press(" ")
    expect(page.locator("#time .mode")).to_have_text("History ▶ ×2")
    # The picture runs on between the frames, at the speed of the clock.
    assert page.evaluate(f"{STORE}.pace") == 2
    settled(page, f"{STORE}.dataTimeS > {first_s + 92.0}")
    for _ in range(3):
        page.keyboard.press("+")
    assert page.evaluate(f"{CLOCK}.speed") == 20
    # Both clocks are that of the picture, between frames, too.
    for _ in range(3):
        shown_s = time_of(page)
        settled(page, f"{STORE}.dataTimeS > {shown_s}")
        settled(
            page,
            """new Set([...document.querySelectorAll("#bar time, #time time")]
              .map((one) => one.textContent.replace(" UTC", ""))).size === 1""",
        )
    for _ in range(4):
        page.keyboard.press("+")
    assert page.evaluate(f"{CLOCK}.speed") == 300
    # It catches up with the present.
    expect(page.locator("#time .mode")).to_have_text("Live")


def young_track(air: Air, first_s: float) -> tuple[int, float]:
    """Return a track and its first update, of a time that would be rounded down."""
    with clients.client(air.url) as client:
        for track in client.get("/v1/tracks").json()["tracks"]:
            history = client.get(f"/v1/tracks/{track['track_id']}/history", params={"limit": 1})
            born_s = float(history.json()["updates"][0]["time_s"])
            if born_s > first_s + 0.1 and float(f"{born_s:.3f}") < born_s:
                return track["track_id"], born_s
    pytest.fail("no track begins later than the first one")


def test_one_click_shows_where_the_aircraft_was_five_minutes_ago(page: Page, long: Air) -> None:
    watch = opened(page, long)
    present = time_of(page)
    button = page.get_by_role("button", name="Go back 5 min")
    expect(button).to_be_disabled()
    # One that was there already then.
    old = page.evaluate(f"Math.min(...{STORE}.tracks.map((one) => one.id))")
    page.evaluate(f"window.multiradar.actions.select({old})")
    button.click()
    settled(page, f"Math.abs({STORE}.dataTimeS - {present - 300.0}) < 0.1")
    track: dict[str, Any] = page.evaluate(
        f"(() => {{ const [x, y] = {STORE}.placeOf({STORE}.track({old}), {STORE}.dataTimeS);"
        " return { x, y }; })()"
    )
    # Web Mercator, back to degrees.
    longitude = math.degrees(track["x"] / 6378137.0)
    latitude = math.degrees(2.0 * math.atan(math.exp(track["y"] / 6378137.0)) - math.pi / 2.0)
    said = page.locator("#time p[role=status]")
    expect(said).to_contain_text(f"{latitude:.4f}, {longitude:.4f}. The picture is paused there")
    centre = "window.multiradar.picture.map.getView().getCenter()"
    settled(page, f"Math.hypot({centre}[0] - {track['x']}, {centre}[1] - {track['y']}) < 500")
    # A younger one is shown where it was first.
    page.get_by_role("button", name="Go live").click()
    settled(page, f"{STORE}.dataTimeS === {present}")
    first_s = page.evaluate(f"{CLOCK}.span[0]")
    young, born_s = young_track(long, first_s)
    # Also when it was selected only just now: its past is still to be read.
    page.evaluate(f"window.multiradar.actions.select({old})")
    page.evaluate("window.multiradar.selection.settled()")
    page.evaluate(
        f"""(() => {{
          window.multiradar.actions.select({young});
          void window.multiradar.ago.show(window.multiradar, {present - first_s - 0.1});
        }})()"""
    )
    expect(page.locator("#time p[role=status]")).to_contain_text("was first tracked at")
    assert abs(time_of(page) - born_s) < 0.1
    # Before that it was not there, and the service is not asked for its plots: it would answer 404.
    expect(page.locator("#sheet")).to_contain_text("in the last minute")
    page.evaluate(f"{CLOCK}.seek({first_s})")
    expect(page.locator("#sheet")).to_contain_text("did not exist at")
    # What was said of another time is gone.
    expect(said).to_have_count(0)
    page.evaluate(f"window.multiradar.actions.select({old})")
    page.evaluate(f"{CLOCK}.seek({present - 300.0})")
    settled(page, f"Math.abs({STORE}.dataTimeS - {present - 300.0}) < 0.1")
    # Five minutes before that nothing is retained: the start is shown.
    button.click()
    expect(page.locator("#time p[role=status]")).to_contain_text(
        "before the earliest retained time"
    )
    assert time_of(page) < present - 300.0
    assert watch.messages == []


def test_a_service_that_restarts_is_announced_and_the_picture_goes_on_without_doubles(
    page: Page, tmp_path: Any
) -> None:
    air = Air(tmp_path, 60.0)
    try:
        half_s = float(air.measurements["time_s"].median())  # type: ignore[arg-type]  # a number
        air.send(air.measurements.filter(air.measurements["time_s"] <= half_s))
        page.goto(air.url)
        settled(page, f"{STORE}.tracks.length > 10 && {STORE}.plots.length > 50")
        air.application.stop()
        alert = page.get_by_role("alert")
        expect(alert).to_contain_text("Air picture not updated since")
        air.start()
        time_s = air.measurements["time_s"]
        air.send(air.measurements.filter((time_s > half_s) & (time_s < half_s + 12.0)))
        expect(alert).to_have_count(0)
        settled(page, f"{STORE}.dataTimeS > {half_s + 8.0}")
        plots = page.evaluate(
            f"[...{STORE}.plots].map((one) =>"
            " `${one.timeS} ${one.sensor} ${one.track} ${one.x}`)"
        )
        assert len(plots) > 100
        assert len(set(plots)) == len(plots)
        # Those of before the restart are still there.
        assert min(float(one.split()[0]) for one in plots) < half_s
        assert page.evaluate(f"{STORE}.malformed") == 0
    finally:
        air.application.stop()


def test_a_fault_stays_in_the_history_from_when_it_was_found(page: Page, tmp_path: Path) -> None:
    air = Air(tmp_path)
    try:
        of_west = pl.when(pl.col("sensor_id") == "west")
        in_km = of_west.then(pl.col("range_m") / 1e3).otherwise(pl.col("range_m"))
        air.send(air.measurements.with_columns(range_m=in_km))
        received(page, 1.0)
        page.goto(air.url)
        badge = page.locator("#tab-sensors .badge")
        expect(badge).to_have_text("1 FAULT")
        page.keyboard.press("3")
        page.evaluate(f"{CLOCK}.pause()")
        expect(page.locator("#sensors")).to_contain_text("Biases and health at the time shown.")
        expect(badge).to_have_text("1 FAULT")
        page.evaluate(f"{CLOCK}.seek({CLOCK}.span[0] + 60)")
        expect(badge).not_to_have_text("1 FAULT")
    finally:
        air.application.stop()


def test_a_track_has_not_ended_while_the_present_is_being_read(page: Page, long: Air) -> None:
    opened(page, long)
    young = page.evaluate(f"Math.max(...{STORE}.tracks.map((one) => one.id))")
    page.evaluate(f"window.multiradar.actions.select({young})")
    page.evaluate(f"{CLOCK}.seek({CLOCK}.span[0])")
    sheet = page.locator("#sheet")
    expect(sheet).to_contain_text("did not exist at")
    held = [True]

    def later(route: Route) -> None:
        if held[0]:
            route.fulfill(status=503, json={"detail": "busy"})
        else:
            route.continue_()

    page.route("**/v1/picture?*", later)
    page.keyboard.press("n")
    expect(sheet).to_contain_text("Loading the air picture")
    held[0] = False
    expect(sheet.locator(".name")).to_be_visible()
