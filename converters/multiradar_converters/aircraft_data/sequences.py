"""Checks of aircraft-derived data over the reports of each aircraft: stale values, wrong motion.

=============  ===========  ========================================================================
reason         drops        condition
=============  ===========  ========================================================================
`unchanged`    motion, air  in flight, all values of the group are equal in `UNCHANGED_REPORTS`
                            reports and for `UNCHANGED_S` at least: the transponder is not updated;
                            the first of them is kept
`positions`    motion       ground speed and track angle contradict the positions of the aircraft
=============  ===========  ========================================================================
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.aircraft_data import quantities as q
from multiradar_converters.aircraft_data.plausibility import (
    AIR,
    AIRBORNE_MIN_M_S,
    MOTION,
    Finding,
    Flags,
)
from multiradar_converters.aircraft_data.quantities import Numbers

Integers = NDArray[np.int64]

#: Registers in flight change at every second to fourth reading at least, in cruise too; without
#: the vertical rate or the track angle rate they may be constant for half a minute.
UNCHANGED_REPORTS = 8
UNCHANGED_S = 60.0
#: Values of a group that is compared: a speed alone is constant in cruise.
UNCHANGED_VALUES_MIN = 4

#: Positions within this time before and after a report give its motion, s.
MOTION_WINDOW_S = 15.0
MOTION_SIDE_MIN_S = 3.0
#: Error of a velocity from turns within the window, m/s and fraction.
MOTION_ERROR_M_S = 30.0
MOTION_ERROR_FRACTION = 0.25
#: Errors of positions: azimuth of a radar, and any position; as multiples of sigma.
AZIMUTH_SIGMA_RAD = np.radians(0.15)
POSITION_SIGMA_M = 100.0
POSITION_SIGMAS = 4.0

_SPACED_S = 1e7
_EARTH_M = 6_371_000.0


class Reports(NamedTuple):
    """Reports with the positions of their aircraft.

    Attributes
    ----------
    aircraft : (n,) int64
        Equal for the reports of one aircraft by one sensor; negative if it is unknown.
    time_s : (n,) float64
        Times, s.
    east_m, north_m : (n,) float64
        Plots of a radar, m, in its plane; NaN for positions.
    range_m : (n,) float64
        Range from a radar, m; NaN for positions.
    latitude_deg, longitude_deg : (n,) float64
        Positions; NaN for plots.
    """

    aircraft: Integers
    time_s: Numbers
    east_m: Numbers
    north_m: Numbers
    range_m: Numbers
    latitude_deg: Numbers
    longitude_deg: Numbers


def sequence_findings(values: Numbers, reports: Reports) -> list[Finding]:
    """Check values over the reports of each aircraft.

    Parameters
    ----------
    values : float64[n, 10]
        Columns of `QUANTITIES`.
    reports : Reports
        The reports, in any order.

    Returns
    -------
    list of Finding
        In the order of the reports.
    """
    found = []
    for group, speeds in (
        (MOTION, (q.GROUND_SPEED, q.TRUE_AIRSPEED)),
        (AIR, (q.INDICATED_AIRSPEED,)),
    ):
        flies: Flags = np.asarray((values[:, speeds] >= AIRBORNE_MIN_M_S).any(axis=1))
        found.append(Finding("unchanged", group, _unchanged(values[:, group], flies, reports)))
    found.append(Finding("positions", MOTION, _contradicted(values, reports)))
    return [one for one in found if one.where.any()]


def plane_positions(
    range_m: Numbers, azimuth_deg: Numbers, height_m: Numbers
) -> tuple[Numbers, Numbers]:
    """Return plots in the plane of their radar, m.

    Parameters
    ----------
    range_m, azimuth_deg : float64[n]
        Slant range and azimuth; NaN for positions.
    height_m : float64[n]
        Height, m.

    Returns
    -------
    float64[n], float64[n]
        East and north; differences of close plots are correct within 1 %. NaN for positions.
    """
    height = np.clip(np.nan_to_num(height_m), -range_m, range_m)
    ground = np.sqrt(range_m**2 - height**2)
    azimuth = np.radians(azimuth_deg)
    return ground * np.sin(azimuth), ground * np.cos(azimuth)


def _unchanged(values: Numbers, flies: Flags, reports: Reports) -> Flags:
    enough = (~np.isnan(values)).sum(axis=1) >= UNCHANGED_VALUES_MIN
    rows = np.flatnonzero(enough & flies & (reports.aircraft >= 0))
    order = rows[np.lexsort((reports.time_s[rows], reports.aircraft[rows]))]
    aircraft, time_s = reports.aircraft[order], reports.time_s[order]
    # NaN counts as a value: the same fields have to be absent.
    content = np.nan_to_num(values[order], nan=np.inf)
    new = np.ones(len(order), dtype=np.bool_)
    new[1:] = (aircraft[1:] != aircraft[:-1]) | (content[1:] != content[:-1]).any(axis=1)
    if not len(order):
        return np.zeros(len(values), dtype=np.bool_)
    first = np.flatnonzero(new)
    ends = np.append(first[1:], len(order))
    lasts_s = time_s[ends - 1] - time_s[first]
    long = (ends - first >= UNCHANGED_REPORTS) & (lasts_s >= UNCHANGED_S)
    found = np.zeros(len(values), dtype=np.bool_)
    found[order] = np.repeat(long, ends - first) & ~new
    return found


def _contradicted(values: Numbers, reports: Reports) -> Flags:
    found = np.zeros(len(values), dtype=np.bool_)
    east, north, error = plot_velocities(reports)
    speed, track = values[:, q.GROUND_SPEED], np.radians(values[:, q.TRACK_ANGLE])
    apart = np.hypot(speed * np.sin(track) - east, speed * np.cos(track) - north)
    within = MOTION_ERROR_M_S + MOTION_ERROR_FRACTION * speed + error
    found[:] = (speed >= AIRBORNE_MIN_M_S) & (apart > within)
    return found


def plot_velocities(reports: Reports) -> tuple[Numbers, Numbers, Numbers]:
    """Return velocities from positions before and after each report, m/s.

    Parameters
    ----------
    reports : Reports
        The reports, in any order.

    Returns
    -------
    float64[n], float64[n], float64[n]
        East, north, and the largest error by noise; NaN without plots or positions on both sides.
        Correct within 1 % apart from it.
    """
    count = len(reports.time_s)
    located = np.isfinite(reports.east_m) | np.isfinite(
        reports.latitude_deg + reports.longitude_deg
    )
    rows = np.flatnonzero((reports.aircraft >= 0) & located)
    order = rows[np.lexsort((reports.time_s[rows], reports.aircraft[rows]))]
    out = np.full((3, count), np.nan)
    if not len(order):
        return out[0], out[1], out[2]
    # Aircraft so far apart in time that windows never reach from one to the next.
    number = np.cumsum(np.diff(reports.aircraft[order], prepend=reports.aircraft[order[0]]) != 0)
    time_s = reports.time_s[order] - reports.time_s[order].min() + number * _SPACED_S
    before = np.searchsorted(time_s, time_s - MOTION_WINDOW_S, "left")
    after = np.searchsorted(time_s, time_s + MOTION_WINDOW_S, "right") - 1
    enough = (time_s - time_s[before] >= MOTION_SIDE_MIN_S) & (
        time_s[after] - time_s >= MOTION_SIDE_MIN_S
    )
    own, before, after = order[enough], order[before[enough]], order[after[enough]]
    elapsed_s = reports.time_s[after] - reports.time_s[before]
    for axis, moved_m in enumerate(_moved(reports, own, before, after)):
        out[axis, own] = moved_m / elapsed_s
    sigma = POSITION_SIGMA_M + AZIMUTH_SIGMA_RAD * np.nan_to_num(reports.range_m[own])
    out[2, own] = POSITION_SIGMAS * np.sqrt(2.0) * sigma / elapsed_s
    return out[0], out[1], out[2]


def _moved(
    reports: Reports, own: Integers, before: Integers, after: Integers
) -> tuple[Numbers, Numbers]:
    """Return the movement between two rows, east and north, m; NaN from a plot to a position.

    Positions are points of a sphere, and east and north those at the row `own` between them:
    correct across the meridian of 180 degrees and beside a pole as well.
    """
    latitude, longitude = np.radians(reports.latitude_deg), np.radians(reports.longitude_deg)
    x, y, z = (
        axis[after] - axis[before]
        for axis in (
            _EARTH_M * np.cos(latitude) * np.cos(longitude),
            _EARTH_M * np.cos(latitude) * np.sin(longitude),
            _EARTH_M * np.sin(latitude),
        )
    )
    latitude, longitude = latitude[own], longitude[own]
    out = np.cos(longitude) * x + np.sin(longitude) * y
    radar = np.isfinite(reports.east_m[own])
    east = np.cos(longitude) * y - np.sin(longitude) * x
    north = np.cos(latitude) * z - np.sin(latitude) * out
    return (
        np.where(radar, reports.east_m[after] - reports.east_m[before], east),
        np.where(radar, reports.north_m[after] - reports.north_m[before], north),
    )
