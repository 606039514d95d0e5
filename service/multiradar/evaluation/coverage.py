"""Coverage of the sensors that made the tracks: where and when a reference can be compared."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from multiradar.evaluation.trajectories import Flags, Floats, Indices, Uncovered
from multiradar.geodesy.longitudes import median_longitude
from multiradar.geodesy.wgs84 import geodetic_to_ecef
from multiradar_schemas.sensors.sensor import Sensor

#: Effective radius of the Earth with standard refraction, 4/3 of its radius, m.
EFFECTIVE_RADIUS_M = 8_495_000.0
#: Minimum height of an antenna above its surroundings, m: a generous horizon removes nothing seen.
ANTENNA_MIN_M = 30.0
#: Positions of an aircraft up to this far apart are joined across the edge of the coverage, s.
EDGE_S = 15.0
#: Biases move plots beyond the range of a radar by this fraction, and this length, m.
RANGE_MARGIN, RANGE_MARGIN_M = 0.01, 500.0


@dataclass(frozen=True, slots=True)
class CoveredRegion:
    """Region and time of one sensor.

    Attributes
    ----------
    latitude_rad, longitude_rad : float
        Site of a radar; the middle of the updates of another sensor.
    height_m : float
        Height of the antenna of a radar; NaN for another sensor, which has no horizon.
    range_max_m : float
        Instrumented range, or without one the distance of the farthest update.
    first_s, last_s : float
        Times of its first and last update.
    by_feet : bool
        Whether the range is that between feet on the ellipsoid, not the slant range: that of the
        farthest update.
    """

    latitude_rad: float
    longitude_rad: float
    height_m: float
    range_max_m: float
    first_s: float
    last_s: float
    by_feet: bool = False


def covered_regions(updates: pl.DataFrame, sensors: Sequence[Sensor]) -> list[CoveredRegion]:
    """Return the regions of the sensors that updated tracks.

    Parameters
    ----------
    updates : DataFrame
        `tracks.parquet`.
    sensors : sequence of Sensor
        The sensors; others, and those without updates, have no region.

    Returns
    -------
    list of CoveredRegion
        One for each sensor with updates.
    """
    measured = updates.filter(pl.col("state") != "coasting")
    found = []
    for sensor in sensors:
        own = measured.filter(pl.col("sensor_id").is_in(sorted(sensor.all_names())))
        if own.is_empty():
            continue
        latitude, longitude = (
            np.radians(own[name].cast(pl.Float64).to_numpy())
            for name in ("latitude_deg", "longitude_deg")
        )
        site = _site(sensor, latitude, longitude)
        middle = geodetic_to_ecef(site[0], site[1], 0.0)
        far = np.linalg.norm(geodetic_to_ecef(latitude, longitude, 0.0) - middle, axis=-1)
        limit = float(far.max()) if sensor.range_max_m is None else sensor.range_max_m
        times = own["time_s"].cast(pl.Float64).to_numpy()
        found.append(
            CoveredRegion(
                *site, limit, float(times.min()), float(times.max()),
                by_feet=sensor.range_max_m is None,
            )
        )  # fmt: skip
    return found


def covered_rows(
    regions: Sequence[CoveredRegion],
    aircraft: Indices,
    time_s: Floats,
    place_rad: tuple[Floats, Floats],
    height_m: Floats,
) -> tuple[Flags, Uncovered]:
    """Return which positions any sensor can see, with their neighbours.

    Parameters
    ----------
    regions : sequence of CoveredRegion
        Of the sensors.
    aircraft : (n,) int64
        Aircraft of each position, ascending.
    time_s : (n,) float64
        Time, ascending for each aircraft.
    place_rad : two (n,) float64
        Latitude and longitude.
    height_m : (n,) float64
        Height; positions of unknown height (NaN) are not below a horizon.

    Returns
    -------
    covered : (n,) bool
        Whether a sensor covers it, or the position before or after it, at most `EDGE_S` away: up
        to the edge the aircraft is known by interpolation.
    uncovered : Uncovered
        The others, by reason.

    Notes
    -----
    The horizon is that of a smooth Earth with standard refraction: a target at height h is visible
    from an antenna at height H up to √(2RH) + √(2Rh), with heights above the ellipsoid. Terrain is
    unknown, so no position that a radar can see is removed.
    """
    on, near, seen = np.zeros((3, len(time_s)), np.bool_)
    position, feet = (geodetic_to_ecef(*place_rad, one) for one in (np.nan_to_num(height_m), 0.0))
    for one in regions:
        has_horizon = np.isfinite(one.height_m)
        site_m = one.height_m if has_horizon else 0.0
        site = geodetic_to_ecef(one.latitude_rad, one.longitude_rad, 0.0 if one.by_feet else site_m)
        away_m = np.linalg.norm((feet if one.by_feet else position) - site, axis=-1)
        known = np.isfinite(height_m) & has_horizon
        target_m = np.where(known, np.maximum(height_m, 0.0), np.inf)
        horizon_m = np.sqrt(2.0 * EFFECTIVE_RADIUS_M * max(site_m, ANTENNA_MIN_M)) + np.sqrt(
            2.0 * EFFECTIVE_RADIUS_M * target_m
        )
        active = (time_s >= one.first_s) & (time_s <= one.last_s)
        within = active & (away_m <= one.range_max_m * (1.0 + RANGE_MARGIN) + RANGE_MARGIN_M)
        on |= active
        near |= within
        seen |= within & (away_m <= horizon_m)
    linked = (np.diff(aircraft) == 0) & (np.diff(time_s) <= EDGE_S)
    covered = seen.copy()
    covered[1:] |= linked & seen[:-1]
    covered[:-1] |= linked & seen[1:]
    lost = ~covered
    counts = (lost & ~on, lost & on & ~near, lost & near)
    return covered, Uncovered(*(int(np.count_nonzero(one)) for one in counts))


def _site(sensor: Sensor, latitude: Floats, longitude: Floats) -> tuple[float, float, float]:
    if sensor.kind == "radar" and sensor.latitude_deg is not None:
        assert sensor.longitude_deg is not None
        assert sensor.height_m is not None
        place = np.radians([sensor.latitude_deg, sensor.longitude_deg]).tolist()
        return place[0], place[1], sensor.height_m
    # Receivers are many, and not at the site of the file.
    return float(np.median(latitude)), median_longitude(longitude), np.nan
