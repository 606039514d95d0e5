"""Reports and plots with an accuracy of their own are compared with that accuracy."""

import numpy as np
import polars as pl

from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.outputs import TrackUpdates
from multiradar.tracking.settings import TrackingSettings
from multiradar.wire import measurement_batch, sensor_table, tracks_frame
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.sensors.sensor import SensorsFile
from support.scenarios.moving_scene import PLANE

RADARS = {"41-10": (49.9, 14.4, 400.0), "41-20": (49.6, 15.8, 300.0)}
SMALL_BIASES = {
    "range_offset_m": {"prior_sigma": 20.0}, "azimuth_offset_deg": {"prior_sigma": 0.02},
}  # fmt: skip
TABLE = sensor_table(
    SensorsFile.model_validate(
        {
            "sensor": (
                *(
                    {
                        "id": name, "kind": "radar", "latitude_deg": one[0],
                        "longitude_deg": one[1], "height_m": one[2], "bias": SMALL_BIASES,
                    }
                    for name, one in RADARS.items()
                ),
                {"id": "adsb", "kind": "adsb"},
                *({"id": name, "kind": "mlat"} for name in ("mlat-1", "mlat-2")),
            )
        }
    )
)  # fmt: skip
#: Of NACp 5: 95 % of the positions are within 0.5 NM.
COARSE_M = 378.0
HEIGHT_M = 9000.0


def _times(sensor: str) -> np.ndarray:
    first, period = {
        "adsb": (0.0, 1.0), "41-10": (0.4, 5.0), "41-20": (1.7, 5.0), "mlat-1": (0.3, 2.0),
        "mlat-2": (1.1, 2.0),
    }[sensor]  # fmt: skip
    return np.arange(first, 90.0, period)


def _seen(
    sensor: str, rng: np.random.Generator, *, error_m: float = 30.0, sigma_m: float | None = None,
    wrong_m: float = 0.0,
) -> pl.DataFrame:  # fmt: skip
    """Return what a sensor measures of an aircraft, and of the accuracy that it reports."""
    time_s = _times(sensor)
    count = len(time_s)
    path_m = np.array([-20e3, 15e3]) + time_s[:, None] * [190.0, 60.0]
    columns: dict[str, object] = {
        "time_s": 1000.0 + time_s, "sensor_id": [sensor] * count, "track_number": [7] * count,
        "height_m": np.full(count, HEIGHT_M),
    }  # fmt: skip
    if sensor in RADARS:
        latitude, longitude, height = RADARS[sensor]
        site = np.radians(latitude), np.radians(longitude), height
        feet = PLANE.to_geodetic(*path_m.T)
        slant, azimuth, _ = slant_range_azimuth(site, *feet, np.full(count, HEIGHT_M))
        columns |= {
            "kind": ["radar"] * count,
            "range_m": slant + 50.0 * rng.standard_normal(count),
            "azimuth_deg": np.degrees(azimuth) + 0.06 * rng.standard_normal(count),
        }
    else:
        off_m = error_m * rng.standard_normal((count, 2)) + np.array([0.0, wrong_m])
        latitude_rad, longitude_rad = PLANE.to_geodetic(*(path_m + off_m).T)
        columns |= {
            "kind": [sensor.partition("-")[0]] * count,
            "latitude_deg": np.degrees(latitude_rad), "longitude_deg": np.degrees(longitude_rad),
            "position_sigma_m": [sigma_m] * count,
        }  # fmt: skip
    missing = {name: [None] * count for name in MEASUREMENT_SCHEMA if name not in columns}
    return pl.DataFrame(columns | missing, schema_overrides=dict(MEASUREMENT_SCHEMA)).select(
        list(MEASUREMENT_SCHEMA)
    )


def _flagged(*parts: pl.DataFrame) -> tuple[float, int]:
    """Return the share of updates with implausible reports, and the reports used."""
    batch, rejected = measurement_batch(pl.concat(parts).sort("time_s"), TABLE)
    assert not len(rejected)
    engine = Engine(TABLE, TrackingSettings(filter_name="two-stage"))
    outputs = [engine.push(batch), engine.flush()]
    tracks = tracks_frame(TrackUpdates.concatenate([one.updates for one in outputs]), TABLE)
    implausible = tracks["adsb_implausible"].to_numpy().astype(np.float64)
    return float(implausible.mean()), len(tracks.filter(pl.col("sensor_id") == "adsb"))


def test_reports_as_wrong_as_they_say_are_plausible() -> None:
    rng = np.random.default_rng(5)
    radars = [_seen(name, rng) for name in RADARS]
    share, used = _flagged(*radars, _seen("adsb", rng, error_m=COARSE_M, sigma_m=COARSE_M))
    assert share == 0.0
    assert used > 80


def test_reports_more_wrong_than_they_say_are_implausible() -> None:
    rng = np.random.default_rng(6)
    radars = [_seen(name, rng) for name in RADARS]
    for wrong_m, sigma_m in ((800.0, None), (800.0, 30.0), (4000.0, COARSE_M)):
        reports = _seen("adsb", rng, error_m=sigma_m or 30.0, sigma_m=sigma_m, wrong_m=wrong_m)
        assert _flagged(*radars, reports)[0] > 0.7


def test_reports_are_compared_with_the_accuracy_of_multilateration() -> None:
    rng = np.random.default_rng(7)
    reports = _seen("adsb", rng)
    coarse = [_seen(name, rng, error_m=500.0, sigma_m=500.0) for name in ("mlat-1", "mlat-2")]
    assert _flagged(*coarse, reports)[0] == 0.0
    off = [_seen(name, rng, wrong_m=600.0, sigma_m=30.0) for name in ("mlat-1", "mlat-2")]
    assert _flagged(*off, reports)[0] > 0.5


def test_reports_that_become_accurate_are_plausible() -> None:
    rng = np.random.default_rng(8)
    parts = []
    for error_m, later in ((COARSE_M, False), (10.0, True)):
        one = _seen("adsb", rng, error_m=error_m, sigma_m=error_m)
        # Every other ten seconds.
        parts.append(one.filter(((pl.col("time_s") // 10.0) % 2.0 == 1.0) == later))
    radars = [_seen(name, rng) for name in RADARS]
    assert _flagged(*radars, *parts)[0] == 0.0
