"""Clock, height and range errors of a sensor from its residuals against others.

The difference between the plots of a sensor and the positions by others is fitted with the range
and azimuth biases of both, and then in addition with a time offset, a shift of the site, or the
effect of a hypothetical error on each plot. Aircraft on different headings separate a time offset
from the rest; the fitted factor of an actual error is 1.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import Agreement, seen_from
from multiradar.diagnosis.cross_sensor.comparison import Comparison
from multiradar.diagnosis.cross_sensor.references import Pairs, are_named
from multiradar.diagnosis.plausibility import FOOT_M
from multiradar.diagnosis.plots import Floats, Site, ground_range, located
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation

#: Prior sigmas of range m and azimuth rad of every sensor (`PRIOR_SIGMA_DEFAULT`).
_PRIOR = (500.0, np.radians(0.5))
#: Residuals beyond this multiple of their median are excluded; number of rounds.
_TRIM, _ROUNDS = 4.0, 5
#: Pairs that a fit needs.
PAIRS_MIN = 60
#: Minimum time offset, s: twice its prior sigma.
TIME_MIN_S = 1.0
#: An additional parameter must reduce the residuals by this factor, and be significant.
SMALLER = 0.8
SIGMAS = 8.0
#: Tolerance of the fitted factor about 1. Other causes stay far from 1: pressure heights 7 % off
#: give −0.2 for ground ranges.
FACTOR_WITHIN = 0.2
#: A wrong site height has a smaller effect: this replaces `SMALLER`, and feet are tested where they
#: differ from metres by this, m.
SMALLER_BY_HEIGHT = 0.9
HEIGHT_MIN_M = 500.0
#: Maximum difference of the heights used for a plot by the sensor and by others, m: the height of a
#: plot without one is assumed.
HEIGHTS_ALIKE_M = 300.0
#: Pressure heights are off in proportion on a hot or a cold day (7 % at 20 K from the standard
#: atmosphere), which resembles another site height; the step of the fit.
HEIGHT_SCALE = 1.05
#: Range of errors of a site height that are reported, m: pressure heights are off by less. Number
#: of iterations, and the first step, m.
HEIGHT_OFF_MIN_M, HEIGHT_OFF_MAX_M = 1000.0, 6000.0
_HEIGHT_STEPS, _HEIGHT_STEP_M = 4, 1000.0
#: Unit of a shift of the site in a fit, m: columns of one size, as those of the biases.
_SHIFT_M = 1000.0


class Registration(NamedTuple):
    """Errors of a sensor beside its biases; 0 where there is none.

    Attributes
    ----------
    time_offset_s : float
        Claimed time minus true time, s.
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
    residual, biases, shift, flight = _equations(comparison, number, pairs)
    plain = _fit(residual, biases)
    by_time = _fit(residual, np.concatenate([biases, flight], axis=2))
    by_site = _fit(residual, np.concatenate([biases, shift], axis=2))
    by_height = _of_heights(comparison, number, pairs, min(by_time.scale, by_site.scale))
    if by_height is not None:
        return by_height
    late_s = float(by_time.solution[-1])
    sure = abs(late_s) >= max(TIME_MIN_S, SIGMAS * by_time.sigma[-1])
    if sure and by_time.scale <= SMALLER * min(plain.scale, by_site.scale / SMALLER):
        return nothing._replace(time_offset_s=late_s)
    offset, sigma = plain.solution[:2] * _PRIOR, plain.sigma[:2] * _PRIOR
    return nothing._replace(
        offset=(float(offset[0]), float(offset[1])),
        offset_sigma=(float(sigma[0]), float(sigma[1])),
    )


# Errors whose effect depends on aircraft height; `best_m` is the residual under other errors.
def _of_heights(
    comparison: Comparison, number: int, pairs: Pairs, best_m: float
) -> Registration | None:
    site, plots = comparison.site(number), comparison.tested(number).select(pairs.plot)
    _, _, seen_m = ecef_to_geodetic(pairs.position_m)
    known = np.abs(plots.height_m - seen_m) <= HEIGHTS_ALIKE_M
    pairs, plots = pairs.select(known), plots.select(known)
    if pairs.size < PAIRS_MIN:
        return None
    residual, biases, _, _ = _equations(comparison, number, pairs)
    along = _bias_columns(site, pairs)[:, :, :1]
    ground_m, _ = ground_range(site[2], plots.range_m, plots.height_m)
    plain = _fit(residual, biases)
    effect = along * (ground_m - plots.range_m)[:, None, None]
    ground = _fit(residual, np.concatenate([biases, effect], axis=2))
    if _is_confirmed(ground) and ground.scale <= min(SMALLER * plain.scale, best_m):
        return Registration(ground_ranges=True, before_m=plain.scale, after_m=ground.scale)
    scaled = _height_scale_columns(comparison, number, pairs, plots.height_m)
    others = np.concatenate([biases, scaled], axis=2)

    # The fit for another site height.
    def at_height(height_m: float) -> _Fit:
        there_m, _ = ground_range(height_m, plots.range_m, plots.height_m)
        raised = along * (ground_m - there_m)[:, None, None]
        return _fit(residual, np.concatenate([others, raised], axis=2))

    return _of_site_height(site[2], _fit(residual, others), at_height, best_m)


