"""Sites of radars from positions of their aircraft by others, with their covariance.

The position of a site and the biases of range and azimuth are estimated together. Errors of an
aircraft's plots are common: of its transponder and its height; so are those of a reference: its
biases. The covariance is therefore that of clusters (Liang and Zeger, *Longitudinal data analysis
using generalized linear models*, Biometrika 73, 1986), by aircraft and by reference, not that of
independent plots. Both are added, which counts what is of one aircraft and one reference twice.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import (
    best_site,
    polar_agreement,
    seen_from,
    wrapped,
)
from multiradar.diagnosis.cross_sensor.comparison import AGREES_MIN
from multiradar.diagnosis.cross_sensor.references import (
    Pairs,
    common_key,
    named_pairs,
    named_paths,
    recorded_pairs,
)
from multiradar.diagnosis.plots import NORMAL_SPREAD, Floats, Integers, Plots, Site, positions
from multiradar.geodesy.wgs84 import ecef_to_geodetic, enu_rotation, geodetic_to_ecef

#: Plots of a radar that are compared, at most, and at least; aircraft at least.
PLOTS_MAX, PLOTS_MIN, AIRCRAFT_MIN = 4_000, 20, 8
#: Height of an antenna that is not known, m, and its uncertainty, which affects no coordinate
#: but those of near plots.
HEIGHT_ASSUMED_M = 300.0
#: Prior standard deviations of range and azimuth bias: those of a sensors file.
RANGE_PRIOR_M, AZIMUTH_PRIOR_RAD = 500.0, math.radians(0.5)
#: A solved site with a larger sigma is no reference for other radars, m.
REFERENCE_SIGMA_MAX_M = 500.0
# Residuals beyond so many sigma are of other aircraft; rounds of the fit; rounds of solving.
_TRIMMED_SIGMAS, _STEPS, _ROUNDS = 3.5, 8, 3
_RANGE_LEAST_M, _AZIMUTH_LEAST_RAD = 5.0, math.radians(0.005)
_UNKNOWNS = 4
# Plots without identity are aircraft of their own, with numbers above all identities.
_UNNAMED = 1 << 40


@dataclass(frozen=True)
class SolvedSite:
    """Site of a radar.

    Attributes
    ----------
    site : Site
        Latitude and longitude, rad, and height, m, which is assumed.
    sigma_m : float
        Standard deviation along the worst axis, m.
    plots, aircraft : int
        Plots and aircraft in the fit.
    reference : str
        The sensors whose positions were used.
    """

    site: Site
    sigma_m: float
    plots: int
    aircraft: int
    reference: str


@dataclass
class SiteSearch:
    """Plots of all sensors, and known sites.

    Attributes
    ----------
    radars, others : dict of Plots
        Plots of radars, and reports of positions by other sensors, by name.
    known : dict of Site
        Sites of radars by name.
    """

    radars: Mapping[str, Plots]
    others: Mapping[str, Plots]
    known: Mapping[str, Site]
    solved: dict[str, SolvedSite] = field(default_factory=dict)


def solve_sites(
    radars: Mapping[str, Plots], others: Mapping[str, Plots], known: Mapping[str, Site]
) -> dict[str, SolvedSite]:
    """Return the sites of radars that are not known, where the recording determines them.

    Parameters
    ----------
    radars : mapping of Plots
        Plots of radars by name.
    others : mapping of Plots
        Positions by other sensors (ADS-B, MLAT) by name.
    known : mapping of Site
        Known sites, rad and m.

    Returns
    -------
    dict of SolvedSite
        By name; radars that share too few aircraft with others are missing.

    Notes
    -----
    Radars whose sites are solved are references for those that share aircraft with them only.
    """
    search = SiteSearch(radars, others, known)
    for _ in range(_ROUNDS):
        found = {
            name: one
            for name in radars
            if name not in known and name not in search.solved
            if (one := _solve(name, search)) is not None
        }
        if not found:
            break
        search.solved |= found
    return search.solved


def _solve(name: str, search: SiteSearch) -> SolvedSite | None:
    plots = search.radars[name]
    good = np.isfinite(plots.range_m) & np.isfinite(plots.azimuth_deg) & np.isfinite(plots.time_s)
    plots = plots.select(good)
    recorded = recorded_pairs(plots)
    if recorded.size:
        return _fitted(plots, recorded, "its positions in the recording")
    references = _references(name, search)
    key = common_key(plots, references.values())
    if key is None:
        # A radar without addresses shares codes with fewer aircraft.
        return None
    paths = [
        named_paths(number, one, positions(one, _site_of(other, search)), key)
        for number, (other, one) in enumerate(references.items())
    ]
    thinned = plots.thinned(PLOTS_MAX)
    pairs = named_pairs(thinned, [(key, one) for one in paths], 0.0)
    used = [list(references)[number] for number in np.unique(pairs.source).tolist()]
    return _fitted(thinned, pairs, ", ".join(used), thinned.keys[:, key])


def _references(name: str, search: SiteSearch) -> dict[str, Plots]:
    found = {other: one for other, one in search.others.items() if one.size}
    for other, one in search.radars.items():
        solved = search.solved.get(other)
        sited = other in search.known or (
            solved is not None and solved.sigma_m <= REFERENCE_SIGMA_MAX_M
        )
        if sited and other != name:
            found[other] = one
    return found


def _site_of(name: str, search: SiteSearch) -> Site | None:
    if name in search.known:
        return search.known[name]
    return search.solved[name].site if name in search.solved else None


def _fitted(
    plots: Plots, pairs: Pairs, reference: str, names: Integers | None = None
) -> SolvedSite | None:
    if plots.size > PLOTS_MAX:
        plots = plots.thinned(PLOTS_MAX)
        pairs = recorded_pairs(plots)
    compared = len(np.unique(pairs.plot))
    if compared < PLOTS_MIN:
        return None
    measured = (plots.range_m, np.radians(plots.azimuth_deg))
    latitude, longitude, _ = ecef_to_geodetic(np.median(pairs.position_m, axis=0))
    start = (float(latitude), float(longitude), HEIGHT_ASSUMED_M)
    site = best_site(plots, measured, start, pairs)
    agreement = polar_agreement(measured, site, pairs, compared=compared)
    if agreement.share < AGREES_MIN:
        return None
    own = pairs.select(agreement.matched)
    aircraft = plots.keys[:, 2] if names is None else names
    aircraft = np.where(aircraft < 0, np.arange(len(aircraft)) + _UNNAMED, aircraft)[own.plot]
    if len(np.unique(aircraft)) < AIRCRAFT_MIN:
        return None
    ranges, azimuths = measured[0][own.plot], measured[1][own.plot]
    return _refined(site, (ranges, azimuths), own.position_m, (aircraft, own.source), reference)


def _refined(
    site: Site, measured: tuple[Floats, Floats], position_m: Floats,
    clusters: tuple[Integers, Integers],
    reference: str,
) -> SolvedSite:  # fmt: skip
    """Fit site and biases by Gauss and Newton's method, without outliers."""
    biases = np.zeros(2)
    prior = np.diag([0.0, 0.0, RANGE_PRIOR_M**-2, AZIMUTH_PRIOR_RAD**-2])
    covariance = np.eye(_UNKNOWNS)
    kept = np.ones(len(position_m), dtype=np.bool_)
    for _ in range(_STEPS):
        seen_range, seen_azimuth = seen_from(site, position_m)
        ranges = measured[0] - seen_range - biases[0]
        azimuths = wrapped(measured[1] - seen_azimuth - biases[1])
        sigmas = (
            _spread(ranges[kept], _RANGE_LEAST_M),
            _spread(azimuths[kept], _AZIMUTH_LEAST_RAD),
        )
        kept = (np.abs(ranges) <= _TRIMMED_SIGMAS * sigmas[0]) & (
            np.abs(azimuths) <= _TRIMMED_SIGMAS * sigmas[1]
        )
        slopes = _slopes(seen_range, seen_azimuth)[kept] / np.array(sigmas)[:, None]
        residuals = np.stack([ranges, azimuths], axis=1)[kept] / np.array(sigmas)
        information = np.einsum("nki,nkj->ij", slopes, slopes) + prior
        pulls = np.einsum("nki,nk->ni", slopes, residuals)
        step = np.linalg.solve(information, pulls.sum(axis=0) - prior @ [0.0, 0.0, *biases])
        inverse = np.linalg.inv(information)
        scatter = _scatter(pulls, clusters[0][kept]) + _scatter(pulls, clusters[1][kept])
        covariance = inverse @ (scatter + prior) @ inverse
        biases += step[2:]
        origin = geodetic_to_ecef(*site) + np.array([*step[:2], 0.0]) @ enu_rotation(*site[:2])
        latitude, longitude, _ = ecef_to_geodetic(origin)
        site = (float(latitude), float(longitude), site[2])
    return SolvedSite(
        site=site,
        sigma_m=float(np.sqrt(np.linalg.eigvalsh(covariance[:2, :2])[-1])),
        plots=int(kept.sum()),
        aircraft=len(np.unique(clusters[0][kept])),
        reference=reference,
    )


def _slopes(range_m: Floats, azimuth_rad: Floats) -> Floats:
    """Return derivatives of range and azimuth by east and north of the site and by the biases."""
    sine, cosine = np.sin(azimuth_rad), np.cos(azimuth_rad)
    one, nothing = np.ones(len(sine)), np.zeros(len(sine))
    ranges = np.stack([-sine, -cosine, one, nothing], axis=1)
    azimuths = np.stack([-cosine / range_m, sine / range_m, nothing, one], axis=1)
    return np.stack([ranges, azimuths], axis=1)


def _scatter(pulls: Floats, clusters: Integers) -> Floats:
    """Return the sum of outer products of the sums over clusters, for a finite number of them."""
    distinct, place = np.unique(clusters, return_inverse=True)
    sums = np.zeros((len(distinct), pulls.shape[1]))
    np.add.at(sums, place, pulls)
    many = len(distinct)
    return np.asarray(sums.T @ sums * many / max(many - _UNKNOWNS, 1))


def _spread(values: Floats, least: float) -> float:
    return max(least, float(NORMAL_SPREAD * np.median(np.abs(values - np.median(values)))))
