"""Aircraft that stand on the ground do not inform about biases; those that taxi do."""

import numpy as np
import polars as pl
import pytest

from multiradar.estimation.bias.store import BiasState
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch, sensor_table
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.sensors.sensor import parse_sensors

SENSORS = """\
[[sensor]]
id = "surface"
kind = "radar"
latitude_deg = 50.0
longitude_deg = 10.0
height_m = 300
range_sigma_m = 10
azimuth_sigma_deg = 0.3
rotation_period_s = 1

[[sensor]]
id = "multilateration"
kind = "mlat"
position_sigma_m = 10
"""
#: Error that every plot of a target has by its extent.
EXTENT_M = 25.0


def biases_after(name: str, speed_mps: float) -> BiasState:
    rng, plane = np.random.default_rng(5), SystemPlane(*np.radians([50.0, 10.0]))
    time_s = np.arange(0.0, 120.0)
    east, north = 800.0 + speed_mps * time_s, np.full(len(time_s), 500.0)
    latitude, longitude = plane.to_geodetic(east, north)
    slant, azimuth, _ = slant_range_azimuth(
        (*np.radians([50.0, 10.0]).tolist(), 300.0), latitude, longitude, 300.0
    )
    where = plane.to_geodetic(*(at + rng.normal(0.0, 10.0, 120) for at in (east, north)))
    common = {"mode_s_address": "4ca123", "on_ground": True}
    seen = pl.DataFrame(
        {
            "time_s": time_s,
            "range_m": slant + EXTENT_M + rng.normal(0.0, 10.0, 120),
            "azimuth_deg": np.degrees(azimuth) + rng.normal(0.0, 0.3, 120),
        }
    ).with_columns(sensor_id=pl.lit("surface"), kind=pl.lit("radar"))
    reported = pl.DataFrame(
        {
            "time_s": time_s + 0.5,
            "latitude_deg": np.degrees(where[0]),
            "longitude_deg": np.degrees(where[1]),
        }
    ).with_columns(sensor_id=pl.lit("multilateration"), kind=pl.lit("mlat"))
    rows = pl.concat([seen, reported], how="diagonal").with_columns(
        pl.lit(value).alias(key) for key, value in common.items()
    )
    rows = rows.with_columns(
        pl.lit(None, kind).alias(key)
        for key, kind in MEASUREMENT_SCHEMA.items()
        if key not in rows.columns
    ).select(pl.col(key).cast(kind) for key, kind in MEASUREMENT_SCHEMA.items())
    table = sensor_table(parse_sensors(SENSORS))
    engine = Engine(table, TrackingSettings(filter_name=name))
    batch, rejected = measurement_batch(rows.sort("time_s"), table)
    assert len(rejected) == 0
    engine.push(batch)
    engine.flush()
    state = engine.biases
    engine.close()
    return state


@pytest.mark.parametrize("name", ["imm", "two-stage", "joint"])
def test_a_parked_aircraft_does_not_inform_about_biases(name: str) -> None:
    """Else 120 plots with one common error of 25 m would count as 120 aircraft."""
    parked, taxiing = biases_after(name, 0.0), biases_after(name, 12.0)
    # Until its velocity is known it may seem to move.
    assert (parked.sigma / parked.scale).min() > 0.02
    assert (taxiing.sigma / taxiing.scale).min() < 0.01
    assert taxiing.estimate[0] == pytest.approx(EXTENT_M, abs=10.0)
