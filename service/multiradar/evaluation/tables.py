"""Reading tables into arrays on a plane, with a specific error for unusable values."""

from collections.abc import Sequence

import numpy as np
import polars as pl

from multiradar.errors import InputError, MissingColumnError
from multiradar.evaluation.coverage import CoveredRegion
from multiradar.evaluation.reference_rows import ROW_COLUMN, screened
from multiradar.evaluation.trajectories import NUMBER_MAX, Floats, Indices, Reference, Tracks
from multiradar.geodesy.system_plane import SystemPlane
from multiradar_schemas.documents.contents import other_table

#: Maximum height of an aircraft, m; larger ones count as unknown.
HEIGHT_MAX_M = 1e6
#: Maximum rate of climb, m/s; larger ones count as unknown.
CLIMB_MAX_MPS = 1e3
#: Optional column of `tracks.parquet`.
CLIMB_COLUMN = "vertical_rate_mps"
#: Columns read from `tracks.parquet`.
TRACK_COLUMNS = (
    "time_s", "track_id", "latitude_deg", "longitude_deg", "height_m", "speed_mps",
    "heading_deg", "position_sigma_m", "velocity_sigma_mps", "state", "sensor_id",
)  # fmt: skip
_TRACK_NUMBERS = (
    "time_s", "latitude_deg", "longitude_deg", "speed_mps", "heading_deg", "position_sigma_m",
    "velocity_sigma_mps",
)  # fmt: skip
#: Columns read from `truth.parquet`.
TRUTH_COLUMNS = (
    "time_s", "track_number", "latitude_deg", "longitude_deg", "height_m", "speed_mps",
    "heading_deg",
)  # fmt: skip
#: Columns read from ADS-B reports in `measurements.parquet`.
REPORT_COLUMNS = (
    "time_s", "track_number", "mode_s_address", "latitude_deg", "longitude_deg", "height_m",
)  # fmt: skip

_VELOCITY = ("speed_mps", "heading_deg")


def reference_of_truth(
    frame: pl.DataFrame, source: str, gap_s: float, regions: Sequence[CoveredRegion] = ()
) -> Reference:
    """Return the reference from the truth of a simulation.

    Parameters
    ----------
    frame : DataFrame
        `truth.parquet`; rows without an aircraft are clutter and skipped.
    source : str
        Name used in errors.
    gap_s : float
        Positions farther apart in time are not joined, s.
    regions : sequence of CoveredRegion
        Coverage of the sensors; positions outside are left out.

    Returns
    -------
    Reference
        With velocities; aircraft are named by their track number.

    Raises
    ------
    MissingColumnError
        A column is missing.
    InputError
        The table is empty, a column has no numbers, or no row can be used.
    """
    _require_columns(frame, TRUTH_COLUMNS, source)
    known = (
        with_rows(frame)
        .drop_nulls(["track_number"])
        .with_columns(pl.col("track_number").cast(pl.String).alias("name"))
    )
    numbers = ("time_s", "latitude_deg", "longitude_deg", *_VELOCITY)
    return _reference(known, numbers, source, gap_s, regions)


def reference_of_reports(
    frame: pl.DataFrame, source: str, gap_s: float, regions: Sequence[CoveredRegion] = ()
) -> Reference:
    """Return the reference from ADS-B reports, or from system tracks.

    Parameters
    ----------
    frame : DataFrame
        Rows of `measurements.parquet` or `system_tracks.parquet` with positions.
    source : str
        Name used in errors.
    gap_s : float
        Reports farther apart in time are not joined, s.
    regions : sequence of CoveredRegion
        Coverage of the sensors; positions outside are left out.

    Returns
    -------
    Reference
        With velocities where every row has speed and heading, as in system tracks. Aircraft are
        named by track number, or else by Mode S address; reports with neither are rejected.

    Raises
    ------
    MissingColumnError
        A column is missing.
    InputError
        The table is empty, a column has no numbers, or no row can be used.
    """
    _require_columns(frame, REPORT_COLUMNS, source)
    known = frame.with_columns(aircraft_name())
    numbers = ("time_s", "latitude_deg", "longitude_deg")
    moving = set(_VELOCITY) <= set(frame.columns) and not any(
        frame[name].null_count() for name in _VELOCITY
    )
    return _reference(known, numbers + _VELOCITY * moving, source, gap_s, regions)


