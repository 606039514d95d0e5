"""The measures of the single integrated air picture (SIAP)."""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.instants import Instants
from multiradar.evaluation.measures.identity import Identity

_HOUR_S = 3600.0


@dataclass(frozen=True, slots=True)
class Siap:
    """Measures of the air picture as a whole; None where there is nothing to measure.

    Attributes
    ----------
    completeness : float
        Fraction of the aircraft with a track; 1 is best.
    ambiguity : float
        Tracks for each aircraft that has one; 1 is best.
    spuriousness : float
        Fraction of the tracks that are spurious; 0 is best.
    positional_accuracy_m, velocity_accuracy_mps : float
        Mean distance and mean velocity error of the assigned tracks.
    number_changes_per_h : float
        Track number changes per hour of tracked time.
    longest_segment : float
        Longest time with one track over the time of the aircraft, for all aircraft; 1 is best.
    """

    completeness: float | None
    ambiguity: float | None
    spuriousness: float | None
    positional_accuracy_m: float | None
    velocity_accuracy_mps: float | None
    number_changes_per_h: float | None
    longest_segment: float | None


def siap(instants: Instants, identity: Identity) -> Siap:
    """Return the SIAP measures over all instants.

    Parameters
    ----------
    instants : Instants
        Assignment at each instant.
    identity : Identity
        Assignment over time.

    Returns
    -------
    Siap
        Sums over all instants: completeness Σ JT / Σ J, ambiguity Σ NA / Σ JT, spuriousness
        Σ (N − NA) / Σ N, with J aircraft, JT of them tracked, N tracks, NA of them at an aircraft.

    References
    ----------
    P. Votruba, R. Nisley, R. Rothrock, B. Zombro, "Single Integrated Air Picture (SIAP) Metrics
    Implementation", SIAP System Engineering Task Force, technical report 2001-001.
    """
    matched = np.flatnonzero(instants.track_of >= 0)
    track_row = instants.track_of[matched]
    off = np.hypot(*(instants.track_m[track_row] - instants.aircraft_m[matched]).T)
    slip = np.hypot(*(instants.track_mps[track_row] - instants.aircraft_mps[matched]).T)
    aircraft, tracked, tracks = len(instants.aircraft), len(matched), int(instants.evaluated.sum())
    at_aircraft = tracked + int(instants.redundant.sum())
    known = slip[np.isfinite(slip)]
    hours = tracked * instants.step_s / _HOUR_S
    return Siap(
        completeness=_quotient(tracked, aircraft),
        ambiguity=_quotient(at_aircraft, tracked),
        spuriousness=_quotient(tracks - at_aircraft, tracks),
        positional_accuracy_m=_quotient(float(off.sum()), tracked),
        velocity_accuracy_mps=_quotient(float(known.sum()), len(known)),
        number_changes_per_h=_quotient(identity.number_changes, hours),
        longest_segment=_quotient(float(identity.longest_s.sum()), aircraft * instants.step_s),
    )


def _quotient(part: float, whole: float) -> float | None:
    return part / whole if whole else None
