"""A batch of measurements as columns: input of the pure core."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import NamedTuple, Self

import numpy as np
from numpy.typing import NDArray

from multiradar.tracking.columns import column_types, empty_columns, joined_columns
from multiradar.tracking.roster import MISSING


class Directions(NamedTuple):
    """Elevations of bearings and positions of moving sources; a missing number is NaN.

    Attributes
    ----------
    elevation_rad : (n,) float64
        Elevation above the horizontal plane at the source.
    source_latitude_rad, source_longitude_rad, source_height_m : (n,) float64
        Position of a moving source at the time of the measurement; NaN for fixed ones.
    """

    elevation_rad: NDArray[np.float64]
    source_latitude_rad: NDArray[np.float64]
    source_longitude_rad: NDArray[np.float64]
    source_height_m: NDArray[np.float64]

    @property
    def moves(self) -> NDArray[np.bool_]:
        """Rows of moving sources, (n,)."""
        return ~np.isnan(self.source_latitude_rad)

    @classmethod
    def none(cls, count: int) -> Self:
        """Return columns without any value."""
        return cls(*np.full((len(cls._fields), count), np.nan))

    @classmethod
    def or_none(cls, columns: Self) -> Self | None:
        """Return the columns, or None where all are empty."""
        return None if all(np.isnan(column).all() for column in columns) else columns


@dataclass(frozen=True, slots=True)
class MeasurementBatch:
    """Measurements in the order of their arrival, one row each.

    A missing number is NaN, a missing integer is −1. Known biases of a sensor
    (`SensorTable.known_bias`) are already subtracted, estimated ones are not.

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
        Track number of the aircraft in the recording.
    callsign : (n,) int64
        Eight characters of six bits (`multiradar_schemas.measurements.callsigns`).
    directions : Directions or None
        Elevations and moving sources of bearings; None without any, as in most batches.
    on_ground : (n,) int8 or None
        Reported ground status: 1 on the ground, 0 airborne, −1 unknown; None without any.
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
    on_ground: NDArray[np.int8] | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    def select(self, rows: NDArray[np.intp] | NDArray[np.bool_] | slice) -> Self:
        """Return the selected rows, in the given order."""
        columns = {name: getattr(self, name)[rows] for name in COLUMNS}
        seen = self.directions
        if seen is not None:
            seen = Directions.or_none(Directions(*(column[rows] for column in seen)))
        status = None if self.on_ground is None else _known_or_none(self.on_ground[rows])
        return type(self)(**columns, directions=seen, on_ground=status)

    def ground_status(self) -> NDArray[np.int64]:
        """Return the ground status of each row, −1 where unknown, (n,)."""
        if self.on_ground is None:
            return np.full(len(self), MISSING, np.int64)
        return self.on_ground.astype(np.int64)

    def without(self, hidden: Collection[str]) -> Self:
        """Return the rows with some identity columns blanked.

        Parameters
        ----------
        hidden : collection of str
            Names of integer columns; other names are ignored.

        Returns
        -------
        MeasurementBatch
            The same rows, with these columns missing.
        """
        columns = set(COLUMNS) & set(hidden)
        missing = {name: np.full_like(getattr(self, name), MISSING) for name in sorted(columns)}
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
        status = None
        if any(batch.on_ground is not None for batch in batches):
            status = np.concatenate([batch.ground_status() for batch in batches]).astype(np.int8)
        return MeasurementBatch(
            **joined_columns(MeasurementBatch, batches), directions=seen, on_ground=status
        )

    @classmethod
    def empty(cls) -> "MeasurementBatch":
        """Return a batch without rows."""
        return MeasurementBatch(**empty_columns(MeasurementBatch), directions=None, on_ground=None)


def _known_or_none(status: NDArray[np.int8]) -> NDArray[np.int8] | None:
    """Return the ground status of rows, None where all are unknown."""
    return status if (status != MISSING).any() else None


#: Numeric columns of every batch.
COLUMNS = tuple(column_types(MeasurementBatch))
