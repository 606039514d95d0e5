"""Frames have the tracks with their covariance and sources, and are encoded once for all pages."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from multiradar.clock import FixedClock
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.engine.plot_rows import NO_TRACK
from multiradar.runtime.memory.knowledge import Knowledge
from multiradar.runtime.memory.past_rows import PastRows
from multiradar.runtime.picture import air_picture, recent_plots
from multiradar.runtime.picture.air_picture import (
    PAUSE_MAX_S,
    PLOTS_FIRST_S,
    TICK_S,
    AirPicture,
    Asked,
)
from multiradar.runtime.picture.past import ENDING_S, PATH_S, PLOTS_S
from multiradar.runtime.picture.selection import Area, Columns
from multiradar.runtime.picture.track_columns import track_columns
from multiradar.runtime.queries.used_plots import residuals_of_radars
from multiradar.settings.limits import RuntimeLimits
from multiradar.tracking.outputs import EngineOutput, TrackPlots
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch
from support.fakes.fake_engine import FakeEngine
from support.inputs.picture_frames import Tables, decoded
from support.scenarios.live_scene import recording, sensors

TABLE = sensors()
PLANE = SystemPlane.for_sensors(TABLE.latitude_rad, TABLE.longitude_rad)


class _Air:
    """A picture of what a fake engine publishes."""

    def __init__(self) -> None:
        self.engine, self.clock = FakeEngine(), FixedClock()
        self.known = Knowledge(TABLE, TrackingSettings(), RuntimeLimits())
        self.picture = AirPicture(self.known, self.clock)

    def push(self, rows: int, seed: int = 1) -> EngineOutput:
        batch, _ = measurement_batch(recording(rows, seed=seed), TABLE)
        output = self.engine.push(batch)
        east_m, north_m = PLANE.to_plane(output.updates.latitude_rad, output.updates.longitude_rad)
        # Sigmas of 30 m to the east and 90 m to the north.
        shape = np.ones(rows)
        spread = np.column_stack([east_m, north_m, 900 * shape, 0 * shape, 8100 * shape])
        output = replace(output, spread=spread, plots=TrackPlots(output.updates.track_id, batch))
        self.known.absorb(output, float(batch.time_s.max()))
        self.clock.advance(TICK_S)
        return output

    def read(self, asked: Asked = Asked()) -> tuple[dict[str, object], Tables]:  # noqa: B008
        return decoded(self.picture.frame(asked))


def test_a_track_has_the_axes_of_its_covariance_its_sources_and_its_identity() -> None:
    air = _Air()
    updates = air.push(300).updates
    header, tables = air.read()
    tracks = tables["tracks"]
    assert header["total"] == len(tracks["track_id"]) == len(np.unique(updates.track_id))
    # The plane is nearly that of the ground here, its north nearly true north. Since the last
    # update the sigmas of position and velocity add up, with the noise of the acceleration.
    age_s = tracks["age_s"]
    assert age_s.max() > 1.0
    velocity_mps = tracks["velocity_sigma_mps"] / np.sqrt(2.0)
    noise_m2 = TrackingSettings().acceleration_density * age_s**3 / 3.0
    for name, sigma_m in (("major", 90.0), ("minor", 30.0)):
        grown_m = np.sqrt((sigma_m + velocity_mps * age_s) ** 2 + noise_m2)
        np.testing.assert_allclose(tracks[f"sigma_{name}_m"], grown_m, rtol=0.01)
    both_m = np.hypot(tracks["sigma_major_m"], tracks["sigma_minor_m"])
    np.testing.assert_allclose(tracks["sigma_now_m"], both_m, rtol=1e-6)
    off_north_deg = (tracks["sigma_azimuth_deg"] + 90.0) % 180.0 - 90.0
    np.testing.assert_allclose(off_north_deg, 0.0, atol=4.0)
    for row, track in enumerate(tracks["track_id"].tolist()):
        own = updates.track_id == track
        heard = sum({1 if sensor == 2 else 4 for sensor in updates.sensor[own].tolist()})
        assert tracks["sources"][row] == heard
        assert tracks["mode_3a"][row] == updates.mode_3a[own][-1]
        assert tracks["mode_s_address"][row] == updates.mode_s_address[own][-1]
        assert tracks["age_s"][row] == pytest.approx(
            updates.time_s.max() - updates.time_s[own][-1], abs=1e-3
        )


def test_pages_of_one_tick_share_a_frame_that_was_encoded_once() -> None:
    air = _Air()
    air.push(50)
    following = int(str(air.read()[0]["next"]))
    air.push(50, seed=2)
    frames = [air.picture.frame(Asked(following)) for _ in range(20)]
    assert all(frame is frames[0] for frame in frames)
    assert (air.picture.encoded, air.picture.shared) == (2, 19)
    # The area selects nothing among few tracks: such pages share the frame, too.
    assert air.picture.frame(Asked(following, Area(0.0, 0.0, 1.0, 1.0), 3)) is frames[0]


def test_a_frame_is_ready_once_encoded_until_the_next_state_is_due() -> None:
    air = _Air()
    air.push(50)
    assert air.picture.ready(Asked()) is None
    frame = air.picture.frame(Asked())
    assert air.picture.ready(Asked()) is frame
    assert air.picture.ready(Asked(track=3)) is frame
    assert air.picture.ready(Asked(40)) is None
    air.push(50, seed=2)
    assert air.picture.ready(Asked()) is None
    assert air.picture.frame(Asked()) is not frame


def test_plots_that_take_the_place_of_older_ones_have_their_own_positions(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found = []
    for kept in (recent_plots.PLOTS_KEPT, 64):
        monkeypatch.setattr(recent_plots, "PLOTS_KEPT", kept)
        air = _Air()
        for seed in (1, 2, 3):
            air.push(40, seed=seed)
            header, tables = air.read(Asked(70))
        assert (header["next"], header["skipped"]) == (120, 0)
        found.append(tables["plots"])
    assert len(found[0]["time_s"]) == 50
    for name, values in found[0].items():
        np.testing.assert_array_equal(values, found[1][name])


def test_a_frame_continues_the_plots_and_a_first_one_has_those_of_the_last_seconds() -> None:
    air = _Air()
    air.push(40)
    header, tables = air.read()
    assert len(tables["plots"]["time_s"]) == header["next"] == 40
    # A new page has earlier positions of its tracks.
    assert set(tables["path"]["track_id"]) == set(tables["tracks"]["track_id"])
    air.push(10, seed=3)
    header, tables = air.read(Asked(40))
    assert "path" not in tables
    assert len(tables["plots"]["time_s"]) == 10
    assert (header["next"], header["skipped"]) == (50, 0)
    # A number of a service that had more plots: it restarted.
    assert len(air.read(Asked(1000))[1]["plots"]["time_s"]) == 50
    assert len(air.read(Asked(50))[1]["plots"]["time_s"]) == 0


def test_plots_that_update_no_track_are_drawn_without_one() -> None:
    engine = Engine(TABLE, TrackingSettings())
    known = Knowledge(TABLE, TrackingSettings(), RuntimeLimits())
    batch, _ = measurement_batch(recording(600), TABLE)
    # Of aircraft with tracks, but 30 km away from them.
    radar = np.flatnonzero(batch.kind == KIND_RADAR)
    wrong = radar[len(radar) // 2 :: 7]
    batch.range_m[wrong] += 30_000.0
    output = engine.push(batch)
    assert len(output.unused) > 10
    known.absorb(output, float(batch.time_s.max()))
    plots = decoded(AirPicture(known, FixedClock()).frame(Asked()))[1]["plots"]
    recent = output.plots.measured.time_s, output.unused.time_s
    shown = [np.count_nonzero(times >= batch.time_s.max() - PLOTS_FIRST_S) for times in recent]
    without = plots["track_id"] == NO_TRACK
    assert [np.count_nonzero(~without), np.count_nonzero(without)] == shown
    assert np.isfinite(plots["latitude_deg"]).all()
    assert (np.diff(plots["time_s"]) >= 0.0).all()
    # Residuals are those of updates.
    counted = residuals_of_radars(known, window_s=600.0)["sensors"]
    used = output.plots.measured.kind == KIND_RADAR
    assert sum(one["plots"] for one in counted) <= np.count_nonzero(used)


def test_a_new_page_has_all_plots_of_the_last_seconds(monkeypatch: pytest.MonkeyPatch) -> None:
    air = _Air()
    monkeypatch.setattr(air_picture, "PLOTS_MAX", 100)
    air.push(500)
    header, tables = air.read()
    assert len(tables["plots"]["time_s"]) == header["next"] == 500
    # One that was away longer learns how many it lacks.
    air.push(300, seed=2)
    header, tables = air.read(Asked(500))
    assert (len(tables["plots"]["time_s"]), header["skipped"]) == (100, 200)


def test_the_picture_changes_after_a_tick_alone() -> None:
    air = _Air()
    air.push(20)
    first = air.picture.frame(Asked())
    batch, _ = measurement_batch(recording(30, seed=4), TABLE)
    air.known.absorb(air.engine.push(batch), float(batch.time_s.max()))
    air.clock.advance(0.5 * TICK_S)
    assert air.picture.frame(Asked()) is first
    air.clock.advance(0.5 * TICK_S)
    assert air.picture.frame(Asked()) is not first


def test_a_state_that_took_seconds_does_not_stop_the_picture(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    air = _Air()

    # As beside a process that has both cores.
    def slow(*given: Any) -> Columns:
        air.clock.advance(3.0)
        return track_columns(*given)

    monkeypatch.setattr(air_picture, "track_columns", slow)
    air.push(20)
    first = air.picture.frame(Asked())
    air.push(20, seed=2)
    assert air.picture.frame(Asked()) is first
    air.clock.advance(PAUSE_MAX_S)
    assert air.picture.frame(Asked()) is not first


def test_many_tracks_are_those_of_the_area_and_the_selected_one(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(air_picture, "WHOLE_MAX", 5)
    air = _Air()
    updates = air.push(100).updates
    header, tables = air.read(Asked(None, Area(100.0, 0.0, 110.0, 10.0), 3))
    assert tables["tracks"]["track_id"].tolist() == [3]
    assert len(tables["plots"]["time_s"]) == 0
    assert header["total"] == len(np.unique(updates.track_id))
    assert len(air.read()[1]["tracks"]["track_id"]) == header["total"]


class _Files:
    """What is on disk: whatever is asked for, from a time on."""

    def __init__(self, oldest_s: float | None, written_s: float | None = None) -> None:
        self.oldest_s, self.written_s = oldest_s, written_s

    def at(self, at_s: float) -> str:
        del at_s
        return "files"


def test_files_answer_for_tables_that_memory_has_not_completely(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    air = _Air()
    begins = {
        "updates": 1000.0, "transitions": 1000.0, "plots": 2000.0, "biases": 100.0, "health": 0.0,
    }  # fmt: skip
    monkeypatch.setattr(
        PastRows, "complete_from_s", lambda _, *names: max(begins[one] for one in names)
    )
    assert air.picture.source(0.0) is air.picture.retained
    files = _Files(0.0, 3000.0)
    air.picture.history = files  # type: ignore[assignment]

    def found(at_s: float) -> str:
        source: Any = air.picture.source(at_s)
        if source is air.picture.retained:
            return "memory"
        parts = (source._tracks, source._plots, source._biases, source._health)
        return " ".join("files" if one == "files" else "memory" for one in parts)

    window_s = max(PATH_S, air.known.tracking.drop_after_s + ENDING_S)
    assert [found(1000.0 + window_s + after_s) for after_s in (-1.0, 0.0)] == [
        "files files memory memory", "memory files memory memory",
    ]  # fmt: skip
    assert [found(2000.0 + PLOTS_S + after_s) for after_s in (-1.0, 0.0)] == [
        "memory files memory memory", "memory",
    ]  # fmt: skip
    assert found(150.0) == "files files files memory"
    # Of later times they have nothing yet.
    for written_s, expected in ((1500.0, "memory files memory memory"), (1499.9, "memory")):
        files.written_s = written_s
        assert found(1500.0) == expected
    files.written_s = None
    assert found(150.0) == "memory"


def test_the_past_starts_with_the_earliest_of_memory_and_files() -> None:
    air = _Air()
    assert air.picture.span_s() is None
    air.push(20)
    first_s, last_s = air.known.past.oldest_s, air.known.data_time_s
    assert first_s is not None
    assert air.picture.span_s() == (first_s, last_s)
    for oldest_s, expected_s in ((first_s - 60.0, first_s - 60.0), (None, first_s)):
        air.picture.history = _Files(oldest_s)  # type: ignore[assignment]
        assert air.picture.span_s() == (expected_s, last_s)


def test_the_picture_starts_again_with_the_journal() -> None:
    air = _Air()
    air.push(20)
    air.read()
    air.known.clear()
    air.clock.advance(TICK_S)
    header, tables = air.read(Asked(20))
    assert (header["data_time_s"], header["next"], header["total"]) == (None, 0, 0)
    assert not len(tables["tracks"]["track_id"])
