"""Crowded airspace on flight levels, seen by rotating radars: what the tracker must resolve.

Aircraft fly wide circles around a common middle, one in ten turns with a steep bank all the time;
each keeps its level, 300 m from the next. Plots come with the beam, so that a radar's plots of one
moment lie in one sector; some are missing, some are false. The true number of each aircraft stands
in `track_number`, null for false plots; the tracker is run with it hidden.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from benchmark.scenes.sky import DEGREE_M, LATITUDE_DEG, LONGITUDE_DEG, START_S, sites
from multiradar.geodesy.polar import slant_range_azimuth
from multiradar_schemas.measurements.directions import PLAIN_SCHEMA

Floats = NDArray[np.float64]

#: Radius of the disc of aircraft: 4000 aircraft are one per 71 km², 15 000 one per 19 km².
RADIUS_M = 300e3
LEVEL_FIRST_M, LEVEL_STEP_M, LEVELS = 3_000.0, 300.0, 30
#: Heights are reported in steps of 25 feet.
MODE_C_M = 7.62
#: Radii of the circles: a gentle one, and that of a bank of 20° at 200 m/s.
WIDE_M, TIGHT_M = 150e3, 11.2e3
#: Scan period of the first radar, and increment for each next one, s.
TURN_S, TURN_STEP_S = 4.0, 0.1
RANGE_SIGMA_M, AZIMUTH_SIGMA_DEG = 40.0, 0.06
RANGE_BIASES_M = (185.0, -120.0, 60.0, 60.0, -40.0, 90.0, 0.0, 150.0)
AZIMUTH_BIASES_DEG = (-0.19, 0.17, -0.08, 0.05, 0.1, -0.03, 0.0, 0.06)
DETECTED = 0.97
#: False plots per true plot.
FALSE = 0.005


@dataclass(frozen=True)
class Flights:
    """The true motion: ground positions, metres from the centre, by time."""

    centre_m: Floats
    radius_m: Floats
    start_rad: Floats
    turn_rate: Floats
    height_m: Floats

    def at(self, number: NDArray[np.intp], time_s: Floats) -> tuple[Floats, Floats]:
        """Return east and north, m, of aircraft at times."""
        angle = self.start_rad[number] + self.turn_rate[number] * time_s
        east = self.centre_m[0, number] + self.radius_m[number] * np.cos(angle)
        return east, self.centre_m[1, number] + self.radius_m[number] * np.sin(angle)

    def geodetic(self, number: NDArray[np.intp], time_s: Floats) -> tuple[Floats, Floats]:
        """Return latitude and longitude, rad, of aircraft at times."""
        east, north = self.at(number, time_s)
        latitude = LATITUDE_DEG + north / DEGREE_M
        longitude = LONGITUDE_DEG + east / (DEGREE_M * np.cos(np.radians(LATITUDE_DEG)))
        return np.radians(latitude), np.radians(longitude)


def make_flights(aircraft: int, seed: int = 1) -> Flights:
    """Draw aircraft; all exist for the whole duration.

    Parameters
    ----------
    aircraft : int
        How many.
    seed : int
        Of everything.
    """
    random = np.random.default_rng(seed)
    angle = random.uniform(0.0, 2.0 * np.pi, aircraft)
    distance = RADIUS_M * np.sqrt(random.uniform(0.0, 1.0, aircraft))
    tight = random.uniform(size=aircraft) < 0.1
    radius = np.where(tight, TIGHT_M, WIDE_M)
    start = random.uniform(0.0, 2.0 * np.pi, aircraft)
    speed = np.where(tight, 200.0, random.uniform(150.0, 250.0, aircraft))
    direction = np.where(random.uniform(size=aircraft) < 0.5, 1.0, -1.0)
    place = distance * np.array([np.cos(angle), np.sin(angle)])
    level = random.integers(0, LEVELS, aircraft)
    return Flights(
        centre_m=place - radius * np.array([np.cos(start), np.sin(start)]),
        radius_m=radius,
        start_rad=start,
        turn_rate=direction * speed / radius,
        height_m=np.round((LEVEL_FIRST_M + LEVEL_STEP_M * level) / MODE_C_M) * MODE_C_M,
    )


def write_sensors(path: Path) -> None:
    """Write the `sensors.toml` of every recording of this module."""
    radars = [
        f'[[sensor]]\nid = "{name}"\nkind = "radar"\nlatitude_deg = {latitude:.6f}\n'
        f"longitude_deg = {longitude:.6f}\nheight_m = {height:.1f}\n"
        f"range_sigma_m = {RANGE_SIGMA_M}\nazimuth_sigma_deg = {AZIMUTH_SIGMA_DEG}\n"
        f"rotation_period_s = {TURN_S + TURN_STEP_S * index:.1f}\n"
        for index, (name, latitude, longitude, height) in enumerate(sites())
    ]
    path.write_text("\n".join(radars))


def make_recording(rows: int, aircraft: int, seed: int = 1) -> pl.DataFrame:
    """Return the plots of all radars in the order of their time.

    Parameters
    ----------
    rows : int
        Number of plots; with the number of aircraft it decides how long the recording is.
    aircraft : int
        Number of aircraft.
    seed : int
        Of aircraft and noise.
    """
    flights = make_flights(aircraft, seed)
    # Half a scan more than the slowest radar needs: no plots are missing at the end.
    slowest_s = TURN_S + TURN_STEP_S * len(sites())
    duration_s = rows / (aircraft * len(sites()) * DETECTED) * slowest_s + slowest_s
    frames = [
        _plots_of(index, site, flights, duration_s, np.random.default_rng([seed, index]))
        for index, site in enumerate(sites())
    ]
    together = pl.concat(frames).sort("time_s", maintain_order=True).head(rows)
    return together.select(
        pl.col(name).cast(kind) if name in together.columns else pl.lit(None, kind).alias(name)
        for name, kind in PLAIN_SCHEMA.items()
    )


def _plots_of(
    index: int,
    site: tuple[str, float, float, float],
    flights: Flights,
    duration_s: float,
    random: np.random.Generator,
) -> pl.DataFrame:
    name, latitude, longitude, height = site
    aircraft = len(flights.height_m)
    turn_s = TURN_S + TURN_STEP_S * index
    turns = np.arange(int(duration_s / turn_s))
    number = np.tile(np.arange(aircraft), len(turns))
    # The beam illuminates an aircraft once per scan, by its azimuth, unwrapped beyond north.
    first_s = np.repeat(turns * turn_s, aircraft)
    azimuth, _ = _seen((latitude, longitude, height), flights, number, first_s)
    azimuth = np.unwrap(azimuth.reshape(len(turns), aircraft), axis=0)
    time_s = ((turns[:, None] + azimuth / (2.0 * np.pi)) * turn_s).ravel()
    azimuth, range_m = _seen((latitude, longitude, height), flights, number, time_s)
    azimuth_deg = np.degrees(azimuth) + AZIMUTH_BIASES_DEG[index]
    azimuth_deg += random.normal(0.0, AZIMUTH_SIGMA_DEG, len(number))
    range_m = range_m + RANGE_BIASES_M[index] + random.normal(0.0, RANGE_SIGMA_M, len(number))
    chance = random.uniform(size=len(number))
    # False plots lie in the current beam, at any range and height.
    false = chance > 1.0 - FALSE
    range_m[false] = random.uniform(20e3, RADIUS_M, int(false.sum()))
    height_m = flights.height_m[np.where(false, random.integers(0, aircraft, len(number)), number)]
    numbers = pl.Series(np.where(false, -1, number))
    kept = (chance < DETECTED) | false
    return pl.DataFrame(
        {
            "time_s": START_S + np.round(time_s, 3),
            "sensor_id": pl.Series([name]).gather(pl.Series(np.zeros(len(number), np.uint32))),
            "kind": pl.Series(["radar"]).gather(pl.Series(np.zeros(len(number), np.uint32))),
            "range_m": np.round(range_m, 1),
            "azimuth_deg": np.round(azimuth_deg, 4) % 360.0,
            "height_m": height_m,
            "mode_3a": _codes(aircraft, "{:04o}", 0o10000).gather(numbers),
            "mode_s_address": _codes(aircraft, "{:06x}", 1 << 24).gather(numbers),
            "track_number": pl.Series([*range(1, aircraft + 1), None]).gather(numbers),
        }
    ).filter(pl.Series(kept))


# One per aircraft, none for false plots.
def _codes(count: int, form: str, end: int) -> pl.Series:
    return pl.Series([*(form.format((number + 1) % end) for number in range(count)), None])


def _seen(
    site: tuple[float, float, float],
    flights: Flights,
    number: NDArray[np.intp],
    time_s: Floats,
) -> tuple[Floats, Floats]:
    range_m, azimuth_rad, _ = slant_range_azimuth(
        (np.radians(site[0]), np.radians(site[1]), site[2]),
        *flights.geodetic(number, time_s),
        flights.height_m[number],
    )
    return azimuth_rad, range_m