def with_rows(frame: pl.DataFrame) -> pl.DataFrame:
    """Return a table with the index of each row, for messages, before rows are selected."""
    return frame if ROW_COLUMN in frame.columns else frame.with_row_index(ROW_COLUMN)


def aircraft_name() -> pl.Expr:
    """Return the aircraft name of a measurement: track number or Mode S address; null for none."""
    return pl.coalesce(pl.col("track_number").cast(pl.String), "mode_s_address").alias("name")


def with_names(frame: pl.DataFrame) -> pl.DataFrame:
    """Return measurements of several sensors with the column `name` of `aircraft_name`.

    Rows with an address alone have the track number that other rows have beside this address, if
    there is one such number.
    """
    both = frame.select("track_number", "mode_s_address").drop_nulls()
    numbers = (
        both.group_by("mode_s_address")
        .agg(pl.col("track_number").n_unique().alias("count"), pl.col("track_number").first())
        .filter(pl.col("count") == 1)
    )
    by_address = dict(numbers.select("mode_s_address", "track_number").iter_rows())
    number = pl.col("mode_s_address").replace_strict(
        by_address, default=None, return_dtype=pl.Int64
    )
    return frame.with_columns(
        pl.coalesce(
            pl.col("track_number").cast(pl.String), number.cast(pl.String), "mode_s_address"
        ).alias("name")
    )


def tracks_of(frame: pl.DataFrame, source: str, plane: SystemPlane, *, tentative: bool) -> Tracks:
    """Return the updates of tracks.

    Parameters
    ----------
    frame : DataFrame
        `tracks.parquet`.
    source : str
        Name used in errors.
    plane : SystemPlane
        The plane of the reference.
    tentative : bool
        Whether tentative tracks count.

    Returns
    -------
    Tracks
        By track, then by time.

    Raises
    ------
    MissingColumnError
        A column is missing.
    InputError
        The table is empty, or a value is not a number.
    OutsidePlaneError
        A track is outside the plane.
    """
    _require_columns(frame, TRACK_COLUMNS, source)
    _require_rows(frame, "tracks", source)
    _require_numbers(frame, _TRACK_NUMBERS, source)
    if frame["track_id"].null_count() or not frame["track_id"].dtype.is_integer():
        msg = f"{source}: track_id: expected a whole number in every row"
        raise InputError(msg)
    firm = frame.filter(pl.col("state") != "tentative")
    shown = frame if tentative else firm
    _require_rows(shown, "confirmed tracks", source)
    rows = shown.sort("track_id", "time_s", maintain_order=True)
    ids, track = np.unique(rows["track_id"].to_numpy(), return_inverse=True)
    position, velocity, ground = _moved(rows, plane)
    return Tracks(
        ids=ids.astype(np.int64),
        track=track.astype(np.int64),
        time_s=rows["time_s"].to_numpy(),
        position_m=position,
        velocity_mps=velocity,
        ground_mps=ground,
        height_m=_heights(rows),
        climb_mps=_climb(rows),
        position_sigma_m=rows["position_sigma_m"].cast(pl.Float64).to_numpy(),
        velocity_sigma_mps=rows["velocity_sigma_mps"].cast(pl.Float64).to_numpy(),
        measured=(rows["state"] != "coasting").to_numpy(),
        sensor_id=rows["sensor_id"].cast(pl.String).fill_null("").to_numpy().astype(np.str_),
        initiated=frame["track_id"].n_unique(),
        confirmed=firm["track_id"].n_unique(),
    )


def _reference(
    frame: pl.DataFrame,
    numbers: tuple[str, ...],
    source: str,
    gap_s: float,
    regions: Sequence[CoveredRegion],
) -> Reference:
    _require_rows(frame.drop_nulls(["name"]), "aircraft positions", source)
    _require_numeric(frame, numbers, source)
    rows, counts = screened(frame, numbers, source, regions)
    if rows.is_empty():
        msg = f"{source}: all {counts.read} rows are rejected; the first: {counts.rejects[0]}"
        raise InputError(msg)
    names, aircraft = np.unique(rows["name"].to_numpy().astype(np.str_), return_inverse=True)
    order = np.lexsort((rows["time_s"].to_numpy(), aircraft))
    rows, aircraft = rows[order], aircraft[order]
    latitude, longitude = _radians(rows, "latitude_deg"), _radians(rows, "longitude_deg")
    plane = SystemPlane.for_sensors(latitude, longitude)
    velocity = None
    if set(_VELOCITY) <= set(numbers):
        position, velocity, _ = _moved(rows, plane)
    else:
        position = np.stack(plane.to_plane(latitude, longitude), axis=-1)
    return Reference(
        plane=plane,
        names=names,
        aircraft=aircraft.astype(np.int64),
        time_s=rows["time_s"].cast(pl.Float64).to_numpy(),
        position_m=position,
        velocity_mps=velocity,
        height_m=_heights(rows),
        gap_s=gap_s,
        counts=counts,
    )


