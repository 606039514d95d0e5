"""Wrong sites and range scales, by one fit of all radars that share aircraft.

Differences between positions of one aircraft by two sensors are fitted with offsets of range,
azimuth and time of every radar and a scale of pressure heights, and then with one error of a radar
in addition. An error shows in every pair with this radar and in no other: a sensor that reports
positions, or the shape of the network, determines which radar is wrong.

Errors of all plots of an aircraft are common. The covariance is therefore that of clusters by
aircraft (Liang and Zeger, *Longitudinal data analysis using generalized linear models*,
Biometrika 73, 1986).
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import Agreement, seen_from
from multiradar.diagnosis.cross_sensor.comparison import Comparison, configured_bias
from multiradar.diagnosis.cross_sensor.references import Pairs, are_named, joined
from multiradar.diagnosis.cross_sensor.registration import HEIGHT_SCALE, HEIGHTS_ALIKE_M
from multiradar.diagnosis.diagnosis import Diagnosis
from multiradar.diagnosis.names import listed
from multiradar.diagnosis.plots import Booleans, Floats, Integers, Site, ground_range, located
from multiradar.estimation.measurement.sensors import PARAMETER_RANGE_GAIN, SensorTable
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation, geodetic_to_ecef

#: Kinds of errors.
SHIFT, GAIN = "shift", "gain"
#: Minimum error that is reported: shift of a site, m, and relative error of ranges.
LEAST = {SHIFT: 150.0, GAIN: 0.005}
#: An error is significant from this multiple of its standard deviation on.
SIGMAS = 8.0
#: Aircraft and pairs that an error needs; pairs in a fit, at most.
AIRCRAFT_MIN, PAIRS_MIN, PAIRS_MAX = 12, 60, 6_000
#: An error whose improvement of the fit is within this fraction of the best is as likely.
ALIKE = 0.05
#: Radars closer together than this share a site, m.
ONE_SITE_M = 100.0
#: Number of errors found in one run, at most.
ERRORS_MAX = 3
#: Larger differences of two positions are those of other aircraft, m.
APART_MAX_M = 20_000.0
_REMEDIES = {
    SHIFT: "latitude_deg and longitude_deg in the sensors file",
    GAIN: "the ranges, or give bias.range_gain in the sensors file",
}
# Sizes of the columns of a fit: range m, azimuth rad and time s of a radar; each kind of error.
_OFFSETS = (500.0, float(np.radians(0.5)), 1.0)
_STEPS = {SHIFT: 1000.0, GAIN: 0.01}
# Residuals beyond this multiple of their median are excluded; number of rounds.
_TRIM, _ROUNDS = 4.0, 6
# The fit is determined but for a common rotation and shift; relative size of what decides then.
_RIDGE = 1e-6


@dataclass(frozen=True, slots=True)
class SiteError:
    """An error of one radar, or of radars that share a site.

    Attributes
    ----------
    kind : str
        `SHIFT` or `GAIN`.
    radars : tuple of int
        Rows of the radars in the table of sensors.
    value : tuple of float
        Configured minus true site east and north, m, or ratio of measured to true range minus 1.
    before_m, after_m : float
        Median residual of the pairs with these radars as configured and with the error corrected,
        m.
    """

    kind: str
    radars: tuple[int, ...]
    value: tuple[float, ...]
    before_m: float
    after_m: float


class _Rows(NamedTuple):
    """Pairs of all radars: both sensors, differences east and north, heights of the aircraft."""

    own: Integers
    apart: Floats
    height_m: Floats
    rotation: Floats
    pairs: Pairs


class _Fit(NamedTuple):
    solution: Floats
    covariance: Floats
    residual: Floats
    used: Booleans
    scale: float

    def cost(self, scale: float) -> float:
        """Return the sum of a robust loss of all residuals."""
        return float(np.log1p((self.residual / scale) ** 2).sum())


def find_site_errors(
    comparison: Comparison,
    compared: Mapping[int, tuple[Agreement, Pairs]],
    with_gain: Collection[int],
) -> list[tuple[SiteError, ...]]:
    """Return errors of sites and range scales, the most certain first.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    compared : mapping of (Agreement, Pairs)
        Radars, with positions by others of their aircraft.
    with_gain : collection of int
        Radars whose range gain is configured or estimated.

    Returns
    -------
    list of tuple of SiteError
        An error, or several of which the plots do not show which one it is, the most likely first.
    """
    rows = _rows(comparison, compared)
    if rows is None:
        return []
    radars = np.unique(rows.own).tolist()
    candidates = [(SHIFT, one) for one in _sites(comparison, radars)]
    candidates += [(GAIN, (one,)) for one in radars if one not in with_gain]
    basis = _offset_columns(comparison, rows)
    found: list[tuple[SiteError, ...]] = []
    for _ in range(ERRORS_MAX):
        plain = _fit(rows, basis)
        tried = [
            (candidate, columns, _fit(rows, np.concatenate([basis, columns], axis=2)))
            for candidate in candidates
            for columns in [_error_columns(comparison, rows, *candidate)]
        ]
        errors = {
            number: error
            for number, (candidate, _, fit) in enumerate(tried)
            if (error := _error(rows, candidate, plain, fit)) is not None
        }
        if not errors:
            break
        scale = min(tried[number][2].scale for number in errors)
        gains = {number: plain.cost(scale) - tried[number][2].cost(scale) for number in errors}
        ranked = sorted(errors, key=lambda number: -gains[number])
        likely = [one for one in ranked if gains[one] >= (1.0 - ALIKE) * gains[ranked[0]]]
        found.append(tuple(errors[one] for one in likely))
        basis = np.concatenate([basis, tried[ranked[0]][1]], axis=2)
        known = errors[ranked[0]].radars
        candidates = [one for one in candidates if not set(known) & set(one[1])]
    return found


def check_site_errors(
    sensors: SensorTable,
    comparison: Comparison,
    compared: Mapping[int, tuple[Agreement, Pairs]],
) -> tuple[set[int], list[Diagnosis]]:
    """Diagnose wrong sites and range scales.

    Parameters
    ----------
    sensors : SensorTable
        As configured.
    comparison : Comparison
        The plots.
    compared : mapping of (Agreement, Pairs)
        Radars, with their agreement and the positions by others of their aircraft.

    Returns
    -------
    radars : set of int
        Those that are, or may be, wrong.
    found : list of Diagnosis
        One sentence for each error.
    """
    with_gain = {
        one for one in compared if configured_bias(sensors, one, PARAMETER_RANGE_GAIN) != (0.0, 0.0)
    }
    radars: set[int] = set()
    found = []
    for likely in find_site_errors(comparison, compared, with_gain):
        radars.update(one for error in likely for one in error.radars)
        sentence = _sentence(sensors, likely[0], likely[1:])
        code = "site" if likely[0].kind == SHIFT else "range_gain"
        found.append(Diagnosis(sensors.ids[likely[0].radars[0]], code, sentence))
    return radars, found


def _sentence(sensors: SensorTable, error: SiteError, others: Sequence[SiteError]) -> str:
    what = [_description(sensors, one) for one in (error, *others)]
    alone = "" if len(what) == 1 else " (another radar or ADS-B would show which)"
    kinds = {one.kind for one in (error, *others)}
    remedies = [_REMEDIES[kind] for kind in _REMEDIES if kind in kinds]
    return (
        f"{', or '.join(what)}{alone}: with the {'first ' if others else ''}error corrected, the "
        f"median distance of its plots from the positions by others is {error.after_m:.0f} m "
        f"({error.before_m:.0f} m as they are); correct {' or '.join(remedies)}"
    )


def _description(sensors: SensorTable, error: SiteError) -> str:
    names = listed([sensors.ids[one] for one in error.radars])
    if error.kind == GAIN:
        sense = "long" if error.value[0] > 0.0 else "short"
        return f"{names}: its ranges are probably {abs(error.value[0]):.1%} too {sense}"
    east_km, north_km = -error.value[0] / 1e3, -error.value[1] / 1e3
    return (
        f"{names}: its site is probably {np.hypot(east_km, north_km):.2f} km from the one "
        f"configured ({east_km:+.2f} km east, {north_km:+.2f} km north)"
    )


# The error of a fit, None where it is not significant or too small.
def _error(
    rows: _Rows, candidate: tuple[str, tuple[int, ...]], plain: _Fit, fit: _Fit
) -> SiteError | None:
    kind, radars = candidate
    about = np.isin(rows.own, radars) != np.isin(rows.pairs.source, radars)
    used = about & fit.used
    if np.count_nonzero(used) < PAIRS_MIN or len(np.unique(rows.pairs.name[used])) < AIRCRAFT_MIN:
        return None
    count = 2 if kind == SHIFT else 1
    solution, covariance = fit.solution[-count:], fit.covariance[-count:, -count:]
    value = solution * _STEPS[kind]
    sigmas = float(np.sqrt(solution @ np.linalg.solve(covariance, solution)))
    if float(np.linalg.norm(value)) < LEAST[kind] or sigmas < SIGMAS:
        return None
    before, after = (float(np.median(one.residual[about])) for one in (plain, fit))
    return SiteError(kind, radars, tuple(value.tolist()), before, after)


# Every radar alone, and the radars that share a site.
def _sites(comparison: Comparison, radars: Sequence[int]) -> list[tuple[int, ...]]:
    where = {one: geodetic_to_ecef(*comparison.site(one)) for one in radars}
    found: dict[tuple[int, ...], None] = {(one,): None for one in radars}
    for here in where.values():
        near = [one for one in radars if np.linalg.norm(where[one] - here) <= ONE_SITE_M]
        found[tuple(near)] = None
    return list(found)


def _rows(comparison: Comparison, compared: Mapping[int, tuple[Agreement, Pairs]]) -> _Rows | None:
    parts = [_rows_of(comparison, number, *one) for number, one in compared.items()]
    count = sum(len(one.own) for one in parts)
    if count < PAIRS_MIN:
        return None
    chosen = np.unique(np.linspace(0, count - 1, min(count, PAIRS_MAX)).astype(np.intp))
    own, apart, height_m, rotation = (
        np.concatenate(column)[chosen] for column in list(zip(*parts, strict=True))[:4]
    )
    return _Rows(
        own, apart, height_m, rotation, joined(*(one.pairs for one in parts)).select(chosen)
    )


def _rows_of(comparison: Comparison, number: int, agreement: Agreement, pairs: Pairs) -> _Rows:
    if not are_named(pairs):
        pairs = pairs.select(agreement.matched)
    pairs = pairs.select(np.flatnonzero(np.isfinite(pairs.velocity_mps).all(axis=1)))
    plots, site = comparison.tested(number).select(pairs.plot), comparison.site(number)
    latitude, longitude, seen_m = ecef_to_geodetic(pairs.position_m)
    height_m = np.where(np.isfinite(plots.height_m), plots.height_m, seen_m)
    rotation = enu_rotation(latitude, longitude)
    where = located(site, plots.range_m, np.radians(plots.azimuth_deg), height_m)
    apart = np.einsum("kij,kj->ki", rotation, where - pairs.position_m)[:, :2]
    good = np.flatnonzero(
        (np.linalg.norm(apart, axis=1) <= APART_MAX_M)
        & (np.abs(height_m - seen_m) <= HEIGHTS_ALIKE_M)
    )
    own = np.full(len(good), number)
    return _Rows(own, apart[good], height_m[good], rotation[good], pairs.select(good))


# Offsets of all radars, and the scale of heights: (k, 2, 3 radars + 1).
def _offset_columns(comparison: Comparison, rows: _Rows) -> Floats:
    flown = -np.einsum("kij,kj->ki", rows.rotation, rows.pairs.velocity_mps)[:, :2, None]
    heights = np.zeros((len(rows.own), 2, 1))
    columns = []
    for radar in np.unique(np.concatenate([rows.own, rows.pairs.source])).tolist():
        if not comparison.is_radar(radar):
            continue
        site, sign = comparison.site(radar), _sign(rows, (radar,))
        range_m, along, across = _seen(site, rows)
        turned = across * (range_m * _OFFSETS[1])[:, None, None]
        columns += [along * _OFFSETS[0] * sign, turned * sign, flown * _OFFSETS[2] * sign]
        nearer_m = (
            ground_range(site[2], range_m, rows.height_m)[0]
            - ground_range(site[2], range_m, HEIGHT_SCALE * rows.height_m)[0]
        )
        heights += along * nearer_m[:, None, None] * sign
    return np.concatenate([*columns, heights], axis=2)


# A shift of the site, (k, 2, 2), or a gain of the ranges, (k, 2, 1).
def _error_columns(
    comparison: Comparison, rows: _Rows, kind: str, radars: tuple[int, ...]
) -> Floats:
    sign = _sign(rows, radars)
    if kind == SHIFT:
        return np.eye(2) * _STEPS[kind] * sign
    range_m, along, _ = _seen(comparison.site(radars[0]), rows)
    return along * (range_m * _STEPS[kind])[:, None, None] * sign


# 1 for pairs with a plot of one of these radars, -1 with a position by one, 0 with none or both.
def _sign(rows: _Rows, radars: tuple[int, ...]) -> Floats:
    own, other = (np.isin(one, radars).astype(np.float64) for one in (rows.own, rows.pairs.source))
    return (own - other)[:, None, None]


# Range, and the directions in which a position moves with range and with azimuth.
def _seen(site: Site, rows: _Rows) -> tuple[Floats, Floats, Floats]:
    range_m, azimuth = seen_from(site, rows.pairs.position_m)
    along = np.stack([np.sin(azimuth), np.cos(azimuth)], axis=1)[:, :, None]
    across = np.stack([np.cos(azimuth), -np.sin(azimuth)], axis=1)[:, :, None]
    return range_m, along, across


def _fit(rows: _Rows, design: Floats) -> _Fit:
    count = design.shape[2]
    kept = used = np.ones(len(rows.own), np.bool_)
    normal: Floats = np.eye(count)
    solution: Floats = np.zeros(count)
    residual: Floats = np.zeros(len(rows.own))
    left: Floats = rows.apart
    scale = 1.0
    for _ in range(_ROUNDS):
        used = kept
        a, b = design[used].reshape(-1, count), rows.apart[used].reshape(-1)
        normal = a.T @ a
        normal += _RIDGE * np.eye(count) * max(float(np.trace(normal)), 1.0) / count
        solution = np.asarray(np.linalg.solve(normal, a.T @ b), np.float64)
        left = rows.apart - design @ solution
        residual = np.hypot(left[:, 0], left[:, 1])
        scale = max(float(np.median(residual)), 1.0)
        kept = residual <= _TRIM * scale
        if np.array_equal(kept, used):
            break
    pulls = np.einsum("nki,nk->ni", design[used], left[used])
    names, place = np.unique(rows.pairs.name[used], return_inverse=True)
    sums = np.stack([np.bincount(place, one, len(names)) for one in pulls.T], axis=1)
    inverse = np.linalg.inv(normal)
    covariance = inverse @ (sums.T @ sums) @ inverse * len(names) / max(len(names) - count, 1)
    return _Fit(solution, covariance, residual, used, scale)
