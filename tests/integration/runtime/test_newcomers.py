"""Aircraft that come into the cover where a false plot was made shortly before."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from multiradar import wire
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.output import measurements_frame
from multiradar.simulation.scenario.file import builtin_scenario
from multiradar.simulation.scenario.model import PARAMETERS, Aircraft, Bias, Scenario
from multiradar.simulation.scenario.sensors_text import sensors_text
from multiradar.toolbox.inputs import load_sensor_table
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings

NAMELESS = ("track_number", "mode_s_address", "mode_3a")
FIRST_S = 40.0


@pytest.mark.parametrize("filter_name", ["two-stage", "imm"])
@pytest.mark.parametrize(
    ("before_s", "east_m", "north_m"),
    [
        (11.6, 524.0, -3644.0), (26.3, 1586.0, 3723.0), (4.0, -900.0, 400.0),
        (16.0, 3000.0, 4000.0),
    ],
)  # fmt: skip
def test_a_false_plot_neither_delays_nor_takes_over_the_track_of_a_new_aircraft(
    tmp_path: Path, filter_name: str, before_s: float, east_m: float, north_m: float
) -> None:
    scene = newcomer()
    seen = observe(scene, np.random.Generator(np.random.PCG64(5)))
    frame = measurements_frame(scene, seen)
    false = false_plot(scene, frame, before_s, east_m, north_m)
    path = tmp_path / "sensors.toml"
    path.write_text(sensors_text(scene), encoding="utf-8")
    table = load_sensor_table(path)
    batch, _ = wire.measurement_batch(pl.concat([false, frame]), table)
    engine = Engine(table, TrackingSettings(hidden_fields=NAMELESS, filter_name=filter_name))
    updates = TrackUpdates.concatenate([engine.push(batch).updates, engine.flush().updates])
    tracks = wire.tracks_frame(updates, table).sort("time_s")
    confirmed = tracks.filter(pl.col("state") == "confirmed")
    assert confirmed["track_id"].n_unique() == 1
    confirmed_s = float(confirmed["time_s"][0])
    # Three scans of the slower radar contain three plots of each.
    assert confirmed_s - float(frame["time_s"][0]) <= 2.0 * 11.4
    assert len(confirmed) == int((frame["time_s"] >= confirmed_s).sum())


def newcomer() -> Scenario:
    """One aircraft under the radars of `newcomers`, which see all and are known."""
    scene = builtin_scenario("newcomers")
    known = tuple(Bias(estimate=False) for _ in range(PARAMETERS))
    return replace(
        scene,
        duration_s=160.0,
        traffic=(),
        aircraft=(
            Aircraft(1, 10e3, -20e3, 9000.0, 230.0, np.radians(70.0), start_s=FIRST_S,
                     height_step_m=7.62),
        ),
        sensors=tuple(
            replace(
                one, clutter_per_turn=0.0, detection_probability=1.0, biases=known,
                specified_biases=frozenset({0, 1}),
            )
            for one in scene.sensors
        ),
    )  # fmt: skip


def false_plot(
    scene: Scenario, frame: pl.DataFrame, before_s: float, east_m: float, north_m: float
) -> pl.DataFrame:
    """A plot without height of the first radar, so long before and so far off."""
    plane, radar = SystemPlane(*scene.centre_rad), scene.sensors[0]
    site = plane.to_geodetic(radar.east_m, radar.north_m)
    place = plane.to_geodetic(10e3 + east_m, -20e3 + north_m)
    slant, azimuth, _ = slant_range_azimuth(
        (float(site[0]), float(site[1]), radar.height_m), *place, 9000.0
    )
    return frame.head(1).with_columns(
        time_s=pl.lit(float(frame["time_s"][0]) - before_s),
        sensor_id=pl.lit(radar.identifier),
        range_m=pl.lit(float(slant)),
        azimuth_deg=pl.lit(float(np.degrees(azimuth)) % 360.0),
        height_m=pl.lit(None, pl.Float64),
    )
