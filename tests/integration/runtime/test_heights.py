"""Climbs, level steps, garbled heights and aircraft without Mode C, through the engine."""

from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np
import polars as pl
import pytest
from numpy.typing import NDArray

from multiradar import wire
from multiradar.estimation.filters.bank import FILTERS
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame, truth_frame
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.model import Bias, Scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings

Floats = NDArray[np.float64]

SETTLED_S = 100.0
ROW = ["time_s", "sensor_id", "track_number"]


class Errors(NamedTuple):
    """Errors and published sigmas of the updates after a while, and heights."""

    place_m: Floats
    place_sigma_m: Floats
    height_m: Floats
    height_sigma_m: Floats
    rate_mps: Floats

    @property
    def place_nees(self) -> float:
        return float(np.mean((self.place_m / self.place_sigma_m) ** 2))

    @property
    def height_nees(self) -> float:
        return float(np.nanmean((self.height_m / self.height_sigma_m) ** 2))

    @property
    def place_rms_m(self) -> float:
        return float(np.sqrt(np.mean(self.place_m**2)))


def without_heights(radars: int, seed: int = 1) -> Scenario:
    """Aircraft without Mode C, measured by radars without biases."""
    scene = builtin_scenario("climbs")
    sensors = tuple(
        replace(one, biases=(Bias(estimate=False),) * 4) for one in scene.sensors[:radars]
    )
    traffic = (replace(scene.traffic[2], count=30),)
    return replace(scene, seed=seed, duration_s=600.0, sensors=sensors, traffic=traffic)


def played(
    folder: Path, scene: Scenario, settings: TrackingSettings, size: int | None = None
) -> tuple[Engine, pl.DataFrame, pl.DataFrame]:
    seen = observe(scene, np.random.Generator(np.random.PCG64(scene.seed)))
    path = folder / "sensors.toml"
    path.write_text(sensors_text(scene), encoding="utf-8")
    table = load_sensor_table(path)
    frame = measurements_frame(scene, seen)
    engine = Engine(table, settings)
    updates = []
    for part in frame.iter_slices(size or len(frame)):
        batch, _ = wire.measurement_batch(part, table)
        updates.append(engine.push(batch).updates)
    updates.append(engine.flush().updates)
    tracks = wire.tracks_frame(TrackUpdates.concatenate(updates), table)
    return engine, tracks, truth_frame(scene, seen)


def errors_of(engine: Engine, tracks: pl.DataFrame, truth: pl.DataFrame) -> Errors:
    both = tracks.join(truth.unique(ROW), on=ROW, suffix="_true").filter(
        pl.col("time_s") > SETTLED_S
    )
    column = {
        name: both[name].cast(pl.Float64).fill_null(np.nan).to_numpy()
        for name in both.columns
        if both[name].dtype.is_numeric()
    }
    apart = [
        engine.plane.to_plane(
            np.radians(column[f"latitude_deg{of}"]), np.radians(column[f"longitude_deg{of}"])
        )
        for of in ("", "_true")
    ]
    return Errors(
        np.hypot(apart[0][0] - apart[1][0], apart[0][1] - apart[1][1]),
        column["position_sigma_m"],
        column["height_m"] - column["height_m_true"],
        column["height_sigma_m"],
        column["vertical_rate_mps"],
    )


@pytest.mark.parametrize("step_m", [7.62, 30.48])
def test_garbled_and_missing_heights_leave_height_and_rate_as_sure_as_they_say(
    tmp_path: Path, step_m: float
) -> None:
    scene = builtin_scenario("climbs")
    traffic = tuple(one for one in scene.traffic if one.height_step_m == step_m)
    scene = replace(scene, duration_s=600.0, traffic=traffic)
    found = errors_of(*played(tmp_path, scene, TrackingSettings()))
    assert np.isfinite(found.height_m).all()
    assert np.isfinite(found.rate_mps).mean() > 0.99
    assert 0.6 < found.height_nees < 1.5
    assert np.sqrt(np.mean(found.height_m**2)) < 10.0
    # One height in fifty is off by 150 m to 3 km.
    assert np.mean(np.abs(found.height_m) > 60.0) < 0.002


