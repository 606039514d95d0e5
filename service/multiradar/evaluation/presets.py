"""Published requirements, as sets of lines that pass, fail or are not applicable."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

import numpy as np

from multiradar.errors import UnknownPresetError
from multiradar.evaluation.measures.continuity import AircraftUpdates, TrackedPeriods, detection
from multiradar.evaluation.measures.update_errors import UpdateErrors
from multiradar.evaluation.trajectories import Floats

#: With fewer samples a requirement is not applicable.
SAMPLES_MIN = 100
#: With fewer updates a flight is not evaluated on its own.
FLIGHT_UPDATES_MIN = 30
#: Consecutive errors that make a series.
SERIES_MIN = 3


class PresetOutcome(StrEnum):
    """Whether a requirement is met."""

    PASS = "pass"
    FAIL = "fail"
    NOT_APPLICABLE = "not applicable"


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """Data by which requirements are evaluated.

    Attributes
    ----------
    errors : UpdateErrors
        Errors of updates.
    updates : AircraftUpdates
        Updates of each aircraft.
    where : TrackedPeriods
        Periods in which aircraft should be tracked.
    interval_s : (n,) float64
        Intervals between updates.
    """

    errors: UpdateErrors
    updates: AircraftUpdates
    where: TrackedPeriods
    interval_s: Floats


@dataclass(frozen=True, slots=True)
class Found:
    """A figure, its number of samples, and the number needed."""

    value: float
    samples: int
    samples_min: int = SAMPLES_MIN


@dataclass(frozen=True, slots=True)
class Requirement:
    """One line of a preset.

    Attributes
    ----------
    text : str
        Requirement in words.
    limit : float
        The bound, in `unit`.
    unit : str
        m or %.
    at_least : bool
        Whether the bound is the smallest or the largest value that passes.
    measure : callable
        Returns the figure.
    """

    text: str
    limit: float
    unit: str
    at_least: bool
    measure: Callable[[Evidence], Found]


@dataclass(frozen=True, slots=True)
class PresetResult:
    """Result of one requirement.

    Attributes
    ----------
    preset : str
        Name of the preset.
    requirement : Requirement
        The requirement.
    found : Found
        The value found.
    outcome : PresetOutcome
        Not applicable with too few samples.
    """

    preset: str
    requirement: Requirement
    found: Found
    outcome: PresetOutcome


def evaluate_presets(names: Sequence[str], evidence: Evidence) -> list[PresetResult]:
    """Evaluate presets.

    Parameters
    ----------
    names : sequence of str
        Of `PRESETS`.
    evidence : Evidence
        Data of the evaluation.

    Returns
    -------
    list of PresetResult
        Every requirement of every preset, in order.

    Raises
    ------
    UnknownPresetError
        Unknown name.
    """
    for name in names:
        if name not in PRESETS:
            raise UnknownPresetError(name, tuple(PRESETS))
    results = []
    for name in names:
        for requirement in PRESETS[name]:
            found = requirement.measure(evidence)
            results.append(PresetResult(name, requirement, found, _outcome(requirement, found)))
    return results


def _outcome(requirement: Requirement, found: Found) -> PresetOutcome:
    if found.samples < found.samples_min or not np.isfinite(found.value):
        return PresetOutcome.NOT_APPLICABLE
    if requirement.at_least:
        return PresetOutcome.PASS if found.value >= requirement.limit else PresetOutcome.FAIL
    return PresetOutcome.PASS if found.value <= requirement.limit else PresetOutcome.FAIL


def _detection(interval_s: float) -> Callable[[Evidence], Found]:
    def measure(evidence: Evidence) -> Found:
        hit, total = detection(evidence.updates, evidence.where, interval_s)
        return Found(100.0 * hit / total if total else np.nan, total)

    return measure


def _rms(evidence: Evidence) -> Found:
    error = evidence.errors.position_m
    return Found(float(np.sqrt(np.mean(error**2))) if len(error) else np.nan, len(error))


def _gaps(least_s: float) -> Callable[[Evidence], Found]:
    def measure(evidence: Evidence) -> Found:
        length = evidence.interval_s
        fraction = 100.0 * float(np.mean(length >= least_s)) if len(length) else np.nan
        return Found(fraction, len(length))

    return measure


def _worst_flight(evidence: Evidence) -> Found:
    errors = evidence.errors
    count = np.bincount(errors.aircraft)
    flights = np.flatnonzero(count >= FLIGHT_UPDATES_MIN)
    if not len(flights):
        return Found(np.nan, 0, 1)
    squares = np.bincount(errors.aircraft, errors.position_m**2)[flights]
    return Found(float(np.sqrt(np.max(squares / count[flights]))), len(flights), 1)


def _series(above_m: float) -> Callable[[Evidence], Found]:
    def measure(evidence: Evidence) -> Found:
        errors = evidence.errors
        if not len(errors.time_s):
            return Found(np.nan, 0)
        involved = in_series(errors, above_m)
        return Found(100.0 * involved / len(errors.time_s), len(errors.time_s))

    return measure


def in_series(errors: UpdateErrors, above_m: float) -> int:
    """Count the updates in series of at least three consecutive large errors of one aircraft.

    Parameters
    ----------
    errors : UpdateErrors
        Errors of updates.
    above_m : float
        An error is large above this, m.

    Returns
    -------
    int
        Updates in such series, whatever the direction of their errors.
    """
    order = np.lexsort((errors.time_s, errors.aircraft))
    aircraft, large = errors.aircraft[order], errors.position_m[order] > above_m
    run = np.cumsum(np.append(0, (np.diff(large) != 0) | (np.diff(aircraft) != 0)))
    lengths = np.bincount(run)
    return int(np.sum(large & (lengths[run] >= SERIES_MIN)))


def _per_flight(rms_m: float, large_m: float) -> tuple[Requirement, ...]:
    series = f"updates in series of {SERIES_MIN} or more successive errors above {large_m:g} m"
    return (
        Requirement("RMS position error of the worst flight", rms_m, "m", False, _worst_flight),
        # R5 of both volumes allows 0.03 % of the reports.
        Requirement(series, 0.03, "%", False, _series(large_m)),
    )


#: EUROCAE ED-142 (2010), wide area multilateration; EUROCONTROL-SPEC-0147 (ESASSP, edition 1.1,
#: 2015), requirements 3N_C and 5N_C.
PRESETS = MappingProxyType(
    {
        "ed142-enroute": (
            Requirement("probability of detection within 8 s", 97.0, "%", True, _detection(8.0)),
            Requirement("RMS position error", 350.0, "m", False, _rms),
            Requirement(
                "gaps of 16.4 s or more, as a fraction of all intervals",
                1.0,
                "%",
                False,
                _gaps(16.4),
            ),
        ),
        "ed142-tma": (Requirement("RMS position error", 150.0, "m", False, _rms),),
        "esassp-3nm": _per_flight(330.0, 555.0),
        "esassp-5nm": _per_flight(550.0, 926.0),
    }
)
