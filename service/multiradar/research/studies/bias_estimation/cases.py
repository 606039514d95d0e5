"""Runs every filter on every run of the study, in parallel, and combines the runs."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.research.sequential.plots import FORMS, Form
from multiradar.research.sequential.theory import Theory
from multiradar.research.studies.bias_estimation.bands import Bands, consistency_bands
from multiradar.research.studies.bias_estimation.runs import (
    Errors,
    Realisation,
    Setting,
    evaluate_run,
    expected_nees,
    make_setting,
    realise,
    theory_of,
    traces,
)
from multiradar.research.studies.parallel import finish, workers
from multiradar.research.studies.result import Progress

Floats = NDArray[np.float64]

#: The filter that reports its true covariance, for the bands.
REFERENCE = "joint"


@dataclass(frozen=True, slots=True)
class Case:
    """A filter with one form of the measurement, with or without drift.

    Attributes
    ----------
    name, form, drift : str, {"polar", "linearised"}, bool
        Filter, form of the measurement, and whether biases drift.
    times_s : (t,) float64
        Times.
    one, mean, theoretical, reported : (t, 4) float64
        Error in the first run, mean over the runs, by (1.26), reported by the filter; the last two
        are square roots of the mean part of the trace, (1.27).
    nees, expected_nees : (t, 2) float64
        NEES per dimension: mean over the runs, and by (1.26).
    """

    name: str
    form: Form
    drift: bool
    times_s: Floats
    one: Floats
    mean: Floats
    theoretical: Floats
    reported: Floats
    nees: Floats
    expected_nees: Floats


@dataclass(frozen=True, slots=True)
class Findings:
    """Results of the study.

    Attributes
    ----------
    cases : tuple of Case
        By drift, form and filter.
    bands : dict of bool to Bands
        With drift and without.
    settings, first : dict of bool to Setting, dict of bool to Realisation
        The scenarios, and the first run of each.
    """

    cases: tuple[Case, ...]
    bands: dict[bool, Bands]
    settings: dict[bool, Setting]
    first: dict[bool, Realisation]


def run_cases(
    filters: Sequence[str], runs: int, seed: int, duration_s: float, progress: Progress
) -> Findings:
    """Run all filters in both forms, with drift and without.

    Parameters
    ----------
    filters : sequence of str
        Names of the filters.
    runs, seed : int
        Number of runs, and seed.
    duration_s : float
        Duration of the scenario, s.
    progress : Progress
        Called after each run and each theory.

    Returns
    -------
    Findings
        Reproducible for the same arguments, for any number of processors.
    """
    settings = {drift: make_setting(duration_s, drift=drift) for drift in (False, True)}
    first = {drift: realise(setting, seed, 0) for drift, setting in settings.items()}
    theories = tuple(dict.fromkeys([REFERENCE, *filters]))
    with workers() as executor:
        expected = {
            (drift, name): executor.submit(theory_of, name, settings[drift], first[drift])
            for drift in settings
            for name in theories
        }
        found = {
            (drift, run): executor.submit(_evaluate_all, filters, settings[drift], seed, run)
            for run in range(runs)
            for drift in settings
        }
        finish([*expected.values(), *found.values()], progress)
        bands = {
            drift: consistency_bands(expected[drift, REFERENCE].result(), runs, seed)
            for drift in settings
        }
    cases = []
    for drift, setting in settings.items():
        for form in FORMS:
            for name in filters:
                errors = [found[drift, run].result()[form, name] for run in range(runs)]
                theory = expected[drift, name].result()
                cases.append(_case(name, form, setting, errors, theory))
    return Findings(tuple(cases), bands, settings, first)


def _evaluate_all(
    filters: Sequence[str], setting: Setting, seed: int, run: int
) -> dict[tuple[Form, str], Errors]:
    one = realise(setting, seed, run)
    return {
        (form, name): evaluate_run(name, form, setting, one) for form in FORMS for name in filters
    }


def _case(
    name: str, form: Form, setting: Setting, errors: Sequence[Errors], theory: Theory
) -> Case:
    return Case(
        name=name,
        form=form,
        drift=setting.drift,
        times_s=setting.times_s,
        one=errors[0].error,
        mean=np.mean([one.error for one in errors], axis=0),
        theoretical=np.sqrt(traces(theory.aircraft, theory.biases)),
        reported=np.sqrt(np.mean([one.reported for one in errors], axis=0)),
        nees=np.mean([one.nees for one in errors], axis=0),
        expected_nees=expected_nees(theory),
    )
