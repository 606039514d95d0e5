"""Clock, height and range errors of a sensor from its residuals against others.

The difference between the plots of a sensor and the positions by others is fitted with the range
and azimuth biases of both, and then in addition with a time offset, which may drift or jump, a
shift of the site, or the effect of a hypothetical error on each plot. Aircraft on different
headings separate a time offset from the rest; the fitted factor of an actual error is 1.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import Agreement
from multiradar.diagnosis.cross_sensor.comparison import Comparison
from multiradar.diagnosis.cross_sensor.effects import HEIGHT_SCALE, HEIGHTS_ALIKE_M, effects_at
from multiradar.diagnosis.cross_sensor.references import Pairs, are_named
from multiradar.diagnosis.cross_sensor.trimmed_fit import Equations, TrimmedFit
from multiradar.diagnosis.plots import Floats, Integers, Rows, Site, ground_range, located
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation
from multiradar_schemas.measurements.units import FOOT_M

#: Prior sigmas of range m and azimuth rad of every sensor (`PRIOR_SIGMA_DEFAULT`).
PRIOR = (500.0, np.radians(0.5))
#: Pairs that a fit needs.
PAIRS_MIN = 60
#: Minimum time offset, s: a whole second is a mistake, half a second a bias (its prior sigma).
TIME_MIN_S = 0.75
#: An additional parameter must reduce the residuals by this factor, and be significant.
SMALLER = 0.8
SIGMAS = 8.0
#: ... and by so many standard deviations where the errors of each aircraft are common.
_CLUSTER_SIGMAS = 8.0
#: Jumps of a clock are tried after each of these fractions of the plots.
_JUMP_SHARES = np.arange(0.1, 0.95, 0.05)
#: Tolerance of the fitted factor about 1. Other causes stay far from 1: pressure heights 7 % off
#: give −0.2 for ground ranges.
FACTOR_WITHIN = 0.2
#: A wrong site height has a smaller effect: this replaces `SMALLER`. Feet are tested where they
#: differ from metres by this, m, and other errors may leave residuals as small within this factor.
SMALLER_BY_HEIGHT = 0.9
HEIGHT_MIN_M, ALIKE = 500.0, 1.01
#: Bounds of the weights by which near plots count more.
_NEARNESS = (0.3, 5.0)
#: Range of errors of a site height that are reported, m: pressure heights are off by less. Number
#: of iterations, and the first step, m.
HEIGHT_OFF_MIN_M, HEIGHT_OFF_MAX_M = 1000.0, 6000.0
_HEIGHT_STEPS, _HEIGHT_STEP_M = 4, 1000.0
#: Aircraft whose heights are estimated, at least and at most, and largest standard deviation of
#: an estimate that shows a height, m.
_HEIGHTS_MIN, _HEIGHTS_MAX, _HEIGHT_SIGMA_MAX_M = 4, 24, 500.0
#: Unit of a shift of the site in a fit, m: columns of one size, as those of the biases.
_SHIFT_M = 1000.0


class Registration(NamedTuple):
    """Errors of a sensor beside its biases; 0 where there is none.

    Attributes
    ----------
    time_offset_s : float
        Claimed time minus true time, s.
    change_s : float
        Last minus first time offset, s.
    jump_at_s, drift : float
        Claimed time at which the clock jumped by it, s; or, if this is NaN, its drift, s/s.
    ground_ranges : bool
        Whether its ranges are ground ranges.
    height_in_feet : bool
        Whether the height of its site was given in feet.
    height_m : float
        The height of its site estimated from the plots, m, where it is wrong for another reason;
        else NaN.
    offset, offset_sigma : (float, float)
        Its offsets of range, m, and azimuth, rad, with their standard deviations (infinite when
        they were not fitted), where there is none of the errors above.
    before_m, after_m : float
        Median residual as configured and with ranges or height corrected, m.
    """

    time_offset_s: float = 0.0
    change_s: float = 0.0
    jump_at_s: float = np.nan
    drift: float = 0.0
    ground_ranges: bool = False
    height_in_feet: bool = False
    height_m: float = np.nan
    offset: tuple[float, float] = (0.0, 0.0)
    offset_sigma: tuple[float, float] = (np.inf, np.inf)
    before_m: float = 0.0
    after_m: float = 0.0


def check_registration(
    comparison: Comparison, number: int, agreement: Agreement, pairs: Pairs
) -> Registration:
    """Return the errors of a radar that agrees with others.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number : int
        The radar.
    agreement : Agreement
        Its agreement.
    pairs : Pairs
        Positions by others.
    """
    nothing = Registration()
    chosen = np.zeros(pairs.size, np.bool_)
    # Where plots identify their aircraft, those that a wrong clock shifts far away are used, too.
    chosen[slice(None) if are_named(pairs) else agreement.matched] = True
    chosen &= np.isfinite(pairs.velocity_mps).all(axis=1)
    pairs = pairs.select(chosen)
    if pairs.size < PAIRS_MIN:
        return nothing
    rows = _rows(comparison, number, pairs)
    shift = np.broadcast_to(-_SHIFT_M * np.eye(2), (pairs.size, 2, 2))
    columns = np.concatenate([rows.biases, rows.flight, shift], axis=2)
    equations, offsets = Equations(rows.apart_m, columns), range(rows.biases.shape[2])
    plain = equations.fit(offsets)
    by_time = equations.fit([*offsets, len(offsets)])
    by_site = equations.fit([*offsets, len(offsets) + 1, len(offsets) + 2])
    by_change, change, change_sigma_s = _by_change(rows, pairs.name)
    best_m = min(by_time.scale, by_site.scale, by_change.scale)
    by_height = _of_heights(comparison.site(number), rows, best_m)
    if by_height is not None:
        return by_height
    changed = abs(change.change_s) >= max(TIME_MIN_S, SIGMAS * by_change.sigma[-1])
    # Few aircraft, each with errors of its own before and after a time, may show any change.
    changed &= abs(change.change_s) >= _CLUSTER_SIGMAS * change_sigma_s
    if changed and by_change.scale <= min(SMALLER * by_time.scale, best_m):
        return change
    late_s = float(by_time.solution[-1])
    sure = abs(late_s) >= max(TIME_MIN_S, SIGMAS * by_time.sigma[-1])
    if sure and by_time.scale <= SMALLER * min(plain.scale, by_site.scale / SMALLER):
        return nothing._replace(time_offset_s=late_s)
    offset, sigma = plain.solution[:2] * PRIOR, plain.sigma[:2] * PRIOR
    return nothing._replace(
        offset=(float(offset[0]), float(offset[1])),
        offset_sigma=(float(sigma[0]), float(sigma[1])),
    )


def heights_differ(comparison: Comparison, number: int, pairs: Pairs) -> float:
    """Return how far the true heights of aircraft that report one height are from each other.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number : int
        A radar.
    pairs : Pairs
        Positions by others, with the same height, named.

    Returns
    -------
    float
        Spread of the heights with which ranges and positions agree, m; 0 where one height of all
        aircraft explains them as well, and NaN where the plots do not show it.
    """
    pairs = pairs.select(np.flatnonzero(np.isfinite(pairs.velocity_mps).all(axis=1)))
    names, counts = np.unique(pairs.name, return_counts=True)
    names = names[np.argsort(-counts, kind="stable")][:_HEIGHTS_MAX]
    pairs = pairs.select(np.flatnonzero(np.isin(pairs.name, names)))
    if pairs.size < PAIRS_MIN or len(names) < _HEIGHTS_MIN:
        return np.nan
    rows = _rows(comparison, number, pairs)
    own = [rows.scaled * (pairs.name == one)[:, None, None] for one in names]
    equations = Equations(rows.apart_m, np.concatenate([rows.biases, rows.flight, *own], axis=2))
    known = range(rows.biases.shape[2] + 1)
    plain = equations.fit(known)
    fit = equations.fit([*known, *range(len(known), len(known) + len(own))])
    step_m = float(np.median(rows.height_m)) * (HEIGHT_SCALE - 1.0)
    heights_m, sigmas_m = fit.solution[-len(own) :] * step_m, fit.sigma[-len(own) :] * step_m
    shown = sigmas_m <= _HEIGHT_SIGMA_MAX_M
    if np.count_nonzero(shown) < _HEIGHTS_MIN:
        return np.nan
    spread_m = float(np.std(heights_m[shown]))
    certain = fit.scale <= SMALLER * plain.scale and spread_m > _HEIGHT_SIGMA_MAX_M
    return spread_m if certain else 0.0


# The best fit with a time offset that changes, whose last parameter is the change, and the standard
# deviation of the change where the errors of each aircraft are common.
def _by_change(rows: "_Rows", aircraft: Integers) -> tuple[TrimmedFit, Registration, float]:
    first_s, duration_s = rows.time_s.min(), max(float(np.ptp(rows.time_s)), 1.0)
    jumps_s = np.unique(np.quantile(rows.time_s, _JUMP_SHARES)).tolist()
    parts = [(rows.time_s - first_s) / duration_s, *(rows.time_s >= one for one in jumps_s)]
    changes = [rows.flight * part[:, None, None] for part in parts]
    equations = Equations(
        rows.apart_m, np.concatenate([rows.biases, rows.flight, *changes], axis=2)
    )
    count = rows.biases.shape[2] + 1
    fits = [equations.fit([*range(count), count + number]) for number in range(len(parts))]
    best = min(range(len(fits)), key=lambda number: fits[number].scale)
    change_s = float(fits[best].solution[-1])
    sigma_s = float(np.sqrt(equations.clustered(fits[best], 1, aircraft)[0, 0]))
    if best == 0:
        drift = Registration(change_s=change_s, drift=change_s / duration_s)
        return fits[0], drift, sigma_s
    return fits[best], Registration(change_s=change_s, jump_at_s=jumps_s[best - 1]), sigma_s


# Errors whose effect depends on aircraft height; `best_m` is the residual under other errors.
def _of_heights(site: Site, rows: "_Rows", best_m: float) -> Registration | None:
    rows = rows.select(np.abs(rows.height_m - rows.seen_m) <= HEIGHTS_ALIKE_M)
    if rows.size < PAIRS_MIN:
        return None
    along = rows.biases[:, :, :1] / PRIOR[0]
    ground_m, _ = ground_range(site[2], rows.range_m, rows.height_m)
    flat_m = 2.0 * rows.range_m - np.hypot(rows.range_m, rows.height_m)
    # A range gain resembles each of them, and has another diagnosis.
    gain_m = 1.01 * rows.range_m
    effects = [along * (one - rows.range_m)[:, None, None] for one in (ground_m, flat_m, gain_m)]
    columns = np.concatenate([rows.biases, rows.scaled, *effects], axis=2)
    equations, offsets = Equations(rows.apart_m, columns), range(rows.biases.shape[2])
    plain = equations.fit(offsets)
    best_m = min(best_m, equations.fit([*offsets, len(offsets) + 3]).scale)
    for effect in (1, 2):
        fit = equations.fit([*offsets, len(offsets) + effect])
        if _is_confirmed(fit) and fit.scale <= min(SMALLER * plain.scale, best_m):
            return Registration(ground_ranges=True, before_m=plain.scale, after_m=fit.scale)
    others = [*offsets, len(offsets)]

    # The fit for another site height, with weights.
    def at_height(height_m: float, weight: Floats) -> TrimmedFit:
        there_m, _ = ground_range(height_m, rows.range_m, rows.height_m)
        raised = along * (ground_m - there_m)[:, None, None]
        raised = np.concatenate([columns[:, :, others], raised], axis=2) * weight[:, None, None]
        return Equations(rows.apart_m * weight[:, None], raised).fit(range(raised.shape[2]))

    # Near plots show a height most, and their azimuth noise is the shortest.
    nearness = np.clip(np.median(rows.range_m) / rows.range_m, *_NEARNESS)
    weights = np.ones(rows.size), nearness
    return _of_site_height(site[2], equations.fit(others), at_height, weights, best_m)


# The site height, with all aircraft heights free to be off in proportion.
def _of_site_height(
    given_m: float,
    plain: TrimmedFit,
    at_height: Callable[[float, Floats], TrimmedFit],
    weights: tuple[Floats, Floats],
    best_m: float,
) -> Registration | None:
    enough_m = min(SMALLER_BY_HEIGHT * plain.scale, best_m)
    if given_m * (1.0 - FOOT_M) >= HEIGHT_MIN_M:
        feet, near = (at_height(given_m * FOOT_M, one) for one in weights)
        agrees = abs(float(feet.solution[-1]) - 1.0) <= FACTOR_WITHIN and _is_confirmed(near)
        if agrees and feet.scale <= min(plain.scale, ALIKE * best_m):
            return Registration(height_in_feet=True, before_m=plain.scale, after_m=feet.scale)
    height_m = given_m + _HEIGHT_STEP_M
    for _ in range(_HEIGHT_STEPS):
        last_m, fit = height_m, at_height(height_m, weights[0])
        step_m = float(fit.solution[-1]) * (height_m - given_m)
        if not HEIGHT_OFF_MIN_M <= abs(step_m) <= HEIGHT_OFF_MAX_M:
            return None
        height_m = given_m + step_m
    settled = abs(height_m - last_m) <= 0.1 * abs(step_m)
    if settled and _is_confirmed(fit) and fit.scale <= enough_m:
        return Registration(height_m=height_m, before_m=plain.scale, after_m=fit.scale)
    return None


def _is_confirmed(fit: TrimmedFit) -> bool:
    factor, sigma = float(fit.solution[-1]), float(fit.sigma[-1])
    return abs(factor - 1.0) <= FACTOR_WITHIN and SIGMAS * sigma <= factor


@dataclass(frozen=True, slots=True)
class _Rows(Rows):
    """Pairs of a radar: differences east and north, and the columns that explain them.

    `biases` are those of the radar and of each radar that it is compared with, `flight` is a late
    clock, `scaled` are greater heights. Times, ranges and heights are those of the plots, `seen_m`
    are the heights of the positions by others.
    """

    apart_m: Floats
    biases: Floats
    flight: Floats
    scaled: Floats
    time_s: Floats
    range_m: Floats
    height_m: Floats
    seen_m: Floats


def _rows(comparison: Comparison, number: int, pairs: Pairs) -> _Rows:
    plots, site = comparison.tested(number).select(pairs.plot), comparison.site(number)
    latitude, longitude, seen_m = ecef_to_geodetic(pairs.position_m)
    rotation = enu_rotation(latitude, longitude)
    where = located(site, plots.range_m, np.radians(plots.azimuth_deg), plots.heights())
    apart = np.einsum("kij,kj->ki", rotation, where - pairs.position_m)[:, :2]
    sources = [one for one in np.unique(pairs.source) if one >= 0 and comparison.is_radar(int(one))]
    biases = np.zeros((pairs.size, 2, 2 + 2 * len(sources)))
    own = effects_at(site, pairs.position_m, plots.height_m)
    biases[:, :, :2], scaled = own.offsets * PRIOR, own.height_scale
    for column, source in enumerate(sources, 1):
        rows = np.flatnonzero(pairs.source == source)
        other = effects_at(
            comparison.site(int(source)), pairs.position_m[rows], plots.height_m[rows]
        )
        biases[rows, :, 2 * column : 2 * column + 2] = -other.offsets * PRIOR
        scaled[rows] -= other.height_scale
    # With a late clock the positions by others are interpolated to a later time.
    flight = -np.einsum("kij,kj->ki", rotation, pairs.velocity_mps)[:, :2, None]
    return _Rows(apart, biases, flight, scaled, plots.time_s, plots.range_m, plots.height_m, seen_m)
