"""The compiled filters in nanoseconds a plot, for few and many aircraft, few and many radars."""

from dataclasses import dataclass
from itertools import product
from time import perf_counter

import numpy as np

from benchmark.report import Row
from multiradar.estimation.bias.book import BiasBook
from multiradar.estimation.filters._kernels import READOUT_COUNT
from multiradar.estimation.filters._separated_kernels import LOG_COUNT
from multiradar.estimation.filters.arrays import Result, Rows
from multiradar.estimation.filters.bank import FILTERS, FilterDefinition
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy._kernels import predict_polar, site_parameters
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.tracking.model import filter_model
from multiradar.tracking.pool import PARTITIONS, AircraftPool
from multiradar.tracking.settings import TrackingSettings

AIRCRAFT = (150, 15_000)
RADARS = (3, 8)
SCANS = 4
REPEATS = 5


@dataclass(frozen=True)
class Load:
    """Every radar sees every aircraft once a scan, in an order that mixes both."""

    sensors: SensorTable
    plane: SystemPlane
    rows: Rows


def run() -> list[Row]:
    """Measure all filters; each row compares with the same filter at 150 aircraft."""
    rows = []
    for (name, definition), radars in product(FILTERS.items(), RADARS):
        base = None
        for aircraft in AIRCRAFT:
            cost = nanoseconds(definition, make_load(aircraft, radars))
            label = f"{name}, {aircraft} aircraft, {radars} radars"
            peer = None if base is None else f"{name}, {AIRCRAFT[0]} aircraft, {radars} radars"
            rows.append(Row(label, cost, "ns/plot", peer, base))
            base = cost if base is None else base
    return rows


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
        np.full(len(slot), 9000.0),
    )  # fmt: skip
    return Load(sensors, plane, rows)


def nanoseconds(definition: FilterDefinition, load: Load) -> float:
    """Time the step over all rows in one thread, the aircraft already under way."""
    columns = len(load.sensors.parameter_kind)
    pool = AircraftPool(columns if definition.keeps_sensitivity else 0)
    while len(pool.aircraft.time) <= load.rows.slot.max():
        pool.grow()
    model = filter_model(
        load.sensors, TrackingSettings(), load.plane, BiasBook(load.sensors, definition).state
    )
    count = len(load.rows.slot)
    result = Result(
        np.zeros((PARTITIONS, columns, columns)), np.zeros((PARTITIONS, columns)),
        np.zeros((count, LOG_COUNT)), np.zeros(count, np.int64), np.zeros((count, READOUT_COUNT)),
    )  # fmt: skip
    _, work = pool.work(load.rows.slot, 0)
    best = np.inf
    for repeat in range(REPEATS + 1):
        pool.aircraft.time[:] = np.where(np.isnan(pool.aircraft.time), np.nan, 0.0)
        begin = perf_counter()
        definition.step(work, load.rows, model, pool.aircraft, result, want_readout=False)
        if repeat:
            best = min(best, perf_counter() - begin)
    return best / count * 1e9


def _sensors(latitude_deg: np.ndarray, longitude_deg: np.ndarray) -> SensorTable:  # type: ignore[type-arg]
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
