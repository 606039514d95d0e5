"""The page asks for a key where clients need credentials, and keeps it for the tab."""

import json

from playwright.sync_api import Page, expect

from integration.page.test_browser import STORE, settled
from multiradar.api.factory import create_api
from multiradar.settings.limits import HttpLimits
from multiradar.storage.overlays import Overlay
from support.access import KEYS, guarded_api
from support.fakes.fake_service import FakeService
from support.processes.live_server import serving


def test_a_key_is_asked_for_and_kept_for_the_tab(page: Page) -> None:
    with serving(guarded_api(FakeService()), HttpLimits()) as port:
        address = f"http://127.0.0.1:{port}/"
        page.goto(address)
        dialog = page.locator("#access")
        expect(dialog).to_be_visible()
        for wrong in ("mr_unknown", "clé"):
            dialog.get_by_label("API key").fill(wrong)
            dialog.get_by_role("button").click()
            expect(dialog.get_by_role("alert")).to_have_text("This key is not valid.")
            expect(dialog).to_be_visible()
        dialog.get_by_label("API key").fill(f" {KEYS['display']} ")
        dialog.get_by_role("button").click()
        expect(dialog).to_be_hidden()
        settled(page, f"{STORE}.frames > 0")
        page.reload()
        settled(page, f"{STORE}.frames > 0")
        expect(dialog).to_be_hidden()
        assert page.context.cookies() == []
        assert page.evaluate("localStorage.length") == 0
        assert KEYS["display"] not in page.url
        # Another tab asks again.
        other = page.context.new_page()
        other.goto(address)
        expect(other.locator("#access")).to_be_visible()


def test_overlays_are_shown_once_the_key_is_entered(page: Page) -> None:
    sector = {"type": "Point", "coordinates": [8.0, 47.0]}
    feature = {"type": "Feature", "properties": {"name": "ALPHA"}, "geometry": sector}
    content = json.dumps({"type": "FeatureCollection", "features": [feature]}).encode()
    overlays = (Overlay("sectors", content, 1, ""),)
    with serving(guarded_api(FakeService(), overlays=overlays), HttpLimits()) as port:
        with page.expect_response("**/v1/overlays") as rejected:
            page.goto(f"http://127.0.0.1:{port}/")
        assert rejected.value.status == 401
        page.locator("#access").get_by_label("API key").fill(KEYS["display"])
        page.locator("#access").get_by_role("button").click()
        names = "window.multiradar.picture.layers.overlayNames.places.map((one) => one.name).join()"
        settled(page, f"{names} === 'ALPHA'")


def test_without_credentials_no_key_is_asked_for(page: Page) -> None:
    with serving(create_api(FakeService()), HttpLimits()) as port:
        page.goto(f"http://127.0.0.1:{port}/")
        settled(page, f"{STORE}.frames > 0")
        expect(page.locator("#access")).to_be_hidden()
