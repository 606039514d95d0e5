"""A service with simulated traffic, and a browser."""

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import polars as pl
import pytest
from playwright.sync_api import Browser, BrowserContext, Page, Route, expect, sync_playwright

from multiradar.app import Application
from multiradar.settings.service import load_settings
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame
from multiradar.simulation.scenario.file import builtin_table, changed, scenario_of
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.simulation.traffic import run_generator
from multiradar.wire import sensor_table
from multiradar_schemas.sensors.sensor import parse_sensors
from support.processes import clients
from support.processes.waiting import WAIT_TIMEOUT_S
from support.required import skip_unless_required

#: Names of the browser; the first that is installed is used.
BROWSERS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
#: Without a screen and a graphics processor, and without connections of the browser's own; pages
#: share a process, as to start one costs as much as a test.
OPTIONS = (
    "--renderer-process-limit=1",
    "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
    "--disable-background-networking", "--disable-component-update", "--disable-sync",
)  # fmt: skip

#: At most ten frames a second: the others, drawn without a graphics processor, took half the
#: processor time of these tests.
FRAMES = """
window.requestAnimationFrame = (draw) => setTimeout(() => draw(performance.now()), 100);
window.cancelAnimationFrame = (number) => clearTimeout(number);
"""


class Air:
    """A running service, and the measurements of a scenario for it.

    Parameters
    ----------
    folder : Path
        For the journal.
    duration_s : float
        Length of the scenario, s.
    scenario : str
        Name of a built-in one.
    """

    def __init__(self, folder: Path, duration_s: float = 180.0, scenario: str = "crossing") -> None:
        scene = scenario_of(changed(builtin_table(scenario), seed=None, duration_s=duration_s))
        seen = observe(scene, run_generator(scene.seed))
        self.measurements = measurements_frame(scene, seen)
        self.sensors = sensors_text(scene)
        self._folder, self._port = folder, 0
        self.start()

    def start(self) -> None:
        """Start the service, again at its address and with its journal."""
        settings = load_settings(
            None,
            {
                "server": {"port": self._port},
                "http": {"acknowledge_deadline_s": WAIT_TIMEOUT_S},
                "journal": {"path": self._folder / "journal.sqlite"},
                "zenoh": {"enabled": False},
                "trajectories": {"aircraft_max": 2},
            },
        )
        table = sensor_table(parse_sensors(self.sensors))
        self.application = Application(settings, table, lambda: None)
        self.application.start()
        self.url = self.application.http_url
        self._port = int(self.url.rpartition(":")[2])

    def send(self, frame: pl.DataFrame) -> None:
        """Send measurements, and wait until they are processed."""
        with clients.client(self.url) as client:
            answer = client.post(
                "/v1/measurements",
                content=frame.write_ndjson().encode(),
                headers={"content-type": "application/x-ndjson"},
            )
            assert answer.json()["accepted"] == len(frame)
            assert client.post("/v1/flush").status_code == 200


def received(page: Page, age_s: float) -> list[float]:
    """Let the last measurement be so old; the list can be changed."""
    ages_s = [age_s]

    def answer(route: Route) -> None:
        route.fulfill(json={**route.fetch().json(), "received_age_s": ages_s[0]})

    page.route("**/v1/status", answer)
    return ages_s


@pytest.fixture(scope="module")
def air(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Air]:
    air = Air(tmp_path_factory.mktemp("air"))
    air.send(air.measurements)
    yield air
    air.application.stop()


# Not of the session: its event loop runs in this thread, where tests with own loops follow.
@pytest.fixture(scope="module")
def browser() -> Iterator[Browser]:
    found = next((path for name in BROWSERS if (path := shutil.which(name))), None)
    if found is None:
        skip_unless_required("browser", "no Chromium or Chrome is installed")
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=found, args=list(OPTIONS))
        yield browser
        browser.close()


@contextmanager
def window(browser: Browser, **options: Any) -> Iterator[BrowserContext]:
    """A window with the bound of all waits."""
    context = browser.new_context(viewport={"width": 1280, "height": 720}, **options)
    context.set_default_timeout(WAIT_TIMEOUT_S * 1000.0)
    expect.set_options(timeout=WAIT_TIMEOUT_S * 1000.0)
    context.add_init_script(FRAMES)
    yield context
    context.close()


@pytest.fixture
def page(browser: Browser) -> Iterator[Page]:
    with window(browser) as context:
        page = context.new_page()
        yield page
        # What answers for the service would answer a page that is closed.
        page.unroute_all(behavior="ignoreErrors")
