"""Seeded scenes: aircraft over WGS 84, seen by turning radars with noise and biases.

Truth and plots are made with geodesy alone; nothing here knows the filters that are judged by it.
Aircraft keep their velocity on the system plane, but for white acceleration where it is asked for.
A bias is measured minus true; the truth of a row is that at its time stamp.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
    SensorTable,
)
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.tracking.measurements import KIND_RADAR, MeasurementBatch

Floats = NDArray[np.float64]

PRIOR_SIGMA = {
    PARAMETER_RANGE_OFFSET: 500.0,
    PARAMETER_AZIMUTH_OFFSET: float(np.radians(0.5)),
    PARAMETER_RANGE_GAIN: 0.002,
    PARAMETER_TIME_OFFSET: 0.5,
}
# Between knots of the path the acceleration is smooth; half a second is short for an aircraft.
KNOT_S = 0.5


@dataclass(frozen=True)
class Radar:
    """A radar and its true biases, by kind of parameter (m, rad, ratio, s); all are estimated."""

    identifier: str
    latitude_deg: float
    longitude_deg: float
    height_m: float = 300.0
    rotation_s: float = 4.0
    range_sigma_m: float = 40.0
    azimuth_sigma_deg: float = 0.06
    biases: Mapping[int, float] = field(default_factory=dict)
    drifts: Mapping[int, float] = field(default_factory=dict)
    detection: float = 1.0
    outliers: float = 0.0
    range_max_m: float = 400_000.0


@dataclass(frozen=True)
class Flight:
    """An aircraft from its birth to its death: state on the system plane at the birth."""

    start_s: float
    end_s: float
    state: tuple[float, float, float, float]
    height_m: float = 9_000.0
    acceleration_density: float = 0.0
    reports_height: bool = True


@dataclass(frozen=True)
class Scene:
    """Plots in the order of their time stamps, and the truth of each.

    `aircraft` is the index of the flight of each row, `truth` its state (n, 4) on the plane,
    `outlier` marks plots that show nothing; `bias_values` (t, c) are the true biases at
    `bias_times`, in the order of the sensor table.
    """

    plane: SystemPlane
    sensors: SensorTable
    batch: MeasurementBatch
    aircraft: NDArray[np.int64]
    truth: Floats
    outlier: NDArray[np.bool_]
    bias_times: Floats
    bias_values: Floats

    def biases_at(self, time_s: float) -> Floats:
        """The true biases (c,) at a time."""
        return np.array(
            [np.interp(time_s, self.bias_times, column) for column in self.bias_values.T]
        )


# True biases, (t, c) at times (t,).
@dataclass(frozen=True)
class _Walk:
    times: Floats
    values: Floats


def make_scene(
    rng: np.random.Generator, radars: Sequence[Radar], flights: Sequence[Flight]
) -> Scene:
    """Fly the flights, turn the radars, and gather what they see."""
    radars = sorted(radars, key=lambda radar: radar.identifier)
    sensors = sensor_table(radars)
    plane = SystemPlane.for_sensors(sensors.latitude_rad, sensors.longitude_rad)
    end = max(flight.end_s for flight in flights) + 10.0
    bias_times = np.arange(min(flight.start_s for flight in flights) - 10.0, end, 1.0)
    bias_values = _walk(rng, radars, len(bias_times))
    paths = [fly(rng, flight) for flight in flights]
    walk = _Walk(bias_times, bias_values)
    rows = [
        _see(rng, index, radar, (flight, path), plane=plane, sensors=sensors, walk=walk)
        | {"aircraft": np.array(one)}
        for index, radar in enumerate(radars)
        for one, (flight, path) in enumerate(zip(flights, paths, strict=True))
    ]
    columns = {
        name: np.concatenate([np.broadcast_to(row[name], row["time_s"].shape) for row in rows])
        for name in rows[0]
        if name != "truth"
    }
    order = np.argsort(columns["time_s"], kind="stable")
    truth = np.concatenate([row["truth"] for row in rows])[order]
    columns = {name: column[order] for name, column in columns.items()}
    return Scene(
        plane, sensors, _batch(columns), columns["aircraft"].astype(np.int64), truth,
        columns["outlier"].astype(bool), bias_times, bias_values,
    )  # fmt: skip


def flat_sites(plane: SystemPlane, sensors: SensorTable) -> Floats:
    """East and north (m, 2) of the sensors on the system plane."""
    return np.column_stack(plane.to_plane(sensors.latitude_rad, sensors.longitude_rad))


def flattened(rng: np.random.Generator, scene: Scene) -> Scene:
    """The same rows as on a flat plane: range and azimuth there, with new noise."""
    sensors, batch = scene.sensors, scene.batch
    line = scene.truth[:, :2] - flat_sites(scene.plane, sensors)[batch.sensor]
    length = np.hypot(*line.T)
    radial = np.sum(line * scene.truth[:, 2:], axis=1) / length
    across = (line[:, 1] * scene.truth[:, 2] - line[:, 0] * scene.truth[:, 3]) / length**2
    count = len(batch)
    measured = length + sensors.range_sigma_m[batch.sensor] * rng.normal(size=count)
    pointed = np.arctan2(*line.T) + sensors.azimuth_sigma_rad[batch.sensor] * rng.normal(size=count)
    biases = np.array(
        [np.interp(batch.time_s, scene.bias_times, one) for one in scene.bias_values.T]
    ).reshape(len(sensors.parameter_kind), count)
    for one, sensor, kind in zip(
        biases, sensors.parameter_sensor, sensors.parameter_kind, strict=True
    ):
        own = one * (batch.sensor == sensor)
        if kind == PARAMETER_TIME_OFFSET:
            measured -= own * radial
            pointed -= own * across
        elif kind == PARAMETER_AZIMUTH_OFFSET:
            pointed += own
        else:
            measured += own * (length if kind == PARAMETER_RANGE_GAIN else 1.0)
    plots = replace(batch, range_m=measured, azimuth_rad=np.mod(pointed, 2.0 * np.pi))
    return replace(scene, batch=plots)


def sensor_table(radars: Sequence[Radar]) -> SensorTable:
    """The sensors as the service knows them: sites and sigmas, not the biases."""
    kinds = [(index, kind) for index, one in enumerate(radars) for kind in sorted(one.biases)]
    return SensorTable(
        ids=tuple(radar.identifier for radar in radars),
        kinds=np.full(len(radars), KIND_RADAR, np.int8),
        latitude_rad=np.radians([radar.latitude_deg for radar in radars]),
        longitude_rad=np.radians([radar.longitude_deg for radar in radars]),
        height_m=np.array([radar.height_m for radar in radars]),
        range_sigma_m=np.array([radar.range_sigma_m for radar in radars]),
        azimuth_sigma_rad=np.radians([radar.azimuth_sigma_deg for radar in radars]),
        position_sigma_m=np.full(len(radars), 30.0),
        range_max_m=np.array([radar.range_max_m for radar in radars]),
        rotation_period_s=np.array([radar.rotation_s for radar in radars]),
        parameter_sensor=np.array([index for index, _ in kinds], np.int32),
        parameter_kind=np.array([kind for _, kind in kinds], np.int8),
        prior_mean=np.zeros(len(kinds)),
        prior_sigma=np.array([PRIOR_SIGMA[kind] for _, kind in kinds]),
        drift=np.array([radars[index].drifts.get(kind, 0.0) for index, kind in kinds]),
    )


def fly(rng: np.random.Generator, flight: Flight) -> CubicHermiteSpline:
    """The path of a flight: time to (east, north); white acceleration integrated exactly."""
    count = int(np.ceil((flight.end_s - flight.start_s) / KNOT_S)) + 2
    density = flight.acceleration_density
    jumps = np.sqrt(density * KNOT_S) * rng.normal(size=(count - 1, 2))
    apart = np.sqrt(density * KNOT_S**3 / 12.0) * rng.normal(size=(count - 1, 2))
    speed = np.vstack([np.zeros((1, 2)), np.cumsum(jumps, axis=0)]) + flight.state[2:]
    moves = (speed[:-1] + jumps / 2.0) * KNOT_S + apart
    place = np.vstack([np.zeros((1, 2)), np.cumsum(moves, axis=0)]) + flight.state[:2]
    return CubicHermiteSpline(flight.start_s + KNOT_S * np.arange(count), place, speed)


def random_flights(
    rng: np.random.Generator,
    count: int,
    duration_s: float,
    *,
    extent_m: float = 150_000.0,
    acceleration_density: float = 0.0,
    lives_differ: bool = False,
) -> list[Flight]:
    """Flights at 150 to 250 m/s anywhere within ± extent; with births and deaths if they differ."""
    flights = []
    for _ in range(count):
        course, speed = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(150.0, 250.0)
        east, north = rng.uniform(-extent_m, extent_m, 2)
        start, end = 0.0, duration_s
        if lives_differ:
            start = rng.uniform(0.0, 0.4) * duration_s
            end = rng.uniform(0.6, 1.0) * duration_s
        velocity = speed * np.sin(course), speed * np.cos(course)
        flights.append(
            Flight(
                start, end, (east, north, *velocity), rng.uniform(3e3, 12e3), acceleration_density
            )
        )
    return flights


def three_radars() -> list[Radar]:
    """Three radars about 200 km apart with range and azimuth offsets of both signs."""
    places = [("A", 55.9, 60.2, 310.0), ("B", 57.4, 61.9, 240.0), ("C", 55.6, 63.3, 180.0)]
    offsets = [(400.0, -0.19), (130.0, -0.16), (-300.0, 0.17)]
    return [
        Radar(
            *place,
            rotation_s=period,
            biases={
                PARAMETER_RANGE_OFFSET: metres,
                PARAMETER_AZIMUTH_OFFSET: float(np.radians(degrees)),
            },
        )
        for place, period, (metres, degrees) in zip(places, (4.9, 4.0, 6.0), offsets, strict=True)
    ]


# The random walk of all biases, a value a second.
def _walk(rng: np.random.Generator, radars: Sequence[Radar], count: int) -> Floats:
    columns = []
    for radar in radars:
        for kind in sorted(radar.biases):
            steps = rng.normal(size=count) * radar.drifts.get(kind, 0.0)
            columns.append(radar.biases[kind] + np.cumsum(steps) - steps[0])
    return np.array(columns).reshape(len(columns), count).T


# All plots of one flight by one radar, as columns.
def _see(
    rng: np.random.Generator,
    index: int,
    radar: Radar,
    flown: tuple[Flight, CubicHermiteSpline],
    *,
    plane: SystemPlane,
    sensors: SensorTable,
    walk: "_Walk",
) -> dict[str, NDArray[np.generic]]:
    flight, path = flown
    site = (sensors.latitude_rad[index], sensors.longitude_rad[index], radar.height_m)

    def look(time_s: Floats) -> tuple[Floats, Floats]:
        latitude, longitude = plane.to_geodetic(*path(time_s).T)
        return slant_range_azimuth(site, latitude, longitude, flight.height_m)[:2]

    turns = np.arange(np.ceil((flight.end_s - flight.start_s) / radar.rotation_s))
    north = flight.start_s + radar.rotation_s * (turns + rng.uniform())
    time_s = np.minimum(north, flight.end_s)
    for _ in range(3):  # The antenna meets the aircraft, which moves on meanwhile.
        time_s = north + radar.rotation_s * look(time_s)[1] / (2.0 * np.pi)
        time_s = np.minimum(time_s, flight.end_s)
    own = np.flatnonzero(sensors.parameter_sensor == index)
    bias = dict.fromkeys(PRIOR_SIGMA, np.zeros(len(time_s)))
    for column in own:
        kind = int(sensors.parameter_kind[column])
        bias[kind] = np.interp(time_s, walk.times, walk.values[:, column])
    stamp = time_s + bias[PARAMETER_TIME_OFFSET]
    slant, azimuth = look(time_s)
    count, outlier = len(time_s), rng.uniform(size=len(time_s)) < radar.outliers
    measured = slant * (1.0 + bias[PARAMETER_RANGE_GAIN]) + bias[PARAMETER_RANGE_OFFSET]
    measured += radar.range_sigma_m * rng.normal(size=count)
    measured += outlier * rng.choice([-1.0, 1.0], count) * rng.uniform(2e3, 2e4, count)
    pointed = azimuth + bias[PARAMETER_AZIMUTH_OFFSET]
    pointed += np.radians(radar.azimuth_sigma_deg) * rng.normal(size=count)
    pointed += outlier * rng.uniform(-0.2, 0.2, count)
    seen = (rng.uniform(size=count) < radar.detection) & (measured > 0.0)
    seen &= (slant < radar.range_max_m) & (time_s < flight.end_s)
    seen &= (stamp >= flight.start_s) & (stamp <= flight.end_s)
    height = flight.height_m if flight.reports_height else np.nan
    return {
        "time_s": stamp[seen],
        "sensor": np.array(index),
        "range_m": measured[seen],
        "azimuth_rad": np.mod(pointed[seen], 2.0 * np.pi),
        "height_m": np.array(height),
        "outlier": outlier[seen],
        "truth": np.hstack([path(stamp[seen]), path(stamp[seen], 1)]),
    }


def _batch(columns: Mapping[str, NDArray[np.generic]]) -> MeasurementBatch:
    aircraft = columns["aircraft"].astype(np.int64)
    none = np.full(len(aircraft), np.nan)
    return MeasurementBatch(
        time_s=columns["time_s"].astype(np.float64),
        sensor=columns["sensor"].astype(np.int32),
        kind=np.full(len(aircraft), KIND_RADAR, np.int8),
        range_m=columns["range_m"].astype(np.float64),
        azimuth_rad=columns["azimuth_rad"].astype(np.float64),
        latitude_rad=none,
        longitude_rad=none,
        height_m=columns["height_m"].astype(np.float64),
        mode_3a=(0o1000 + aircraft).astype(np.int32),
        mode_s_address=0x400000 + aircraft,
        track_number=aircraft + 1,
    )
