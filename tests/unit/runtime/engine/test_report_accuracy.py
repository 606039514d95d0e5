"""Accuracies of single reports are used as their noise, by every filter that weighs reports."""

import numpy as np
import polars as pl
import pytest

from multiradar.evaluation.smoothing.reference import smoothed_reference
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.runtime.engine.plot_rows import plot_rows
from multiradar.runtime.trajectories.plots import PLOT_DTYPE
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch, sensor_table
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.sensors.sensor import parse_sensors

SENSORS = """
[[sensor]]
id = "reports"
kind = "mlat"
latitude_deg = 47.0
longitude_deg = 8.0
height_m = 0.0
position_sigma_m = 100.0
"""
NORTH_M = 111_176.0
SPEED_MPS = 150.0
SIGMAS_M = (5.0, 200.0)
COUNT, SETTLED = 300, 100


def flight(*, accuracies: bool) -> tuple[pl.DataFrame, np.ndarray]:
    """Fly north; one report in three is accurate. Return reports and true latitudes, degrees."""
    random = np.random.default_rng(3)
    time_s = np.arange(float(COUNT))
    sigma_m = random.choice(SIGMAS_M, COUNT, p=[1 / 3, 2 / 3])
    east_m, north_m = random.normal(size=(2, COUNT)) * sigma_m
    truth = 47.0 + SPEED_MPS * time_s / NORTH_M
    frame = pl.DataFrame(
        {
            "time_s": time_s, "sensor_id": "reports", "kind": "mlat",
            "latitude_deg": truth + north_m / NORTH_M,
            "longitude_deg": 8.0 + east_m / (NORTH_M * np.cos(np.radians(truth))),
            "height_m": 9000.0, "mode_s_address": "3c660c",
            "position_sigma_m": sigma_m if accuracies else None,
        }
    )  # fmt: skip
    absent = {
        name: pl.lit(None, kind)
        for name, kind in MEASUREMENT_SCHEMA.items()
        if name not in frame.columns
    }
    return frame.with_columns(**absent).cast(MEASUREMENT_SCHEMA), truth


def errors(name: str, *, accuracies: bool) -> tuple[float, float]:
    """Return the RMS error of the latitude, m, and the mean of error² / sigma²."""
    frame, truth = flight(accuracies=accuracies)
    table = sensor_table(parse_sensors(SENSORS))
    batch, rejected = measurement_batch(frame, table)
    assert not len(rejected)
    engine = Engine(table, TrackingSettings(filter_name=name))
    outputs = [engine.push(batch), engine.flush()]
    engine.close()
    updates = [one.updates for one in outputs]
    time_s = np.concatenate([one.time_s for one in updates])
    latitude = np.degrees(np.concatenate([one.latitude_rad for one in updates]))
    sigma_m = np.concatenate([one.position_sigma_m for one in updates])
    late = time_s >= SETTLED
    error_m = (latitude - truth[time_s.astype(int)])[late] * NORTH_M
    # `position_sigma_m` is of both axes.
    ratio = float(np.mean(2.0 * error_m**2 / sigma_m[late] ** 2))
    return float(np.sqrt(np.mean(error_m**2))), ratio


@pytest.mark.parametrize("name", ["two-stage", "imm", "joint", "blom", "ci"])
def test_accurate_reports_weigh_more(name: str) -> None:
    plain, _ = errors(name, accuracies=False)
    weighed, ratio = errors(name, accuracies=True)
    assert weighed < 0.5 * plain
    assert 0.3 < ratio < 1.6


@pytest.mark.parametrize("name", ["two-stage", "imm", "joint"])
def test_unknown_heights_are_estimated_with_the_accuracy_of_reports(name: str) -> None:
    """No sensor knows the height: it follows from the ranges where the reports say it is."""
    radar = """
[[sensor]]
id = "radar"
kind = "radar"
latitude_deg = 47.0
longitude_deg = 8.2
height_m = 0.0
"""
    reports, truth = flight(accuracies=False)
    site = np.radians(47.0), np.radians(8.2), 0.0
    feet = np.radians(truth), np.full(COUNT, np.radians(8.0))
    slant_m, azimuth_rad, _ = slant_range_azimuth(site, *feet, np.full(COUNT, 9000.0))
    plots = reports.with_columns(
        pl.col("time_s") + 0.5, sensor_id=pl.lit("radar"), kind=pl.lit("radar"),
        range_m=pl.Series(slant_m), azimuth_deg=pl.Series(np.degrees(azimuth_rad)),
        latitude_deg=pl.lit(None, pl.Float64), longitude_deg=pl.lit(None, pl.Float64),
    )  # fmt: skip
    found = []
    for sensor_sigma_m, sigma_m in ((500.0, None), (100.0, 500.0)):
        known = reports.with_columns(position_sigma_m=pl.lit(sigma_m, pl.Float64))
        frame = pl.concat([known, plots]).with_columns(height_m=pl.lit(None, pl.Float64))
        sensors = SENSORS.replace("100.0", str(sensor_sigma_m)) + radar
        table = sensor_table(parse_sensors(sensors))
        batch, _ = measurement_batch(frame.sort("time_s").head(120), table)
        engine = Engine(table, TrackingSettings(filter_name=name))
        updates = [one.updates for one in (engine.push(batch), engine.flush())]
        engine.close()
        columns = ("latitude_rad", "height_m", "position_sigma_m", "height_sigma_m")
        parts = [[getattr(one, column) for one in updates] for column in columns]
        found.append(np.array([np.concatenate(part) for part in parts]))
    assert found[0].shape[1] > 100
    np.testing.assert_allclose(found[1], found[0], rtol=1e-9)


@pytest.mark.parametrize("accuracies", [True, False])
def test_rows_of_trajectories_and_windows_keep_accuracies(*, accuracies: bool) -> None:
    frame, _ = flight(accuracies=accuracies)
    table = sensor_table(parse_sensors(SENSORS))
    engine = Engine(table, TrackingSettings())
    output = engine.push(measurement_batch(frame, table)[0])
    engine.close()
    known = dict(frame.select("time_s", "position_sigma_m").iter_rows())
    for rows in (plot_rows(output), plot_rows(output, PLOT_DTYPE)):
        assert len(rows) > SETTLED
        expected = [known[time_s] if accuracies else np.nan for time_s in rows["time_s"]]
        np.testing.assert_array_equal(rows["position_sigma_m"], expected)


def test_a_smoothed_reference_weighs_accurate_reports_more() -> None:
    off_m = {}
    for accuracies in (True, False):
        frame, truth = flight(accuracies=accuracies)
        sensors = parse_sensors(SENSORS).sensor
        found = smoothed_reference(frame, sensors, (), source="reports", density=0.1, gap_s=60.0)
        reference = found.reference
        latitude, _ = reference.plane.to_geodetic(*reference.position_m.T)
        error_m = (np.degrees(latitude) - truth[reference.time_s.astype(int)]) * NORTH_M
        off_m[accuracies] = float(np.sqrt(np.mean(error_m**2)))
    assert off_m[True] < 0.5 * off_m[False]
