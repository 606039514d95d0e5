"""Radars in groups that share aircraft, so that a joint fit has a bounded number of unknowns.

The cost of a joint fit grows with the third power of the radars in it, and its pairs are bounded:
of hundreds of radars each would have too few. An error of a radar shows in the pairs with its
neighbours and with ADS-B, so a group of neighbours determines it as well as all radars would.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from multiradar.diagnosis.cross_sensor.agreement import Agreement
from multiradar.diagnosis.cross_sensor.comparison import Comparison
from multiradar.diagnosis.cross_sensor.references import Pairs
from multiradar.geodesy.wgs84 import geodetic_to_ecef

#: Radars in one fit, at most.
GROUP_MAX = 16
#: Radars closer together than this share a site, m.
ONE_SITE_M = 100.0

Compared = Mapping[int, tuple[Agreement, Pairs]]


def grouped(comparison: Comparison, compared: Compared) -> list[Compared]:
    """Divide radars into groups of at most `GROUP_MAX` that have the most pairs with each other.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    compared : mapping of (Agreement, Pairs)
        Radars, and the positions of their aircraft by other sensors.

    Returns
    -------
    list of mapping
        The same, for each group: without the positions by radars of other groups. A number of
        radars that fits into one group is not divided.
    """
    if len(compared) <= GROUP_MAX:
        return [compared]
    shared = _shared(compared)
    remaining = sorted(compared)
    groups = []
    while remaining:
        group = [remaining.pop(0)]
        weight = shared[group[0]]
        while remaining and len(group) < GROUP_MAX:
            nearest = max(remaining, key=lambda one: (weight[one], -one))
            if not weight[nearest]:
                break
            remaining.remove(nearest)
            group.append(nearest)
            weight = weight + shared[nearest]
        groups.append(_within(comparison, compared, sorted(group)))
    return groups


# Pairs between each two radars, by their rows in the table of sensors.
def _shared(compared: Compared) -> np.ndarray[tuple[int, int], np.dtype[np.int64]]:
    sources = [int(pairs.source.max(initial=0)) for _, pairs in compared.values()]
    count = max(*compared, *sources) + 1
    shared = np.zeros((count, count), np.int64)
    for number, (_, pairs) in compared.items():
        shared[number] += np.bincount(pairs.source[pairs.source >= 0], minlength=count)
    return shared + shared.T


def _within(comparison: Comparison, compared: Compared, group: list[int]) -> Compared:
    found = {}
    for number in group:
        agreement, pairs = compared[number]
        radars = [
            one for one in np.unique(pairs.source).tolist() if one >= 0 and comparison.is_radar(one)
        ]
        others = [one for one in radars if one not in group]
        found[number] = agreement, pairs.select(~np.isin(pairs.source, others))
    return found


def sites_of(comparison: Comparison, radars: Sequence[int]) -> list[tuple[int, ...]]:
    """Return every radar alone, and the radars that share a site.

    Parameters
    ----------
    comparison : Comparison
        The plots.
    radars : sequence of int
        Rows of the table of sensors.
    """
    where = {one: geodetic_to_ecef(*comparison.site(one)) for one in radars}
    found: dict[tuple[int, ...], None] = {(one,): None for one in radars}
    for here in where.values():
        near = [one for one in radars if np.linalg.norm(where[one] - here) <= ONE_SITE_M]
        found[tuple(near)] = None
    return list(found)
