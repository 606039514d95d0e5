"""Requirements of the field, as sets of lines that pass, fail or cannot be told."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from types import MappingProxyType

import numpy as np

from multiradar.errors import UnknownPresetError
from multiradar.evaluation.measures.continuity import Heard, Stretches, detection
from multiradar.evaluation.measures.update_errors import UpdateErrors
from multiradar.evaluation.trajectories import Floats

#: With fewer samples nothing is said of a requirement.
SAMPLES_MIN = 100
#: With fewer updates a flight has no figure of its own.
FLIGHT_UPDATES_MIN = 30
#: Errors in a row that make a series.
SERIES_MIN = 3


class Verdict(StrEnum):
    """Whether a requirement is met."""

    PASS = "pass"
    FAIL = "fail"
    NOT_APPLICABLE = "not applicable"


@dataclass(frozen=True, slots=True, eq=False)
class Evidence:
    """What requirements are judged by.

    Attributes
    ----------
    errors : UpdateErrors
        Errors of updates.
    updates : Heard
        Updates of each aircraft.
    where : Stretches
        Times over which aircraft should be tracked.
    interval_s : (n,) float64
        Times between updates.
    """

    errors: UpdateErrors
    updates: Heard
    where: Stretches
    interval_s: Floats


@dataclass(frozen=True, slots=True)
class Found:
    """A figure, how many samples it is of, and how many are needed."""

    value: float
    samples: int
    samples_min: int = SAMPLES_MIN


@dataclass(frozen=True, slots=True)
class Requirement:
    """One line of a preset.

    Attributes
    ----------
    text : str
        What is required.
    limit : float
        The bound, in `unit`.
    unit : str
        m or %.
    at_least : bool
        Whether the bound is the least or the largest value that passes.
    measure : callable
        Gives the figure.
    """

    text: str
    limit: float
    unit: str
    at_least: bool
    measure: Callable[[Evidence], Found]


@dataclass(frozen=True, slots=True)
class Judgement:
    """A requirement with what was found.

    Attributes
    ----------
    preset : str
        Name of the preset.
    requirement : Requirement
        What is required.
    found : Found
        What was found.
    verdict : Verdict
        Not applicable with too few samples.
    """

    preset: str
    requirement: Requirement
    found: Found
    verdict: Verdict


def judge(names: Sequence[str], evidence: Evidence) -> list[Judgement]:
    """Judge presets.

    Parameters
    ----------
    names : sequence of str
        Of `PRESETS`.
    evidence : Evidence
        What was found.

    Returns
    -------
    list of Judgement
        Every requirement of every preset, in order.

    Raises
    ------
    UnknownPresetError
        A name that there is not.
    """
    for name in names:
        if name not in PRESETS:
            raise UnknownPresetError(name, tuple(PRESETS))
    judgements = []
    for name in names:
        for requirement in PRESETS[name]:
            found = requirement.measure(evidence)
            judgements.append(Judgement(name, requirement, found, _verdict(requirement, found)))
    return judgements


def _verdict(requirement: Requirement, found: Found) -> Verdict:
    if found.samples < found.samples_min or not np.isfinite(found.value):
        return Verdict.NOT_APPLICABLE
    if requirement.at_least:
        return Verdict.PASS if found.value >= requirement.limit else Verdict.FAIL
    return Verdict.PASS if found.value <= requirement.limit else Verdict.FAIL


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
        share = 100.0 * float(np.mean(length >= least_s)) if len(length) else np.nan
        return Found(share, len(length))

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
    """Count the updates in series of at least three large errors of one aircraft.

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
    series = f"updates in series of {SERIES_MIN} or more errors above {large_m:g} m"
    return (
        Requirement("RMS position error of the worst flight", rms_m, "m", False, _worst_flight),
        # R5 of both volumes bears with 0.03 % of the reports.
        Requirement(series, 0.03, "%", False, _series(large_m)),
    )


#: EUROCAE ED-142 (2010), wide area multilateration; EUROCONTROL-SPEC-0147 (ESASSP, edition 1.1,
#: 2015), requirements 3N_C and 5N_C.
PRESETS = MappingProxyType(
    {
        "ed142-enroute": (
            Requirement("probability of detection in 8 s", 97.0, "%", True, _detection(8.0)),
            Requirement("RMS position error", 350.0, "m", False, _rms),
            Requirement("gaps of 16.4 s or more among all intervals", 1.0, "%", False, _gaps(16.4)),
        ),
        "ed142-tma": (Requirement("RMS position error", 150.0, "m", False, _rms),),
        "esassp-3nm": _per_flight(330.0, 555.0),
        "esassp-5nm": _per_flight(550.0, 926.0),
    }
)
