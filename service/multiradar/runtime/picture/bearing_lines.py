"""Bearings of the air picture: lines from the sensor to the track that they updated."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_BEARING
from multiradar.estimation.measurement.known_biases import polar_without_biases
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation, geodetic_to_ecef
from multiradar.runtime.picture.plot_columns import plot_columns
from multiradar.runtime.picture.selection import Area, Columns, at, inside

#: Length of a bearing that updated no track, of a sensor without a range, m.
LENGTH_ASSUMED_M = 250_000.0
_SOURCE = ("source_latitude_deg", "source_longitude_deg")

Floats = NDArray[np.float64]


def marks(
    rows: NDArray[np.void], estimates: Floats, sensors: SensorTable
) -> dict[str, NDArray[Any]]:
    """Return plots and bearings together; `mark_tables` separates them.

    Parameters
    ----------
    rows : (n,) ndarray of `PLOT_DTYPE`
        The plots and bearings.
    estimates : (s, p) float64
        Biases by sensor and parameter, m, rad, 1, s.
    sensors : SensorTable
        The sensors.

    Returns
    -------
    dict of (n,) ndarray
        As `plot_columns`, for bearings the end of the line. If there are any, also
        `source_latitude_deg` and `source_longitude_deg`, the position of their sensor at the time;
        NaN for plots.
    """
    columns = plot_columns(rows, estimates, sensors)
    bearings = rows["kind"] == KIND_BEARING
    if not bearings.any():
        return columns
    source_rad, ends = _lines(rows[bearings], estimates, sensors)
    names = ("latitude_deg", "longitude_deg", "corrected_latitude_deg", "corrected_longitude_deg")
    for name, values in zip(names, ends, strict=True):
        columns[name][bearings] = np.degrees(values)
    for name, values in zip(_SOURCE, source_rad, strict=True):
        columns[name] = np.full(len(rows), np.nan)
        columns[name][bearings] = np.degrees(values)
    return columns


def mark_tables(columns: Columns, area: Area | None) -> dict[str, Columns]:
    """Return the tables `plots` and, if there are any, `bearings` of a frame.

    Parameters
    ----------
    columns : dict of (n,) ndarray
        As of `marks`; the positions of sources may be absent, or NaN everywhere.
    area : Area or None
        Plots outside are left out; bearings may cross it and are not.
    """
    plots = {name: column for name, column in columns.items() if name not in _SOURCE}
    of_bearings = np.isfinite(columns.get(_SOURCE[0], np.empty(0)))
    tables = {}
    if of_bearings.any():
        plots = at(plots, ~of_bearings)
        tables["bearings"] = at(columns, of_bearings)
    if area is not None:
        plots = at(plots, inside(area, plots["latitude_deg"], plots["longitude_deg"]))
    return {"plots": plots, **tables}


def directions_to(
    rows: NDArray[np.void], sensors: SensorTable, latitude_rad: Floats, longitude_rad: Floats
) -> Floats:
    """Return the azimuths of positions from the sensors of bearings, rad.

    Parameters
    ----------
    rows : (n,) ndarray of `PLOT_DTYPE`
        The bearings.
    sensors : SensorTable
        The sensors.
    latitude_rad, longitude_rad : (n,) float64
        A position for each.
    """
    seen = _seen(*_sources(rows, sensors), latitude_rad, longitude_rad)
    return np.arctan2(seen[:, 0], seen[:, 1])


# Latitudes and longitudes of the sensors at the time of their bearings, rad.
def _sources(rows: NDArray[np.void], sensors: SensorTable) -> tuple[Floats, Floats]:
    reported, of_sensor = rows["directions"], rows["sensor"]
    moves = np.isfinite(reported[:, 1])
    return (
        np.where(moves, reported[:, 1], sensors.latitude_rad[of_sensor]),
        np.where(moves, reported[:, 2], sensors.longitude_rad[of_sensor]),
    )


# Positions on the ground to the east, north and up of sources, m.
def _seen(latitude: Floats, longitude: Floats, to_latitude: Floats, to_longitude: Floats) -> Floats:
    apart = geodetic_to_ecef(to_latitude, to_longitude, 0.0) - geodetic_to_ecef(
        latitude, longitude, 0.0
    )
    seen: Floats = np.einsum("kij,kj->ki", enu_rotation(latitude, longitude), apart)
    return seen


# Positions of the sensors, and the ends of the lines as measured and without biases: latitudes and
# longitudes, rad. On the plane tangent at the sensor a direction of constant azimuth is straight.
def _lines(
    rows: NDArray[np.void], estimates: Floats, sensors: SensorTable
) -> tuple[tuple[Floats, Floats], tuple[Floats, Floats, Floats, Floats]]:
    of_sensor = rows["sensor"]
    latitude, longitude = _sources(rows, sensors)
    source_m, rotation = (
        geodetic_to_ecef(latitude, longitude, 0.0),
        enu_rotation(latitude, longitude),
    )
    seen = _seen(latitude, longitude, rows["track_latitude_rad"], rows["track_longitude_rad"])
    end_m = sensors.range_max_m[of_sensor]
    end_m = np.where(np.isfinite(end_m), end_m, LENGTH_ASSUMED_M)
    length_m = np.where(np.isfinite(seen[:, 0]), np.hypot(seen[:, 0], seen[:, 1]), end_m)
    _, corrected = polar_without_biases(length_m, rows["azimuth_rad"], estimates[of_sensor])
    ends: list[Floats] = []
    for azimuth in (rows["azimuth_rad"], corrected):
        along = np.stack([np.sin(azimuth), np.cos(azimuth), np.zeros(len(rows))], axis=1)
        point_m = source_m + length_m[:, None] * np.einsum("kij,ki->kj", rotation, along)
        ends += ecef_to_geodetic(point_m)[:2]
    return (latitude, longitude), (ends[0], ends[1], ends[2], ends[3])
