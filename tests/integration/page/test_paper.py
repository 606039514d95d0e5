"""The map on paper, across the antimeridian, and where symbols are crowded."""

from typing import Any

from playwright.sync_api import Page, expect

from integration.page.conftest import Air
from integration.page.test_browser import PICTURE, STORE, opened, settled
from integration.page.test_panels import pictured

ACTIONS = "window.multiradar.actions"


def test_the_print_is_light_and_one_page(page: Page, air: Air) -> None:
    opened(page, air)
    page.evaluate(f"{ACTIONS}.show({STORE}.tracks[0].id)")
    expect(page.locator("#sheet mr-chart").first).to_be_visible()
    document = page.pdf(prefer_css_page_size=True)
    assert document.count(b"/Type /Page\n") == 1
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert page.evaluate("document.documentElement.dataset.theme") == "light"
    # One image, with the symbols of the aircraft.
    on_paper = page.evaluate(
        f"""() => {{
          const image = document.querySelector("#map > canvas.paper");
          const {{ scene }} = window.multiradar.picture;
          const ratio = image.width / scene.width;
          const {{ width, height }} = image;
          const {{ data }} = image.getContext("2d").getImageData(0, 0, width, height);
          const isDark = (x, y) => data[4 * (y * width + x)] < 120;
          const near = [-3, -2, -1, 0, 1, 2, 3];
          const coloured = ({{ x, y }}) => near.some((east) => near.some((south) =>
            isDark(Math.round(x * ratio) + east, Math.round(y * ratio) + south)));
          return {PICTURE}.seenOnCanvas.map(coloured);
        }}"""
    )
    # Some lie at the edge, or are faint.
    assert sum(on_paper) > max(5, 0.8 * len(on_paper))
    # A4 at 96 dots per inch, less the margins.
    page.set_viewport_size({"width": 703, "height": 1032})
    page.emulate_media(media="print")
    for part in ("#map", "#sheet .name", "#sheet section[aria-label='Contributing sensors'] table"):
        box = page.locator(part).first.bounding_box()
        assert box is not None
        assert box["y"] + box["height"] <= 1032.0
        assert box["x"] + box["width"] <= 703.0
    expect(page.get_by_role("tablist")).not_to_be_visible()
    paper = page.locator("#map > canvas.paper")
    expect(paper).to_be_visible()
    box = paper.bounding_box()
    assert box is not None
    assert box["x"] + box["width"] <= 703.0
    page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert page.evaluate("document.documentElement.dataset.theme") == "dark"
    expect(paper).to_have_count(0)


def test_traffic_across_the_antimeridian_is_on_one_map(page: Page, air: Air) -> None:
    opened(page, air)
    # East and west of it.
    inside = page.evaluate(
        f"""(() => {{
          const half = Math.PI * 6378137;
          const {{ tracks }} = {STORE};
          tracks.forEach((one, at) => {{
            [one.x, one.vx] = [at % 2 === 0 ? half - 1e5 : 1e5 - half, 0];
          }});
          {PICTURE}.sites = () => [];
          {PICTURE}.fit();
          {PICTURE}.map.renderSync();
          const zoom = {PICTURE}.map.getView().getZoom();
          return [tracks.every((one) => {PICTURE}.contains(one)), zoom > 6];
        }})()"""
    )
    assert inside == [True, True]
    # Only what is visible is asked for.
    west, east = (f"Number(window.multiradar.feed.area.split(',')[{at}])" for at in (0, 2))
    settled(page, f"{west} > 170 && {east} < -170")

    # Flown across it since the frame, at the time shown.
    def crossing(header: dict[str, Any], tracks: dict[str, Any]) -> None:
        tracks["longitude_deg"][:] = 180.5
        tracks["speed_mps"][:] = 0.0

    pictured(page, crossing)
    page.evaluate(f"window.multiradar.actions.select({STORE}.tracks[0].id)")
    page.keyboard.press("2")
    expect(page.locator("#sheet")).to_contain_text(", -179.5000")


def test_labels_are_not_those_of_other_symbols(page: Page, air: Air) -> None:
    opened(page, air)
    slots = page.evaluate(
        f"""(() => {{
          const places = new {PICTURE}.layers.labels.places.constructor();
          const one = (x, y, rank) => ({{
            x, y, rank, width: 60, height: 26, slot: -1, left: 0, top: 0, home: false,
            covers: false, coveredMs: 0,
          }});
          const crowd = [];
          for (let x = 100; x < 700; x += 12) for (let y = 100; y < 500; y += 12) {{
            crowd.push(one(x, y, 2));
          }}
          const ordinary = one(402, 302, 2);
          const [emergency, other] = [one(410, 310, 1), one(440, 300, 1)];
          const all = [ordinary, emergency, other, ...crowd];
          places.place(all, all.length, 600, 800, 600, 0);
          const covers = (label, symbol) => symbol.x > label.left && symbol.x < label.left + 60
            && symbol.y > label.top && symbol.y < label.top + 26;
          return [ordinary.slot, emergency.slot >= 0,
            covers(emergency, other), covers(other, emergency)];
        }})()"""
    )
    assert slots == [-1, True, False, False]
