"""Fraction of the plots of a sensor that match the positions by others under a hypothesis.

Under the right hypothesis the residuals of all plots are equal but for noise; they are counted in
the densest cell of their plane. Under a wrong one they scatter.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.diagnosis.cross_sensor.references import Pairs
from multiradar.diagnosis.plots import NORMAL_SPREAD, Floats, Integers, Plots, Site, ground_range
from multiradar.geodesy.wgs84 import (
    ecef_to_geodetic,
    enu_rotation,
    geodetic_to_ecef,
)

#: Half width of the cell in which residuals count as equal; covers noise, biases of others, and
#: interpolation between two plots. Range m, azimuth rad; east and north m.
RANGE_ALIKE_M = 1000.0
AZIMUTH_ALIKE_RAD = np.radians(0.6)
POSITION_ALIKE_M = 1500.0
#: Five prior standard deviations of the biases (500 m, 0.5°): what estimation can absorb.
RANGE_OFFSET_MAX_M = 2500.0
AZIMUTH_OFFSET_MAX_RAD = np.radians(2.5)
#: Steps in which the site of a radar is searched for, m.
_SITE_STEPS_M = (8000.0, 3000.0, 1500.0, 1500.0)


class Agreement(NamedTuple):
    """How well plots agree with others.

    Attributes
    ----------
    share : float
        Fraction of the compared plots whose residuals are equal.
    compared : int
        Plots that could be compared.
    offset : (float, float)
        The most frequent residual: range m and azimuth rad, or east and north m.
    matched : (k,) int64
        Rows of the pairs behind `share`.
    spread : (float, float)
        Standard deviation of these residuals, from their median absolute value; includes the
        noise of both sides.
    """

    share: float
    compared: int
    offset: tuple[float, float]
    matched: Integers
    spread: tuple[float, float] = (np.nan, np.nan)


NO_AGREEMENT = Agreement(0.0, 0, (0.0, 0.0), np.empty(0, np.int64))


def polar_agreement(
    measured: tuple[Floats, Floats],
    site: Site,
    pairs: Pairs,
    *,
    compared: int,
    any_rotation: bool = False,
) -> Agreement:
    """Return how well polar plots agree.

    Parameters
    ----------
    measured : ((n,) float64, (n,) float64)
        Ranges, m, and azimuths, rad, by the hypothesis.
    site : Site
        Of the radar, by the hypothesis.
    pairs : Pairs
        Positions of the aircraft by others.
    compared : int
        Plots that can be compared.
    any_rotation : bool
        Whether any azimuth offset is accepted.
    """
    range_m, azimuth_rad = measured
    seen_range, seen_azimuth = seen_from(site, pairs.position_m)
    by_range = range_m[pairs.plot] - seen_range
    by_azimuth = wrapped(azimuth_rad[pairs.plot] - seen_azimuth)
    near = np.abs(by_range) <= RANGE_OFFSET_MAX_M
    if not any_rotation:
        near &= np.abs(by_azimuth) <= AZIMUTH_OFFSET_MAX_RAD
    widths = (RANGE_ALIKE_M, AZIMUTH_ALIKE_RAD)
    residuals = _Residuals(by_range[near], by_azimuth[near], pairs.plot[near], np.flatnonzero(near))
    return _densest(residuals, widths, compared, circle=any_rotation)


def position_agreement(
    position_m: Floats, pairs: Pairs, *, compared: int, within_m: float = 2.0 * POSITION_ALIKE_M
) -> Agreement:
    """Return how well reported positions (n, 3), ECEF, agree, with a displacement of `within_m`."""
    apart = position_m[pairs.plot] - pairs.position_m
    latitude, longitude, _ = ecef_to_geodetic(pairs.position_m)
    local = np.einsum("kij,kj->ki", enu_rotation(latitude, longitude), apart)
    near = np.hypot(local[:, 0], local[:, 1]) <= within_m
    widths = (POSITION_ALIKE_M, POSITION_ALIKE_M)
    rows = np.flatnonzero(near)
    residuals = _Residuals(local[rows, 0], local[rows, 1], pairs.plot[rows], rows)
    return _densest(residuals, widths, compared)


def best_site(plots: Plots, measured: tuple[Floats, Floats], site: Site, pairs: Pairs) -> Site:
    """Return the site with which most plots of a radar match the positions by others.

    Parameters
    ----------
    plots : Plots
        Its plots; their heights are used.
    measured : ((n,) float64, (n,) float64)
        Ranges, m, and azimuths, rad.
    site : Site
        As configured; its height is kept.
    pairs : Pairs
        Positions of the aircraft by others.
    """
    ground_m, _ = ground_range(site[2], measured[0], plots.heights())
    ground, azimuth = ground_m[pairs.plot], measured[1][pairs.plot]
    middle = np.median(pairs.position_m, axis=0)
    latitude, longitude, _ = ecef_to_geodetic(middle)
    found = [
        _site_from((start[0], start[1], site[2]), ground, azimuth, pairs)
        for start in ((float(latitude), float(longitude)), site[:2])
    ]
    return max(found, key=lambda one: one[0])[1]


def seen_from(site: Site, position_m: Floats) -> tuple[Floats, Floats]:
    """Return slant range, m, and azimuth, rad, of ECEF positions from a radar."""
    line = (position_m - geodetic_to_ecef(*site)) @ enu_rotation(site[0], site[1]).T
    return np.linalg.norm(line, axis=1), np.arctan2(line[:, 0], line[:, 1])


def wrapped(angle_rad: Floats) -> Floats:
    """Return angles from −π to π."""
    return np.mod(angle_rad + np.pi, 2.0 * np.pi) - np.pi


def _site_from(start: Site, ground: Floats, azimuth: Floats, pairs: Pairs) -> tuple[int, Site]:
    site, votes = start, 0
    for step_m in _SITE_STEPS_M:
        rotation = enu_rotation(site[0], site[1])
        origin = geodetic_to_ecef(*site)
        line = (pairs.position_m - origin) @ rotation.T
        east, north = line[:, 0] - ground * np.sin(azimuth), line[:, 1] - ground * np.cos(azimuth)
        rows = np.flatnonzero(np.isfinite(east) & np.isfinite(north))
        residuals = _Residuals(east[rows], north[rows], pairs.plot[rows], rows)
        densest = _densest(residuals, (step_m, step_m), 1)
        if len(densest.matched) == 0:
            return 0, start
        votes = len(np.unique(pairs.plot[densest.matched]))
        local = np.array([*densest.offset, 0.0])
        latitude, longitude, _ = ecef_to_geodetic(origin + local @ rotation)
        site = float(latitude), float(longitude), start[2]
    return votes, site


class _Residuals(NamedTuple):
    first: Floats
    second: Floats
    plot: Integers
    row: NDArray[np.intp]


# The cell, twice as wide as `widths`, that contains the residuals of most plots.
def _densest(
    residuals: _Residuals, widths: tuple[float, float], compared: int, *, circle: bool = False
) -> Agreement:
    a, b, plots, rows = residuals
    if len(rows) == 0 or compared == 0:
        return NO_AGREEMENT._replace(compared=compared)
    best, most = (0.0, 0.0), 0
    # Cells on four grids, half a width apart, so that equal residuals share a cell in one of them.
    for shift in ((0.0, 0.0), (0.5, 0.0), (0.0, 0.5), (0.5, 0.5)):
        cell_a = np.floor(a / (2.0 * widths[0]) + shift[0]).astype(np.int64)
        cell_b = np.floor(b / (2.0 * widths[1]) + shift[1]).astype(np.int64)
        cells, code = np.unique(cell_a * 10_000_019 + cell_b, return_inverse=True)
        once = np.unique(code * (int(plots.max()) + 1) + plots)
        votes = np.bincount(once // (int(plots.max()) + 1), minlength=len(cells))
        if votes.max() > most:
            most = int(votes.max())
            inside = code == votes.argmax()
            best = float(np.median(a[inside])), float(np.median(b[inside]))
    apart_b = wrapped(b - best[1]) if circle else b - best[1]
    equal = (np.abs(a - best[0]) <= widths[0]) & (np.abs(apart_b) <= widths[1])
    share = len(np.unique(plots[equal])) / compared
    spread = tuple(
        float(NORMAL_SPREAD * np.median(np.abs(one[equal] - np.median(one[equal]))))
        for one in (a, b)
    )
    return Agreement(share, compared, best, rows[equal], (spread[0], spread[1]))
