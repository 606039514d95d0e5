"""Tables to and from other packages: traffic and Stone Soup.

Neither is needed by multiradar. `traffic` (https://github.com/xoolive/traffic) names its columns
timestamp, icao24, callsign, flight_id, latitude, longitude (degrees), altitude (feet), groundspeed
(knots), track (degrees), vertical_rate (feet per minute). Stone Soup's tracks are lists of Gaussian
states; here their state vectors are east, its rate, north, its rate, in metres and seconds, on the
system plane around a given centre.
"""

import datetime as dt
from collections.abc import Iterable
from operator import itemgetter
from typing import TYPE_CHECKING, Any

import numpy as np
import polars as pl

from multiradar.errors import ConfigurationError, InputError, MissingColumnError
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.toolbox.arguments import typed
from multiradar.toolbox.frames import Frame, to_polars
from multiradar.toolbox.run import Run
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.measurements.units import FOOT_M, KNOT_MPS

if TYPE_CHECKING:
    from stonesoup.types.track import Track

#: Times before 1980 are times of day.
_DATED_FROM_S = 315_532_800.0


def to_traffic(tracks: "Run | Frame") -> pl.DataFrame:
    """Return tracks in the columns of `traffic`.

    Parameters
    ----------
    tracks : Run or table
        What `track` returned, or rows of `tracks.parquet`, with Unix times.

    Returns
    -------
    DataFrame
        For ``traffic.core.Traffic(frame.to_pandas())``: a `flight_id` for each track.

    Raises
    ------
    InputError
        The times have no date.
    """
    frame = _tracks(tracks)
    _require_dates(frame)
    return frame.select(
        pl.from_epoch((pl.col("time_s") * 1e6).round().cast(pl.Int64), time_unit="us")
        .dt.replace_time_zone("UTC")
        .alias("timestamp"),
        pl.col("mode_s_address").str.to_lowercase().alias("icao24"),
        _present(frame, "callsign", pl.String),
        pl.format("track-{}", "track_id").alias("flight_id"),
        pl.col("latitude_deg").alias("latitude"),
        pl.col("longitude_deg").alias("longitude"),
        (pl.col("height_m") / FOOT_M).alias("altitude"),
        (pl.col("speed_mps") / KNOT_MPS).alias("groundspeed"),
        pl.col("heading_deg").alias("track"),
        (_present(frame, "vertical_rate_mps", pl.Float64) * (60.0 / FOOT_M)).alias("vertical_rate"),
    )


@typed
def from_traffic(flights: "Frame | Any", *, sensor_id: str = "adsb") -> pl.DataFrame:
    """Return trajectories of `traffic` as ADS-B measurements.

    Parameters
    ----------
    flights : Traffic, Flight or table
        With timestamp, icao24, latitude, longitude and altitude (feet). Flights without an icao24
        are distinguished by their flight_id, if there is one.
    sensor_id : str
        Name of the sensor that reports them.

    Returns
    -------
    DataFrame
        Columns of `measurements.parquet`, in the order of time; rows without a position are left
        out, and flights without an address are numbered. For `track`, or as the reference of
        `evaluate`.

    Raises
    ------
    MissingColumnError
        A column is missing.
    """
    frame = to_polars(getattr(flights, "data", flights), "flights")
    needed = ("timestamp", "icao24", "latitude", "longitude", "altitude")
    missing = [name for name in needed if name not in frame.columns]
    if missing:
        raise MissingColumnError("flights", missing, frame.columns)
    places = pl.col("latitude", "longitude").cast(pl.Float64).fill_nan(None)
    found = (
        frame.with_columns(places)
        .drop_nulls(["timestamp", "latitude", "longitude"])
        .select(
            (pl.col("timestamp").dt.epoch("us") / 1e6).alias("time_s"),
            pl.lit(sensor_id).alias("sensor_id"),
            pl.lit("adsb").alias("kind"),
            pl.col("latitude").alias("latitude_deg"),
            pl.col("longitude").alias("longitude_deg"),
            (pl.col("altitude").cast(pl.Float64) * FOOT_M).fill_nan(None).alias("height_m"),
            pl.col("icao24").cast(pl.String).str.to_uppercase().alias("mode_s_address"),
            _present(frame, "callsign", pl.String),
            _flight_number(frame).alias("track_number"),
        )
    )
    return found.select(
        pl.col(name) if name in found.columns else pl.lit(None, kind).alias(name)
        for name, kind in MEASUREMENT_SCHEMA.items()
    ).sort("time_s", maintain_order=True)


