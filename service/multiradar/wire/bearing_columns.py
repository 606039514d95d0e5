"""Columns of bearings between wire and core: elevations, and positions of moving sensors."""

import numpy as np
import polars as pl

from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.tracking.input.measurements import Directions, MeasurementBatch, or_none
from multiradar_schemas.measurements.columns import MEASUREMENT_DIRECTIONS
from multiradar_schemas.measurements.directions import MEASURES_ELEVATION, MOVING, has_directions


def with_movers(frame: pl.DataFrame, table: SensorTable, sensor: str) -> pl.DataFrame:
    """Return measurements with the columns required by the gates of directions in the schemas.

    Parameters
    ----------
    frame : DataFrame
        Measurements.
    table : SensorTable
        The sensors.
    sensor : str
        Column with the index of the sensor, null for unknown sensors.
    """
    index = frame[sensor]
    measures = pl.Series(~np.isnan(table.elevation_sigma_rad))
    return frame.with_columns(
        pl.Series(table.moving).gather(index).fill_null(value=False).alias(MOVING),
        measures.gather(index).fill_null(value=False).alias(MEASURES_ELEVATION),
    )


def directions_of(frame: pl.DataFrame) -> Directions | None:
    """Return elevations and sensor positions of accepted bearings, None if there are none.

    Parameters
    ----------
    frame : DataFrame
        Columns of `MEASUREMENT_SCHEMA`, degrees; the elevations of other kinds are not used.
    """
    if not has_directions(frame):
        return None
    bearing = pl.col("kind") == "bearing"
    columns = frame.select(
        pl.when(bearing).then(name).fill_null(np.nan).alias(name) for name in MEASUREMENT_DIRECTIONS
    )
    # Normalise -0.0 to 0.0: rows are ordered and compared by content.
    elevation, latitude, longitude, height = (
        column.to_numpy(writable=True) + 0.0 for column in columns
    )
    return or_none(
        Directions(np.radians(elevation), np.radians(latitude), np.radians(longitude), height)
    )


def direction_rows(batch: MeasurementBatch, row: int) -> dict[str, float]:
    """Return elevation and sensor position of a row as columns of the wire, degrees."""
    if batch.directions is None:
        return {}
    elevation, latitude, longitude, height = (float(column[row]) for column in batch.directions)
    angles = np.degrees([elevation, latitude, longitude]).tolist()
    values = dict(zip(MEASUREMENT_DIRECTIONS, [*angles, height], strict=True))
    return {name: value for name, value in values.items() if not np.isnan(value)}
