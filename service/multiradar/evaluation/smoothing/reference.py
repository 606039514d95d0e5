"""A reference from the measurements themselves: all sensors, biases subtracted, smoothed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import polars as pl

from multiradar.errors import InputError
from multiradar.evaluation.coverage import CoveredRegion, covered_rows
from multiradar.evaluation.measures.bias_errors import BiasHistory
from multiradar.evaluation.measures.update_times import with_ids
from multiradar.evaluation.reference_rows import ROW_COLUMN, screened
from multiradar.evaluation.smoothing.motion_modes import civil_modes
from multiradar.evaluation.smoothing.multiple_modes import smooth_modes
from multiradar.evaluation.smoothing.plot_positions import (
    Radar,
    locate_plots,
    noise_on_plane,
    report_without_biases,
    without_biases,
)
from multiradar.evaluation.smoothing.residual_biases import residual_biases
from multiradar.evaluation.smoothing.single_mode import PositionMeasurements, smooth
from multiradar.evaluation.tables import HEIGHT_MAX_M, with_names, with_rows
from multiradar.evaluation.trajectories import (
    NUMBER_MAX,
    Flags,
    Floats,
    Indices,
    Reference,
    RowCounts,
)
from multiradar.geodesy.refraction import straight_range
from multiradar.geodesy.system_plane import SystemPlane
from multiradar_schemas.measurements.columns import POSITION_SIGMA
from multiradar_schemas.sensors.sensor import Sensor

#: Increase of the sigma of a constant bias at a jump, at least.
_JUMP_RATIO = 2.0
#: Minimum number of positions of a trajectory.
POSITIONS_MIN = 5
#: Motion models of the smoother.
CONSTANT_VELOCITY = "constant-velocity"
INTERACTING_MODES = "imm"


@dataclass(frozen=True, slots=True, eq=False)
class SmoothedReference:
    """A smoothed reference with its accuracy.

    Attributes
    ----------
    reference : Reference
        With velocities; aircraft are named by track number, or else by Mode S address.
    sigma_m : float
        Root mean trace of the covariance of its positions, m; residual biases are included with
        interacting modes only.
    outliers : int
        Number of measurements excluded as outliers.
    """

    reference: Reference
    sigma_m: float
    outliers: int


@dataclass(frozen=True, slots=True, eq=False)
class _Positions:
    # Measurements of known aircraft as positions; missing heights are interpolated.
    aircraft: Indices
    sensor: Indices
    time_s: Floats
    latitude_rad: Floats
    longitude_rad: Floats
    height_m: Floats
    range_m: Floats
    sigma_m: Floats
    usable: Flags


def smoothed_reference(
    measurements: pl.DataFrame,
    sensors: Sequence[Sensor],
    biases: Sequence[BiasHistory],
    *,
    source: str,
    density: float,
    gap_s: float,
    smoother: str = CONSTANT_VELOCITY,
    regions: Sequence[CoveredRegion] = (),
) -> SmoothedReference:
    """Return trajectories smoothed from all measurements.

    Parameters
    ----------
    measurements : DataFrame
        `measurements.parquet`; rows of unknown aircraft or sensors, and bearings, are skipped.
    sensors : sequence of Sensor
        Positions and random errors.
    biases : sequence of BiasHistory
        Estimates of the biases: the last one, or that at each time for a drifting bias.
    source : str
        Name of the measurements in errors.
    density : float
        Spectral density of the acceleration of aircraft, m²/s³.
    gap_s : float
        Positions farther apart in time are not joined, s.
    smoother : str
        `CONSTANT_VELOCITY`, see `single_mode.smooth`, or `INTERACTING_MODES`, see
        `multiple_modes.smooth_modes`.
    regions : sequence of CoveredRegion
        Coverage of the sensors; smoothed positions outside are left out.

    Returns
    -------
    SmoothedReference
        Positions at the times of the measurements.

    Raises
    ------
    InputError
        No aircraft has enough measurements.
    """
    numbers = {one.id: number for number, one in enumerate(sensors)}
    # Non-finite values are skipped, as in the tracker's quarantine.
    sane = [
        pl.when(pl.col(name).abs() <= most).then(name)
        for name, most in (
            ("time_s", NUMBER_MAX),
            ("range_m", NUMBER_MAX),
            ("azimuth_deg", NUMBER_MAX),
            ("latitude_deg", 90.0),
            ("longitude_deg", 360.0),
            ("height_m", HEIGHT_MAX_M),
        )
    ]
    rows = (
        with_ids(with_names(with_rows(measurements)), sensors)
        .with_columns(sane)
        .filter(
            pl.col("time_s").is_not_null()
            & pl.col("name").is_not_null()
            & pl.col("kind").is_in(["radar", "adsb", "mlat"])
            & pl.col("sensor_id").is_in(list(numbers))
        )
    )
    rows, counts = _without_wild(rows, source)
    names, aircraft = np.unique(rows["name"].to_numpy().astype(np.str_), return_inverse=True)
    of = np.array([numbers[name] for name in rows["sensor_id"]], np.int64)
    positions = _located(rows, aircraft.astype(np.int64), of, sensors, biases)
    enough = (
        np.bincount(positions.aircraft[positions.usable], minlength=len(names)) >= POSITIONS_MIN
    )
    kept = np.flatnonzero(positions.usable & enough[positions.aircraft])
    if not len(kept):
        msg = f"{source}: no aircraft has at least {POSITIONS_MIN} measurements"
        raise InputError(msg)
    kept = kept[np.lexsort((positions.time_s[kept], positions.aircraft[kept]))]
    latitude, longitude = positions.latitude_rad[kept], positions.longitude_rad[kept]
    plane = SystemPlane.for_sensors(latitude, longitude)
    position = np.stack(plane.to_plane(latitude, longitude), axis=-1)
    noise = _noise(plane, position, positions, kept, sensors)
    aircraft_index, when = positions.aircraft[kept], positions.time_s[kept]
    measured = PositionMeasurements(aircraft_index, when, position, noise)
    if smoother == INTERACTING_MODES:
        shown = position, positions.range_m[kept], positions.sensor[kept]
        left = residual_biases(plane, shown, sensors, biases)
        found = smooth_modes(measured, civil_modes(), density, left)
    else:
        found = smooth(measured, density)
    used = np.flatnonzero(found.used)
    # Positions of the same time have the same smoothed state: one is enough.
    later = (np.diff(aircraft_index[used]) != 0) | (np.diff(when[used]) > 0.0)
    selected = used[np.append(later, np.ones(1, np.bool_))]
    height_m = positions.height_m[kept]
    if regions:
        place = plane.to_geodetic(*found.state[selected, :2].T)
        inside, uncovered = covered_rows(
            regions, aircraft_index[selected], when[selected], place, height_m[selected]
        )
        selected, counts = selected[inside], replace(counts, uncovered=uncovered)
    if not len(selected):
        msg = f"{source}: no smoothed position lies within the coverage of the sensors"
        raise InputError(msg)
    present, renumbered = np.unique(aircraft_index[selected], return_inverse=True)
    reference = Reference(
        plane=plane,
        names=names[present],
        aircraft=renumbered.astype(np.int64),
        time_s=when[selected],
        position_m=found.state[selected, :2],
        velocity_mps=found.state[selected, 2:],
        height_m=height_m[selected],
        gap_s=gap_s,
        counts=counts,
    )
    sigma_m = float(np.sqrt(np.mean(found.position_variance_m2[selected])))
    return SmoothedReference(reference, sigma_m, int(np.sum(~found.used)))


# Reported positions that no aircraft flies to; plots of radars are left to the smoother.
def _without_wild(rows: pl.DataFrame, source: str) -> tuple[pl.DataFrame, RowCounts]:
    place = ("latitude_deg", "longitude_deg")
    reported = rows.filter(pl.col("kind") != "radar").drop_nulls(place)
    _, counts = screened(reported, ("time_s", *place), source)
    good = rows.filter(~pl.col(ROW_COLUMN).is_in([one.offset for one in counts.rejects]))
    # Several sensors may report an aircraft at one time: none is a duplicate.
    return good, RowCounts(len(rows), len(good), 0, counts.rejects)


def _located(
    rows: pl.DataFrame,
    aircraft: Indices,
    sensor: Indices,
    sensors: Sequence[Sensor],
    biases: Sequence[BiasHistory],
) -> _Positions:
    column = {
        name: rows[name].cast(pl.Float64).fill_null(np.nan).to_numpy().copy()
        for name in (
            "time_s", "range_m", "azimuth_deg", "latitude_deg", "longitude_deg", "height_m",
        )
    }  # fmt: skip
    time_s, range_m = column["time_s"], column["range_m"]
    sigma_m = np.full(len(rows), np.nan)
    if POSITION_SIGMA in rows.columns:
        sigma_m = rows[POSITION_SIGMA].cast(pl.Float64).fill_null(np.nan).to_numpy()
    latitude, longitude = np.radians(column["latitude_deg"]), np.radians(column["longitude_deg"])
    height = _filled(aircraft, time_s, column["height_m"])
    usable = np.isfinite(latitude) & np.isfinite(longitude)
    for number, one in enumerate(sensors):
        own = np.flatnonzero(sensor == number)
        if not len(own):
            continue
        bias = biases_at(one, time_s[own], biases)
        if one.kind != "radar":
            whole = usable[own]
            own, bias = own[whole], {name: value[whole] for name, value in bias.items()}
            latitude[own], longitude[own], time_s[own] = report_without_biases(
                latitude[own], longitude[own], time_s[own], _reference_point(one), bias
            )
            continue
        range_m[own], azimuth_deg, time_s[own] = without_biases(
            range_m[own], column["azimuth_deg"][own], time_s[own], bias
        )
        if one.earth_radius_factor is not None:
            range_m[own] = straight_range(
                range_m[own], height[own], _radar(one).site[2], one.earth_radius_factor
            )
        located = locate_plots(_radar(one).site, range_m[own], np.radians(azimuth_deg), height[own])
        latitude[own], longitude[own] = located.latitude_rad, located.longitude_rad
        usable[own] = located.usable
    return _Positions(
        aircraft, sensor, time_s, latitude, longitude, height, range_m, sigma_m, usable
    )


def _reference_point(one: Sensor) -> tuple[float, float] | None:
    if one.latitude_deg is None or one.longitude_deg is None:
        return None
    return math.radians(one.latitude_deg), math.radians(one.longitude_deg)


# Missing heights of an aircraft are interpolated.
def _filled(aircraft: Indices, time_s: Floats, height_m: Floats) -> Floats:
    filled = height_m.copy()
    order = np.lexsort((time_s, aircraft))
    ends = np.flatnonzero(np.diff(aircraft[order])) + 1
    for own in np.split(order, ends):
        known = own[np.isfinite(height_m[own])]
        if 0 < len(known) < len(own):
            filled[own] = np.interp(time_s[own], time_s[known], height_m[known])
    return filled


def biases_at(sensor: Sensor, time_s: Floats, biases: Sequence[BiasHistory]) -> dict[str, Floats]:
    """Return the biases of a radar at times.

    Parameters
    ----------
    sensor : Sensor
        The radar, with its known biases.
    time_s : (n,) float64
        Times.
    biases : sequence of BiasHistory
        Estimates: for a drifting bias that at each time, else the last one, or the last one before
        the next jump of the bias.

    Returns
    -------
    dict of str to (n,) float64
        By parameter, measured minus true; the prior where nothing is estimated.
    """
    found = {name: np.full(len(time_s), value) for name, value in sensor.known_biases().items()}
    for one in sensor.estimated_biases():
        found[one.parameter] = np.full(len(time_s), one.prior)
        for history in biases:
            if (history.sensor_id, history.parameter) != (sensor.id, one.parameter):
                continue
            found[one.parameter] = (
                np.interp(time_s, history.time_s, history.estimate)
                if one.drift > 0.0
                else _constant_between_jumps(history, time_s)
            )
    return found


# The sigma of a constant bias never increases but where the tracker detects a jump.
def _constant_between_jumps(history: BiasHistory, time_s: Floats) -> Floats:
    begins = 1 + np.flatnonzero(history.sigma[1:] > _JUMP_RATIO * history.sigma[:-1])
    lasts = np.append(begins, len(history.sigma)) - 1
    of = np.searchsorted(history.time_s[begins], time_s, side="right")
    return np.asarray(history.estimate[lasts][of])


def _noise(
    plane: SystemPlane,
    position_m: Floats,
    positions: _Positions,
    kept: Indices,
    sensors: Sequence[Sensor],
) -> Floats:
    sensor, range_m, sigma_m = (
        positions.sensor[kept], positions.range_m[kept], positions.sigma_m[kept]
    )  # fmt: skip
    noise = np.zeros((len(position_m), 2, 2))
    for number, one in enumerate(sensors):
        own = sensor == number
        if one.kind == "radar":
            noise[own] = noise_on_plane(plane, _radar(one), position_m[own], range_m[own])
        else:
            # A report may have an accuracy of its own.
            own_m = np.where(sigma_m[own] > 0.0, sigma_m[own], one.position_sigma_m)
            noise[own] = own_m[:, None, None] ** 2 * np.eye(2)
    return noise


def _radar(one: Sensor) -> Radar:
    latitude, longitude, height = one.latitude_deg, one.longitude_deg, one.height_m
    # The schema gives every radar a site.
    assert latitude is not None
    assert longitude is not None
    assert height is not None
    site = (float(np.radians(latitude)), float(np.radians(longitude)), height)
    return Radar(site, one.range_sigma_m, float(np.radians(one.azimuth_sigma_deg)))
