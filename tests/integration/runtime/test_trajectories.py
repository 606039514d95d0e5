"""Trajectories of the whole service: HTTP, Zenoh and `track` give the same numbers."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, NamedTuple

import httpx
import polars as pl
import pytest
import zenoh

from multiradar.app import Application
from multiradar.runtime.offline.offline_job import TRAJECTORIES_FILE, OfflineJob
from multiradar.runtime.offline.offline_run import track_recording
from multiradar.runtime.offline.trajectory_table import STEP_S, table_row
from multiradar.runtime.trajectories.options import trajectory_options
from multiradar.settings.service import TrajectorySettings, load_settings
from multiradar.storage.recording import Recording
from multiradar.tracking.settings import TrackingSettings
from multiradar_schemas.products.forecast import Forecast
from multiradar_schemas.products.trajectories import Trajectories
from support.processes import clients
from support.processes.waiting import WAIT_TIMEOUT_S, wait_until
from support.processes.zenoh_subscriber import client_config
from support.scenarios.live_scene import cut
from support.scenarios.trajectory_scene import MUTE, TABLE, TURNING, recording
from support.scenarios.zenoh_scene import free_endpoint

WITH_BUNDLES = (TURNING, MUTE, 3, 4)
FORECAST = "by=bundle;horizon_s=30;step_s=10"


class _Answers(NamedTuple):
    http: dict[int, dict[str, Any]]
    zenoh: dict[int, dict[str, Any]]
    counts: dict[str, Any]
    forecasts: tuple[dict[str, Any], dict[str, Any]]


def _application(folder: Path) -> Application:
    settings = load_settings(
        None,
        {
            "server": {"port": 0},
            "journal": {"path": folder / "journal.sqlite"},
            "zenoh": {"listen": (free_endpoint(),)},
            "trajectories": {"aircraft_max": 10},
        },
    )
    return Application(settings, TABLE, lambda: None)


def _asked(application: Application) -> _Answers:
    with clients.client(application.http_url) as client:

        def counted() -> dict[str, Any]:
            found: dict[str, Any] = client.get("/v1/status").json()["trajectories"]
            return found

        wait_until(lambda: not counted()["plots_waiting"], "the bundles to have taken all plots")
        counts = counted()
        path = f"/v1/tracks/{{}}/trajectories?step_s={STEP_S}"
        http = {track: client.get(path.format(track)).json() for track in WITH_BUNDLES}
        forecast = client.get(f"/v1/tracks/{TURNING}/forecast?{FORECAST.replace(';', '&')}").json()
    queried = {}
    with zenoh.open(client_config(application.zenoh_endpoints[0])) as session:
        for track in WITH_BUNDLES:
            selector = f"multiradar/v1/trajectories/{track}?step_s={STEP_S}"
            (reply,) = session.get(selector, timeout=WAIT_TIMEOUT_S)
            assert reply.ok is not None
            assert str(reply.ok.key_expr) == f"multiradar/v1/trajectories/{track}"
            queried[track] = httpx.Response(200, content=reply.ok.payload.to_bytes()).json()
        selector = f"multiradar/v1/forecasts/{TURNING}?{FORECAST}"
        (reply,) = session.get(selector, timeout=WAIT_TIMEOUT_S)
        assert reply.ok is not None
        again = httpx.Response(200, content=reply.ok.payload.to_bytes()).json()
    return _Answers(http, queried, counts, (forecast, again))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("trajectories")


@pytest.fixture(scope="module")
def live(folder: Path) -> _Answers:
    application = _application(folder)
    application.start()
    try:
        for part in cut(recording(), [1, 70, 7]):
            application.service.submit(part, source="test").result(WAIT_TIMEOUT_S)
        application.service.flush(source="test").result(WAIT_TIMEOUT_S)
        application.service.settled().result(WAIT_TIMEOUT_S)
        return _asked(application)
    finally:
        application.stop()


@pytest.fixture(scope="module")
def restarted(folder: Path, live: _Answers) -> Iterator[_Answers]:
    application = _application(folder)
    application.start()
    try:
        yield _asked(application)
    finally:
        application.stop()


def test_a_forecast_by_the_bundle_is_the_same_over_http_and_zenoh(
    live: _Answers, restarted: _Answers
) -> None:
    http, queried = live.forecasts
    document = Forecast.model_validate_json(httpx.Response(200, json=http).content)
    assert [point.members is not None for point in document.points] == [True] * 4
    assert queried == http
    assert restarted.forecasts == live.forecasts


def test_every_track_has_trajectories(live: _Answers) -> None:
    for track, answer in live.http.items():
        document = Trajectories.model_validate_json(httpx.Response(200, json=answer).content)
        assert document.track_id == track
        assert document.state == "confirmed"
    assert live.counts["aircraft"] == len(WITH_BUNDLES)
    assert live.counts["plots_lost"] == 0


def test_zenoh_agrees_with_http(live: _Answers) -> None:
    assert live.zenoh == live.http


def test_answers_are_the_same_after_a_restart(live: _Answers, restarted: _Answers) -> None:
    assert restarted.http == live.http
    assert restarted.counts == live.counts


def test_the_track_command_agrees(live: _Answers, tmp_path: Path) -> None:
    source = tmp_path / "measurements.parquet"
    recording().write_parquet(source)
    (tmp_path / "out").mkdir()
    job = OfflineJob(
        Recording(source), TABLE, TrackingSettings(), batch_rows=11,
        trajectories=trajectory_options(
            10, 1000, TrajectorySettings().lateral_max_mps2,
            TrajectorySettings().longitudinal_max_mps2,
        ),
    )  # fmt: skip
    track_recording(job, tmp_path / "out")
    table = pl.read_parquet(tmp_path / "out" / TRAJECTORIES_FILE)
    for track, answer in live.http.items():
        last = table.filter(pl.col("track_id") == track).row(-1, named=True)
        row = table_row(answer)
        assert last == {name: row.get(name) for name in table.columns}


def test_neither_a_primary_nor_its_standby_waits_for_trajectories(tmp_path: Path) -> None:
    """A standby followed as slowly as its sets were computed, and fell behind without bound."""
    settings = load_settings(
        None,
        {
            "server": {"port": 0},
            "journal": {"path": tmp_path / "journal.sqlite", "standby": True},
            "zenoh": {"enabled": False},
            "trajectories": {"aircraft_max": 10, "plots_waiting_max": 10},
        },
    )
    both = primary, standby = [Application(settings, TABLE, lambda: None) for _ in range(2)]
    primary.start()
    standby.start()
    try:
        assert standby.following
        with ExitStack() as held:
            for one in both:
                assert one._trajectories is not None
                # Before the plots: a feed that waits for room would block them for minutes.
                assert not one._trajectories._patient
                held.enter_context(one._trajectories._using)
            primary.service.submit(recording(), source="test").result(WAIT_TIMEOUT_S)
            primary.service.flush(source="test").result(WAIT_TIMEOUT_S)
            processor = standby.service._processor
            assert processor is not None
            wait_until(lambda: processor.processed == 2, "the standby to be level")
        for one in both:
            assert one.service.view.status()["trajectories"]["plots_lost"] > 0
    finally:
        standby.stop()
        primary.stop()
