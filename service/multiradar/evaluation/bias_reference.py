"""System tracks of another processor as position measurements, from which biases are estimated.

A track is no measurement: its errors last as long as the memory of its filter, it lags in turns,
and it is extrapolated where plots are missing. So only updates are used whose errors are nearly
those of independent measurements: of straight flight, `APART_S` or more after each other,
confirmed, and of aircraft that the radars measure, too.

What remains cannot be seen: tracks made of the same radars carry the registration of that
processor, so that the biases found are relative to it.
"""

from dataclasses import dataclass

import numpy as np
import polars as pl

from multiradar.evaluation.trajectories import Flags, Floats, Indices
from multiradar.geodesy.wgs84 import geodetic_to_ecef

#: Name of the sensor of these measurements.
REFERENCE_ID = "reference"
#: Time after which errors of tracks of the usual filters are nearly independent, s.
APART_S = 20.0
#: Standard deviation of the position of a system track on each axis, m, where it has no own.
SIGMA_M = 60.0
#: A larger median of the reported ones, m, is not the accuracy of tracks by radar.
SIGMA_MAX_M = 1000.0
#: An update is of straight flight if it lies as near to the middle of the positions `APART_S`
#: before and after it, in sigmas of that difference of three positions.
STRAIGHT_SIGMAS = 2.0
#: An aircraft is measured if a plot with its identity is so near in time, s.
MEASURED_S = 15.0

#: Columns that an update needs.
COLUMNS = ("time_s", "latitude_deg", "longitude_deg", "flight")
SIGMA_COLUMN = "position_sigma_m"
#: Identities by which plots belong to an aircraft, the best first. One decides for all aircraft at
#: times when any plot has it: those of Mode A/C radars have no address.
IDENTITIES = ("mode_s_address", "mode_3a", "track_number")


@dataclass(frozen=True, slots=True)
class ReferenceCounts:
    """Disposition of the updates of a bias reference; the reasons in this order.

    Attributes
    ----------
    read, used : int
        Updates, and those that became measurements.
    turning : int
        Neither straight nor between updates `APART_S` before and after it.
    dependent : int
        Less than `APART_S` after one that is used.
    not_measured : int
        Of aircraft without a plot with their identity at that time.
    """

    read: int
    used: int
    turning: int
    dependent: int
    not_measured: int


def own_sigma_m(updates: pl.DataFrame) -> float:
    """Return the median standard deviation that tracks report, m, on each axis; else `SIGMA_M`.

    A median above `SIGMA_MAX_M` is not used.

    Parameters
    ----------
    updates : DataFrame
        With `position_sigma_m`, the root of the trace, where tracks have it.
    """
    if SIGMA_COLUMN not in updates.columns or not len(updates):
        return SIGMA_M
    median = updates[SIGMA_COLUMN].cast(pl.Float64).median()
    if not isinstance(median, float) or not median <= SIGMA_MAX_M:
        return SIGMA_M
    return max(float(median / np.sqrt(2.0)), 1.0)


def reference_measurements(
    updates: pl.DataFrame, plots: pl.DataFrame, sigma_m: float
) -> tuple[pl.DataFrame, ReferenceCounts]:
    """Return system tracks as measurements of positions.

    Parameters
    ----------
    updates : DataFrame
        Measured updates of confirmed tracks: `COLUMNS`, of `IDENTITIES` those known, and
        what else tracks have.
    plots : DataFrame
        `time_s` and `IDENTITIES` of the plots of the radars.
    sigma_m : float
        Standard deviation of each axis, m.

    Returns
    -------
    measurements : DataFrame
        `time_s`, `latitude_deg`, `longitude_deg` and `IDENTITIES`, by time.
    counts : ReferenceCounts
        Disposition of the updates.
    """
    rows = updates.sort("flight", "time_s", maintain_order=True)
    _, flight = np.unique(rows["flight"].to_numpy().astype(np.str_), return_inverse=True)
    time_s = rows["time_s"].cast(pl.Float64).to_numpy()
    straight = _straight(flight.astype(np.int64), time_s, _position(rows), sigma_m)
    measured = _measured(rows, plots)
    chosen = _apart(flight.astype(np.int64), time_s, straight & measured)
    counts = ReferenceCounts(
        read=len(rows),
        used=int(chosen.sum()),
        turning=int((~straight).sum()),
        dependent=int((straight & measured & ~chosen).sum()),
        not_measured=int((straight & ~measured).sum()),
    )
    kept = rows.filter(pl.Series(chosen)).select(*COLUMNS[:3], *IDENTITIES)
    return kept.sort("time_s", maintain_order=True), counts