# Position and velocity on the plane, and velocity in true metres.
def _moved(rows: pl.DataFrame, plane: SystemPlane) -> tuple[Floats, Floats, Floats]:
    east, north = plane.to_plane(_radians(rows, "latitude_deg"), _radians(rows, "longitude_deg"))
    heading, speed = _radians(rows, "heading_deg"), rows["speed_mps"].cast(pl.Float64).to_numpy()
    ground = speed[:, None] * np.stack([np.sin(heading), np.cos(heading)], axis=-1)
    matrix = plane.local_matrix(east, north, np.nan_to_num(_heights(rows)))
    velocity = np.linalg.solve(matrix, ground[..., None])[..., 0]
    return np.stack([east, north], axis=-1), velocity, ground


def _radians(rows: pl.DataFrame, column: str) -> Floats:
    angle: Floats = np.radians(rows[column].cast(pl.Float64).to_numpy())
    return angle


def _heights(rows: pl.DataFrame) -> Floats:
    heights = rows["height_m"].cast(pl.Float64).fill_null(np.nan).to_numpy()
    return np.where(np.abs(heights) <= HEIGHT_MAX_M, heights, np.nan)


# Optional: tables of other trackers may lack it.
def _climb(rows: pl.DataFrame) -> Floats:
    if CLIMB_COLUMN not in rows.columns or not rows[CLIMB_COLUMN].dtype.is_numeric():
        return np.full(len(rows), np.nan)
    rate = rows[CLIMB_COLUMN].cast(pl.Float64).fill_null(np.nan).to_numpy()
    return np.where(np.abs(rate) <= CLIMB_MAX_MPS, rate, np.nan)


def _require_columns(frame: pl.DataFrame, wanted: tuple[str, ...], source: str) -> None:
    missing = [name for name in wanted if name not in frame.columns]
    if missing:
        raise MissingColumnError(
            source, missing, frame.columns, other_table(frame.columns, missing)
        )
    kind = frame["height_m"].dtype
    if not (kind.is_numeric() or kind == pl.Null()):
        msg = f"{source}: height_m: expected numbers, was {kind}"
        raise InputError(msg)


def _require_rows(frame: pl.DataFrame, what: str, source: str) -> None:
    if frame.is_empty():
        msg = f"{source}: contains no {what}"
        raise InputError(msg)


def _require_numeric(frame: pl.DataFrame, columns: tuple[str, ...], source: str) -> None:
    for name in columns:
        if not frame[name].dtype.is_numeric():
            msg = f"{source}: {name}: expected numbers, was {frame[name].dtype}"
            raise InputError(msg)
        if name == "time_s" and frame[name].dtype == pl.Float32:
            # Single precision counts Unix times in steps of 128 s.
            msg = f"{source}: time_s: expected float64 or integers, was {frame[name].dtype}"
            raise InputError(msg)


def _require_numbers(frame: pl.DataFrame, columns: tuple[str, ...], source: str) -> None:
    _require_numeric(frame, columns, source)
    for name in columns:
        values = frame[name].cast(pl.Float64).fill_null(np.nan).to_numpy()
        wrong: Indices = np.flatnonzero(~(np.abs(values) <= NUMBER_MAX)).astype(np.int64)
        if name.endswith("latitude_deg"):
            wrong = np.union1d(wrong, np.flatnonzero(np.abs(values) > 90.0))
        if len(wrong):
            value = frame[name][int(wrong[0])]
            msg = f"{source}: {name}: expected a number in row {wrong[0]}, was {value}"
            raise InputError(msg)
        if "_sigma_" in name and np.any(values < 0.0):
            row = int(np.argmax(values < 0.0))
            msg = (
                f"{source}: {name}: expected a sigma of at least 0 in row {row}, "
                f"was {values[row]:g}"
            )
            raise InputError(msg)
