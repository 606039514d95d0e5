"""Pairs of plots of one aircraft by two sensors at nearly the same time, as positions."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from multiradar.diagnosis.alignment.tracked_plots import TrackedPlots
from multiradar.diagnosis.plots import Floats, Integers, Rows, Site, located
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.estimation.measurement.known_biases import (
    polar_without_biases,
    reports_without_frames,
)
from multiradar.estimation.measurement.sensors import (
    PARAMETER_NAMES,
    PARAMETER_TIME_OFFSET,
    SensorTable,
)
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation, geodetic_to_ecef

#: Longest time between the plots of a pair, s: moved by the velocity of their track.
APART_MAX_S = 2.0
#: At a steeper elevation the height determines the position.
SINE_MAX = 0.7
#: Standard deviation of the height of a plot: pressure altitudes differ from heights, m.
HEIGHT_SIGMA_M = 100.0
_SIDES = ("first", "second")
_HEIGHT_ROUNDS = 2


@dataclass(frozen=True, slots=True)
class Side(Rows):
    """One plot of each pair, seen from its sensor.

    Attributes
    ----------
    along : (n, 2) float64
        Direction of the plot from a radar, east and north at the aircraft; zero for positions.
    ground_m, range_m : (n,) float64
        Its distance on the ground and along the line of sight; zero for positions.
    azimuth_rad : (n,) float64
        At a radar; NaN for positions.
    slope : (n,) float64
        Tangent of the elevation: effect of a height on the distance.
    east_m, north_m : (n,) float64
        Position from the site; NaN where the sensor has none.
    """

    along: Floats
    ground_m: Floats
    range_m: Floats
    azimuth_rad: Floats
    slope: Floats
    east_m: Floats
    north_m: Floats

    @property
    def across(self) -> Floats:
        """Return the direction of increasing azimuth (n, 2)."""
        return np.stack([self.along[:, 1], -self.along[:, 0]], axis=1)


@dataclass(frozen=True, slots=True)
class Pairs(Rows):
    """Pairs of plots of two sensors.

    Attributes
    ----------
    aircraft : (n,) int64
        The aircraft.
    first_sensor, second_sensor : (n,) int32
        Indices into the sensor table, the first below the second.
    time_s : (n,) float64
        Time of the later plot.
    apart_m : (n, 2) float64
        Position by the first sensor minus that by the second, east and north, at one time.
    apart_s : (n,) float64
        Time of the plot of the first sensor minus that of the second.
    velocity_mps : (n, 2) float64
        East and north.
    velocity_variance : (n,) float64
        Of each axis, m²/s².
    first, second : Side
        The plots.
    """

    aircraft: Integers
    first_sensor: NDArray[np.int32]
    second_sensor: NDArray[np.int32]
    time_s: Floats
    apart_m: Floats
    apart_s: Floats
    velocity_mps: Floats
    velocity_variance: Floats
    first: Side
    second: Side

    def select(self, which: NDArray[np.intp] | NDArray[np.int64] | NDArray[np.bool_]) -> "Pairs":
        """Return the pairs of a mask or of indices."""
        columns = {
            name: getattr(self, name)[which] for name in self.__slots__ if name not in _SIDES
        }
        return Pairs(**columns, first=self.first.select(which), second=self.second.select(which))

    def groups(self) -> Iterator[tuple[int, int, NDArray[np.intp]]]:
        """Yield both sensors and the rows of each pair of sensors, in order."""
        key = self.first_sensor.astype(np.int64) << 32 | self.second_sensor
        order = np.argsort(key, kind="stable")
        starts = np.flatnonzero(np.diff(key[order], prepend=-1))
        for rows in np.split(order, starts[1:]):
            if len(rows):
                yield int(self.first_sensor[rows[0]]), int(self.second_sensor[rows[0]]), rows


def pairs_of(plots: TrackedPlots, sensors: SensorTable) -> Pairs:
    """Return the pairs of plots of tracks.

    Parameters
    ----------
    plots : TrackedPlots
        Plots by track and time.
    sensors : SensorTable
        The sensors.

    Returns
    -------
    Pairs
        No other plot of either sensor lies between the two plots of a pair.

    Notes
    -----
    Biases act at the middle of both positions. At its own, each would have an error of its own, and
    what is common to two radars of one site would seem observable: by noise, and by the velocity,
    which has the same biases.
    """
    position = _positions(plots, sensors)
    later, earlier = _neighbours(plots, np.asarray(np.isfinite(position).all(axis=1)))
    swap = plots.sensor[later] > plots.sensor[earlier]
    first, second = np.where(swap, earlier, later), np.where(swap, later, earlier)
    axes = enu_rotation(plots.track_latitude_rad[later], plots.track_longitude_rad[later])
    apart_s = plots.time_s[first] - plots.time_s[second]
    velocity = plots.velocity_mps[later]
    between = np.einsum("kij,kj->ki", axes, position[first] - position[second])[:, :2]
    apart_m = between - velocity * apart_s[:, None]
    middle = (position[first] + position[second]) / 2.0
    return Pairs(
        aircraft=plots.aircraft[later],
        first_sensor=plots.sensor[first],
        second_sensor=plots.sensor[second],
        time_s=plots.time_s[later],
        apart_m=apart_m,
        apart_s=apart_s,
        velocity_mps=velocity,
        velocity_variance=plots.velocity_variance[later],
        first=_side(plots, first, middle, axes, sensors),
        second=_side(plots, second, middle, axes, sensors),
    )


def without_biases(plots: TrackedPlots, sensors: SensorTable, estimate: Floats) -> TrackedPlots:
    """Return plots corrected for biases, in the order of the parameters of the sensor table."""
    value = np.zeros((len(sensors), len(PARAMETER_NAMES)))
    value[sensors.parameter_sensor, sensors.parameter_kind] = estimate
    own = value[plots.sensor]
    range_m, azimuth_rad = polar_without_biases(plots.range_m, plots.azimuth_rad, own)
    latitude, longitude = reports_without_frames(
        plots.latitude_rad, plots.longitude_rad, plots.sensor, sensors, value
    )
    return replace(
        plots,
        time_s=plots.time_s - own[:, PARAMETER_TIME_OFFSET],
        range_m=range_m,
        azimuth_rad=azimuth_rad,
        latitude_rad=latitude,
        longitude_rad=longitude,
    )


def _positions(plots: TrackedPlots, sensors: SensorTable) -> Floats:
    found = geodetic_to_ecef(plots.latitude_rad, plots.longitude_rad, plots.height_m)
    for number in np.unique(plots.sensor[plots.kind == KIND_RADAR]).tolist():
        own = np.flatnonzero((plots.sensor == number) & (plots.kind == KIND_RADAR))
        site = _site(sensors, number)
        height_m, range_m = plots.height_m[own], plots.range_m[own]
        level = np.abs(height_m - site[2]) <= SINE_MAX * range_m
        found[own] = _located(site, range_m, plots.azimuth_rad[own], height_m)
        found[own[~level]] = np.nan
    return found


# On the ellipsoid: `located` is on a sphere, up to 20 m too high or too low.
def _located(site: Site, range_m: Floats, azimuth_rad: Floats, height_m: Floats) -> Floats:
    assumed_m = height_m
    for _ in range(_HEIGHT_ROUNDS):
        found = located(site, range_m, azimuth_rad, assumed_m)
        assumed_m = assumed_m + height_m - ecef_to_geodetic(found)[2]
    return located(site, range_m, azimuth_rad, assumed_m)


def _site(sensors: SensorTable, number: int) -> Site:
    return (
        float(sensors.latitude_rad[number]),
        float(sensors.longitude_rad[number]),
        float(sensors.height_m[number]),
    )


# Rows of the later and of the earlier plot of each pair.
def _neighbours(
    plots: TrackedPlots, usable: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    rows = np.flatnonzero(usable)
    track, sensor, time_s = plots.track_id[rows], plots.sensor[rows], plots.time_s[rows]
    order = np.lexsort((np.arange(len(rows)), sensor, track))
    follows = (np.diff(track[order]) == 0) & (np.diff(sensor[order]) == 0)
    previous, following = np.full(len(rows), -1), np.full(len(rows), len(rows))
    previous[order[1:][follows]] = order[:-1][follows]
    following[order[:-1][follows]] = order[1:][follows]
    found: list[tuple[NDArray[np.intp], NDArray[np.intp]]] = []
    for lag in range(1, len(rows)):
        late, early = np.arange(lag, len(rows)), np.arange(len(rows) - lag)
        near = (track[late] == track[early]) & (time_s[late] - time_s[early] <= APART_MAX_S)
        if not near.any():
            break
        late, early = late[near], early[near]
        # Neither sensor has another plot in between.
        good = sensor[late] != sensor[early]
        good &= (following[early] > late) & (previous[late] < early)
        found.append((rows[late[good]], rows[early[good]]))
    if not found:
        return np.empty(0, np.intp), np.empty(0, np.intp)
    later, earlier = (np.concatenate(parts) for parts in zip(*found, strict=True))
    in_time = np.lexsort((earlier, later, plots.time_s[later]))
    return later[in_time], earlier[in_time]


def _side(
    plots: TrackedPlots,
    rows: NDArray[np.intp],
    position: Floats,
    axes: Floats,
    sensors: SensorTable,
) -> Side:
    number = plots.sensor[rows]
    radar = plots.kind[rows] == KIND_RADAR
    sited = np.isfinite(sensors.latitude_rad[number])
    latitude = np.where(sited, sensors.latitude_rad[number], 0.0)
    longitude = np.where(sited, sensors.longitude_rad[number], 0.0)
    # A local frame has no height of its own.
    height = np.nan_to_num(np.where(sited, sensors.height_m[number], 0.0))
    line_m = position - geodetic_to_ecef(latitude, longitude, height)
    line = np.einsum("kij,kj->ki", axes, line_m)
    local = np.einsum("kij,kj->ki", enu_rotation(latitude, longitude), line_m)
    ground = np.maximum(np.hypot(line[:, 0], line[:, 1]), 1.0)
    polar = np.where(radar, 1.0, 0.0)
    return Side(
        along=line[:, :2] / ground[:, None] * polar[:, None],
        ground_m=ground * polar,
        range_m=np.linalg.norm(line, axis=1) * polar,
        azimuth_rad=np.where(radar, plots.azimuth_rad[rows], np.nan),
        # Heights of reported positions are of no effect.
        slope=np.abs(line[:, 2]) / ground * polar,
        east_m=np.where(sited, local[:, 0], np.nan),
        north_m=np.where(sited, local[:, 1], np.nan),
    )
