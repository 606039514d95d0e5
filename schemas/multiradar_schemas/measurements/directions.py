"""Optional columns: directions of bearings, ground status, accuracy, detection, aircraft data.

Few recordings have these columns. If they are empty they are omitted, so that journals and requests
stay compatible with earlier versions.
"""

from collections.abc import Sequence

import polars as pl

from multiradar_schemas.measurements.columns import (
    DETECTION,
    MEASUREMENT_AIRCRAFT,
    MEASUREMENT_DIRECTIONS,
    MEASUREMENT_SCHEMA,
    ON_GROUND,
    POSITION_SIGMA,
)
from multiradar_schemas.measurements.gates import Gate
from multiradar_schemas.measurements.measurement import SOURCE, SOURCE_FIELDS
from multiradar_schemas.reject import RejectCode

#: Columns that are omitted, each by itself, where no measurement has a value.
_SINGLE = (ON_GROUND, POSITION_SIGMA, DETECTION, *MEASUREMENT_AIRCRAFT)
_OPTIONAL = (*MEASUREMENT_DIRECTIONS, *_SINGLE)

#: Columns of recordings without any of these, such as converted text dumps.
PLAIN_SCHEMA = pl.Schema(
    {name: kind for name, kind in MEASUREMENT_SCHEMA.items() if name not in _OPTIONAL}
)
#: The same with the ground status: recordings of Mode S, multilateration and ADS-B.
PLAIN_GROUND_SCHEMA = pl.Schema({**PLAIN_SCHEMA, ON_GROUND: pl.Boolean()})
#: The same with accuracy and detection, of ASTERIX reports.
REPORT_SCHEMA = pl.Schema(
    {**PLAIN_GROUND_SCHEMA, POSITION_SIGMA: pl.Float64(), DETECTION: pl.String()}
)

#: Columns used by `sensor_gates`, for the sensor of each row: whether it moves, and whether it
#: measures elevation.
MOVING = "__moving"
MEASURES_ELEVATION = "__measures_elevation"


# Columns that are counted one by one.
_FEW_COLUMNS = 5


def has_directions(frame: pl.DataFrame) -> bool:
    """Return whether any measurement has an elevation or the position of its source."""
    return bool(_filled(frame, MEASUREMENT_DIRECTIONS))


def has_column(frame: pl.DataFrame, name: str) -> bool:
    """Return whether any measurement has a value of an optional column."""
    return bool(_filled(frame, (name,)))


def has_aircraft_data(frame: pl.DataFrame) -> bool:
    """Return whether any measurement has aircraft-derived data."""
    return bool(_filled(frame, MEASUREMENT_AIRCRAFT))


def filled_columns(frame: pl.DataFrame) -> frozenset[str]:
    """Return the optional columns that `without_empty_columns` keeps."""
    filled = _filled(frame, _OPTIONAL)
    directed = not filled.isdisjoint(MEASUREMENT_DIRECTIONS)
    return filled.union(MEASUREMENT_DIRECTIONS) if directed else filled


def without_empty_columns(frame: pl.DataFrame) -> pl.DataFrame:
    """Return measurements without the optional columns that are empty."""
    kept = filled_columns(frame)
    return frame[:, [one for one in frame.columns if one in kept or one not in _OPTIONAL]]


def _filled(frame: pl.DataFrame, names: Sequence[str]) -> frozenset[str]:
    rows, columns = frame.height, frame.columns
    if len(names) <= _FEW_COLUMNS:
        given = [name for name in names if name in columns]
        return frozenset(name for name in given if frame.get_column(name).null_count() < rows)
    # Of all columns at once, which costs no more than that of some.
    nulls = dict(zip(columns, frame.null_count().row(0), strict=True))
    return frozenset(name for name in names if nulls.get(name, rows) < rows)


def sensor_gates() -> tuple[Gate, ...]:
    """Return gates for rows that their sensor cannot have measured.

    Returns
    -------
    tuple of Gate
        They use `MOVING` and `MEASURES_ELEVATION` and the columns of `MEASUREMENT_SCHEMA`.
    """
    bearing = pl.col("kind") == "bearing"
    gates = [
        Gate(
            RejectCode.UNKNOWN_FIELD,
            "elevation_deg",
            "no elevation from a sensor without elevation_sigma_deg",
            bearing & pl.col("elevation_deg").is_not_null() & ~pl.col(MEASURES_ELEVATION),
        )
    ]
    for name in SOURCE_FIELDS:
        given = pl.col(name).is_not_null()
        gates += [
            Gate(
                RejectCode.UNKNOWN_FIELD,
                name,
                "no source position except for bearings of a moving sensor",
                given & ~(bearing & pl.col(MOVING)),
            ),
            Gate(
                RejectCode.MISSING_FIELD,
                name,
                f"all of {SOURCE} from a moving sensor",
                ~given & bearing & pl.col(MOVING),
            ),
        ]
    return tuple(gates)
