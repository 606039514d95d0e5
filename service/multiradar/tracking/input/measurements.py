"""A batch of measurements as columns: input of the pure core."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.aircraft_data import AircraftData
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


#: Single columns that are None where no row has a value: type, and the mark of a missing value.
SINGLE: dict[str, tuple[type[np.generic], float]] = {
    "on_ground": (np.int8, MISSING),
    "position_sigma_m": (np.float64, np.nan),
    "detection": (np.int8, MISSING),
}
#: Groups of columns that few batches have: None where no row has a value.
Rare = TypeVar("Rare", Directions, AircraftData)


def or_none(columns: Rare) -> Rare | None:
    """Return the columns, or None where all are empty.

    Parameters
    ----------
    columns : Directions or AircraftData
        A missing number is NaN.

    Returns
    -------
    Directions, AircraftData or None
        The same columns.
    """
    return None if all(np.isnan(column).all() for column in columns) else columns


@dataclass(frozen=True, slots=True)
class MeasurementBatch:
    """Measurements in the order of their arrival, one row each.

    A missing number is NaN, a missing integer is −1. Known biases of a sensor
    (`SensorTable.known_bias`) are already subtracted, estimated ones are not; ranges are already
    free of refraction.

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
    aircraft_data : AircraftData or None
        What the aircraft reports about its flight; None without any.
    position_sigma_m : (n,) float64 or None
        Accuracy of a reported position, 1 sigma on each axis, NaN where that of the sensor applies;
        None without any.
    detection : (n,) int8 or None
        How a radar detected the aircraft (`DETECTIONS` of the schemas), −1 unknown; None without
        any.
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
    aircraft_data: AircraftData | None = None
    position_sigma_m: NDArray[np.float64] | None = None
    detection: NDArray[np.int8] | None = None

    def __len__(self) -> int:
        return len(self.time_s)

    def select(self, rows: NDArray[np.intp] | NDArray[np.bool_] | slice) -> Self:
        """Return the selected rows, in the given order."""
        columns: dict[str, Any] = {name: getattr(self, name)[rows] for name in COLUMNS}
        columns |= {name: _selected_single(getattr(self, name), rows) for name in SINGLE}
        return type(self)(
            **columns,
            directions=_selected(self.directions, rows),
            aircraft_data=_selected(self.aircraft_data, rows),
        )

    def ground_status(self) -> NDArray[np.int64]:
        """Return the ground status of each row, −1 where unknown, (n,)."""
        return self._whole("on_ground").astype(np.int64)

    def detections(self) -> NDArray[np.int64]:
        """Return how each row was detected, −1 where unknown, (n,)."""
        return self._whole("detection").astype(np.int64)

    def accuracies(self) -> NDArray[np.float64]:
        """Return the accuracies of reports, m, NaN where that of the sensor applies, (n,)."""
        return self._whole("position_sigma_m").astype(np.float64)

    def _whole(self, name: str) -> NDArray[Any]:
        kind, missing = SINGLE[name]
        column = getattr(self, name)
        return np.full(len(self), missing, kind) if column is None else np.asarray(column)

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
        sizes = [len(batch) for batch in batches]
        columns: dict[str, Any] = joined_columns(MeasurementBatch, batches)
        columns |= {
            name: np.concatenate([batch._whole(name) for batch in batches])
            for name in SINGLE
            if any(getattr(batch, name) is not None for batch in batches)
        }
        return MeasurementBatch(
            **columns,
            directions=_joined(Directions, [batch.directions for batch in batches], sizes),
            aircraft_data=_joined(AircraftData, [one.aircraft_data for one in batches], sizes),
        )

    @classmethod
    def empty(cls) -> "MeasurementBatch":
        """Return a batch without rows."""
        columns: dict[str, Any] = empty_columns(MeasurementBatch)
        columns |= dict.fromkeys((*SINGLE, "directions", "aircraft_data"))
        return MeasurementBatch(**columns)


def _selected_single(
    column: NDArray[Any] | None, rows: NDArray[np.intp] | NDArray[np.bool_] | slice
) -> NDArray[Any] | None:
    """Return rows of an optional column, None where no row has a value."""
    if column is None:
        return None
    some = column[rows]
    # −1 and NaN are missing; an accuracy is above 0.
    return some if (some >= 0).any() else None


def _selected(
    columns: Rare | None, rows: NDArray[np.intp] | NDArray[np.bool_] | slice
) -> Rare | None:
    if columns is None:
        return None
    return or_none(type(columns)(*(column[rows] for column in columns)))


def _joined(kind: type[Rare], parts: Sequence[Rare | None], sizes: Sequence[int]) -> Rare | None:
    """Return the columns of all parts, one part after the other; None where all parts are None."""
    if all(part is None for part in parts):
        return None
    whole = [
        np.full((len(kind._fields), size), np.nan) if part is None else part
        for part, size in zip(parts, sizes, strict=True)
    ]
    return kind(*(np.concatenate(column) for column in zip(*whole, strict=True)))


#: Numeric columns of every batch.
COLUMNS = tuple(column_types(MeasurementBatch))
