"""What has no data must not look alive: coasting tracks, data that ended, a silent service."""

import math
import re
from typing import Any

import polars as pl
import pytest
from playwright.sync_api import Page, Route, expect

from integration.page.conftest import Air, received
from integration.page.test_browser import PICTURE, STORE, opened, settled
from integration.page.test_panels import pictured
from multiradar.report.times import clock_text
from multiradar.tracking.settings import TrackingSettings
from support.processes import clients

#: Without plots for so long, an aircraft is coasting and not yet dropped.
SILENT_S = 45.0


def test_a_coasting_track_flies_on_and_its_uncertainty_grows(page: Page, tmp_path: Any) -> None:
    air = Air(tmp_path, 120.0)
    try:
        plots = air.measurements
        lost = plots["mode_s_address"].drop_nulls().mode()[0]
        end_s = plots["time_s"].max()
        assert isinstance(end_s, float)
        heard = (pl.col("mode_s_address") != lost) | (pl.col("time_s") < end_s - SILENT_S)
        air.send(plots.filter(heard))
        opened(page, air)
        found = f"{STORE}.tracks.find((one) => one.address === '{lost}')"
        settled(page, f"{found}?.state === 'coasting'")
        track: dict[str, Any] = page.evaluate(
            f"""(() => {{
              const one = {found};
              const {{ timeS, a, e, d, f }} = {PICTURE}.scene;
              const seen = {PICTURE}.seenOnCanvas.find((each) => each.id === one.id);
              const ahead = timeS - one.timeS;
              return {{ ...one, seen: [seen.x, seen.y], ahead,
                there: [a * (one.x + ahead * one.vx) + e, d * (one.y + ahead * one.vy) + f] }};
            }})()"""
        )
        # Its symbol stands where it flies at the time shown.
        assert track["ahead"] > 0.9 * SILENT_S
        assert track["seen"] == pytest.approx(track["there"], abs=1.0)
        # Sigmas of position and velocity add up, and its acceleration is unknown.
        moved_m = track["velocitySigmaMps"] / math.sqrt(2.0) * track["ageS"]
        noise_m2 = TrackingSettings().acceleration_density * track["ageS"] ** 3 / 3.0
        least_m = math.sqrt(track["sigmaM"] ** 2 + 2.0 * moved_m**2 + 2.0 * noise_m2)
        assert least_m < track["sigmaNowM"] < 1.5 * least_m
        assert track["sigmaNowM"] > 10.0 * track["sigmaM"]
        axes_m = math.hypot(track["majorM"], track["minorM"])
        assert axes_m == pytest.approx(track["sigmaNowM"], rel=1e-3)
        # The same in the table, beside it and in the sheet.
        page.get_by_role("button", name="Sigma").click()
        first = page.locator("#tracks tbody tr[data-id]").first
        expect(first).to_have_attribute("data-id", str(track["id"]))
        expect(first).to_contain_text(f"{round(track['sigmaNowM'])} m")
        # Its age is that of the sigma, which does not grow without data.
        received(page, 600.0)
        expect(page.locator("#time .mode")).to_have_text("No data")
        worst = page.get_by_role("button", name="Least certain")
        expect(worst).to_contain_text(f" m, {track['ageS']:.0f} s after its last plot")
        worst.click()
        sheet = page.locator("#sheet")
        age = f"{track['ageS']:.0f} s after the last plot"
        expect(sheet).to_contain_text(f"at {clock_text(end_s)}, {age}")
        expect(sheet).to_contain_text(f"{round(track['sigmaM'])} m at the last plot")
    finally:
        air.application.stop()


