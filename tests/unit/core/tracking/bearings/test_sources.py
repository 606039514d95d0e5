"""Each measurement is looked up with the site and the noise that are its own."""

import numpy as np
import polars as pl

from multiradar.estimation.filters.arrays import Model, Rows
from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_DIRECTION, KIND_POSITION
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy._kernels import site_parameters
from multiradar.runtime.engine.run_updates import filter_rows
from multiradar.tracking.bearings.sources import Sources, find_sources
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch, sensor_table
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.sensors.sensor import parse_sensors
from support.references.direction_filter import model_of

ADSB, FIXED, FLYING = range(3)
ELEVATION_SIGMA_DEG = 0.2
SENSORS = f"""
[[sensor]]
id = "fixed"
kind = "direction-finder"
latitude_deg = 49.6
longitude_deg = 15.2
height_m = 300.0
elevation_sigma_deg = {ELEVATION_SIGMA_DEG}

[[sensor]]
id = "flying"
kind = "direction-finder"
moving = true
latitude_deg = 50.0
longitude_deg = 15.4
height_m = 3000.0

[[sensor]]
id = "adsb"
kind = "adsb"
"""
BEARING = {"kind": "bearing", "azimuth_deg": 40.0}
FROM = {"source_latitude_deg": 50.2, "source_longitude_deg": 15.9, "source_height_m": 3500.0}
POSITION = {"kind": "adsb", "latitude_deg": 50.0, "longitude_deg": 15.0}


def found(*rows: dict[str, object]) -> tuple[SensorTable, Model, Rows, Sources | None]:
    table = sensor_table(parse_sensors(SENSORS))
    model = model_of(table, TrackingSettings())
    frame = pl.DataFrame(
        [
            {**dict.fromkeys(MEASUREMENT_SCHEMA), "time_s": float(number)} | row
            for number, row in enumerate(rows)
        ],
        schema=dict(MEASUREMENT_SCHEMA),
    )
    batch, rejects = measurement_batch(frame, table)
    assert not len(rejects.index)
    return table, model, *find_sources(batch, filter_rows(batch, model), model, table)


def test_each_measurement_has_its_own_site_and_noise() -> None:
    table, model, rows, sources = found(
        {"sensor_id": "fixed"} | BEARING,
        {"sensor_id": "fixed", "elevation_deg": 3.0} | BEARING,
        {"sensor_id": "flying"} | BEARING | FROM,
        {"sensor_id": "adsb"} | POSITION,
        {"sensor_id": "adsb", "position_sigma_m": 25.0} | POSITION,
        {"sensor_id": "adsb", "position_sigma_m": 70.0} | POSITION,
        {"sensor_id": "adsb", "position_sigma_m": 25.0} | POSITION,
    )
    assert sources is not None
    expected = [
        KIND_BEARING, KIND_DIRECTION, KIND_BEARING, *(KIND_POSITION,) * 4,
    ]  # fmt: skip
    assert rows.kind.tolist() == expected
    assert rows.z[1, 0] == np.sin(np.radians(3.0))

    # Those without anything of their own use what the sensor has.
    assert rows.seen[[0, 3]].tolist() == [FIXED, ADSB]
    assert (sources.sites[:3] == model.sites).all()
    assert (sources.noises[:3] == model.noises).all()
    # Equal accuracies share an entry.
    assert rows.seen[4] == rows.seen[6] != rows.seen[5]

    sites, noises = sources.sites[rows.seen], sources.noises[rows.seen]
    assert (sites[[0, 1]] == model.sites[FIXED]).all()
    assert (sites[3:] == model.sites[ADSB]).all()
    there = site_parameters(model.plane, np.radians(50.2), np.radians(15.9), 3500.0)
    assert (sites[2] == there).all()
    assert noises[2, 3] == 3500.0
    assert noises[2, 1] == model.noises[FLYING, 1]
    assert noises[1, 0] == np.radians(ELEVATION_SIGMA_DEG) ** 2
    assert (noises[1, 1:] == model.noises[FIXED, 1:]).all()
    assert noises[3:, 2].tolist() == [model.noises[ADSB, 2], 25.0**2, 70.0**2, 25.0**2]
    # The biases are those of the sensor.
    for own, sensor in zip(rows.seen, rows.sensor, strict=True):
        assert (sources.starts[own : own + 2] == model.starts[sensor : sensor + 2]).all()
    assert table.ids == ("adsb", "fixed", "flying")


def test_measurements_without_anything_of_their_own_need_no_arrays() -> None:
    *_, rows, sources = found({"sensor_id": "fixed"} | BEARING, {"sensor_id": "adsb"} | POSITION)
    assert sources is None
    assert rows.seen.tolist() == [FIXED, ADSB]
