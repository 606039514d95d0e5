"""Forecasts against the reference: errors, and containment of their regions."""

from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np
import polars as pl

from multiradar.errors import InputError, MissingColumnError
from multiradar.evaluation.trajectories import (
    NUMBER_MAX,
    Flags,
    Floats,
    Indices,
    Reference,
    Tracks,
    positions_at,
)

#: Columns read from tables of forecasts.
FORECAST_COLUMNS = (
    "track_id", "made_s", "horizon_s", "time_s", "probability", "latitude_deg", "longitude_deg",
    "covariance_east_m2", "covariance_east_north_m2", "covariance_north_m2", "region_major_m",
    "region_minor_m", "region_azimuth_deg",
)  # fmt: skip
_METHOD = "by"


@dataclass(frozen=True, slots=True, eq=False)
class ForecastErrors:
    """Forecasts whose truth is known.

    Attributes
    ----------
    by : (n,) str
        Methods of the forecasts.
    horizon_s, probability : (n,) float64
        Forecast horizon, s; probability of the region.
    inside : (n,) bool
        Whether the aircraft was in the region.
    error_m : (n,) float64
        Distance from the forecast, true metres.
    normalised : (n,) float64
        error² / sigma² per dimension, by the covariance of the forecast.
    radius_m : (n,) float64
        Geometric mean of the semi-axes of the region.
    """

    by: "np.typing.NDArray[np.str_]"
    horizon_s: Floats
    probability: Floats
    inside: Flags
    error_m: Floats
    normalised: Floats
    radius_m: Floats


def forecast_errors(
    frame: pl.DataFrame, source: str, tracks: Tracks, reference: Reference, aircraft: Indices
) -> ForecastErrors:
    """Compare forecasts with the later positions of the aircraft.

    Parameters
    ----------
    frame : DataFrame
        `forecasts.parquet` or `bundle_forecasts.parquet`.
    source : str
        Name used in errors.
    tracks : Tracks
        Of n updates.
    reference : Reference
        Positions of the aircraft.
    aircraft : (n,) int64
        Aircraft of each update; −1 for none.

    Returns
    -------
    ForecastErrors
        Forecasts made at an update of a known aircraft, for times at which its position is known.

    Raises
    ------
    MissingColumnError
        A column is missing.
    InputError
        A column is not numeric, or an ellipse or a covariance is degenerate.
    """
    columns = _columns(frame, source)
    aircraft_index = _aircraft(columns, tracks, aircraft)
    truth = positions_at(reference, aircraft_index, columns["time_s"]).position_m
    known = np.isfinite(truth[:, 0])
    columns, truth = {name: one[known] for name, one in columns.items()}, truth[known]
    plane = reference.plane
    latitude_rad, longitude_rad = (
        np.radians(columns[name]) for name in ("latitude_deg", "longitude_deg")
    )
    east_m, north_m = plane.to_plane(latitude_rad, longitude_rad)
    matrix = plane.local_matrix(east_m, north_m, 0.0)
    off = np.einsum("nij,nj->ni", matrix, truth - np.column_stack([east_m, north_m]))
    azimuth_rad = np.radians(columns["region_azimuth_deg"])
    along = off[:, 0] * np.sin(azimuth_rad) + off[:, 1] * np.cos(azimuth_rad)
    across = off[:, 0] * np.cos(azimuth_rad) - off[:, 1] * np.sin(azimuth_rad)
    major, minor = columns["region_major_m"], columns["region_minor_m"]
    named = np.asarray(frame[_METHOD].cast(pl.String).to_list(), np.str_)[known]
    return ForecastErrors(
        by=named,
        horizon_s=columns["horizon_s"],
        probability=columns["probability"],
        inside=(along / major) ** 2 + (across / minor) ** 2 <= 1.0,
        error_m=np.hypot(*off.T),
        normalised=_normalised(off, columns),
        radius_m=np.sqrt(major * minor),
    )


def joined(parts: Sequence[ForecastErrors]) -> ForecastErrors | None:
    """Return all forecasts as one; None where there are no tables."""
    if not parts:
        return None
    names = [one.name for one in fields(ForecastErrors)]
    return ForecastErrors(
        **{name: np.concatenate([getattr(one, name) for one in parts]) for name in names}
    )


def _normalised(off: Floats, columns: dict[str, Floats]) -> Floats:
    east, cross, north = (
        columns[name]
        for name in ("covariance_east_m2", "covariance_east_north_m2", "covariance_north_m2")
    )
    squared = north * off[:, 0] ** 2 - 2.0 * cross * off[:, 0] * off[:, 1] + east * off[:, 1] ** 2
    normalised: Floats = 0.5 * squared / (east * north - cross**2)
    return normalised


# The aircraft of the update at which each forecast was made; −1 for none.
def _aircraft(columns: dict[str, Floats], tracks: Tracks, aircraft: Indices) -> Indices:
    track_id = columns["track_id"].astype(np.int64)
    index = np.minimum(np.searchsorted(tracks.ids, track_id), len(tracks.ids) - 1)
    known = tracks.ids[index] == track_id
    origin = tracks.time_s.min()
    # One axis for all tracks: the updates of each follow those of the previous one.
    length = float(np.ptp(tracks.time_s)) + 2.0
    axis = tracks.track * length + (tracks.time_s - origin)
    asked = np.clip(columns["made_s"] - origin + 1e-6, -1.0, length - 1.0)
    row = np.searchsorted(axis, index * length + asked, side="right") - 1
    row = np.maximum(row, 0)
    known &= (tracks.track[row] == index) & (np.abs(tracks.time_s[row] - columns["made_s"]) <= 1e-6)
    return np.where(known, aircraft[row], -1)


def _columns(frame: pl.DataFrame, source: str) -> dict[str, Floats]:
    wanted = (*FORECAST_COLUMNS, _METHOD)
    missing = [name for name in wanted if name not in frame.columns]
    if missing:
        raise MissingColumnError(source, missing, frame.columns)
    columns = {}
    for name in FORECAST_COLUMNS:
        values = frame[name]
        good = values.dtype.is_numeric() and not values.null_count()
        # Areas may be as large as the square of the largest length.
        most = NUMBER_MAX**2 if name.endswith("_m2") else NUMBER_MAX
        if not good or not values.cast(pl.Float64).is_between(-most, most).all():
            msg = f"{source}: {name}: expected a number in every row, was {values.dtype}"
            raise InputError(msg)
        columns[name] = values.cast(pl.Float64).to_numpy()
    axes = (columns["region_major_m"] > 0.0) & (columns["region_minor_m"] > 0.0)
    east, north = columns["covariance_east_m2"], columns["covariance_north_m2"]
    if not (axes & (east * north > columns["covariance_east_north_m2"] ** 2)).all():
        msg = f"{source}: expected positive axes and positive definite covariances in every row"
        raise InputError(msg)
    return columns