def test_data_that_ended_are_not_live_and_their_ages_go_on(page: Page, air: Air) -> None:
    """Of a replay: no alarm, but nothing comes any more."""
    age_s = received(page, 1.0)
    opened(page, air)
    mode = page.locator("#time .mode")
    expect(mode).to_have_text("Live")
    expect(page.locator(".picture.ended")).to_have_count(0)
    oldest = f"Math.max(...{STORE}.tracks.map((one) => one.ageS))"
    assert page.evaluate(oldest) < 100.0
    age_s[0] = 600.0
    expect(mode).to_have_text("No data")
    expect(page.locator("#time .since")).to_have_text("for 10 min")
    expect(page.locator(".picture.ended")).to_have_count(1)
    ages = page.locator("#tracks tbody tr[data-id] td:last-child")
    expect(ages.first).to_have_text("10 min")
    page.keyboard.press("3")
    badges = page.locator("#sensors tbody .badge")
    expect(badges).to_have_text(["NO DATA"] * 3)
    expect(page.locator("#tab-sensors .badge")).to_have_text("3 NO DATA")
    expect(page.locator("#sensors .summary")).to_contain_text("No data for 10 min.")
    expect(page.locator("#sensors .facts")).to_contain_text("last 10 min ago")
    # The map says the same; what was measured before says nothing of the present.
    settled(
        page,
        f"{PICTURE}.layers.layers[1].names.filter((one) => / NO DATA$/.test(one)).length === 3",
    )
    expect(page.locator("#sensors tbody tr").first.locator("td").nth(1)).to_have_text("–")
    age_s[0] = 1.0
    expect(badges.get_by_text("NO DATA")).to_have_count(0)
    expect(mode).to_have_text("Live")
    expect(page.locator(".picture.ended")).to_have_count(0)


def test_a_service_that_does_not_keep_up_is_not_live(page: Page, air: Air) -> None:
    waiting_s = [37.0]

    def lagging(route: Route) -> None:
        document = route.fetch().json() | {"received_age_s": 0.5, "backlog_rows": 1000}
        if waiting_s:
            document |= {"unready": [{"code": "LAG", "text": ""}], "lags_s": {"processor": 2000.0}}
        route.fulfill(json=document)

    page.route("**/v1/status", lagging)
    opened(page, air)
    mode = page.locator("#time .mode")
    expect(mode).to_have_text("Delayed")
    expect(page.locator("#time .since")).to_have_text("by 33 min")
    expect(page.locator(".picture.ended")).to_have_count(1)
    expect(page.locator("#tracks tbody tr[data-id] td:last-child").first).to_have_text("33 min")
    # The sensors deliver.
    page.keyboard.press("3")
    expect(page.locator("#sensors tbody .badge")).to_have_count(3)
    expect(page.locator("#sensors tbody .badge").get_by_text("NO DATA")).to_have_count(0)
    waiting_s.clear()
    expect(mode).to_have_text("Live")


def test_ages_do_not_fall_when_the_service_restarts(page: Page, air: Air) -> None:
    age_s: list[float | None] = [900.0]

    def answer(route: Route) -> None:
        route.fulfill(json=route.fetch().json() | {"received_age_s": age_s[0], "silence_s": None})

    page.route("**/v1/status", answer)
    opened(page, air)
    ages = page.locator("#tracks tbody tr[data-id] td:last-child")
    expect(ages.first).to_have_text("15 min")
    age_s[0] = None
    seen = page.evaluate("window.multiradar.feed.revision")
    settled(page, f"window.multiradar.feed.revision > {seen} + 1")
    expect(ages.first).to_have_text("15 min")
    expect(page.locator("#time .since")).to_have_text("for 15 min")


def test_a_service_that_restarted_without_new_data_is_not_live(page: Page, tmp_path: Any) -> None:
    air = Air(tmp_path, 30.0)
    try:
        air.send(air.measurements)
        air.application.stop()
        air.start()
        opened(page, air)
        expect(page.locator("#time .mode")).to_have_text("No data")
        expect(page.locator("#time .since")).to_have_text("since the service started")
        expect(page.locator("#tracks tbody tr[data-id] td:last-child").first).to_contain_text("≥")
    finally:
        air.application.stop()