def _position(rows: pl.DataFrame) -> Floats:
    latitude, longitude = (
        np.radians(rows[name].cast(pl.Float64).to_numpy())
        for name in ("latitude_deg", "longitude_deg")
    )
    return geodetic_to_ecef(latitude, longitude, 0.0)


# Rows are by flight and time.
def _straight(flight: Indices, time_s: Floats, position_m: Floats, sigma_m: float) -> Flags:
    straight: Flags = np.zeros(len(time_s), np.bool_)
    bounds = np.append(np.flatnonzero(np.diff(flight, prepend=-1)), len(flight))
    # The difference of a position and the mean of two others has 1.5 times their variance.
    near_m = STRAIGHT_SIGMAS * np.sqrt(1.5) * sigma_m
    for first, end in zip(bounds[:-1].tolist(), bounds[1:].tolist(), strict=True):
        own = slice(first, end)
        times = time_s[own]
        inside = (times - APART_S >= times[0]) & (times + APART_S <= times[-1])
        middle = 0.5 * (
            _at(times - APART_S, times, position_m[own])
            + _at(times + APART_S, times, position_m[own])
        )
        off_m = np.linalg.norm(position_m[own] - middle, axis=1)
        straight[own] = inside & (off_m < near_m)
    return straight


def _at(wanted_s: Floats, time_s: Floats, position_m: Floats) -> Floats:
    return np.stack([np.interp(wanted_s, time_s, axis) for axis in position_m.T], axis=-1)


def _apart(flight: Indices, time_s: Floats, usable: Flags) -> Flags:
    chosen: Flags = np.zeros(len(time_s), np.bool_)
    before, last_s = -1, -np.inf
    for row in np.flatnonzero(usable).tolist():
        if flight[row] != before or time_s[row] - last_s >= APART_S:
            chosen[row] = True
            before, last_s = int(flight[row]), float(time_s[row])
    return chosen


def _measured(rows: pl.DataFrame, plots: pl.DataFrame) -> Flags:
    """Return which updates have a plot with their identity within `MEASURED_S`.

    The first of `IDENTITIES` decides that the update has and any plot then has, of whatever
    aircraft: as soon as one Mode S plot is within `MEASURED_S`, an update with an address needs a
    plot with this address, and its Mode 3/A code no longer counts. Updates of aircraft that only
    radars without Mode S measure are left out then, rather than matched by codes that others may
    have.
    """
    time_s = rows["time_s"].cast(pl.Float64).to_numpy()
    measured: Flags = np.zeros(len(rows), np.bool_)
    decided: Flags = np.zeros(len(rows), np.bool_)
    for name in IDENTITIES:
        known = rows[name].is_not_null().to_numpy() & ~decided
        if name == "mode_3a":
            known &= _by_one_flight(rows, name)
        times = plots.drop_nulls(name).select("time_s", name).sort("time_s")
        known &= _any_near(time_s, times["time_s"].cast(pl.Float64).to_numpy())
        own = np.flatnonzero(known)
        wanted = rows[own.tolist()].select("time_s", name).with_row_index("at").sort("time_s")
        found = wanted.join_asof(
            times.with_columns(pl.col("time_s").alias("plot_s")),
            on="time_s",
            by=name,
            strategy="nearest",
            tolerance=MEASURED_S,
            check_sortedness=False,
        ).drop_nulls("plot_s")
        measured[own[found["at"].to_numpy()]] = True
        decided |= known
    return measured


# Whether any of the others, ascending, is at most `MEASURED_S` away.
def _any_near(time_s: Floats, others_s: Floats) -> Flags:
    first = np.searchsorted(others_s, time_s - MEASURED_S, side="left")
    return np.searchsorted(others_s, time_s + MEASURED_S, side="right") > first


# Several aircraft may have one code, which then says nothing.
def _by_one_flight(rows: pl.DataFrame, name: str) -> Flags:
    single = rows.select((pl.col("flight").n_unique().over(name) == 1).fill_null(value=False))
    return np.asarray(single.to_series().to_numpy(), np.bool_)
