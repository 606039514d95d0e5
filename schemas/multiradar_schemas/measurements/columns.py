"""Columns of measurements: `measurements.parquet` and Arrow bodies."""

from functools import lru_cache

import polars as pl

from multiradar_schemas.columns import table_schema
from multiradar_schemas.measurements.aircraft_data import AircraftData
from multiradar_schemas.measurements.measurement import RadarMeasurement

#: Required columns.
MEASUREMENT_REQUIRED = ("time_s", "sensor_id", "kind")

#: `measurements.parquet` and Arrow bodies.
MEASUREMENT_SCHEMA = table_schema(
    RadarMeasurement,
    first=(
        *MEASUREMENT_REQUIRED, "range_m", "azimuth_deg", "latitude_deg", "longitude_deg",
        "height_m", "mode_3a", "mode_s_address", "track_number",
    ),
    without={"time_ns", "time"},
)  # fmt: skip

_NAMES = MEASUREMENT_SCHEMA.names()
# Simple types are equal if their classes are, which compares faster.
_CLASSES = {name: type(kind) for name, kind in MEASUREMENT_SCHEMA.items()}
_NO_ROWS = pl.DataFrame(schema=MEASUREMENT_SCHEMA)
#: Rows up to which absent columns are kept for the next message of as many.
_SHORT_ROWS = 64
# Built once: it takes longer than their evaluation on a short message.
_GIVEN = {name: pl.col(name).cast(kind) for name, kind in MEASUREMENT_SCHEMA.items()}
_ABSENT = {name: pl.lit(None, kind).alias(name) for name, kind in MEASUREMENT_SCHEMA.items()}

#: Optional columns of bearings beside the azimuth.
MEASUREMENT_DIRECTIONS = (
    "elevation_deg",
    "source_latitude_deg",
    "source_longitude_deg",
    "source_height_m",
)

#: Optional column of the ground status.
ON_GROUND = "on_ground"

#: Optional columns of the accuracy of a position, and of how a radar detected the aircraft.
POSITION_SIGMA = "position_sigma_m"
DETECTION = "detection"

#: Optional columns of aircraft-derived data.
MEASUREMENT_AIRCRAFT = tuple(AircraftData.model_fields)

#: Columns that may be absent in recordings of earlier versions.
MEASUREMENT_LATER = (
    "callsign", ON_GROUND, POSITION_SIGMA, DETECTION, *MEASUREMENT_DIRECTIONS,
    *MEASUREMENT_AIRCRAFT,
)  # fmt: skip


def complete(frame: pl.DataFrame) -> pl.DataFrame:
    """Return exactly the columns of `MEASUREMENT_SCHEMA`; absent ones are null."""
    names = frame.columns
    classes = dict(zip(names, map(type, frame.dtypes), strict=True))
    given = [name for name in names if name in _CLASSES]
    if not given or any(classes[name] is not _CLASSES[name] for name in given):
        return frame.select((_GIVEN if name in classes else _ABSENT)[name] for name in _GIVEN)
    if names == _NAMES:
        return frame
    if len(given) == len(_NAMES):
        return frame[:, _NAMES]
    # Cheaper on a short message than a selection with literals, or a concatenation.
    if frame.height <= _SHORT_ROWS:
        nulls = _nulls(frame.height)
        return frame.hstack([nulls[name] for name in _NAMES if name not in classes])[:, _NAMES]
    return pl.concat([_NO_ROWS, frame[:, given]], how="diagonal")


@lru_cache(maxsize=_SHORT_ROWS + 1)
def _nulls(rows: int) -> dict[str, pl.Series]:
    return {one.name: one for one in _NO_ROWS.clear(rows).get_columns()}