def test_a_service_that_starts_has_no_picture_but_answers(page: Page, air: Air) -> None:
    opened(page, air)
    page.route("**/v1/picture*", lambda route: route.fulfill(status=503, json={"detail": "starts"}))
    page.route(
        "**/v1/status",
        lambda route: route.fulfill(json=route.fetch().json() | {"state": "recovering"}),
    )
    mode = page.locator("#time .mode")
    expect(mode).to_have_text("Not running")
    settled(page, "window.multiradar.feed.isLost(performance.now())")
    seen = page.evaluate("window.multiradar.feed.revision")
    settled(page, f"window.multiradar.feed.revision > {seen} + 1")
    expect(mode).to_have_text("Not running")


def test_a_service_out_of_reach_is_not_live_and_ages_go_on(page: Page, air: Air) -> None:
    opened(page, air)
    page.route("**/v1/**", lambda route: route.abort())
    expect(page.locator("#time .mode")).to_have_text("No contact")
    # At once it looks so, and nothing moves.
    expect(page.locator(".picture")).to_have_class(re.compile("lost"))
    assert page.evaluate(f"{STORE}.timeAt(performance.now()) === {STORE}.dataTimeS")
    age = page.locator("#tracks tbody tr[data-id] td:last-child").first
    before = age.inner_text()
    expect(age).not_to_have_text(before)
    page.unroute("**/v1/**")
    expect(page.locator("#time .mode")).to_have_text("No data")


def test_the_last_picture_stays_when_another_time_cannot_be_read(page: Page, air: Air) -> None:
    opened(page, air)
    time_s, count = page.evaluate(f"[{STORE}.dataTimeS, {STORE}.tracks.length]")
    page.evaluate(f"window.multiradar.actions.select({STORE}.tracks[0].id)")
    page.route("**/v1/**", lambda route: route.abort())
    mode = page.locator("#time .mode")
    expect(mode).to_have_text("No contact")
    said = page.locator("#time p[role=status]")
    for key, word in (("a", "History paused"), ("n", "No contact")):
        page.keyboard.press(key)
        expect(mode).to_have_text(word)
        expect(said).to_contain_text(
            f"Still showing {clock_text(time_s)}: the selected time cannot be loaded"
        )
        assert page.evaluate(f"[{STORE}.dataTimeS, {STORE}.tracks.length]") == [time_s, count]
    page.unroute("**/v1/**")
    expect(said).to_have_count(0)
    expect(page.get_by_role("alert")).to_have_count(0)


def test_rejected_measurements_are_named(page: Page, tmp_path: Any) -> None:
    air = Air(tmp_path, 30.0)
    try:
        plots = air.measurements.with_columns(callsign=pl.lit("<b>"))
        with clients.client(air.url) as client:
            answer = client.post(
                "/v1/measurements",
                content=plots.write_ndjson().encode(),
                headers={"content-type": "application/x-ndjson"},
            )
        assert answer.json()["accepted"] == 0
        page.goto(f"{air.url}/#tab=sensors")
        expect(page.locator("#sensors tbody .badge")).to_have_text(["NO DATA"] * 3)
        expect(page.locator("#sensors")).to_contain_text(f"rejected {len(plots)} measurements")
    finally:
        air.application.stop()


def test_a_picture_that_is_being_read_or_computed_is_not_empty(page: Page, air: Air) -> None:
    waiting = [5000]

    def loaded(route: Route) -> None:
        route.fulfill(json={**route.fetch().json(), "backlog_rows": waiting[0]})

    def none(header: dict[str, Any], tracks: dict[str, Any]) -> None:
        header["total"] = 0
        for name, values in tracks.items():
            tracks[name] = values[:0]

    page.route("**/v1/status", loaded)
    pictured(page, none)
    page.goto(air.url)
    said = page.locator("#tracks .hint")
    expect(said).to_have_text("The service is still processing the measurements received so far.")
    expect(page.locator("#time .mode")).to_have_text("Live")
    waiting[0] = 0
    expect(said).to_have_text("No tracks at this time.")
