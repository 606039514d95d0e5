"""A batch of measurements as columns: what the pure core sees of the outside world."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.columns import column_types, empty_columns, joined_columns

KIND_RADAR = 0
KIND_POSITION = 1
KIND_BEARING = 2
MISSING_INTEGER = -1


class Directions(NamedTuple):
    """What bearings tell beside the azimuth; a missing number is NaN.

    Attributes
    ----------
    elevation_rad : (n,) float64
        Elevation above the horizontal plane at the source.
    source_latitude_rad, source_longitude_rad, source_height_m : (n,) float64
        Where a moving source was at the time of the measurement; NaN for those that stand still.
    """

    elevation_rad: NDArray[np.float64]
    source_latitude_rad: NDArray[np.float64]
    source_longitude_rad: NDArray[np.float64]
    source_height_m: NDArray[np.float64]

    @property
    def moves(self) -> NDArray[np.bool_]:
        """Which rows are of a source that moves, (n,)."""
        return ~np.isnan(self.source_latitude_rad)

    @classmethod
    def none(cls, count: int) -> Self:
        """Return those of rows that tell nothing of the kind."""
        return cls(*np.full((len(cls._fields), count), np.nan))

    @classmethod
    def told(cls, columns: Self) -> Self | None:
        """Return the columns, or None where they hold nothing at all."""
        return None if all(np.isnan(column).all() for column in columns) else columns


@dataclass(frozen=True, slots=True)
class MeasurementBatch:
    """Measurements in the order of their arrival, one row each.

    A missing number is NaN, a missing integer is −1; neither leaves this type unexamined. What is
    known of the biases of a sensor (`SensorTable.known_bias`) is taken off already; what is
    estimated is not.

    Attributes
    ----------
    time_s : (n,) float64
        UTC, seconds since the Unix epoch (or time of day going on past midnight).
    sensor : (n,) int32
        Index into the sensor table.
    kind : (n,) int8
        `KIND_RADAR` (range and azimuth), `KIND_POSITION` (latitude and longitude) or
        `KIND_BEARING`.
    range_m, azimuth_rad : (n,) float64
        Measured slant range, and azimuth clockwise from true north at the sensor.
    latitude_rad, longitude_rad : (n,) float64
        Reported WGS 84 position.
    height_m : (n,) float64
        Height above the ellipsoid, as measured.
    mode_3a : (n,) int32
        Mode 3/A code as a number (four octal digits).
    mode_s_address : (n,) int64
        ICAO 24-bit address.
    track_number : (n,) int64
        The recording's own number of the aircraft.
    callsign : (n,) int64
        Eight letters of six bits (`multiradar_schemas.measurements.callsigns`).
    directions : Directions or None
        What bearings tell beside the azimuth; None where no row does, as in most batches.
    """

    time_s: NDArray[np.float64]
    sensor: NDArray[np.int32]
    kind: NDArray[np.int8]
    range_m: NDArray[np.float64]
    azimuth_rad: NDArray[np.float64]
    latitude_rad: NDArray[np.float64]
    longitude_rad: NDArray[np.float64]
    height_m: NDArray[np.float64]
    mode_3a: NDArray[np.int32]
    mode_s_address: NDArray[np.int64]
    track_number: NDArray[np.int64]
    callsign: NDArray[np.int64]
    directions: Directions | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_] | slice) -> Self:
        """Return the chosen rows, in the order asked for."""
        columns = {name: getattr(self, name)[rows] for name in COLUMNS}
        seen = self.directions
        if seen is not None:
            seen = Directions.told(Directions(*(column[rows] for column in seen)))
        return type(self)(**columns, directions=seen)

    def without(self, hidden: Collection[str]) -> Self:
        """Return the rows without some of their identity.

        Parameters
        ----------
        hidden : collection of str
            Names of columns of integers; names that are no columns are passed over.

        Returns
        -------
        MeasurementBatch
            The same rows, these columns missing.
        """
        columns = set(COLUMNS) & set(hidden)
        missing = {
            name: np.full_like(getattr(self, name), MISSING_INTEGER) for name in sorted(columns)
        }
        return replace(self, **missing) if missing else self

    @classmethod
    def concatenate(cls, batches: "list[MeasurementBatch]") -> "MeasurementBatch":
        """Return the rows of all batches, one after the other."""
        if len(batches) == 1:
            return batches[0]
        seen = None
        if any(batch.directions is not None for batch in batches):
            parts = [batch.directions or Directions.none(len(batch)) for batch in batches]
            seen = Directions(*(np.concatenate(column) for column in zip(*parts, strict=True)))
        return MeasurementBatch(**joined_columns(MeasurementBatch, batches), directions=seen)

    @classmethod
    def empty(cls) -> "MeasurementBatch":
        """Return a batch without rows."""
        return MeasurementBatch(**empty_columns(MeasurementBatch), directions=None)


#: The columns of numbers that every batch has.
COLUMNS = tuple(column_types(MeasurementBatch))
