"""A recording of made aircraft, seen by eight radars and by ADS-B, of any size."""

from pathlib import Path

import numpy as np
import polars as pl
from numpy.typing import NDArray

from multiradar.geodesy.polar import slant_range_azimuth
from multiradar_schemas.measurements.directions import PLAIN_SCHEMA

RADARS = 8
START_S = 1_700_000_000.0
#: Each source sees each aircraft once in this time.
SCAN_S = 4.0
HEIGHT_M = 9000.0
LATITUDE_DEG, LONGITUDE_DEG = 47.0, 8.0
DEGREE_M = 111_200.0
#: Aircraft fly wide circles, so that they stay in sight however long the recording is.
CIRCLE_M = 100e3
CENTRES_M = 200e3
RANGE_BIAS_M, AZIMUTH_BIAS_DEG = 60.0, 0.05

Floats = NDArray[np.float64]


def sites() -> list[tuple[str, float, float, float]]:
    """Return name, latitude (degrees), longitude (degrees) and height (m) of the radars."""
    turn = np.arange(RADARS) / RADARS * 2.0 * np.pi
    return [
        (f"r{index}", LATITUDE_DEG + 1.35 * np.cos(angle), LONGITUDE_DEG + 2.0 * np.sin(angle), 500)
        for index, angle in enumerate(turn)
    ]


def write_sensors(path: Path) -> None:
    """Write the `sensors.toml` of every recording of this module."""
    radars = [
        f'[[sensor]]\nid = "{name}"\nkind = "radar"\nlatitude_deg = {latitude:.6f}\n'
        f"longitude_deg = {longitude:.6f}\nheight_m = {height:.1f}\n"
        for name, latitude, longitude, height in sites()
    ]
    path.write_text("\n".join([*radars, '[[sensor]]\nid = "adsb"\nkind = "adsb"\n']))


def make_recording(rows: int, aircraft: int, seed: int = 1) -> pl.DataFrame:
    """Return measurements in the order of their time, of all sources and aircraft alike.

    Parameters
    ----------
    rows : int
        Number of measurements; with the number of aircraft it decides how long the recording is.
    aircraft : int
        Number of aircraft, all there from the beginning to the end.
    seed : int
        Of the noise.
    """
    random = np.random.default_rng(seed)
    # Sources turn at their own phase; an aircraft is met at another moment of each turn.
    per_turn = aircraft * (RADARS + 1)
    turn, sighting = np.divmod(np.arange(rows), per_turn)
    moment = np.sort(random.uniform(0.0, SCAN_S, per_turn))
    order = random.permutation(per_turn)
    number, source = np.divmod(order[sighting], RADARS + 1)
    time_s = turn * SCAN_S + moment[sighting]
    latitude, longitude = _positions(number, time_s, aircraft, random)
    reported = source == RADARS
    range_m, azimuth_deg = _plots(source, latitude, longitude, random)
    noise = random.normal(0.0, 30.0 / DEGREE_M, (2, rows))
    names = pl.Series([name for name, *_ in sites()] + ["adsb"])
    return pl.DataFrame(
        {
            "time_s": START_S + np.round(time_s, 3),
            "sensor_id": names.gather(pl.Series(source)),
            "kind": pl.Series(["radar", "adsb"]).gather(pl.Series(reported.astype(np.uint32))),
            "range_m": range_m,
            "azimuth_deg": azimuth_deg,
            "latitude_deg": np.where(reported, latitude + noise[0], np.nan),
            "longitude_deg": np.where(reported, longitude + noise[1], np.nan),
            "height_m": np.full(rows, HEIGHT_M),
            "mode_3a": _codes(aircraft, "{:04o}", 0o10000).gather(pl.Series(number)),
            "mode_s_address": _codes(aircraft, "{:06x}", 1 << 24).gather(pl.Series(number)),
            "track_number": number,
            "callsign": pl.repeat(None, rows, dtype=pl.String, eager=True),
        }
    ).fill_nan(None).cast(PLAIN_SCHEMA).select(PLAIN_SCHEMA.names())  # fmt: skip


def _positions(
    number: NDArray[np.int64], time_s: Floats, aircraft: int, random: np.random.Generator
) -> tuple[Floats, Floats]:
    centre_m = random.uniform(-CENTRES_M, CENTRES_M, (2, aircraft))
    start = random.uniform(0.0, 2.0 * np.pi, aircraft)
    turn_rate = random.uniform(150.0, 250.0, aircraft) / CIRCLE_M
    angle = start[number] + turn_rate[number] * time_s
    north = centre_m[0, number] + CIRCLE_M * np.cos(angle)
    east = centre_m[1, number] + CIRCLE_M * np.sin(angle)
    latitude = LATITUDE_DEG + north / DEGREE_M
    return latitude, LONGITUDE_DEG + east / (DEGREE_M * np.cos(np.radians(LATITUDE_DEG)))


def _plots(
    source: NDArray[np.int64], latitude: Floats, longitude: Floats, random: np.random.Generator
) -> tuple[Floats, Floats]:
    range_m = np.full(len(source), np.nan)
    azimuth_deg = np.full(len(source), np.nan)
    for index, (_, site_latitude, site_longitude, site_height) in enumerate(sites()):
        seen = np.flatnonzero(source == index)
        distance, azimuth_rad, _ = slant_range_azimuth(
            (np.radians(site_latitude), np.radians(site_longitude), site_height),
            np.radians(latitude[seen]),
            np.radians(longitude[seen]),
            np.full(len(seen), HEIGHT_M),
        )
        range_m[seen] = distance + RANGE_BIAS_M + random.normal(0.0, 50.0, len(seen))
        noise_deg = random.normal(0.0, 0.08, len(seen))
        azimuth_deg[seen] = np.mod(np.degrees(azimuth_rad) + AZIMUTH_BIAS_DEG + noise_deg, 360.0)
    return np.round(range_m, 1), np.round(azimuth_deg, 4) % 360.0


def _codes(count: int, form: str, end: int) -> pl.Series:
    return pl.Series([form.format((number + 1) % end) for number in range(count)])
