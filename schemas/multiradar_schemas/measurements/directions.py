"""What a bearing may tell beside its azimuth: the elevation, and where a moving source was.

Few recordings have these columns. Where no row fills them they are left out, so that a journal or
a request holds what it held before there were any.
"""

import polars as pl

from multiradar_schemas.arrow import MEASUREMENT_DIRECTIONS, MEASUREMENT_SCHEMA
from multiradar_schemas.measurements.gates import Gate
from multiradar_schemas.measurements.measurement import SOURCE, SOURCE_FIELDS
from multiradar_schemas.measurements.reject import RejectCode

#: Columns of recordings that have no bearings of this kind, such as those that are converted.
PLAIN_SCHEMA = pl.Schema(
    {name: kind for name, kind in MEASUREMENT_SCHEMA.items() if name not in MEASUREMENT_DIRECTIONS}
)

#: Columns that `sensor_gates` looks at, of the sensor of each row: whether it moves, and whether it
#: measures elevations.
MOVING = "__moving"
MEASURES_ELEVATION = "__measures_elevation"


def has_directions(frame: pl.DataFrame) -> bool:
    """Return whether a row of measurements tells an elevation or the place of its source."""
    return any(
        frame[name].null_count() < len(frame)
        for name in MEASUREMENT_DIRECTIONS
        if name in frame.columns
    )


def lean(frame: pl.DataFrame) -> pl.DataFrame:
    """Return measurements without the columns of directions where no row fills any of them."""
    return frame if has_directions(frame) else frame.drop(MEASUREMENT_DIRECTIONS, strict=False)


def sensor_gates() -> tuple[Gate, ...]:
    """Return what rows must pass for their sensor to have seen them so.

    Returns
    -------
    tuple of Gate
        They look at `MOVING` and `MEASURES_ELEVATION` beside the columns of `MEASUREMENT_SCHEMA`.
    """
    bearing = pl.col("kind") == "bearing"
    gates = [
        Gate(
            RejectCode.UNKNOWN_FIELD,
            "elevation_deg",
            "no elevation of a sensor without elevation_sigma_deg",
            bearing & pl.col("elevation_deg").is_not_null() & ~pl.col(MEASURES_ELEVATION),
        )
    ]
    for name in SOURCE_FIELDS:
        given = pl.col(name).is_not_null()
        gates += [
            Gate(
                RejectCode.UNKNOWN_FIELD,
                name,
                "no place of the source but of bearings of a sensor that is moving",
                given & ~(bearing & pl.col(MOVING)),
            ),
            Gate(
                RejectCode.MISSING_FIELD,
                name,
                f"all of {SOURCE} of a sensor that is moving",
                ~given & bearing & pl.col(MOVING),
            ),
        ]
    return tuple(gates)
