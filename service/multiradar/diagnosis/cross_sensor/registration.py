"""What the residuals of a sensor that agrees with others say of its clock, site and ranges.

The difference between the plots of a sensor and the positions where others see the aircraft is
fitted with the biases of range and azimuth of both, and then in addition with a time offset, with a
shift of the site, or with what a mistake does to each plot. Aircraft that fly in different
directions separate a time offset from the rest; the factor of a mistake that was made is 1.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import Agreement, seen_from
from multiradar.diagnosis.cross_sensor.comparison import Comparison
from multiradar.diagnosis.cross_sensor.references import Pairs
from multiradar.diagnosis.plausibility import FOOT_M
from multiradar.diagnosis.plots import Floats, Site, ground_range, located
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation

#: Beforehand: range m and azimuth rad of every sensor (`PRIOR_SIGMA_DEFAULT`).
_PRIOR = (500.0, np.radians(0.5))
#: Residuals beyond so many median amounts are left out, in so many rounds.
_TRIM, _ROUNDS = 4.0, 5
#: Pairs that a fit needs.
PAIRS_MIN = 60
#: A clock is wrong by this at least, s: twice what is assumed beforehand.
TIME_MIN_S = 1.0
#: A site is elsewhere by this at least, m: twice the standard deviation of range beforehand.
SHIFT_MIN_M = 1000.0
#: What is fitted in addition must make the residuals so much smaller, and be so sure.
SMALLER = 0.8
SIGMAS = 8.0
#: The factor of a mistake that was made is so near 1. What is no such mistake stays far from it:
#: pressure heights 7 % off make −0.2 of ground ranges.
FACTOR_WITHIN = 0.2
#: A mistake of the site's height shows less of it: the residuals are so much smaller with it, in
#: place of `SMALLER`, and it is looked for where feet and metres differ by this, m.
SMALLER_BY_HEIGHT = 0.9
HEIGHT_MIN_M = 500.0
#: Heights by which a sensor and others place an aircraft must be alike within this, m: those of a
#: plot without height are assumed.
_HEIGHTS_ALIKE_M = 300.0
#: Heights of all aircraft are off in proportion on a hot or a cold day (7 % of height in 20 K off
#: the standard atmosphere), which would look like another height of the site; the step of a fit.
_HOTTER = 1.05
#: Another height of a site is named from this on, m: pressure heights are off by less. It is found
#: in so many steps, from one so far away.
HEIGHT_OFF_MIN_M, HEIGHT_OFF_MAX_M = 1000.0, 6000.0
_HEIGHT_STEPS, _HEIGHT_STEP_M = 4, 1000.0
#: Unit of a shift of the site in a fit, m: columns of one size, as those of the biases.
_SHIFT_M = 1000.0


class Registration(NamedTuple):
    """What is wrong with a sensor beside its biases; 0 where nothing is.

    Attributes
    ----------
    time_offset_s : float
        How late its clock is: claimed time minus true time, s.
    east_m, north_m : float
        How far its site is from the one configured, m.
    ground_ranges : bool
        Whether its ranges are ground ranges.
    height_in_feet : bool
        Whether the height of its site was given in feet.
    height_m : float
        The height of its site that the plots show, where it is another one for no such reason, m;
        else NaN.
    offset, offset_sigma : (float, float)
        Its offsets of range, m, and azimuth, rad, with their standard deviations (infinite when
        they were not fitted), where nothing of the above is wrong.
    before_m, after_m : float
        Median residual as configured and with ranges or height corrected, m.
    """

    time_offset_s: float = 0.0
    east_m: float = 0.0
    north_m: float = 0.0
    ground_ranges: bool = False
    height_in_feet: bool = False
    height_m: float = np.nan
    offset: tuple[float, float] = (0.0, 0.0)
    offset_sigma: tuple[float, float] = (np.inf, np.inf)
    before_m: float = 0.0
    after_m: float = 0.0


def registered(
    comparison: Comparison, number: int, agreement: Agreement, pairs: Pairs
) -> Registration:
    """Return what is wrong with a radar that agrees with others.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    number : int
        The radar.
    agreement : Agreement
        How it agrees.
    pairs : Pairs
        With whom.
    """
    nothing = Registration()
    chosen = np.zeros(pairs.size, np.bool_)
    # Where plots name their aircraft, those that a wrong clock takes far away count, too.
    chosen[slice(None) if _are_named(pairs) else agreement.matched] = True
    chosen &= np.isfinite(pairs.velocity_mps).all(axis=1)
    pairs = pairs.take(chosen)
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
    moved = by_site.solution[-2:] * _SHIFT_M
    sure = abs(late_s) >= max(TIME_MIN_S, SIGMAS * by_time.sigma[-1])
    if sure and by_time.scale <= SMALLER * min(plain.scale, by_site.scale / SMALLER):
        return nothing._replace(time_offset_s=late_s)
    far = float(np.hypot(*moved)) >= max(
        SHIFT_MIN_M, SIGMAS * float(by_site.sigma[-2:].max()) * _SHIFT_M
    )
    if far and by_site.scale <= SMALLER * plain.scale:
        return nothing._replace(east_m=float(moved[0]), north_m=float(moved[1]))
    offset, sigma = plain.solution[:2] * _PRIOR, plain.sigma[:2] * _PRIOR
    return nothing._replace(
        offset=(float(offset[0]), float(offset[1])),
        offset_sigma=(float(sigma[0]), float(sigma[1])),
    )


# Mistakes that act by the heights of the aircraft; `best_m` is what other mistakes leave.
def _of_heights(
    comparison: Comparison, number: int, pairs: Pairs, best_m: float
) -> Registration | None:
    site, plots = comparison.site(number), comparison.tested(number).take(pairs.plot)
    _, _, seen_m = ecef_to_geodetic(pairs.position_m)
    known = np.abs(plots.height_m - seen_m) <= _HEIGHTS_ALIKE_M
    pairs, plots = pairs.take(known), plots.take(known)
    if pairs.size < PAIRS_MIN:
        return None
    residual, biases, _, _ = _equations(comparison, number, pairs)
    along = _bias_columns(site, pairs)[:, :, :1]
    ground_m, _ = ground_range(site[2], plots.range_m, plots.height_m)
    plain = _fit(residual, biases)
    taken = along * (ground_m - plots.range_m)[:, None, None]
    ground = _fit(residual, np.concatenate([biases, taken], axis=2))
    if _made(ground) and ground.scale <= min(SMALLER * plain.scale, best_m):
        return Registration(ground_ranges=True, before_m=plain.scale, after_m=ground.scale)
    hotter = _hotter(comparison, number, pairs, plots.height_m)
    others = np.concatenate([biases, hotter], axis=2)

    # What is fitted where the site stands at another height.
    def at_height(height_m: float) -> _Fit:
        there_m, _ = ground_range(height_m, plots.range_m, plots.height_m)
        raised = along * (ground_m - there_m)[:, None, None]
        return _fit(residual, np.concatenate([others, raised], axis=2))

    return _of_site_height(site[2], _fit(residual, others), at_height, best_m)


# The height of the site, where that of all aircraft may be off in proportion.
def _of_site_height(
    given_m: float, plain: "_Fit", at_height: Callable[[float], "_Fit"], best_m: float
) -> Registration | None:
    enough_m = min(SMALLER_BY_HEIGHT * plain.scale, best_m)
    if given_m * (1.0 - FOOT_M) >= HEIGHT_MIN_M:
        feet = at_height(given_m * FOOT_M)
        if _made(feet) and feet.scale <= enough_m:
            return Registration(height_in_feet=True, before_m=plain.scale, after_m=feet.scale)
    height_m = given_m + _HEIGHT_STEP_M
    for _ in range(_HEIGHT_STEPS):
        last_m, fit = height_m, at_height(height_m)
        step_m = float(fit.solution[-1]) * (height_m - given_m)
        if not HEIGHT_OFF_MIN_M <= abs(step_m) <= HEIGHT_OFF_MAX_M:
            return None
        height_m = given_m + step_m
    settled = abs(height_m - last_m) <= 0.1 * abs(step_m)
    if settled and _made(fit) and fit.scale <= enough_m:
        return Registration(height_m=height_m, before_m=plain.scale, after_m=fit.scale)
    return None


def _made(fit: "_Fit") -> bool:
    factor, sigma = float(fit.solution[-1]), float(fit.sigma[-1])
    return abs(factor - 1.0) <= FACTOR_WITHIN and SIGMAS * sigma <= factor


# What heights greater in proportion do to where this radar and the others see aircraft.
def _hotter(comparison: Comparison, number: int, pairs: Pairs, height_m: Floats) -> Floats:
    found = _nearer(comparison.site(number), pairs, height_m)
    for source in np.unique(pairs.source):
        if source >= 0 and comparison.is_radar(int(source)):
            of_it = _nearer(comparison.site(int(source)), pairs, height_m)
            found = found - of_it * (pairs.source == source)[:, None, None]
    return found


def _nearer(site: Site, pairs: Pairs, height_m: Floats) -> Floats:
    range_m, _ = seen_from(site, pairs.position_m)
    less_m = (
        ground_range(site[2], range_m, height_m)[0]
        - ground_range(site[2], range_m, _HOTTER * height_m)[0]
    )
    return _bias_columns(site, pairs)[:, :, :1] * less_m[:, None, None]


def _are_named(pairs: Pairs) -> bool:
    of_others = pairs.take(pairs.source >= 0)
    return len(np.unique(np.column_stack([of_others.plot, of_others.source]), axis=0)) == (
        of_others.size
    )


class _Fit(NamedTuple):
    solution: Floats
    sigma: Floats
    scale: float


# Residuals (k, 2) east and north, and what they are multiples of: (k, 2, parameters).
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
    # A late clock: others are asked where the aircraft is only later.
    flight = -np.einsum("kij,kj->ki", rotation, pairs.velocity_mps)[:, :2, None]
    return apart, biases * scale, shift, flight


# What 1 m of range and 1 rad of azimuth do to where a radar sees an aircraft, east and north.
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
        a, b = design[kept].reshape(-1, count), residual[kept].reshape(-1)
        normal = a.T @ a + 1e-6 * np.eye(count) * max(float(np.trace(a.T @ a)), 1.0) / count
        solution = np.linalg.solve(normal, a.T @ b)
        left = np.linalg.norm(residual - design @ solution, axis=1)
        scale = max(float(np.median(left)), 1.0)
        kept = left <= _TRIM * scale
    sigma = scale * np.sqrt(np.diag(np.linalg.inv(normal)))
    return _Fit(solution, sigma, scale)
