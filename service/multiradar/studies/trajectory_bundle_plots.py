"""Plots of the study of bundles: maps of the flight, and the tracks before and after each step."""

import numpy as np
from numpy.typing import NDArray

from multiradar.report.content import Plot, Series, Style
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
    tracks = [_line("tracks", track, "thin", "tracks") for track in picture.places_m[::-1]]
    return Plot(
        title=title,
        x_label="east, km",
        y_label="north, km",
        series=(
            *tracks,
            _line("best track", picture.places_m[0], "line", "best"),
            _line("true path", run.path.place(picture.time_s), "dashed", "ink"),
            _line("plots", run.plots.position_m[known], "rings", "plots"),
        ),
        equal_axes=True,
        caption=f"{len(picture.places_m)} tracks, {picture.name}.",
        name=name,
    )


def _line(label: str, places_m: NDArray[np.float64], style: Style, key: str) -> Series:
    return Series(label, 1e-3 * places_m[:, 0], 1e-3 * places_m[:, 1], style, key=key)
