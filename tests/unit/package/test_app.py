"""The composition root hands every setting on."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from multiradar.access.authentication import Authentication
from multiradar.app import (
    Application,
    build_service,
    trajectory_feed,
    zenoh_options,
)
from multiradar.errors import MultiradarError
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.memory.live_tracks import LiveTracks
from multiradar.runtime.queries.encounter_query import EncounterQuery
from multiradar.runtime.queries.encounters import TrackSnapshot, encounters
from multiradar.runtime.trajectories.options import trajectory_options
from multiradar.runtime.warm_up import warm_up
from multiradar.settings.limits import HttpLimits, RuntimeLimits
from multiradar.settings.service import load_settings
from multiradar.tracking.columns import rows_of
from multiradar.tracking.encounters._approach_kernels import find_approaches
from multiradar.tracking.encounters._conflict_kernels import find_bounds, find_probabilities
from multiradar.tracking.encounters._search_kernels import find_pairs
from multiradar.tracking.forecast.forecast_calibration import calibration_for
from multiradar.tracking.forecast.forecast_family import ForecastFamily
from multiradar.tracking.outputs import TrackStates
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from support.scenarios import live_scene


def test_limits_are_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MULTIRADAR_HTTP__REQUESTS_MAX", "7")
    monkeypatch.setenv("MULTIRADAR_RUNTIME__EVENTS_MAX", "9")
    settings = load_settings(None)
    assert settings.http_limits() == HttpLimits(requests_max=7)
    assert settings.runtime_limits() == RuntimeLimits(events_max=9)


def test_zenoh_is_on_loopback_and_without_multicast_by_default() -> None:
    options = zenoh_options(load_settings(None), Authentication())
    assert options.listen == ("tcp/127.0.0.1:7447",)
    assert not options.multicast
    output = {
        "zenoh": {"multicast": True},
        "rows_per_message_max": 7,
        "http": {"body_bytes_max": 8},
    }
    options = zenoh_options(load_settings(None, output), Authentication())
    assert (options.multicast, options.message_rows_max, options.message_bytes_max) == (True, 7, 8)


def test_warming_up_needs_no_more_than_the_sensors() -> None:
    warm_up(live_scene.sensors(), TrackingSettings())


def test_warming_up_makes_the_first_forecast_ready(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its kernel would else be compiled while somebody waits for an answer."""
    tracks: list[int] = []
    forecast_all = ForecastFamily.forecast_all

    def counted(
        family: ForecastFamily, states: TrackStates, ahead_s: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        tracks.append(len(states))
        return forecast_all(family, states, ahead_s)

    monkeypatch.setattr(ForecastFamily, "forecast_all", counted)
    warm_up(live_scene.sensors(), TrackingSettings(filter_name="imm"))
    assert tracks[0] > 0


def test_warming_up_makes_the_first_answer_about_encounters_ready() -> None:
    """What it compiles is what is called: empty arrays have the same types."""
    warm_up(live_scene.sensors(), TrackingSettings())
    kernels: tuple[Any, ...] = (find_pairs, find_approaches, find_probabilities, find_bounds)
    before = [set(kernel.signatures) for kernel in kernels]
    assert all(before)
    table, settings = live_scene.sensors(), TrackingSettings()
    engine, live = Engine(table, settings), LiveTracks()
    live.update(
        rows_of(engine.push(measurement_batch(live_scene.recording(900), table)[0]).updates)
    )
    sky = TrackSnapshot(live_scene.START_S, live.all(), engine.tracks())
    query, calibration = EncounterQuery(distance_m=2e4, height_m=500.0), calibration_for(settings)
    found = encounters(sky, query, engine.plane, settings, calibration)
    assert found["count"] > 0
    assert [set(kernel.signatures) for kernel in kernels] == before


@pytest.mark.parametrize("mistake", ["another filter", "a converted recording"])
def test_a_wrong_state_folder_is_reported_before_kernels_are_compiled(
    mistake: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def chosen(name: str) -> Application:
        given: dict[str, Any] = {
            "journal": {"path": tmp_path / "journal.sqlite"},
            "server": {"port": 0},
            "zenoh": {"enabled": False},
            "tracking": {"filter_name": name},
        }
        return Application(
            load_settings(None, given),
            live_scene.sensors(),
            lambda: None,
            live_scene.sensors_file(),
        )

    if mistake == "another filter":
        first = chosen("joint")
        first.service.open()
        first.stop()
        words = "created with --filter joint, now ci; use the original"
    else:
        (tmp_path / "measurements.parquet").write_bytes(b"")
        words = "was the output of `convert`; choose another folder"
    compiled: list[bool] = []
    monkeypatch.setattr(Application, "_compile", lambda _self: compiled.append(True))
    application = chosen("ci")
    with pytest.raises(MultiradarError, match=re.escape(words)):
        application.start()
    application.stop()
    assert not compiled


def test_trajectories_are_made_only_where_aircraft_may_have_some(tmp_path: Path) -> None:
    table = live_scene.sensors()
    output: dict[str, Any] = {"journal": {"path": tmp_path / "journal.sqlite"}}
    without = load_settings(None, output)
    service = build_service(without, table)
    assert trajectory_feed(service, without, table) is None
    assert "trajectories" not in service.view.status()
    output["trajectories"] = {"aircraft_max": 7, "plots_waiting_max": 9, "workers": 2}
    some = load_settings(None, output)
    assert trajectory_feed(service, some, table) is not None
    assert service.view.status()["trajectories"]["aircraft_max"] == 7
    options = trajectory_options(**some.trajectories.model_dump())
    assert (options.plots_waiting_max, options.workers) == (9, 2)
