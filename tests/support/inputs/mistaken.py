"""A simulated recording of three radars into which mistakes are introduced."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar import wire
from multiradar.diagnosis.evidence import Evidence
from multiradar.diagnosis.findings import diagnose
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import ground_range
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar.tracking.outputs import TrackPlots
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile

Floats = NDArray[np.float64]

START_S = 1_533_110_400.0
DURATION_S = 240.0
#: Site, scan period, biases of range (m) and azimuth (degrees) of each radar.
RADARS = {
    "1-10": ((46.4, 6.1, 1600.0), 4.9, (180.0, -0.19)),
    "2-10": ((47.5, 8.4, 800.0), 4.0, (-120.0, 0.17)),
    "3-10": ((45.6, 8.7, 200.0), 6.0, (60.0, -0.08)),
}
SIGMAS = (40.0, 0.06)
METRES_PER_DEGREE = 111_195.0


@dataclass(frozen=True)
class Recording:
    """Measurements with the sensors file that is given for them."""

    frame: pl.DataFrame
    sensors: tuple[Sensor, ...]

    def changed(self, *names: str, **columns: pl.Expr) -> "Recording":
        """Return it with other columns in the plots of some sensors."""
        chosen = pl.col("sensor_id").is_in(names)
        edited = [
            pl.when(chosen).then(one).otherwise(pl.col(name)).alias(name)
            for name, one in columns.items()
        ]
        return replace(self, frame=self.frame.with_columns(edited))

    def configured(self, name: str, **values: object) -> "Recording":
        """Return it with other settings of a sensor."""
        sensors = tuple(
            Sensor.model_validate({**one.model_dump(exclude_none=True), **values})
            if one.id == name
            else one
            for one in self.sensors
        )
        return replace(self, sensors=sensors)

    def only(self, *names: str) -> "Recording":
        """Return it with some sensors alone."""
        return Recording(
            self.frame.filter(pl.col("sensor_id").is_in(names)),
            tuple(one for one in self.sensors if one.id in names),
        )

    def table(self) -> SensorTable:
        """Return the sensor table."""
        return wire.sensor_table(SensorsFile(sensor=self.sensors))

    def evidence(self, tracks: NDArray[np.int64] | None = None) -> Evidence:
        """Return what a run retains when everything valid is accepted, and updates these tracks."""
        evidence = Evidence(self.table())
        measured, rejected = wire.measurement_batch(self.frame, evidence.sensors)
        evidence.record_batch(self.frame, rejected, measured, np.zeros(len(measured), np.int8))
        if tracks is not None:
            evidence.record_plots(TrackPlots(tracks, measured))
        evidence.confirmed = True
        return evidence

    def diagnosed(self, tracks: NDArray[np.int64] | None = None) -> list[Diagnosis]:
        """Return its diagnoses."""
        return diagnose(self.evidence(tracks))

    def codes(self) -> list[tuple[str, str]]:
        """Return the sensor and the code of each diagnosis."""
        return [(one.sensor_id, one.code) for one in self.diagnosed()]


@cache
def recording(
    seed: int = 1, aircraft: int = 25, *, positions: bool = False, named: bool = True,
    anticlockwise: tuple[str, ...] = (),
) -> Recording:  # fmt: skip
    """Return plots of straight flights, as each radar measures them.

    Parameters
    ----------
    seed : int
        Of flights and noise.
    aircraft : int
        How many.
    positions : bool
        Whether the plots have the position of the aircraft beside them, as dumps have.
    named : bool
        Whether plots name their aircraft.
    anticlockwise : tuple of str
        The radars whose antennas rotate anticlockwise.
    """
    rng = np.random.default_rng(seed)
    flights = [_flight(rng) for _ in range(aircraft)]
    parts = [
        _plots(name, flights, rng, positions=positions, named=named,
               sense=-1.0 if name in anticlockwise else 1.0)
        for name in RADARS
    ]  # fmt: skip
    sensors = tuple(
        Sensor(
            id=name, kind="radar", latitude_deg=site[0], longitude_deg=site[1], height_m=site[2],
            range_sigma_m=SIGMAS[0], azimuth_sigma_deg=SIGMAS[1], rotation_period_s=period,
            range_max_m=400_000.0,
        )
        for name, (site, period, _) in RADARS.items()
    )  # fmt: skip
    return Recording(pl.concat(parts).sort("time_s"), sensors)


def _flight(rng: np.random.Generator) -> tuple[float, float, float, float, float]:
    heading, speed = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(150.0, 260.0)
    latitude, longitude = rng.uniform(45.6, 47.6), rng.uniform(6.2, 9.0)
    east, north = speed * np.sin(heading), speed * np.cos(heading)
    return latitude, longitude, east, north, rng.uniform(5000.0, 11_000.0)


_Flights = Sequence[tuple[float, float, float, float, float]]


def _plots(
    name: str, flights: _Flights, rng: np.random.Generator, *, positions: bool, named: bool,
    sense: float,
) -> pl.DataFrame:  # fmt: skip
    (latitude, longitude, height), period, (range_bias, azimuth_bias) = RADARS[name]
    site = float(np.radians(latitude)), float(np.radians(longitude)), height
    rows = []
    for number, flight in enumerate(flights):
        time_s = np.arange(0.0, DURATION_S, period)
        # A plot is taken when the antenna points at the target: by its azimuth within the scan.
        for _ in range(3):
            where = _where(flight, time_s)
            _, azimuth, _ = slant_range_azimuth(site, *where)
            scan = np.floor(time_s / period)
            time_s = (scan + sense * azimuth / (2.0 * np.pi) % 1.0) * period
        where = _where(flight, time_s)
        ranges, azimuth, _ = slant_range_azimuth(site, *where)
        count = len(time_s)
        rows.append(
            pl.DataFrame(
                {
                    "time_s": START_S + time_s,
                    "sensor_id": [name] * count,
                    "kind": ["radar"] * count,
                    "range_m": ranges + range_bias + rng.normal(0.0, SIGMAS[0], count),
                    "azimuth_deg": (
                        np.degrees(azimuth) + azimuth_bias + rng.normal(0.0, SIGMAS[1], count)
                    ) % 360.0,
                    "latitude_deg": np.degrees(where[0]) if positions else [None] * count,
                    "longitude_deg": np.degrees(where[1]) if positions else [None] * count,
                    "height_m": where[2],
                    "track_number": [number if named else None] * count,
                },
                schema_overrides={
                    "latitude_deg": pl.Float64, "longitude_deg": pl.Float64,
                    "track_number": pl.Int64,
                },
            )
        )  # fmt: skip
    return pl.concat(rows)


def _where(
    flight: tuple[float, float, float, float, float], time_s: Floats
) -> tuple[Floats, Floats, Floats]:
    latitude, longitude, east, north, height = flight
    latitudes = latitude + north * time_s / METRES_PER_DEGREE
    longitudes = longitude + east * time_s / METRES_PER_DEGREE / np.cos(np.radians(latitude))
    return np.radians(latitudes), np.radians(longitudes), np.full(len(time_s), height)


def on_the_ground(one: Recording, name: str) -> Recording:
    """Return a recording in which a radar has ground ranges in place of slant ranges."""
    chosen = (one.frame["sensor_id"] == name).to_numpy()
    ranges = one.frame["range_m"].to_numpy()
    ground_m, _ = ground_range(RADARS[name][0][2], ranges, one.frame["height_m"].to_numpy())
    ranges = np.where(chosen, ground_m, ranges)
    return replace(one, frame=one.frame.with_columns(pl.Series("range_m", ranges)))


def with_reports(one: Recording) -> Recording:
    """Return a recording with ADS-B reports at the times of the plots of the second radar."""
    nothing = pl.lit(None, pl.Float64)
    reports = one.frame.filter(sensor_id="2-10").with_columns(
        sensor_id=pl.lit("adsb"), kind=pl.lit("adsb"), range_m=nothing, azimuth_deg=nothing
    )
    adsb = Sensor(id="adsb", kind="adsb")
    return Recording(pl.concat([one.frame, reports]).sort("time_s"), (*one.sensors, adsb))


Edit = Callable[[Recording], Recording]
