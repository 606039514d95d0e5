"""Figures 2.2 to 2.4 of the report: a bundle of trajectories before and after each of its steps."""

import numpy as np

from multiradar.report.content import Table, Value
from multiradar.studies.catalogue import TRAJECTORY_BUNDLE
from multiradar.studies.result import Progress, StudyOptions, StudyResult, step_counter
from multiradar.studies.trajectory_bundle_plots import plots
from multiradar.studies.trajectory_bundle_runs import LOOKED_AT_S, Run, apart_from_truth, one_run

SUMMARY = (
    "An aircraft flies an S: straight on, a turn to the left, one to the right, straight on. Two "
    "radars see it. What do the steps of the report's algorithm make of their plots (arcs through "
    "triples in the initial window, an arc to every new plot, groups of which the best stay, the "
    "search of Hooke and Jeeves), and what does the bundle of the service?"
)


def run(options: StudyOptions, progress: Progress) -> StudyResult:
    """Fly the S many times, and take all steps over its plots.

    Parameters
    ----------
    options : StudyOptions
        `runs` realisations of the noise, and the seed.
    progress : callable
        Told how many of them are done.

    Returns
    -------
    StudyResult
        Rows as in docs/studies.md; the plots are of the first realisation.

    References
    ----------
    IMM UrO RAN report (2016), section 2.7.1: figures 2.2, 2.3 and 2.4.
    """
    runs = TRAJECTORY_BUNDLE.complete(options).runs
    assert runs is not None
    step = step_counter(progress, runs)
    found = []
    for number in range(runs):
        found.append(one_run(np.random.Generator(np.random.PCG64([options.seed, number]))))
        step()
    rows = [_row(found, place) for place in range(len(found[0].pictures))]
    return StudyResult(
        study=TRAJECTORY_BUNDLE.name,
        title=TRAJECTORY_BUNDLE.title,
        seed=options.seed,
        rows=rows,
        tables=[_table(rows)],
        plots=plots(found[0]),
        notes=_notes(rows),
        summary=SUMMARY,
        options={"runs": runs},
    )


# Means over the runs of what is to be seen of a step.
def _row(found: list[Run], place: int) -> dict[str, Value]:
    tracks, best, weighted, plot, end, misfit, evaluations = np.mean(
        [_seen(run, place) for run in found], axis=0
    ).tolist()
    picture = found[0].pictures[place]
    return {
        "step": picture.name,
        "tracks": tracks,
        "best_apart_m": best,
        "weighted_apart_m": weighted,
        "end_from_plot_sigma": plot,
        "end_from_truth_m": end,
        "misfit": misfit if picture.misfit else None,
        "evaluations": evaluations or None,
    }


def _seen(run: Run, place: int) -> list[float]:
    picture = run.pictures[place]
    apart = apart_from_truth(run, picture)
    mean = np.einsum("k,ktc->tc", picture.weights, picture.places_m)
    off = mean - run.path.place(picture.time_s)
    # The last plot is the newest that the step knows.
    last = int(np.searchsorted(run.plots.time_s, picture.time_s[-1] + 1.0)) - 1
    plot, noise = run.plots.position_m[last], run.plots.covariance_m2[last]
    away = picture.ends_m - plot
    sigmas = np.sqrt(np.einsum("ki,ij,kj->k", away, np.linalg.inv(noise), away))
    truth = run.path.place(run.plots.time_s[last : last + 1])[0]
    far = np.hypot(*(picture.ends_m - truth).T)
    return [
        len(apart), apart[0], float(np.mean(np.hypot(off[:, 0], off[:, 1]))),
        float(np.median(sigmas)), far[0], picture.misfit, picture.evaluations,
    ]  # fmt: skip


def _table(rows: list[dict[str, Value]]) -> Table:
    names = (
        ("step", "step"),
        ("tracks", "tracks"),
        ("best_apart_m", "best, m"),
        ("weighted_apart_m", "weighted, m"),
        ("end_from_plot_sigma", "end from plot, sigmas"),
        ("end_from_truth_m", "end of the best, m"),
        ("misfit", "misfit"),
        ("evaluations", "evaluations"),
    )
    return Table(
        title="The bundle after each step",
        header=tuple(title for _, title in names),
        rows=tuple(tuple(row[name] for name, _ in names) for row in rows),
        caption="Means over the runs. Best, weighted: mean distance from the true path over the "
        "window, of the best track and of the mean of all by their weights. End from plot: half of "
        "the tracks end closer to the last plot, in its sigmas; the truth does so at 1.2. End of "
        "the best: from the truth. Misfit: −ln of the likelihood of the plots with the best track.",
    )


def _notes(rows: list[dict[str, Value]]) -> list[str]:
    named = {str(row["step"]): row for row in rows}
    searched = named["search of Hooke and Jeeves, as printed"]
    settled = named["least squares on the same"]
    ours = rows[-1]
    return [
        f"Figure 2.3 is the bundle {LOOKED_AT_S:g} s after the first plot, right after branching; "
        "figure 2.4 is the same bundle after the search. An arc leaves its track 10 s or longer "
        "before the plot, so that no segment is shorter than the search allows.",
        "The defect that the report describes is there: after the search half of the tracks end "
        f"within {_text(searched, 'end_from_plot_sigma')} sigmas of the last plot, where chance "
        "would have 1.2. It is the functional's, not the search's: least squares have it too. What "
        "the report considers: a longer last segment does not cure it; a lighter last plot takes "
        "the ends away from the plot, and no closer to the truth. With priors of accelerations and "
        f"of switches it is {_text(ours, 'end_from_plot_sigma')}, and the best track is "
        f"{_text(ours, 'best_apart_m')} m from the true path in the mean instead of "
        f"{_text(searched, 'best_apart_m')} m.",
        "Least squares on the same functional and parameters end at a misfit of "
        f"{_text(settled, 'misfit')}, the search at {_text(searched, 'misfit')} after "
        f"{_text(searched, 'evaluations')} evaluations a track; they take some dozens, with "
        "slopes.",
        "Read: X is north and Z east; an arc's three points are two of the track and the plot, "
        "and the place, heading and speed at the first are the track's. Groups are tracks less "
        "than 20 m apart in the mean.",
    ]


def _text(row: dict[str, Value], name: str) -> str:
    value = row[name]
    return "–" if value is None else f"{float(value):.3g}"
