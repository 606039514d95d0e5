"""Simulated measurements and their truth as columns."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Aircraft index of clutter.
NO_AIRCRAFT = -1


@dataclass(frozen=True, slots=True)
class Measurements:
    """Measurements by ascending time stamp, then sensor, then aircraft; a missing number is NaN.

    Attributes
    ----------
    time_s : (n,) float64
        Time stamps, from the start of the scenario.
    sensor, aircraft : (n,) int32
        Indices; `NO_AIRCRAFT` for clutter.
    range_m, azimuth_rad : (n,) float64
        Measured by radars.
    latitude_rad, longitude_rad : (n,) float64
        Reported by ADS-B and multilateration.
    height_m : (n,) float64
        Reported height.
    garble : (n,) int32
        Bits of the Mode 3/A code that are garbled.
    outlier : (n,) bool
        Whether it has a gross error.
    true_latitude_rad, true_longitude_rad, true_height_m, true_speed_mps, true_heading_rad : (n,)
        State of the aircraft at the time stamp: ground speed, heading clockwise from true north at
        the aircraft.
    elevation_rad : (n,) float64
        Measured by direction finders beside the azimuth.
    source_latitude_rad, source_longitude_rad, source_height_m : (n,) float64
        Position of a moving sensor.
    registers : (n, 3) or (n, 0) int64
        Content of the registers 4,0, 5,0 and 6,0 received with it, −1 for none; without columns if
        no sensor receives any.
    """

    time_s: Floats
    sensor: NDArray[np.int32]
    aircraft: NDArray[np.int32]
    range_m: Floats
    azimuth_rad: Floats
    latitude_rad: Floats
    longitude_rad: Floats
    height_m: Floats
    garble: NDArray[np.int32]
    outlier: NDArray[np.bool_]
    true_latitude_rad: Floats
    true_longitude_rad: Floats
    true_height_m: Floats
    true_speed_mps: Floats
    true_heading_rad: Floats
    elevation_rad: Floats
    source_latitude_rad: Floats
    source_longitude_rad: Floats
    source_height_m: Floats
    registers: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def bearings(self) -> NDArray[np.bool_]:
        """Measurements with an azimuth and no range."""
        return np.asarray(np.isnan(self.range_m) & ~np.isnan(self.azimuth_rad))


def no_measurements() -> Measurements:
    """Return no measurements."""
    nothing, integers = np.empty(0), np.empty(0, np.int32)
    return Measurements(
        nothing, integers, integers, nothing, nothing, nothing, nothing, nothing, integers,
        np.empty(0, np.bool_), nothing, nothing, nothing, nothing, nothing,
        nothing, nothing, nothing, nothing, no_registers(0),
    )  # fmt: skip


def no_registers(count: int) -> NDArray[np.int64]:
    """Return the registers of measurements by a sensor that receives none."""
    return np.empty((count, 0), np.int64)


def merged(parts: Sequence[Measurements]) -> Measurements:
    """Return the measurements of all parts, sorted by time stamp, sensor, aircraft."""
    columns = {
        field.name: _joined([getattr(part, field.name) for part in parts])
        for field in fields(Measurements)
    }
    order = np.lexsort((columns["aircraft"], columns["sensor"], columns["time_s"]))
    return Measurements(**{name: column[order] for name, column in columns.items()})


def _joined(parts: list[NDArray[Any]]) -> NDArray[Any]:
    width = max(part.shape[1] for part in parts) if parts[0].ndim == 2 else 0
    if not width:
        return np.concatenate(parts)
    return np.concatenate(
        [part if part.shape[1] else np.full((len(part), width), -1) for part in parts]
    )
