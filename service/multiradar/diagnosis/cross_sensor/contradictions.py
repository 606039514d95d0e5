"""Two radars that contradict each other, where no third sensor decides which one is wrong."""

from collections.abc import Collection, Iterator, Sequence
from itertools import combinations

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import (
    best_site,
    polar_agreement,
    seen_from,
    wrapped,
)
from multiradar.diagnosis.cross_sensor.comparison import AGREES_MIN, TESTED_MIN, Comparison
from multiradar.diagnosis.cross_sensor.explanations import BY_RECORDING, GAIN_MIN, common_share
from multiradar.diagnosis.cross_sensor.hypotheses import Reading, as_given, scaled, turned
from multiradar.diagnosis.cross_sensor.radar_groups import ONE_SITE_M
from multiradar.diagnosis.cross_sensor.references import Pairs
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.plots import Site
from multiradar.geodesy.wgs84 import geodetic_to_ecef

#: Errors of one of two sensors that equal the opposite error of the other one.
_MAY_BE_EITHER = (
    "site",
    "clock",
    "azimuth_offset",
    "azimuth_jump",
    "site_height",
    "height_unit",
    "ground_ranges",
    "height_offset",
)
#: Common errors of both radars: the smallest angle, degrees, and the tolerances of an angle and of
#: a factor that are none: a site is found to within some 100 m, of a baseline of 20 km and more.
_TURN_MIN_DEG, _TURN_WITHIN_DEG, _FACTOR_WITHIN = 1.5, 1.0, 0.02


def merge_contradiction(
    comparison: Comparison, found: list[Diagnosis], names: tuple[str, ...], compared: int
) -> list[Diagnosis]:
    """Return one diagnosis in place of one of each of two sensors.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    found : list of Diagnosis
        By comparison of sensors.
    names : tuple of str
        Names of the sensors.
    compared : int
        The number of sensors that are compared.
    """
    if compared != 2 or len(found) != 2 or found[0].code != found[1].code:
        return found
    first, second = found
    if first.code not in _MAY_BE_EITHER or BY_RECORDING in first.sentence + second.sentence:
        return found
    sentence = (
        f"{first.sensor_id} and {second.sensor_id} disagree, and there is no third sensor to "
        f"decide which is wrong: {first.sentence}; or {second.sentence}"
    )
    if first.code == "site":
        radars = names.index(first.sensor_id), names.index(second.sensor_id)
        sentence += "".join(
            f"; or both have the same error: {one.mistake.removeprefix('its ')}; "
            f"{one.remedy.replace(' its ', ' their ')}"
            for one in _common(comparison, radars)
        )
    return [Diagnosis(first.sensor_id, first.code, sentence)]


# Azimuths of two radars that are off by one angle turn all positions of each about its site, and
# ranges in another unit scale them: as seen from the one, the site of the other turns and moves.
def _common(comparison: Comparison, radars: tuple[int, int]) -> Iterator[Reading]:
    first, second = radars
    plots, site = comparison.tested(first), comparison.site(first)
    measured = as_given(plots.range_m, plots.azimuth_deg)
    found = best_site(plots, measured, site, comparison.pairs(first, [second]))
    other = comparison.site(second)
    (configured_m, configured_rad), (solved_m, solved_rad) = _line(other, site), _line(other, found)
    if configured_m < ONE_SITE_M:
        return
    factor = solved_m / configured_m
    turn_deg = float(np.degrees(wrapped(np.array(solved_rad - configured_rad))))
    reading = None
    if abs(factor - 1.0) <= _FACTOR_WITHIN and abs(turn_deg) >= _TURN_MIN_DEG:
        reading = turned(round(turn_deg, 1))
    elif abs(turn_deg) <= _TURN_WITHIN_DEG and abs(factor - 1.0) > _FACTOR_WITHIN:
        reading = scaled(1.0 / factor)
    if reading and all(
        common_share(comparison, one, radars, reading) >= AGREES_MIN for one in radars
    ):
        yield reading


# The horizontal distance and direction of a site from another one.
def _line(origin: Site, site: Site) -> tuple[float, float]:
    distance_m, azimuth = seen_from(origin, geodetic_to_ecef(*site)[None])
    return float(distance_m[0]), float(azimuth[0])


def exchanged_sites(
    comparison: Comparison, suspects: Sequence[int], names: tuple[str, ...]
) -> list[Diagnosis]:
    """Return two radars that agree, with each other and with the rest, at the site of the other.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    suspects : sequence of int
        Sensors of which none agrees with another.
    names : tuple of str
        Names of the sensors.
    """
    radars = [one for one in suspects if comparison.is_radar(one)]
    for two in combinations(radars, 2):
        if comparison.apart_m(*two) < ONE_SITE_M:
            continue
        shares = [_share_exchanged(comparison, one, two, suspects) for one in two]
        if min(after - before for after, before in shares) < GAIN_MIN:
            continue
        if min(after for after, _ in shares) < AGREES_MIN:
            continue
        # At exchanged sites, two radars agree also where both are turned by 180°.
        alone = "" if len(suspects) > 2 else " (or the azimuths of both radars are off by 180°)"
        return [
            Diagnosis(
                names[one],
                "site",
                f"{names[one]}: its site is probably the site of {names[other]}, and the other way "
                f"round{alone}: with the two sites exchanged, {after:.0%} of its plots lie where "
                f"other sensors detect aircraft ({before:.0%} as recorded); correct latitude_deg, "
                "longitude_deg and height_m of both sensors in the sensors file",
            )
            for one, other, (after, before) in zip(two, two[::-1], shares, strict=True)
        ]
    return []


def _share_exchanged(
    comparison: Comparison, number: int, two: tuple[int, int], suspects: Collection[int]
) -> tuple[float, float]:
    (other,) = set(two) - {number}
    sites = {other: comparison.site(number)}
    after = _against_rest(comparison.pairs(number, suspects, sites=sites), other)
    before = _against_rest(comparison.pairs(number, suspects), other)
    plots = comparison.tested(number)
    measured = as_given(plots.range_m, plots.azimuth_deg)
    shares = []
    for pairs, site in ((after, comparison.site(other)), (before, comparison.site(number))):
        compared = len(np.unique(pairs.plot))
        if compared < TESTED_MIN:
            return 0.0, 0.0
        shares.append(polar_agreement(measured, site, pairs, compared=compared).share)
    return shares[0], shares[1]


# Sensors other than the two decide, where there are any.
def _against_rest(pairs: Pairs, other: int) -> Pairs:
    rest = pairs.select(pairs.source != other)
    return rest if len(np.unique(rest.plot)) >= TESTED_MIN else pairs
