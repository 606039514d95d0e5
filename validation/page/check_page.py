"""Measures the page in Chromium without a graphics processor, beside a service with many aircraft.

::

    python -m validation.page.check_page                       # 2000 and 10 000 aircraft
    python -m validation.page.check_page --memory-min 20       # memory at 10 frames/s

Frames per second depend on what else the machine does; the processor time of a frame does not:
that of the drawing (in the page) and of all threads and processes of the browser. The page is
forced to draw every frame, whether something moved or not.
"""

import argparse
import gzip
import os
import shutil
import subprocess
import tempfile
from importlib.resources import files
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, CDPSession, Page, ViewportSize, sync_playwright

from multiradar.report.content import Table
from multiradar.report.markdown import markdown_table
from validation.service.traffic import Traffic, processor_s

#: Limits of the issue: aircraft, and frames per second.
SKIES = {2_000: 45.0, 10_000: 30.0}
SIZE = ViewportSize(width=1280, height=720)
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
_OPTIONS = ("--no-sandbox", "--disable-gpu", "--disable-background-networking", "--disable-sync")
_MEASURED_MS = 10_000
_POLL_MS = 50.0
_TIMEOUT_S = 300.0
_FRAMES = """async (forced) => {
  const { picture } = window.multiradar;
  picture.forced = forced;
  await new Promise((done) => setTimeout(done, 1000));
  const [drawn, drawnMs, began] = [picture.drawn, picture.drawnMs, performance.now()];
  let frames = 0;
  await new Promise((done) => {
    const step = () => {
      frames += 1;
      if (performance.now() - began > MEASURED_MS) done();
      else requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  });
  const seconds = (performance.now() - began) / 1000;
  picture.forced = false;
  return {
    perSecond: frames / seconds, frames,
    drawn: picture.drawn - drawn, scriptMs: picture.drawnMs - drawnMs,
    labels: picture.layers.labels.drawn, symbols: picture.scene.seen.length,
  };
}""".replace("MEASURED_MS", str(_MEASURED_MS))
_CLICK = """async () => {
  const { picture, actions } = window.multiradar;
  const { seen } = picture.scene;
  const spent = [];
  for (let n = 0; n < 9; n++) {
    const track = seen.tracks[Math.floor((n + 0.5) * seen.length / 9)];
    actions.select(null);
    await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
    const began = performance.now();
    actions.select(track.id);
    while (!document.getElementById("sheet").textContent.includes(String(track.id))) {
      await new Promise((done) => setTimeout(done, 0));
    }
    await new Promise((done) => requestAnimationFrame(() => setTimeout(done, 0)));
    spent.push(performance.now() - began);
  }
  actions.select(null);
  return spent.sort((a, b) => a - b);
}"""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("--aircraft", type=int, nargs="*", default=list(SKIES))
    parser.add_argument("--memory-min", type=float, default=0.0, help="minutes of the memory test")
    options = parser.parse_args()
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        raise SystemExit("no Chromium or Chrome is installed")
    print(f"page without coast lines: {_compressed() / 1000:.0f} kB compressed (limit 500)\n")
    with sync_playwright() as playwright:
        rows = []
        for aircraft in options.aircraft:
            browser = playwright.chromium.launch(executable_path=found, args=list(_OPTIONS))
            with tempfile.TemporaryDirectory() as folder, Traffic(Path(folder), aircraft) as sky:
                sky.live()
                if options.memory_min > 0.0:
                    _memory(browser, sky.url, options.memory_min)
                else:
                    rows.append(_measured(browser, sky.url, aircraft))
            browser.close()
    if rows:
        print(markdown_table(Table("The page", _HEADINGS, tuple(map(tuple, rows)))))


_HEADINGS = (
    "aircraft", "symbols", "labels", "limit, frames/s", "frames/s here", "drawing, ms",
    "processor, ms per frame", "first picture, ms", "its processor, ms", "selection to sheet, ms",
)  # fmt: skip


