"""Columns of aircraft-derived data between wire and core: angles in degrees and radians."""

import numpy as np
import polars as pl

from multiradar.estimation.measurement.aircraft_data import AircraftData
from multiradar.tracking.input.measurements import MeasurementBatch, or_none
from multiradar_schemas.measurements.columns import MEASUREMENT_AIRCRAFT
from multiradar_schemas.measurements.directions import has_aircraft_data

_ANGLES = ("_deg", "_deg_s")


def aircraft_data_of(frame: pl.DataFrame) -> AircraftData | None:
    """Return the aircraft-derived data of accepted measurements, None if there are none.

    Parameters
    ----------
    frame : DataFrame
        Columns of `MEASUREMENT_SCHEMA`.
    """
    if not has_aircraft_data(frame):
        return None
    columns = (frame[name].fill_null(np.nan).to_numpy() for name in MEASUREMENT_AIRCRAFT)
    # Normalise -0.0 to 0.0: rows are ordered and compared by content.
    return or_none(
        AircraftData(
            *(
                (np.radians(column) if name.endswith(_ANGLES) else column) + 0.0
                for name, column in zip(MEASUREMENT_AIRCRAFT, columns, strict=True)
            )
        )
    )


def aircraft_data_rows(batch: MeasurementBatch, row: int) -> dict[str, float]:
    """Return the aircraft-derived data of a row as columns of the wire, without missing values."""
    if batch.aircraft_data is None:
        return {}
    values = zip(MEASUREMENT_AIRCRAFT, batch.aircraft_data, strict=True)
    return {
        name: float(np.degrees(column[row]) if name.endswith(_ANGLES) else column[row])
        for name, column in values
        if not np.isnan(column[row])
    }
