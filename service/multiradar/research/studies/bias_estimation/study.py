"""The study of section 1.6 of the report: joint estimation of motion and radar biases."""

from multiradar.estimation.filters.bank import find_filter
from multiradar.research.studies.bias_estimation.cases import run_cases
from multiradar.research.studies.bias_estimation.loss import drift_losses
from multiradar.research.studies.bias_estimation.notes import all_notes
from multiradar.research.studies.bias_estimation.plots import all_plots
from multiradar.research.studies.bias_estimation.rows import all_rows
from multiradar.research.studies.bias_estimation.tables import all_tables
from multiradar.research.studies.catalogue import BIAS_ESTIMATION
from multiradar.research.studies.result import Progress, StudyOptions, StudyResult

_SUMMARY = (
    "Fifteen aircraft fly straight for {duration:g} s and are observed by three radars with range "
    "and azimuth biases. Every filter starts with errors of 1 km, 300 m/s, 500 m and 0.3° (one "
    "sigma) and processes the same plots: one plot per second from each radar for each aircraft. "
    "The {runs} runs differ in noise, in initial errors and, if the biases drift, in the drift. "
    "Gating is disabled; the filters use the same compiled kernels as the service."
)


def run(options: StudyOptions, progress: Progress) -> StudyResult:
    """Run the study.

    Parameters
    ----------
    options : StudyOptions
        Runs, seed, filters and duration; None stands for the default of the catalogue.
    progress : Progress
        Called after each run and each theory.

    Returns
    -------
    StudyResult
        Rows for each filter, form of the measurement, drift, time and quantity; tables; plots.

    Raises
    ------
    UnknownFilterError
        If a name is not that of a filter.

    References
    ----------
    IMM UrO RAN report (2016), section 1.6, figures 1.1 to 1.17.
    """
    complete = BIAS_ESTIMATION.complete(options)
    filters, runs, duration_s = complete.filters, complete.runs, complete.duration_s
    assert filters is not None
    assert runs is not None
    assert duration_s is not None
    for name in filters:
        find_filter(name)
    findings = run_cases(filters, runs, options.seed, duration_s, progress)
    both = {"joint", "two-stage"} <= set(filters)
    end_s = float(findings.settings[True].times_s[-1])
    losses = drift_losses(findings.first[True], end_s) if both and end_s > 0.0 else []
    return StudyResult(
        study=BIAS_ESTIMATION.name,
        title=BIAS_ESTIMATION.title,
        seed=options.seed,
        rows=all_rows(findings),
        tables=all_tables(findings, losses, runs),
        plots=all_plots(findings),
        notes=all_notes(filters, losses),
        summary=_SUMMARY.format(duration=duration_s, runs=runs),
        options={"runs": runs, "filters": list(filters), "duration_s": duration_s},
    )
