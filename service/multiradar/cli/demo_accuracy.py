"""How far tracks are from what the aircraft say of themselves by ADS-B."""

from dataclasses import dataclass

import numpy as np
import polars as pl

#: The first minute of a track, when it still settles, is left out.
SETTLING_S = 60.0
#: A track that was not updated for so long is not compared.
AGE_MAX_S = 12.0
#: Mean radius of the Earth: positions a few kilometres apart are compared on the sphere.
EARTH_RADIUS_M = 6_371_008.8


@dataclass(frozen=True, slots=True)
class Accuracy:
    """Horizontal distances between reported and tracked positions, m."""

    compared: int
    median_m: float
    rms_m: float


def position_accuracy(reports: pl.DataFrame, updates: pl.DataFrame) -> Accuracy | None:
    """Compare ADS-B positions with the tracks of the same aircraft.

    The last update of the track before a report is moved on to the time of the report with the
    track's own speed and heading.

    Parameters
    ----------
    reports : DataFrame
        `time_s`, `track_number`, `latitude_deg`, `longitude_deg` of ADS-B reports.
    updates : DataFrame
        Rows of `tracks.parquet`.

    Returns
    -------
    Accuracy or None
        None when nothing can be compared.
    """
    # A dump without ADS-B, or one whose plots name no aircraft.
    if reports.is_empty() or updates.is_empty():
        return None
    tracked = updates.filter(pl.col("track_number").is_not_null()).sort("time_s")
    begun = pl.col("time_s").min().over("track_number").alias("begun_s")
    tracked = tracked.with_columns(begun, pl.col("time_s").alias("update_s"))
    reported = reports.filter(pl.col("track_number").is_not_null()).sort("time_s")
    pairs = reported.select("time_s", "track_number", "latitude_deg", "longitude_deg").join_asof(
        tracked.select(
            "time_s", "track_number", "begun_s", "update_s", "speed_mps", "heading_deg",
            pl.col("latitude_deg").alias("track_latitude_deg"),
            pl.col("longitude_deg").alias("track_longitude_deg"),
        ),
        on="time_s",
        by="track_number",
        check_sortedness=False,
    )  # fmt: skip
    age = pl.col("time_s") - pl.col("update_s")
    settled = pl.col("time_s") - pl.col("begun_s") >= SETTLING_S
    pairs = pairs.filter(settled & (age <= AGE_MAX_S))
    if pairs.is_empty():
        return None
    distance_m = _distances_m(pairs)
    return Accuracy(
        compared=len(distance_m),
        median_m=float(np.median(distance_m)),
        rms_m=float(np.sqrt(np.mean(distance_m**2))),
    )


def _distances_m(pairs: pl.DataFrame) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    column = {name: pairs[name].to_numpy() for name in pairs.columns}
    age_s = column["time_s"] - column["update_s"]
    heading_rad = np.radians(column["heading_deg"])
    latitude_rad = np.radians(column["track_latitude_deg"])
    north_m = EARTH_RADIUS_M * np.radians(column["latitude_deg"] - column["track_latitude_deg"])
    east_m = (
        EARTH_RADIUS_M
        * np.cos(latitude_rad)
        * np.radians(column["longitude_deg"] - column["track_longitude_deg"])
    )
    north_m -= column["speed_mps"] * age_s * np.cos(heading_rad)
    east_m -= column["speed_mps"] * age_s * np.sin(heading_rad)
    distance: np.ndarray[tuple[int], np.dtype[np.float64]] = np.hypot(north_m, east_m)
    return distance
