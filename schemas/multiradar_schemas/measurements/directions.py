"""Optional columns of bearings: elevation, and the position of a moving sensor.

Few recordings have these columns. If they are empty they are omitted, so that journals and requests
stay compatible with earlier versions.
"""

import polars as pl

from multiradar_schemas.measurements.columns import MEASUREMENT_DIRECTIONS, MEASUREMENT_SCHEMA
from multiradar_schemas.measurements.gates import Gate
from multiradar_schemas.measurements.measurement import SOURCE, SOURCE_FIELDS
from multiradar_schemas.measurements.reject import RejectCode

#: Columns of recordings without such bearings, such as converted ones.
PLAIN_SCHEMA = pl.Schema(
    {name: kind for name, kind in MEASUREMENT_SCHEMA.items() if name not in MEASUREMENT_DIRECTIONS}
)

#: Columns used by `sensor_gates`, for the sensor of each row: whether it moves, and whether it
#: measures elevation.
MOVING = "__moving"
MEASURES_ELEVATION = "__measures_elevation"


def has_directions(frame: pl.DataFrame) -> bool:
    """Return whether any measurement has an elevation or the position of its source."""
    return any(
        frame[name].null_count() < len(frame)
        for name in MEASUREMENT_DIRECTIONS
        if name in frame.columns
    )


def without_empty_directions(frame: pl.DataFrame) -> pl.DataFrame:
    """Return measurements without the direction columns if all of them are empty."""
    return frame if has_directions(frame) else frame.drop(MEASUREMENT_DIRECTIONS, strict=False)


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
