"""What the residuals of a sensor that agrees with others say of its clock and its site.

The difference between the plots of a sensor and the places where others see the aircraft is fitted
with the biases of range and azimuth of both, and then with a time offset, or with a shift of the
site, in addition. Aircraft that fly in different directions tell a time offset from the rest.
"""

from typing import NamedTuple

import numpy as np

from multiradar.diagnosis.agreement import Agreement, seen_from
from multiradar.diagnosis.comparison import Comparison
from multiradar.diagnosis.plots import Floats, Site, located
from multiradar.diagnosis.references import Pairs
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


class Registration(NamedTuple):
    """What is wrong with a sensor beside its biases; 0 where nothing is.

    Attributes
    ----------
    time_offset_s : float
        How late its clock is: claimed time minus true time, s.
    east_m, north_m : float
        How far its site is from the one configured, m.
    """

    time_offset_s: float
    east_m: float
    north_m: float


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
    nothing = Registration(0.0, 0.0, 0.0)
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
    late_s = float(by_time.solution[-1])
    moved = by_site.solution[-2:]
    sure = abs(late_s) >= max(TIME_MIN_S, SIGMAS * by_time.sigma[-1])
    if sure and by_time.scale <= SMALLER * min(plain.scale, by_site.scale / SMALLER):
        return nothing._replace(time_offset_s=late_s)
    far = float(np.hypot(*moved)) >= max(SHIFT_MIN_M, SIGMAS * float(by_site.sigma[-2:].max()))
    if far and by_site.scale <= SMALLER * plain.scale:
        return Registration(0.0, float(moved[0]), float(moved[1]))
    return nothing


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
    shift = np.broadcast_to(-np.eye(2), (pairs.size, 2, 2))
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