# The site height, with all aircraft heights free to be off in proportion.
def _of_site_height(
    given_m: float, plain: "_Fit", at_height: Callable[[float], "_Fit"], best_m: float
) -> Registration | None:
    enough_m = min(SMALLER_BY_HEIGHT * plain.scale, best_m)
    if given_m * (1.0 - FOOT_M) >= HEIGHT_MIN_M:
        feet = at_height(given_m * FOOT_M)
        if _is_confirmed(feet) and feet.scale <= enough_m:
            return Registration(height_in_feet=True, before_m=plain.scale, after_m=feet.scale)
    height_m = given_m + _HEIGHT_STEP_M
    for _ in range(_HEIGHT_STEPS):
        last_m, fit = height_m, at_height(height_m)
        step_m = float(fit.solution[-1]) * (height_m - given_m)
        if not HEIGHT_OFF_MIN_M <= abs(step_m) <= HEIGHT_OFF_MAX_M:
            return None
        height_m = given_m + step_m
    settled = abs(height_m - last_m) <= 0.1 * abs(step_m)
    if settled and _is_confirmed(fit) and fit.scale <= enough_m:
        return Registration(height_m=height_m, before_m=plain.scale, after_m=fit.scale)
    return None


def _is_confirmed(fit: "_Fit") -> bool:
    factor, sigma = float(fit.solution[-1]), float(fit.sigma[-1])
    return abs(factor - 1.0) <= FACTOR_WITHIN and SIGMAS * sigma <= factor


# Effect of proportionally greater heights on the positions by this radar and the others.
def _height_scale_columns(
    comparison: Comparison, number: int, pairs: Pairs, height_m: Floats
) -> Floats:
    found = _range_change_columns(comparison.site(number), pairs, height_m)
    for source in np.unique(pairs.source):
        if source >= 0 and comparison.is_radar(int(source)):
            of_it = _range_change_columns(comparison.site(int(source)), pairs, height_m)
            found = found - of_it * (pairs.source == source)[:, None, None]
    return found


def _range_change_columns(site: Site, pairs: Pairs, height_m: Floats) -> Floats:
    range_m, _ = seen_from(site, pairs.position_m)
    less_m = (
        ground_range(site[2], range_m, height_m)[0]
        - ground_range(site[2], range_m, HEIGHT_SCALE * height_m)[0]
    )
    return _bias_columns(site, pairs)[:, :, :1] * less_m[:, None, None]


class _Fit(NamedTuple):
    solution: Floats
    sigma: Floats
    scale: float


# Residuals (k, 2) east and north, and their design matrices (k, 2, parameters).
def _equations(
    comparison: Comparison, number: int, pairs: Pairs
) -> tuple[Floats, Floats, Floats, Floats]:
    plots, site = comparison.tested(number), comparison.site(number)
    latitude, longitude, _ = ecef_to_geodetic(pairs.position_m)
    rotation = enu_rotation(latitude, longitude)
    where = located(site, plots.range_m, np.radians(plots.azimuth_deg), plots.heights())
    apart = np.einsum("kij,kj->ki", rotation, where[pairs.plot] - pairs.position_m)[:, :2]
    sources = [one for one in np.unique(pairs.source) if one >= 0 and comparison.is_radar(int(one))]
    columns = [_bias_columns(site, pairs)]
    for source in sources:
        of_it = _bias_columns(comparison.site(int(source)), pairs)
        columns.append(-of_it * (pairs.source == source)[:, None, None])
    biases = np.concatenate(columns, axis=2)
    scale = np.tile(_PRIOR, len(columns))
    shift = np.broadcast_to(-_SHIFT_M * np.eye(2), (pairs.size, 2, 2))
    # With a late clock the positions by others are interpolated to a later time.
    flight = -np.einsum("kij,kj->ki", rotation, pairs.velocity_mps)[:, :2, None]
    return apart, biases * scale, shift, flight


# Effect of 1 m of range and 1 rad of azimuth on the position by a radar, east and north.
def _bias_columns(site: Site, pairs: Pairs) -> Floats:
    range_m, azimuth = seen_from(site, pairs.position_m)
    along = np.stack([np.sin(azimuth), np.cos(azimuth)], axis=1)
    across = np.stack([np.cos(azimuth), -np.sin(azimuth)], axis=1) * range_m[:, None]
    return np.stack([along, across], axis=2)


def _fit(residual: Floats, design: Floats) -> _Fit:
    count = design.shape[2]
    kept = np.ones(len(residual), np.bool_)
    solution, scale, normal = np.zeros(count), 1.0, np.eye(count)
    for _ in range(_ROUNDS):
        used = kept
        a, b = design[used].reshape(-1, count), residual[used].reshape(-1)
        normal = a.T @ a
        normal = normal + 1e-6 * np.eye(count) * max(float(np.trace(normal)), 1.0) / count
        solution = np.linalg.solve(normal, a.T @ b)
        left = np.linalg.norm(residual - design @ solution, axis=1)
        scale = max(float(np.median(left)), 1.0)
        kept = left <= _TRIM * scale
        if np.array_equal(kept, used):
            break
    sigma = scale * np.sqrt(np.diag(np.linalg.inv(normal)))
    return _Fit(solution, sigma, scale)
