"""Makes the pictures of the page from the sample recording: each tab, the past, two runs.

::

    python -m validation.documents.make_screenshots   # needs Chromium or Chrome

The recording ends at a fixed time, so that the pictures differ by the azimuths of the sweeps only.
"""

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import httpx
import polars as pl
from PIL import Image
from playwright.sync_api import Browser, Page, Route, sync_playwright

import multiradar as mr
from multiradar.app import Application, view_server
from multiradar.cli.main import run
from multiradar.cli.playback.view import run_files
from multiradar.runtime.recorded.run import RecordedRun
from multiradar.settings.service import load_settings
from multiradar.wire import sensor_table
from multiradar_schemas.sensors.sensor import parse_sensors

ROOT = Path(__file__).parents[2]
IMAGES = ROOT / "docs" / "images"
SENSORS = ROOT / "examples" / "sensors-vid-sample.toml"
#: The moment of the pictures: ten minutes after the start of the recording.
AFTER_S = 600.0
#: Colours of a picture, and its greatest size, octets.
COLOURS, SIZE_MAX = 256, 150_000
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
}"""
_BACK = f"() => {{ ({_CLOSE})(); document.querySelector('#time button.ago').click(); }}"
#: Two sensors without tracks, at the aircraft of `_CLOSE`.
_TWO = f"""() => {{
  const {{ actions, view, store }} = window.multiradar;
  ({_CLOSE})();
  actions.select(null);
  for (const one of store.sensors.slice(2)) view.hiddenSensors.add(one);
  view.tab = "map";
  actions.changed();
}}"""
_END = """() => {
  const { clock } = window.multiradar;
  clock.pause();
  clock.seek(clock.span[1] - 60);
}"""
_TIMEOUT_S = 600.0
_POLL_MS = 100.0


@dataclass(frozen=True, slots=True)
class Picture:
    """A picture: its file, what the address says, and what is done then."""

    name: str
    address: str = ""
    script: str = "() => undefined"


#: Of the running service.
PICTURES = (
    Picture("page", script=_CLOSE),
    Picture("page-biases", "off=biases", _CLOSE),
    Picture("page-area"),
    Picture("page-radars", "tab=sensors&sensor=26-10"),
    Picture("page-system", "tab=system&theme=light"),
    Picture("page-layers", "on=joined&off=tracks,biases", _TWO),
    Picture("page-history", script=_BACK),
)
#: Of two recorded runs.
RUNS = (Picture("page-runs", "tab=map&off=plots", _END),)


def main() -> None:
    """Make the pictures."""
    found = next(filter(None, map(shutil.which, ("chromium", "google-chrome"))), None)
    if found is None:
        raise SystemExit("no Chromium or Chrome is installed")
    with tempfile.TemporaryDirectory(prefix="multiradar-page-") as name, sync_playwright() as play:
        folder = Path(name)
        dump = ROOT / "examples" / "vid-sample"
        measured = mr.convert(dump, date="2018-08-01").measurements
        early = measured.filter(
            pl.col("time_s") < pl.col("time_s").min() + AFTER_S, pl.col("kind") == "radar"
        )
        options = ["--no-sandbox", "--disable-gpu", "--disable-background-networking"]
        browser = play.chromium.launch(executable_path=found, args=options)
        with _service(folder, early) as url:
            _make(browser, url, PICTURES)
        with _view(folder, early) as url:
            _make(browser, url, RUNS)
        browser.close()


@contextmanager
def _service(folder: Path, frame: pl.DataFrame) -> Iterator[str]:
    given = {
        "server": {"port": 0},
        "journal": {"path": folder / "journal.sqlite"},
        "zenoh": {"enabled": False},
    }
    sensors = sensor_table(parse_sensors(SENSORS.read_text(encoding="utf-8")))
    application = Application(load_settings(None, given), sensors, lambda: None)
    application.start()
    try:
        _send(application.http_url, frame)
        yield application.http_url
    finally:
        application.stop()


@contextmanager
def _view(folder: Path, frame: pl.DataFrame) -> Iterator[str]:
    measurements = folder / "measurements.parquet"
    frame.write_parquet(measurements)
    both = [folder / "imm", folder / "two-stage"]
    for out in both:
        command = ["track", str(measurements), "--sensors", str(SENSORS), "--out", str(out)]
        run([*command, "--filter", out.name])
    runs = [RecordedRun(run_files(one, measurements, both), folder) for one in both]
    server = view_server(runs, (), 0, lambda: None)
    server.start()
    try:
        yield server.url
    finally:
        server.stop()


def _send(url: str, frame: pl.DataFrame) -> None:
    with httpx.Client(base_url=url, timeout=_TIMEOUT_S) as client:
        for part in frame.iter_slices(1000):
            client.post(
                "/v1/measurements",
                content=part.write_ndjson().encode(),
                headers={"content-type": "application/x-ndjson"},
            ).raise_for_status()
        client.post("/v1/flush").raise_for_status()


def _make(browser: Browser, url: str, pictures: tuple[Picture, ...]) -> None:
    for picture in pictures:
        page = browser.new_page(viewport={"width": 1280, "height": 720})
        page.route("**/v1/status", _delivering)
        page.goto(f"{url}/#{picture.address}")
        _settle(page)
        page.evaluate(picture.script)
        # The map moves, and the past of the track is read.
        page.wait_for_timeout(5000)
        path = IMAGES / f"{picture.name}.png"
        image = Image.open(BytesIO(page.screenshot())).convert("RGB")
        image.quantize(COLOURS, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE).save(
            path, optimize=True
        )
        size = path.stat().st_size
        print(f"wrote {path.relative_to(ROOT)}, {size / 1000:.0f} kB", flush=True)
        if size > SIZE_MAX:
            raise SystemExit(f"{path}: expected at most {SIZE_MAX} octets, was {size}")
        page.close()


# As while the recording is replayed: the page marks data that have ended.
def _delivering(route: Route) -> None:
    route.fulfill(json={**route.fetch().json(), "received_age_s": 0.5})


def _settle(page: Page) -> None:
    ready = "window.multiradar?.store.tracks.length > 3"
    land = "window.multiradar?.picture.land.getSource().getFeatures().length > 0"
    sensors = "window.multiradar?.feed.sensors.length > 3"
    for _ in range(round(1000.0 * _TIMEOUT_S / _POLL_MS)):
        if page.evaluate(f"Boolean({ready} && {land} && {sensors})"):
            return
        page.wait_for_timeout(_POLL_MS)
    raise SystemExit("the page did not show the picture")


if __name__ == "__main__":
    main()
