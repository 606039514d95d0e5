"""A batch of measurements as columns: what the pure core sees of the outside world."""

from collections.abc import Collection
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import NDArray

KIND_RADAR = 0
KIND_POSITION = 1
KIND_BEARING = 2
MISSING_INTEGER = -1


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
        Eight letters of six bits (`multiradar_schemas.callsigns`).
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

    def __len__(self) -> int:
        return len(self.time_s)

    def take(self, rows: NDArray[np.intp] | NDArray[np.bool_] | slice) -> Self:
        """Return the chosen rows, in the order asked for."""
        return type(self)(**{field.name: getattr(self, field.name)[rows] for field in fields(self)})

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
        columns = {field.name for field in fields(self)} & set(hidden)
        missing = {
            name: np.full_like(getattr(self, name), MISSING_INTEGER) for name in sorted(columns)
        }
        return replace(self, **missing) if missing else self

    @classmethod
    def concatenate(cls, batches: "list[MeasurementBatch]") -> "MeasurementBatch":
        """Return the rows of all batches, one after the other."""
        if len(batches) == 1:
            return batches[0]
        return MeasurementBatch(
            **{
                field.name: np.concatenate([getattr(batch, field.name) for batch in batches])
                for field in fields(cls)
            }
        )

    @classmethod
    def empty(cls) -> "MeasurementBatch":
        """Return a batch without rows."""
        floats = np.empty(0, np.float64)
        integers = np.empty(0, np.int64)
        return MeasurementBatch(
            time_s=floats,
            sensor=np.empty(0, np.int32),
            kind=np.empty(0, np.int8),
            range_m=floats,
            azimuth_rad=floats,
            latitude_rad=floats,
            longitude_rad=floats,
            height_m=floats,
            mode_3a=np.empty(0, np.int32),
            mode_s_address=integers,
            track_number=integers,
            callsign=integers,
        )
