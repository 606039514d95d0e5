"""OSPA and GOSPA: distance between the set of tracks and the set of aircraft at every instant."""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.instants import Instants
from multiradar.evaluation.matching import best_pairs, near_pairs
from multiradar.evaluation.trajectories import Flags, Floats


@dataclass(frozen=True, slots=True, eq=False)
class SetDistances:
    """Distances between the set of aircraft and the set of tracks, by instant.

    Attributes
    ----------
    ospa_m : (t,) float64
        OSPA; 0 where there are neither aircraft nor tracks.
    gospa_m : (t,) float64
        GOSPA with α = 2.
    localisation, missed, false_ : (t,) float64
        Parts of the p-th power of GOSPA; they add up to it, mᵖ.
    present : (t,) bool
        Whether there is an aircraft or a track.
    """

    ospa_m: Floats
    gospa_m: Floats
    localisation: Floats
    missed: Floats
    false_: Floats
    present: Flags


def set_distances(instants: Instants, cutoff_m: float, order: float) -> SetDistances:
    """Return OSPA and GOSPA at every instant.

    Parameters
    ----------
    instants : Instants
        Tracks that the reference cannot classify are left out.
    cutoff_m : float
        Cut-off distance c, m.
    order : float
        p, at least 1: a larger p gives large errors more weight.

    Returns
    -------
    SetDistances
        With n the larger and m the smaller number, M the matched pairs of the optimal assignment:
        OSPA = ((Σ dᵖ + cᵖ (n − |M|)) / n)^(1/p), GOSPA = (Σ dᵖ + cᵖ/2 (missed + false))^(1/p).

    References
    ----------
    D. Schuhmacher, B.-T. Vo, B.-N. Vo, "A consistent metric for performance evaluation of
    multi-object filters", IEEE Transactions on Signal Processing 56 (2008) 3447-3457, equation (3).
    A. S. Rahmathullah, A. F. García-Fernández, L. Svensson, "Generalized optimal sub-pattern
    assignment metric", Fusion 2017, proposition 1.
    """
    count = len(instants.time_s)
    evaluated = np.flatnonzero(instants.evaluated)
    track_instant = instants.track_instant[evaluated]
    first, second, distance = near_pairs(
        instants.aircraft_m, instants.aircraft_instant, instants.track_m[evaluated], track_instant,
        cutoff_m,
    )  # fmt: skip
    best = best_pairs(first, second, distance, cutoff_m, order)
    when = instants.aircraft_instant[first[best]]
    localisation: Floats = np.bincount(when, distance[best] ** order, count).astype(np.float64)
    matched = np.bincount(when, minlength=count)
    aircraft = np.bincount(instants.aircraft_instant, minlength=count)
    tracks = np.bincount(track_instant, minlength=count)
    penalty = cutoff_m**order
    most = np.maximum(aircraft, tracks)
    missed, wrong = (0.5 * penalty * (number - matched) for number in (aircraft, tracks))
    ospa = (localisation + penalty * (most - matched)) / np.maximum(most, 1)
    return SetDistances(
        ospa_m=ospa ** (1.0 / order),
        gospa_m=(localisation + missed + wrong) ** (1.0 / order),
        localisation=localisation,
        missed=missed,
        false_=wrong,
        present=most > 0,
    )
