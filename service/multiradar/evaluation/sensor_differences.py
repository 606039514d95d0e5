"""Ranges and azimuths of radars against a reference: measured minus reference, by radar."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import polars as pl

from multiradar.evaluation.measures.bias_errors import BiasHistory
from multiradar.evaluation.measures.update_times import UPDATE_TIME, with_update_times
from multiradar.evaluation.smoothing.plot_positions import without_biases
from multiradar.evaluation.smoothing.reference import biases_at
from multiradar.evaluation.trajectories import (
    Floats,
    Indices,
    Reference,
    Tracks,
    positions_at,
)
from multiradar.geodesy.refraction import refracted_range
from multiradar.geodesy.wgs84 import enu_rotation, geodetic_to_ecef
from multiradar_schemas.sensors.sensor import Sensor

#: Columns of plots.
PLOT_COLUMNS = ("time_s", "sensor_id", "range_m", "azimuth_deg", "height_m")
#: At a steeper elevation the height decides on range and azimuth.
SINE_MAX = 0.7
#: Differences farther from the median than this many robust standard deviations are excluded.
OUTLIER_SIGMAS = 5.0
#: Median absolute deviation of a normal distribution, in standard deviations.
_MAD = 0.6745


@dataclass(frozen=True, slots=True)
class SensorDifference:
    """Differences of one quantity of one radar.

    Attributes
    ----------
    sensor_id : str
        The radar.
    quantity : str
        ``range_m`` or ``azimuth_deg``, the unit of what follows.
    plots, aircraft, outliers : int
        Plots that are used, their aircraft, and plots excluded as outliers.
    mean, sigma, spread : float
        Mean of measured minus reference; its standard deviation, with the differences of an
        aircraft taken as correlated (None with one aircraft); standard deviation of a plot.
    estimate, left : float
        Mean of what the estimated biases explain, and the rest: mean − estimate.
    """

    sensor_id: str
    quantity: str
    plots: int
    aircraft: int
    outliers: int
    mean: float
    sigma: float | None
    spread: float
    estimate: float
    left: float


def sensor_differences(
    tracks: Tracks,
    reference: Reference,
    aircraft: Indices,
    plots: pl.DataFrame,
    *,
    sensors: Sequence[Sensor],
    biases: Sequence[BiasHistory],
) -> list[SensorDifference]:
    """Compare the plots that updated tracks with the reference.

    Parameters
    ----------
    tracks : Tracks
        Of n updates.
    reference : Reference
        Positions of the aircraft.
    aircraft : (n,) int64
        Aircraft of the track at each update; −1 for none.
    plots : DataFrame
        Columns of `PLOT_COLUMNS`, of radars; where a radar has several plots at one time, the plot
        of an update is ambiguous, and they are skipped.
    sensors : sequence of Sensor
        Sites of the radars.
    biases : sequence of BiasHistory
        Estimated biases.

    Returns
    -------
    list of SensorDifference
        Range and azimuth of each radar that has plots on tracks with a known aircraft.

    Notes
    -----
    The standard deviation of the mean m of N differences d is √(Σ_a (Σ_i (d_ai − m))² A / (A − 1))
    / N over A aircraft (Liang and Zeger 1986): errors of a transponder, of an interpolated
    reference and of its heights are common to the plots of an aircraft. An unknown height of the
    reference is that of the plot.
    """
    used = np.flatnonzero(tracks.measured & (aircraft >= 0))
    updates = pl.DataFrame(
        {
            UPDATE_TIME: tracks.time_s[used],
            "sensor_id": tracks.sensor_id[used],
            "aircraft": aircraft[used],
        }
    )
    plots = with_update_times(plots, sensors)
    single = plots.filter(pl.len().over(UPDATE_TIME, "sensor_id") == 1)
    found: list[SensorDifference] = []
    for sensor in sensors:
        if sensor.kind != "radar":
            continue
        own = pl.col("sensor_id").is_in(sorted(sensor.all_names()))
        rows = single.filter(own).join(
            updates.filter(own).drop("sensor_id"), on=UPDATE_TIME, maintain_order="left"
        )
        found += _differences(sensor, rows, reference, biases)
    return found


def _differences(
    sensor: Sensor, rows: pl.DataFrame, reference: Reference, biases: Sequence[BiasHistory]
) -> list[SensorDifference]:
    time_s, range_m, azimuth_deg, plot_height_m = (
        rows[name].cast(pl.Float64).fill_null(np.nan).to_numpy()
        for name in ("time_s", "range_m", "azimuth_deg", "height_m")
    )
    aircraft = rows["aircraft"].to_numpy()
    measured = range_m, azimuth_deg, time_s
    free = without_biases(*measured, biases_at(sensor, time_s, biases))
    # At the stamped time, and at the time that the estimated offset of the clock leaves.
    stamped = _true_plots(sensor, reference, aircraft, time_s, plot_height_m)
    shifted = _true_plots(sensor, reference, aircraft, free[2], plot_height_m)
    whole = np.isfinite(range_m + azimuth_deg + stamped[0] + shifted[0])
    level = whole & (np.abs(stamped[2]) <= SINE_MAX)
    found = []
    for number, name in enumerate(("range_m", "azimuth_deg")):
        difference, rest = measured[number] - stamped[number], free[number] - shifted[number]
        if name == "azimuth_deg":
            difference, rest = ((one + 180.0) % 360.0 - 180.0 for one in (difference, rest))
        if level.any():
            found.append(_summary(sensor.id, name, aircraft[level], difference[level], rest[level]))
    return found


# Range, azimuth and sine of the elevation of the reference at the radar; NaN where it is unknown.
def _true_plots(
    sensor: Sensor, reference: Reference, aircraft: Indices, time_s: Floats, plot_height_m: Floats
) -> tuple[Floats, Floats, Floats]:
    known = positions_at(reference, aircraft, time_s)
    height_m = np.where(np.isfinite(known.height_m), known.height_m, plot_height_m)
    whole = np.isfinite(known.position_m[:, 0] + height_m)
    found = np.full((3, len(time_s)), np.nan)
    if whole.any():
        latitude, longitude = reference.plane.to_geodetic(*known.position_m[whole].T)
        found[:, whole] = _seen_from(sensor, latitude, longitude, height_m[whole])
    range_m, azimuth_deg, sine = found
    return range_m, azimuth_deg, sine


def _seen_from(
    sensor: Sensor, latitude: Floats, longitude: Floats, height_m: Floats
) -> tuple[Floats, Floats, Floats]:
    # The schema gives every radar a site.
    assert sensor.latitude_deg is not None
    assert sensor.longitude_deg is not None
    assert sensor.height_m is not None
    place = np.radians([sensor.latitude_deg, sensor.longitude_deg])
    site = geodetic_to_ecef(place[0], place[1], sensor.height_m)
    offset = geodetic_to_ecef(latitude, longitude, height_m) - site
    east, north, up = (offset @ enu_rotation(place[0], place[1]).T).T
    slant: Floats = np.sqrt(east**2 + north**2 + up**2)
    azimuth: Floats = np.degrees(np.arctan2(east, north))
    if sensor.earth_radius_factor is not None:
        bent = refracted_range(slant, height_m, sensor.height_m, sensor.earth_radius_factor)
        return bent, azimuth, up / np.maximum(slant, 1.0)
    return slant, azimuth, up / np.maximum(slant, 1.0)


def _summary(
    sensor_id: str, quantity: str, aircraft: Indices, difference: Floats, rest: Floats
) -> SensorDifference:
    middle = np.median(difference)
    deviation = np.median(np.abs(difference - middle)) / _MAD
    good = np.abs(difference - middle) <= OUTLIER_SIGMAS * max(float(deviation), 1e-12)
    mean = float(difference[good].mean())
    _, numbers = np.unique(aircraft[good], return_inverse=True)
    sums = np.bincount(numbers, weights=difference[good] - mean)
    count, groups = int(good.sum()), len(sums)
    sigma = np.sqrt(np.sum(sums**2) * groups / max(groups - 1, 1)) / count
    left = float(rest[good].mean())
    return SensorDifference(
        sensor_id=sensor_id,
        quantity=quantity,
        plots=count,
        aircraft=groups,
        outliers=int(np.sum(~good)),
        mean=mean,
        sigma=float(sigma) if groups > 1 else None,
        spread=float(difference[good].std()),
        estimate=mean - left,
        left=left,
    )
