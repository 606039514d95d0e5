"""Makes the pictures of the page: the sample recording with and without biases, and its past.

::

    python -m validation.documents.make_screenshots   # needs Chromium or Chrome

"""

import shutil
import tempfile
from pathlib import Path

import httpx
import polars as pl
from playwright.sync_api import Page, sync_playwright

import multiradar as mr
from multiradar.app import Application
from multiradar.settings.service import load_settings
from multiradar.wire import sensor_table
from multiradar_schemas.sensors.sensor import parse_sensors

ROOT = Path(__file__).parents[2]
IMAGES = ROOT / "docs" / "images"
#: The moment of the pictures: ten minutes after the start of the recording.
AFTER_S = 600.0
#: The pictures by their file, with what is switched off.
PICTURES = {
    "page.png": "",
    "page-biases.png": "off=biases",
    "page-history.png": "",
    "page-area.png": "",
}
#: The picture of five minutes before.
_HISTORY = "page-history.png"
_BACK = "document.querySelector('#time button.ago').click()"
#: The picture of the whole area; the others show one track.
_AREA = "page-area.png"
#: Shows the earliest track that three sensors see, about 20 km across.
_CLOSE = """() => {
  const { store, picture, actions } = window.multiradar;
  const seen = new Map();
  for (const plot of store.plots) {
    if (!seen.has(plot.track)) seen.set(plot.track, new Set());
    seen.get(plot.track).add(plot.sensor);
  }
  const tracks = store.tracks.filter((one) => seen.has(one.id) && seen.get(one.id).size > 2);
  tracks.sort((a, b) => a.id - b.id);
  picture.map.getView().setZoom(11.7);
  actions.show(tracks[0].id);
  document.querySelectorAll("#sensors details").forEach((one, at) => { one.open = at === 0; });
}"""
_TIMEOUT_S = 600.0
_POLL_MS = 100.0


def main() -> None:
    """Make the pictures."""
    found = next(filter(None, map(shutil.which, ("chromium", "google-chrome"))), None)
    if found is None:
        raise SystemExit("no Chromium or Chrome is installed")
    with tempfile.TemporaryDirectory(prefix="multiradar-page-") as name:
        folder = Path(name)
        dump = ROOT / "examples" / "vid-sample"
        measured = mr.convert(dump, date="2018-08-01").measurements
        early = measured.filter(pl.col("time_s") < pl.col("time_s").min() + AFTER_S)
        application = _started(folder)
        try:
            _send(application.http_url, early.filter(pl.col("kind") == "radar"))
            _make(application.http_url, found)
        finally:
            application.stop()


def _started(folder: Path) -> Application:
    text = (ROOT / "examples" / "sensors-vid-sample.toml").read_text(encoding="utf-8")
    given = {
        "server": {"port": 0},
        "journal": {"path": folder / "journal.sqlite"},
        "zenoh": {"enabled": False},
    }
    application = Application(
        load_settings(None, given), sensor_table(parse_sensors(text)), lambda: None
    )
    application.start()
    return application


def _send(url: str, frame: pl.DataFrame) -> None:
    with httpx.Client(base_url=url, timeout=_TIMEOUT_S) as client:
        for part in frame.iter_slices(1000):
            client.post(
                "/v1/measurements",
                content=part.write_ndjson().encode(),
                headers={"content-type": "application/x-ndjson"},
            ).raise_for_status()


def _make(url: str, browser: str) -> None:
    with sync_playwright() as playwright:
        options = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
        chromium = playwright.chromium.launch(executable_path=browser, args=options)
        for name, given in PICTURES.items():
            page = chromium.new_page(viewport={"width": 1280, "height": 720})
            page.goto(f"{url}/#{given}")
            _settle(page, close=name != _AREA)
            if name == _HISTORY:
                page.evaluate(_BACK)
                page.wait_for_timeout(4000)
            page.screenshot(path=IMAGES / name)
            print(f"wrote {IMAGES / name}")
        chromium.close()


def _settle(page: Page, *, close: bool) -> None:
    ready = "window.multiradar?.picture.seenOnCanvas.length > 3"
    land = "window.multiradar?.picture.land.getSource().getFeatures().length > 0"
    sensors = "window.multiradar?.feed.sensors.length > 3"
    for _ in range(round(1000.0 * _TIMEOUT_S / _POLL_MS)):
        if page.evaluate(f"Boolean({ready} && {land} && {sensors})"):
            break
        page.wait_for_timeout(_POLL_MS)
    else:
        raise SystemExit("the page did not show the picture")
    if close:
        page.evaluate(_CLOSE)
    # The map moves, and the past of the track is read.
    page.wait_for_timeout(4000)


if __name__ == "__main__":
    main()