@typed
def to_stone_soup(tracks: "Run | Frame", centre_deg: tuple[float, float]) -> "set[Track]":
    """Return tracks as Stone Soup tracks.

    Parameters
    ----------
    tracks : Run or table
        What `track` returned, or rows of `tracks.parquet`, with Unix times.
    centre_deg : (float, float)
        Latitude and longitude of the centre of the plane, degrees.

    Returns
    -------
    set of stonesoup.types.track.Track
        Gaussian states of east, its rate, north, its rate (m, m/s), with half of the variance of
        position and velocity on each axis.

    Raises
    ------
    InputError
        The times have no date.
    OutsidePlaneError
        A track is too far from the centre.
    ConfigurationError
        Stone Soup is not installed.
    """
    try:
        from stonesoup.types.state import GaussianState
        from stonesoup.types.track import Track
    except ModuleNotFoundError as error:
        msg = "Stone Soup is not installed; install it: pip install stonesoup"
        raise ConfigurationError(msg) from error

    frame = _tracks(tracks)
    _require_dates(frame)
    plane = _plane(centre_deg)
    east, north = plane.to_plane(
        np.radians(frame["latitude_deg"].to_numpy()), np.radians(frame["longitude_deg"].to_numpy())
    )
    heading = np.radians(frame["heading_deg"].to_numpy())
    true = frame["speed_mps"].to_numpy() * np.array([np.sin(heading), np.cos(heading)])
    rates = np.linalg.solve(plane.local_matrix(east, north), true.T[:, :, None])[:, :, 0]
    variance = np.column_stack(
        [frame[name].to_numpy() ** 2 / 2.0 for name in ("position_sigma_m", "velocity_sigma_mps")]
    )
    made: dict[int, Track] = {}
    rows = zip(frame["track_id"].to_list(), frame["time_s"].to_list(), strict=True)
    for row, (track_id, time_s) in enumerate(rows):
        state = GaussianState(
            np.array([east[row], rates[row, 0], north[row], rates[row, 1]]),
            np.diag([variance[row, 0], variance[row, 1]] * 2),
            timestamp=dt.datetime.fromtimestamp(time_s, dt.UTC).replace(tzinfo=None),
        )
        if track_id not in made:
            made[track_id] = Track(id=str(track_id))
        made[track_id].append(state)
    return set(made.values())


@typed
def from_stone_soup(tracks: "Iterable[Track]", centre_deg: tuple[float, float]) -> pl.DataFrame:
    """Return tracks of Stone Soup in the columns that `evaluate` needs.

    Parameters
    ----------
    tracks : iterable of stonesoup.types.track.Track
        State vectors of east, its rate, north, its rate (m, m/s); times are UTC.
    centre_deg : (float, float)
        Latitude and longitude of the centre of the plane, degrees.

    Returns
    -------
    DataFrame
        Rows of `tracks.parquet`: identifiers counted from 1 by first appearance, all confirmed.

    Raises
    ------
    InputError
        A state does not have four components.
    OutsidePlaneError
        A state is too far from the centre.
    """
    plane = _plane(centre_deg)
    try:
        started = [(track[0].timestamp, track) for track in tracks if len(track)]
    except (AttributeError, TypeError) as error:
        msg = f"tracks: expected tracks of Stone Soup, was {type(tracks).__name__}"
        raise InputError(msg) from error
    ordered = [track for _, track in sorted(started, key=itemgetter(0))]
    rows = []
    for number, track in enumerate(ordered, start=1):
        for state in track:
            vector = np.asarray(state.state_vector, np.float64).ravel()
            if vector.shape != (4,):
                msg = f"track {track.id}: expected states of 4 components, was {vector.shape[0]}"
                raise InputError(msg)
            covariance = np.asarray(state.covar, np.float64)
            latitude, longitude = plane.to_geodetic(vector[0], vector[2])
            speed, heading = plane.ground_velocity(vector[0], vector[2], vector[1], vector[3])
            stamp = state.timestamp
            when = stamp if stamp.tzinfo is not None else stamp.replace(tzinfo=dt.UTC)
            rows.append(
                {
                    "time_s": when.timestamp(),
                    "track_id": number,
                    "track_number": None,
                    "mode_s_address": None,
                    "mode_3a": None,
                    "latitude_deg": float(np.degrees(latitude)),
                    "longitude_deg": float(np.degrees(longitude)),
                    "height_m": None,
                    "speed_mps": float(speed),
                    "heading_deg": float(np.degrees(heading)),
                    "position_sigma_m": float(np.sqrt(covariance[0, 0] + covariance[2, 2])),
                    "velocity_sigma_mps": float(np.sqrt(covariance[1, 1] + covariance[3, 3])),
                    "state": "confirmed",
                    "sensor_id": "",
                }
            )
    return pl.DataFrame(rows, schema=_TRACK_COLUMNS).sort("time_s", maintain_order=True)


_TRACK_COLUMNS: dict[str, Any] = {
    "time_s": pl.Float64,
    "track_id": pl.Int64,
    "track_number": pl.Int64,
    "mode_s_address": pl.String,
    "mode_3a": pl.String,
    "latitude_deg": pl.Float64,
    "longitude_deg": pl.Float64,
    "height_m": pl.Float64,
    "speed_mps": pl.Float64,
    "heading_deg": pl.Float64,
    "position_sigma_m": pl.Float64,
    "velocity_sigma_mps": pl.Float64,
    "state": pl.String,
    "sensor_id": pl.String,
}


def _tracks(given: "Run | Frame") -> pl.DataFrame:
    return given.tracks if isinstance(given, Run) else to_polars(given, "tracks")


def _plane(centre_deg: tuple[float, float]) -> SystemPlane:
    return SystemPlane(np.radians(centre_deg[0]), np.radians(centre_deg[1]))


def _flight_number(frame: pl.DataFrame) -> pl.Expr:
    # In the order of the names, from 1; null with an address, or without a name.
    if "flight_id" not in frame.columns:
        return pl.lit(None, MEASUREMENT_SCHEMA["track_number"])
    named = pl.when(pl.col("icao24").is_null()).then(pl.col("flight_id"))
    return named.rank("dense").cast(MEASUREMENT_SCHEMA["track_number"])


def _present(frame: pl.DataFrame, name: str, kind: Any) -> pl.Expr:
    return pl.col(name) if name in frame.columns else pl.lit(None, kind).alias(name)


def _require_dates(frame: pl.DataFrame) -> None:
    if frame.height and float(frame["time_s"].max()) < _DATED_FROM_S:  # type: ignore[arg-type]  # numbers
        raise InputError("tracks: times have no date; convert the recording with a date")