def _measured(browser: Browser, url: str, aircraft: int) -> list[str]:
    page = _opened(browser, url)
    processes = _processes()
    before_s = sum(map(processor_s, processes))
    measured: dict[str, Any] = page.evaluate(_FRAMES, True)
    used_ms = 1000.0 * (sum(map(processor_s, processes)) - before_s)
    clicks: list[float] = page.evaluate(_CLICK)
    page.context.close()
    first_ms, first_processor_ms = _first(browser, url)
    # All frames were drawn: with one more second for the switch.
    each_ms = used_ms / (measured["frames"] * (1.0 + 1000.0 / _MEASURED_MS))
    return [
        f"{aircraft}",
        f"{measured['symbols']}",
        f"{measured['labels']}",
        f"{SKIES.get(aircraft, 0.0):.0f}",
        f"{measured['perSecond']:.1f}",
        f"{measured['scriptMs'] / measured['drawn']:.2f}",
        f"{each_ms:.1f}",
        f"{first_ms:.0f}",
        f"{first_processor_ms:.0f}",
        f"{clicks[len(clicks) // 2]:.0f} (worst {clicks[-1]:.0f})",
    ]


def _opened(browser: Browser, url: str, given: str = "") -> Page:
    page = browser.new_context(viewport=SIZE).new_page()
    page.goto(f"{url}/#{given}")
    _settled(page, "window.multiradar?.store.tracks.length > 100")
    _settled(page, "window.multiradar.picture.land.getSource().getFeatures().length > 0")
    page.evaluate("window.multiradar.picture.fit()")
    page.wait_for_timeout(2000.0)
    return page


# The second load of a page has the compiled script, as for a user who comes back.
def _first(browser: Browser, url: str) -> tuple[float, float]:
    context = browser.new_context(viewport=SIZE)
    page = context.new_page()
    before = {pid: processor_s(pid) for pid in _processes()}
    page.goto(url)
    _settled(page, "window.multiradar?.picture.firstMs > 0")
    used_s = sum(processor_s(pid) - before.get(pid, 0.0) for pid in _processes())
    first_ms: float = page.evaluate("window.multiradar.picture.firstMs")
    context.close()
    return first_ms, 1000.0 * used_s


def _settled(page: Page, condition: str) -> None:
    for _ in range(round(1000.0 * _TIMEOUT_S / _POLL_MS)):
        if page.evaluate(f"Boolean(window.multiradar && ({condition}))"):
            return
        page.wait_for_timeout(_POLL_MS)
    raise SystemExit(f"the page did not reach: {condition}")


# Heap after collection and resident memory, once a minute.
def _memory(browser: Browser, url: str, minutes: float) -> None:
    page = _opened(browser, url, "tick=100")
    session = page.context.new_cdp_session(page)
    page.wait_for_timeout(60_000.0)
    samples = [_heap(session)]
    steps = max(round(minutes * 2), 2)
    for _ in range(steps):
        page.wait_for_timeout(60_000.0 * minutes / steps)
        samples.append(_heap(session))
        print(f"  heap {samples[-1] / 1e6:.2f} MB", flush=True)
    frames: int = page.evaluate("window.multiradar.store.frames")
    if page.evaluate("window.multiradar.store.plots.length") == 0:
        raise SystemExit("no plots at the end: the traffic has stopped")
    middle = len(samples) // 2
    early = sum(samples[:middle]) / middle
    late = sum(samples[-middle:]) / middle
    print(
        f"heap after collection: first half {early / 1e6:.2f} MB, second half {late / 1e6:.2f} MB "
        f"({100.0 * (late / early - 1.0):+.1f} %; limit +5) over {minutes:.0f} min, {frames} frames"
    )


def _heap(session: CDPSession) -> float:
    session.send("HeapProfiler.collectGarbage")
    return float(session.send("Runtime.getHeapUsage")["usedSize"])


def _compressed() -> int:
    page = files("multiradar.api.page")
    names = ("index.html", "page.js", "page.css")
    return sum(len(gzip.compress(page.joinpath(name).read_bytes(), 9)) for name in names)


# Processes of browsers that descend from this one.
def _processes() -> list[int]:
    lines = subprocess.run(
        ["ps", "-eo", "pid,ppid,comm"], capture_output=True, text=True, check=True
    ).stdout.splitlines()[1:]
    parents = {int(pid): int(parent) for pid, parent, *_ in (line.split() for line in lines)}
    names = {int(line.split()[0]): line.split()[2] for line in lines}
    own = []
    for pid in parents:
        at = pid
        while at in parents and at != os.getpid():
            at = parents[at]
        if at == os.getpid() and "chrom" in names[pid]:
            own.append(pid)
    return own


if __name__ == "__main__":
    main()