@pytest.mark.parametrize("name", sorted(FILTERS))
def test_two_radars_estimate_the_height_of_an_aircraft_without_mode_c(
    tmp_path: Path, name: str
) -> None:
    scene = without_heights(2)
    found = errors_of(*played(tmp_path, scene, TrackingSettings(filter_name=name)))
    has_height = np.isfinite(found.height_m)
    assert has_height.mean() > 0.8
    assert np.isnan(found.rate_mps).all()
    assert found.height_nees < 1.2
    assert found.place_nees < 1.0
    assert np.mean(found.place_m > 3.0 * found.place_sigma_m) < 0.002
    # A fixed assumed height leaves 130 m and more.
    assert found.place_rms_m < 90.0


# The modes of imm follow the error of the assumed height, too: its tail is longer, and with rarer
# turns the longer (0.7 % of the positions before, 1.8 % since).
@pytest.mark.parametrize(
    ("name", "nees", "beyond"), [("two-stage", 1.0, 0.002), ("imm", 1.1, 0.02)]
)
def test_the_height_is_unobservable_from_one_radar(
    tmp_path: Path, name: str, nees: float, beyond: float
) -> None:
    found = errors_of(*played(tmp_path, without_heights(1), TrackingSettings(filter_name=name)))
    assert np.isfinite(found.height_m).mean() < 0.1
    assert found.place_nees < nees
    assert np.mean(found.place_m > 3.0 * found.place_sigma_m) < beyond


@pytest.mark.parametrize("name", sorted(FILTERS))
def test_aircraft_without_height_do_not_contribute_to_the_biases(tmp_path: Path, name: str) -> None:
    scene = builtin_scenario("climbs")
    scene = replace(scene, duration_s=300.0, traffic=scene.traffic[2:])
    engine, _, _ = played(tmp_path, scene, TrackingSettings(filter_name=name))
    np.testing.assert_array_equal(engine.biases.estimate, 0.0)


def test_a_late_first_height_corrects_the_position(tmp_path: Path) -> None:
    # Until 300 s no radar gives heights; then they come.
    scene = without_heights(2)
    traffic = (replace(scene.traffic[0], heard_height_share=1.0, height_step_m=7.62),)
    scene = replace(scene, traffic=traffic)
    seen = observe(scene, np.random.Generator(np.random.PCG64(scene.seed)))
    path = tmp_path / "sensors.toml"
    path.write_text(sensors_text(scene), encoding="utf-8")
    table = load_sensor_table(path)
    frame = measurements_frame(scene, seen).with_columns(
        pl.when(pl.col("time_s") > 300.0).then("height_m").alias("height_m")
    )
    batch, _ = wire.measurement_batch(frame, table)
    engine = Engine(table, TrackingSettings())
    updates = TrackUpdates.concatenate([engine.push(batch).updates, engine.flush().updates])
    assert engine.counts["REFUSED"] + engine.counts["RESTARTED"] == 0
    tracks = wire.tracks_frame(updates, table)
    found = errors_of(engine, tracks, truth_frame(scene, seen))
    assert found.place_nees < 1.5
    known = tracks.select(
        before=pl.col("vertical_rate_mps").filter(pl.col("time_s") < 300.0).is_not_null().any(),
        after=pl.col("vertical_rate_mps").filter(pl.col("time_s") > 330.0).is_not_null().mean(),
    ).row(0)
    assert not known[0]
    assert known[1] > 0.99


@pytest.mark.parametrize("size", [1, 7])
def test_batches_leave_no_trace_in_heights(tmp_path: Path, size: int) -> None:
    scene = replace(builtin_scenario("climbs"), duration_s=60.0)
    settings = TrackingSettings(filter_name="imm")
    whole = played(tmp_path, scene, settings)[1]
    assert whole["vertical_rate_mps"].is_not_null().any()
    assert played(tmp_path, scene, settings, size)[1].equals(whole)
