"""Figures 2.2 to 2.4 of the report: a bundle of trajectories before and after each of its steps."""

import numpy as np

from multiradar.report.cells import number_text
from multiradar.report.content import Table, Value
from multiradar.research.studies.catalogue import TRAJECTORY_BUNDLE
from multiradar.research.studies.result import Progress, StudyOptions, StudyResult, step_counter
from multiradar.research.studies.trajectory_bundle.plots import SEARCHED, plots
from multiradar.research.studies.trajectory_bundle.runs import (
    LOOKED_AT_S,
    Run,
    apart_from_truth,
    last_plot,
    one_run,
)

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
        Rows as in docs/studies.md; the plots are of the realisation whose tracks end as far from
        the last plot after the search as those of half of them do.

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
        plots=plots(_in_the_middle(found)),
        notes=_notes(rows),
        summary=SUMMARY,
        options={"runs": runs},
    )


def _in_the_middle(found: list[Run]) -> Run:
    place = [picture.name for picture in found[0].pictures].index(SEARCHED)
    far = [_seen(run, place)[FROM_PLOT] for run in found]
    return found[int(np.argsort(far, kind="stable")[len(found) // 2])]


# Means over the runs of what is to be seen of a step.
def _row(found: list[Run], place: int) -> dict[str, Value]:
    tracks, best, weighted, scatter, plot, end, misfit, evaluations = np.mean(
        [_seen(run, place) for run in found], axis=0
    ).tolist()
    picture = found[0].pictures[place]
    return {
        "step": picture.name,
        "tracks": tracks,
        "best_apart_m": best,
        "weighted_apart_m": weighted,
        "scatter_m": scatter,
        "end_from_plot_sigma": plot,
        "end_from_truth_m": end,
        "misfit": misfit if picture.misfit else None,
        "evaluations": evaluations or None,
    }


# Where `_seen` tells how far the ends are from the last plot.
FROM_PLOT = 4


def _seen(run: Run, place: int) -> list[float]:
    picture = run.pictures[place]
    apart = apart_from_truth(run, picture)
    mean = np.einsum("k,ktc->tc", picture.weights, picture.places_m)
    off = mean - run.path.position(picture.time_s)
    unlike = picture.places_m - picture.places_m[0]
    last = last_plot(run.plots, picture)
    plot, noise = run.plots.position_m[last], run.plots.covariance_m2[last]
    away = picture.ends_m - plot
    sigmas = np.sqrt(np.einsum("ki,ij,kj->k", away, np.linalg.inv(noise), away))
    truth = run.path.position(run.plots.time_s[last : last + 1])[0]
    far = np.hypot(*(picture.ends_m - truth).T)
    return [
        len(apart), apart[0], float(np.mean(np.hypot(off[:, 0], off[:, 1]))),
        float(np.mean(np.hypot(unlike[..., 0], unlike[..., 1]))),
        float(np.median(sigmas)), far[0], picture.misfit, picture.evaluations,
    ]  # fmt: skip


def _table(rows: list[dict[str, Value]]) -> Table:
    names = (
        ("step", "step"),
        ("tracks", "tracks"),
        ("best_apart_m", "best, m"),
        ("weighted_apart_m", "weighted, m"),
        ("scatter_m", "scatter, m"),
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
        "window, of the best track and of the mean of all by their weights. Scatter: mean distance "
        "of all tracks from the best. End from plot: half of "
        "the tracks end closer to the last plot, in its sigmas; the truth does so at 1.2. End of "
        "the best: from the truth. Misfit: −ln of the likelihood of the plots with the best track.",
    )


def _notes(rows: list[dict[str, Value]]) -> list[str]:
    named = {str(row["step"]): row for row in rows}
    searched, settled = named[SEARCHED], named["least squares on the same"]
    grouped, alone = named["before the last plot"], named["the same, thinned by weight alone"]
    first, ours = rows[0], rows[-1]
    return [
        f"Figure 2.3 is the bundle {LOOKED_AT_S:g} s after the first plot, right after branching; "
        "figure 2.4 is the same bundle after the search. An arc leaves its track 10 s or longer "
        "before the plot, so that no segment is shorter than the search allows. Drawn is the run "
        "in the middle of all by how far its tracks end from the last plot after the search.",
        "Why groups: of tracks that are kept by weight alone all are nearly the same, as the "
        f"report says: their scatter is {_text(alone, 'scatter_m')} m, that of groups "
        f"{_text(grouped, 'scatter_m')} m. The larger errors that it saw after a change of motion "
        f"are not seen here: the end of the best is {_text(alone, 'end_from_truth_m')} m from the "
        f"truth, with groups {_text(grouped, 'end_from_truth_m')} m. The scatter of the initial "
        f"window, {_text(first, 'scatter_m')} m, is {_text(searched, 'scatter_m')} m after the "
        "search.",
        "The defect that the report describes is there: after the search half of the tracks end "
        f"within {_text(searched, 'end_from_plot_sigma')} sigmas of the last plot, where chance "
        "would have 1.2. It is the functional's, not the search's: least squares have it too. What "
        "the report considers: a longer last segment does not cure it; a lighter last plot takes "
        "the ends away from the plot, and no closer to the truth; a functional of dimples, which a "
        "plot farther than two sigmas hardly draws, leaves the ends where they are and the tracks "
        f"farther off. With priors of accelerations and of switches it is "
        f"{_text(ours, 'end_from_plot_sigma')}, and the best track is "
        f"{_text(ours, 'best_apart_m')} m from the true path in the mean instead of "
        f"{_text(searched, 'best_apart_m')} m.",
        "Least squares on the same functional and parameters end at a misfit of "
        f"{_text(settled, 'misfit')}, the search at {_text(searched, 'misfit')} after "
        f"{_text(searched, 'evaluations')} evaluations a track; they take some dozens, with "
        "slopes.",
        "Read: X is north and Z east; an arc's three points are two of the track and the plot, "
        "and the place, heading and speed at the first are the track's. Groups are tracks less "
        "than 20 m apart in the mean. The report names dimples and tells no shape: here each is "
        "ln 2 deep, as if a plot were an outlier as likely as a good one is at best.",
    ]


def _text(row: dict[str, Value], name: str) -> str:
    value = row[name]
    return "–" if value is None else number_text(float(value))
