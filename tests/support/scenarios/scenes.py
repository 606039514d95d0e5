"""Seeded scenes: aircraft over WGS 84, seen by turning radars with noise and biases.

They are made by `multiradar.simulation`, which is independent of the filters evaluated with
it; here they become what the core takes. Aircraft keep their velocity on the system plane, but for
white acceleration where it is asked for. A bias is measured minus true; the truth of a row is that
at its time stamp.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
    PARAMETER_TIME_OFFSET,
    SensorTable,
)
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.simulation.observation.measurements import Measurements
from multiradar.simulation.observation.observe import observe
from multiradar.simulation.scenario import model as simulated
from multiradar.tracking.input.measurements import MeasurementBatch
from validation.motion.check_manoeuvres import batch

Floats = NDArray[np.float64]

PRIOR_SIGMA = {
    PARAMETER_RANGE_OFFSET: 500.0,
    PARAMETER_AZIMUTH_OFFSET: float(np.radians(0.5)),
    PARAMETER_RANGE_GAIN: 0.002,
    PARAMETER_TIME_OFFSET: 0.5,
}


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
    legs: tuple[simulated.Leg, ...] = ()


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


def make_scene(
    rng: np.random.Generator, radars: Sequence[Radar], flights: Sequence[Flight]
) -> Scene:
    """Fly the flights, turn the radars, and gather what they see."""
    radars = sorted(radars, key=lambda radar: radar.identifier)
    sensors = sensor_table(radars)
    plane = SystemPlane.for_sensors(sensors.latitude_rad, sensors.longitude_rad)
    sites = flat_sites(plane, sensors)
    scene = simulated.Scenario(
        title="", seed=0, duration_s=max(flight.end_s for flight in flights), plane="wgs84",
        centre_rad=(plane.latitude_rad, plane.longitude_rad), traffic=(),
        aircraft=tuple(flier(number, one) for number, one in enumerate(flights, start=1)),
        sensors=tuple(_sensor(*one) for one in zip(radars, sites.tolist(), strict=True)),
    )  # fmt: skip
    seen = observe(scene, rng)
    rows = seen.measurements
    return Scene(
        plane, sensors, batch(rows), rows.aircraft.astype(np.int64), _states(plane, rows),
        rows.outlier, seen.biases.time_s,
        seen.biases.values[:, sensors.parameter_sensor, sensors.parameter_kind],
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


def flier(number: int, flight: Flight) -> simulated.Aircraft:
    """The aircraft of a flight."""
    east, north, east_rate, north_rate = flight.state
    return simulated.Aircraft(
        number, east, north, flight.height_m, float(np.hypot(east_rate, north_rate)),
        float(np.arctan2(east_rate, north_rate)), flight.start_s, flight.end_s,
        acceleration_density=flight.acceleration_density, reports_height=flight.reports_height,
        legs=flight.legs,
    )  # fmt: skip


def _sensor(radar: Radar, site: tuple[float, float]) -> simulated.Sensor:
    return simulated.Sensor(
        radar.identifier, "radar", *site, radar.height_m, radar.range_sigma_m,
        float(np.radians(radar.azimuth_sigma_deg)), rotation_period_s=radar.rotation_s,
        range_max_m=radar.range_max_m, detection_probability=radar.detection,
        outlier_probability=radar.outliers,
        biases=tuple(
            simulated.Bias(radar.biases.get(kind, 0.0), radar.drifts.get(kind, 0.0))
            for kind in range(simulated.PARAMETERS)
        ),
    )  # fmt: skip


# States on the plane: the true velocity at the aircraft turned back into that of its foot.
def _states(plane: SystemPlane, rows: Measurements) -> Floats:
    east, north = plane.to_plane(rows.true_latitude_rad, rows.true_longitude_rad)
    heading = np.stack([np.sin(rows.true_heading_rad), np.cos(rows.true_heading_rad)], axis=-1)
    matrix = plane.local_matrix(east, north, rows.true_height_m)
    velocity = np.linalg.solve(matrix, (rows.true_speed_mps[:, None] * heading)[..., None])
    return np.column_stack([east, north, velocity[..., 0]])
