"""Initial window: arcs of constant speed through three plots."""

from dataclasses import dataclass
from math import comb

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.bundle._triple_kernels import ARC_COUNT, triples

Floats = NDArray[np.float64]

#: Three plots form an arc if any two are this far apart, and the motion along it is within
#: `TRIPLE_OFF_M` of them at their times: section 2.2.1.
TRIPLE_APART_S = 8.0
TRIPLE_APART_M = 800.0
TRIPLE_OFF_M = 800.0
#: Limits of the speed, m/s.
SPEED_BOUNDS_MPS = (20.0, 700.0)
#: Curvature below which an arc is a straight line, 1/m: a radius of 10 000 km.
CURVATURE_MIN = 1e-7
#: Maximum number of plots of the initial window, evenly selected: 6545 triples.
PLOTS_TRIED_MAX = 35
_LIMITS = np.array([TRIPLE_APART_S, TRIPLE_APART_M, TRIPLE_OFF_M, *SPEED_BOUNDS_MPS, CURVATURE_MIN])


@dataclass(frozen=True, slots=True)
class Arc:
    """Motion with constant speed along a circle.

    Attributes
    ----------
    time_s : float
        Time at its start.
    east_m, north_m, speed_mps, heading_rad : float
        Position, speed and heading at its start.
    lateral_mps2 : float
        Lateral acceleration, positive to the right.
    deviation_s : float
        Sum over the plots of the window of |time of the plot − time of the arc at its position|.
    """

    time_s: float
    east_m: float
    north_m: float
    speed_mps: float
    heading_rad: float
    lateral_mps2: float
    deviation_s: float


def arcs_through_triples(time_s: Floats, position_m: Floats) -> list[Arc]:
    """Return the arcs through all triples of plots that form one.

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
    return [Arc(*arc.tolist()) for arc in arc_rows(time_s, position_m, PLOTS_TRIED_MAX)]


def arc_rows(time_s: Floats, position_m: Floats, tried_max: int) -> Floats:
    """Return the arcs through all triples of some plots.

    Parameters
    ----------
    time_s : (n,) ndarray
        Times of the plots, ascending, s.
    position_m : (n, 2) ndarray
        East and north, m.
    tried_max : int
        Maximum number of plots, evenly selected.

    Returns
    -------
    (k, 7) ndarray
        By ascending sum of the deviations in time; columns in the order of `Arc`.

    References
    ----------
    IMM UrO RAN report (2016), section 2.2.1.
    """
    if len(time_s) < 3:
        return np.empty((0, ARC_COUNT))
    chosen = np.unique(np.linspace(0, len(time_s) - 1, tried_max).round().astype(np.int64))
    arcs = np.empty((comb(len(chosen), 3), ARC_COUNT))
    count = triples(
        np.ascontiguousarray(time_s), np.ascontiguousarray(position_m), chosen, _LIMITS, arcs
    )
    return np.asarray(arcs[np.argsort(arcs[:count, -1], kind="stable")])
