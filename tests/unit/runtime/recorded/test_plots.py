"""Plots of a recorded run belong to the nearest of the updates with their time."""

from pathlib import Path

import numpy as np
import polars as pl

from multiradar.runtime.recorded.plots import RecordedPlots
from multiradar.storage.time_table import TimeTable
from multiradar.wire import sensor_table
from multiradar_schemas.products.track import TRACK_SCHEMA
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile

SENSORS = sensor_table(
    SensorsFile(
        sensor=(Sensor(id="m", kind="mlat", latitude_deg=-17.0, longitude_deg=179.0, height_m=0.0),)
    )
)


def test_plots_of_one_time_belong_to_updates_across_the_antimeridian(tmp_path: Path) -> None:
    count = 2
    same = {"time_s": [100.0] * count, "sensor_id": ["m"] * count, "latitude_deg": [-17.0] * count}
    measured, tracks = tmp_path / "measurements.parquet", tmp_path / "tracks.parquet"
    pl.DataFrame(
        same | {"kind": ["mlat"] * count, "longitude_deg": [179.999, 179.5]}
    ).write_parquet(measured)
    pl.DataFrame(
        same
        | {
            "track_id": [1, 2], "longitude_deg": [-179.999, 179.6], "height_m": [9000.0] * count,
            "state": ["confirmed"] * count,
        }
    ).write_parquet(tracks)  # fmt: skip
    required = {"time_s", "track_id", "sensor_id", "latitude_deg", "longitude_deg", "height_m"}
    optional = {name: dtype for name, dtype in TRACK_SCHEMA.items() if name not in required}
    table = TimeTable(tracks, list(TRACK_SCHEMA), optional)
    rows, others = RecordedPlots([measured], SENSORS, table).last(99.0, 101.0, 10)
    assert others == 0
    longitude_deg = np.degrees(rows["longitude_rad"]).round(3).tolist()
    assert dict(zip(longitude_deg, rows["track_id"].tolist(), strict=True)) == {
        179.999: 1,
        179.5: 2,
    }
