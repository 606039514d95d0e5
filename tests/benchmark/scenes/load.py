"""Many aircraft and a ring of radars, as rows for the compiled filters."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.arrays import Rows
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy._kernels import predict_polar, site_parameters
from multiradar.geodesy.system_plane import SystemPlane

SCANS = 4


@dataclass(frozen=True)
class Load:
    """Every radar detects every aircraft once per scan, in mixed order."""

    sensors: SensorTable
    plane: SystemPlane
    rows: Rows
    position: NDArray[np.float64]


def make_load(aircraft: int, radars: int, seed: int = 1) -> Load:
    """Aircraft spread over 600 km, radars on a ring of 150 km, plots with noise."""
    rng = np.random.default_rng(seed)
    turn = np.arange(radars) / radars * 2.0 * np.pi
    sensors = _sensors(47.0 + 1.35 * np.cos(turn), 8.0 + 2.0 * np.sin(turn))
    plane = SystemPlane.for_sensors(sensors.latitude_rad, sensors.longitude_rad)
    sites = [
        site_parameters(plane.parameters, latitude, longitude, 500.0)
        for latitude, longitude in zip(sensors.latitude_rad, sensors.longitude_rad, strict=True)
    ]
    position = rng.uniform(-300e3, 300e3, (aircraft, 2))
    velocity = rng.normal(0.0, 150.0, (aircraft, 2))
    sightings = rng.permutation(np.tile(np.arange(aircraft * radars), 1))
    slot, sensor = np.divmod(np.tile(sightings, SCANS), radars)
    time = np.sort(rng.uniform(0.0, 4.0 * SCANS, len(slot)))
    z = np.empty((len(slot), 2))
    for row in range(len(slot)):
        east, north = position[slot[row]] + velocity[slot[row]] * time[row]
        z[row] = predict_polar(plane.parameters, sites[sensor[row]], east, north, 9000.0)[:2]
    z += rng.normal(size=z.shape) * np.array([40.0, 0.001])
    rows = Rows(
        slot.astype(np.int64), time, np.zeros(len(slot), np.int64), sensor.astype(np.int64), z,
        np.full(len(slot), 9000.0), sensor.astype(np.int64), np.full(len(slot), -1, np.int64),
    )  # fmt: skip
    return Load(sensors, plane, rows, position)


def _sensors(latitude_deg: NDArray[np.float64], longitude_deg: NDArray[np.float64]) -> SensorTable:
    count = len(latitude_deg)
    return SensorTable(
        ids=tuple(f"{index:02d}" for index in range(count)),
        kinds=np.zeros(count, np.int8),
        latitude_rad=np.radians(latitude_deg),
        longitude_rad=np.radians(longitude_deg),
        height_m=np.full(count, 500.0),
        range_sigma_m=np.full(count, 40.0),
        azimuth_sigma_rad=np.full(count, 0.001),
        position_sigma_m=np.full(count, 30.0),
        range_max_m=np.full(count, 1e6),
        rotation_period_s=np.full(count, 4.0),
        parameter_sensor=np.repeat(np.arange(count), 2).astype(np.int32),
        parameter_kind=np.tile([0, 1], count).astype(np.int8),
        prior_mean=np.zeros(2 * count),
        prior_sigma=np.tile([500.0, 0.0087], count),
        drift=np.zeros(2 * count),
    )
