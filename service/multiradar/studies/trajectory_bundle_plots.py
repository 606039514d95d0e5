"""Plots of the study of bundles: maps of the flight, and the tracks before and after each step."""

from multiradar.report.content import Plot, Series
from multiradar.studies.trajectory_bundle_runs import Picture, Run

#: What is drawn, by the number of the step: name of the file, and what the report calls it.
DRAWN = (
    (9, "bundle", "The bundle of the service"),
    (0, "figure-2-2", "Figure 2.2: the initial window"),
    (1, "figure-2-2-thinned", "The same after thinning"),
    (2, "before-branching", "Before the last plot"),
    (3, "figure-2-3", "Figure 2.3: after branching"),
    (4, "after-thinning", "The same after thinning"),
    (5, "figure-2-4", "Figure 2.4: after the search"),
    (8, "least-squares", "The same by least squares"),
)


def plots(run: Run) -> list[Plot]:
    """Draw the steps of one run.

    Parameters
    ----------
    run : Run
        Plots, truth and pictures.

    Returns
    -------
    list of Plot
        Maps with equal axes.
    """
    return [_map(run, run.pictures[place], name, title) for place, name, title in DRAWN]


def _map(run: Run, picture: Picture, name: str, title: str) -> Plot:
    known = run.plots.time_s <= picture.time_s[-1] + 1.0
    truth = run.path.place(picture.time_s)
    tracks = [
        Series("tracks", *(1e-3 * track.T), "thin", key="tracks")
        for track in picture.places_m[::-1]
    ]
    best = picture.places_m[0]
    return Plot(
        title=title,
        x_label="east, km",
        y_label="north, km",
        series=(
            *tracks,
            Series("best track", *(1e-3 * best.T), key="best"),
            Series("true path", *(1e-3 * truth.T), "dashed", key="ink"),
            Series("plots", *(1e-3 * run.plots.position_m[known].T), "rings", key="plots"),
        ),
        equal_axes=True,
        caption=f"{len(picture.places_m)} tracks, {picture.name}.",
        name=name,
    )
