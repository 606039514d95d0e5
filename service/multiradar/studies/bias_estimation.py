"""The study of section 1.6 of the report: joint estimation of motion and radar biases."""

from multiradar.estimation.filters.bank import find_filter
from multiradar.studies.bias_estimation_cases import run_cases
from multiradar.studies.bias_estimation_loss import drift_losses
from multiradar.studies.bias_estimation_plots import all_plots
from multiradar.studies.bias_estimation_rows import all_rows
from multiradar.studies.bias_estimation_runs import CI_SCALE_TIME_S, DRIFT_DENSITY
from multiradar.studies.bias_estimation_tables import all_tables
from multiradar.studies.catalogue import BIAS_ESTIMATION
from multiradar.studies.result import Progress, StudyOptions, StudyResult

_SUMMARY = (
    "Fifteen aircraft fly straight for {duration:g} s before three radars whose ranges and "
    "azimuths are biased. Every filter starts 1 km, 300 m/s, 500 m and 0.3° off (one sigma) and "
    "takes the same plots, one a second from each radar of each aircraft; {runs} runs differ in "
    "noise, first guesses and, where the biases drift, in the drift. Without gates, and with the "
    "kernels of the service."
)
_NOTES = (
    "Mean error: the modulus of the deviation, its mean over the runs and over aircraft or radars. "
    "Theoretical and reported: roots of the mean part of the trace, (1.27), of the true covariance "
    "by (1.26) and of the filter's own. A root mean square is a little more than a mean modulus: "
    "1.13 times for two normal components of one sigma, 1.25 times for a single one.",
    "The theory plays each filter along the true tracks of the first run, linearised at the truth, "
    "reads its gain off its response to small innovations, and carries the covariance of all "
    "aircraft and biases by (1.26), whose noise term is K D W Dᵀ Kᵀ. At the truth both forms of "
    "the measurement differ by a change of coordinates alone, so they share one theory: what the "
    "linearised form does worse than that is the price of turning a plot into a place first.",
    "The report's table gives drift rates although (1.7) sets the drift to zero; both are studied. "
    "A bias walks 1 m and 0.02° in a second, and the square root of the time in all. Where the "
    f"biases drift, the aircraft are pushed by a white acceleration of {DRIFT_DENSITY:g} m²/s³, "
    "new in each run, which the filters know: aircraft on exactly straight lines remember all that "
    "the biases ever did, and the two-stage filter, which keeps that as the own error of each "
    "aircraft, then promises too much. The last table says how much.",
    "The band of the normalised errors takes runs as independent and aircraft of one run as "
    "correlated, as the covariance of the joint filter says they are. Errors at one time and the "
    "next are correlated too, so that a mean which leaves the band stays out for a while. The "
    "wider band is the one that a consistent filter keeps to at all times, 95 times in 100.",
    "The trace that CI minimises adds m² and (m/s)², (1.45): here a velocity counts as the way of "
    f"{CI_SCALE_TIME_S:g} s. With 10 s, which suits aircraft that manoeuvre, its velocity is nine "
    "times and its position 1.6 times worse after 1000 s of straight flight.",
    "Plots nearer than 5 km to the radar are not made: near it the azimuth is not linear in the "
    "position. No track of the scene comes as near without being pushed.",
    "The tracks are drawn once, as the report does not print its own, and are those of the "
    "built-in scene report-1-6; the seed changes everything else.",
)


def run(options: StudyOptions, progress: Progress) -> StudyResult:
    """Run the study.

    Parameters
    ----------
    options : StudyOptions
        Runs, seed, filters and duration; what is None is taken from the catalogue.
    progress : Progress
        Told of each run and each theory.

    Returns
    -------
    StudyResult
        Rows for each filter, form of the measurement, drift, time and quantity; tables; plots.

    Raises
    ------
    UnknownFilterError
        If there is no filter of a name.

    References
    ----------
    IMM UrO RAN report (2016), section 1.6, figures 1.1 to 1.17.
    """
    complete = BIAS_ESTIMATION.complete(options)
    filters, runs = complete.filters or (), complete.runs or 1
    duration_s = complete.duration_s or 0.0
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
        notes=list(_NOTES),
        summary=_SUMMARY.format(duration=duration_s, runs=runs),
        options={"runs": runs, "filters": list(filters), "duration_s": duration_s},
    )
