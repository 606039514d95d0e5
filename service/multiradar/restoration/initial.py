"""Construction in the initial window: arcs of constant speed through three plots."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

#: Three plots make an arc when any two of them are so far apart, and the motion along it is not
#: farther from them at their times: section 2.2.1.
TRIPLE_APART_S = 8.0
TRIPLE_APART_M = 800.0
TRIPLE_OFF_M = 800.0
#: Slower and faster nothing flies, m/s.
SPEED_BOUNDS_MPS = (20.0, 700.0)
#: A curvature below it, 1/m, is a straight line: 10 000 km of radius.
CURVATURE_MIN = 1e-7
#: So many plots of the initial window are tried, evenly chosen among them: 6545 triples.
PLOTS_TRIED_MAX = 35


@dataclass(frozen=True, slots=True)
class Arc:
    """Motion with constant speed along a circle.

    Attributes
    ----------
    time_s : float
        When it is at its beginning.
    east_m, north_m, speed_mps, heading_rad : float
        Place, speed and heading there.
    lateral_mps2 : float
        Lateral acceleration, positive to the right.
    deviation_s : float
        Sum over the plots of the window of the time between a plot and the passage at its place.
    """

    time_s: float
    east_m: float
    north_m: float
    speed_mps: float
    heading_rad: float
    lateral_mps2: float
    deviation_s: float


def arcs_through_triples(time_s: Floats, position_m: Floats) -> list[Arc]:
    """Return the arcs through all triples of plots that make one.

    Parameters
    ----------
    time_s : (n,) ndarray
        Times of the plots, ascending, s.
    position_m : (n, 2) ndarray
        East and north, m.

    Returns
    -------
    list of Arc
        By ascending sum of the deviations in time; empty where no triple is wide enough.

    References
    ----------
    IMM UrO RAN report (2016), section 2.2.1.
    """
    found = []
    for rows in _wide_triples(time_s, position_m):
        arc = _arc(time_s[rows], position_m[rows], time_s, position_m)
        if arc is not None:
            found.append(arc)
    return sorted(found, key=lambda arc: arc.deviation_s)


# An aircraft that hovers has thousands of triples of which none is wide enough: they cost little.
def _wide_triples(time_s: Floats, position_m: Floats) -> NDArray[np.intp]:
    if len(time_s) < 3:
        return np.empty((0, 3), np.intp)
    chosen = np.unique(np.linspace(0, len(time_s) - 1, PLOTS_TRIED_MAX).round().astype(np.intp))
    triples = np.array(list(combinations(chosen.tolist(), 3)), np.intp)
    times, places = time_s[triples], position_m[triples]
    sides = np.diff(places[:, [0, 1, 2, 0]], axis=1)
    shortest = np.hypot(sides[..., 0], sides[..., 1]).min(axis=1)
    wide = (np.diff(times, axis=1).min(axis=1) >= TRIPLE_APART_S) & (shortest >= TRIPLE_APART_M)
    return np.asarray(triples[wide])


def _arc(time_s: Floats, places: Floats, all_s: Floats, all_m: Floats) -> Arc | None:
    sides = np.array([places[1] - places[0], places[2] - places[1], places[2] - places[0]])
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    # Right turns have positive curvature: 4 × area over the product of the sides.
    crossed = sides[0, 1] * sides[1, 0] - sides[0, 0] * sides[1, 1]
    curvature = 2.0 * crossed / float(np.prod(lengths))
    heading = _heading_at_first(sides, curvature)
    way = _way_along(places, places[0], heading, curvature)
    if not (way[2] > way[1] > 0.0):
        return None
    slope, offset = np.polyfit(time_s - time_s[0], way, 1)
    if not SPEED_BOUNDS_MPS[0] <= slope <= SPEED_BOUNDS_MPS[1]:
        return None
    # Along the circle the motion is off by what the ways differ by.
    if np.abs(offset + slope * (time_s - time_s[0]) - way).max() > TRIPLE_OFF_M:
        return None
    passed = time_s[0] + (_way_along(all_m, places[0], heading, curvature) - offset) / slope
    return Arc(
        float(time_s[0] - offset / slope), float(places[0, 0]), float(places[0, 1]), float(slope),
        heading, float(curvature * slope**2), float(np.abs(passed - all_s).sum()),
    )  # fmt: skip


# The heading of the circle at its first point: that of the chord, less half the angle it spans.
def _heading_at_first(sides: Floats, curvature: float) -> float:
    chord = float(np.arctan2(sides[0, 0], sides[0, 1]))
    length = float(np.hypot(*sides[0]))
    return chord - float(np.arcsin(np.clip(0.5 * length * curvature, -1.0, 1.0)))


# Way along the circle to the passage nearest to each place, from −half a circle to +half of it.
def _way_along(places: Floats, first: Floats, heading: float, curvature: float) -> Floats:
    off = places - first
    ahead = off[:, 0] * np.sin(heading) + off[:, 1] * np.cos(heading)
    right = off[:, 0] * np.cos(heading) - off[:, 1] * np.sin(heading)
    if abs(curvature) < CURVATURE_MIN:
        return np.asarray(ahead)
    turned: Floats = np.arctan2(ahead * curvature, 1.0 - right * curvature) / curvature
    return turned
