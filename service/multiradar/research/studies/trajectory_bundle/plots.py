"""Plots of the trajectory-bundle study: flight, tracks before and after each step, track ends."""

import numpy as np
from numpy.typing import NDArray

from multiradar.report.content import Plot, Series, Style
from multiradar.research.studies.trajectory_bundle.runs import (
    DURATION_S,
    Picture,
    Run,
    last_plot,
    step_label,
    true_lateral_mps2,
)
from multiradar.restoration.control_tracks.tracks import ControlTrack, whole_seconds

Floats = NDArray[np.float64]

#: Drawn steps: name of the step, name of the file, title.
DRAWN = (
    ("the bundle: priors, least squares, Laplace", "service", "Trajectory bundle of the service"),
    ("initial window: arcs through triples", "figure-2-2", "Figure 2.2: the initial window"),
    ("initial window, thinned", "figure-2-2-thinned", "The initial window after thinning"),
    ("before the last plot", "before-branching", "Before the last plot"),
    ("after branching", "figure-2-3", "Figure 2.3: after branching"),
    ("after thinning", "after-thinning", "After thinning"),
    ("search of Hooke and Jeeves, as printed", "figure-2-4", "Figure 2.4: after the search"),
    ("least squares on the same", "least-squares", "After least squares"),
)
#: Steps with drawn accelerations: the report's, and the service's.
SEARCHED, SERVICE = DRAWN[6][0], DRAWN[0][0]
#: Extent of the plot of the end, m back and to the sides, and beyond it.
BACK_M, BEYOND_M = 1100.0, 300.0
#: Sampling interval of accelerations, s.
_STEP_S = 0.25


def plots(run: Run) -> list[Plot]:
    """Draw the steps of one run.

    Parameters
    ----------
    run : Run
        Plots, truth and pictures.

    Returns
    -------
    list of Plot
        For each step the flight and its end, maps with equal axes; figure 2.1 and accelerations.
    """
    named = {picture.name: picture for picture in run.pictures}
    maps = [
        part
        for step, name, title in DRAWN
        for part in (_map(run, named[step], name, title), _end(run, named[step], name, title))
    ]
    return [*maps[:2], _accelerations(named), *_branching(run), *maps[2:]]


def _map(run: Run, picture: Picture, name: str, title: str) -> Plot:
    seen = run.plots.time_s <= picture.time_s[-1] + 1.0
    # The whole S once; then the part within the window.
    grid = whole_seconds(0.0, DURATION_S) if picture.name == SERVICE else picture.time_s
    return Plot(
        title="Flight path",
        x_label="east, km",
        y_label="north, km",
        series=(
            *(_line("tracks", 1e-3 * one, "thin", "tracks") for one in picture.positions_m[::-1]),
            _line("best track", 1e-3 * picture.positions_m[0], "line", "best"),
            _line("true path", 1e-3 * run.path.position(grid), "dashed", "ink"),
            _line("plots", 1e-3 * run.plots.position_m[seen], "rings", "plots"),
        ),
        equal_axes=True,
        group=title,
        caption=f"{len(picture.positions_m)} tracks ({step_label(picture.name)}).",
        name=f"{name}-flight",
    )


# The last seconds, with the ends of the tracks near the last plot.
def _end(run: Run, picture: Picture, name: str, title: str) -> Plot:
    last = last_plot(run.plots, picture)
    origin = run.plots.position_m[last]
    grid = np.append(picture.time_s, run.plots.time_s[last])
    true_path = run.path.position(grid) - origin
    ended = np.concatenate([picture.positions_m, picture.ends_m[:, None]], axis=1) - origin
    sigma = _ellipse(run.plots.covariance_m2[last])
    return Plot(
        title="Track ends",
        x_label="east of the last plot, m",
        y_label="north of the last plot, m",
        series=(
            *(_line("tracks", one, "thin", "tracks") for one in ended[::-1]),
            _line("best track", ended[0], "line", "best"),
            _line("true path", true_path, "dashed", "ink"),
            _line("one-sigma ellipse of the last plot", sigma, "dotted", "plots"),
            _line("plots", run.plots.position_m[: last + 1] - origin, "rings", "plots"),
        ),
        equal_axes=True,
        group=title,
        x_limits=(-BACK_M, BEYOND_M),
        y_limits=(-0.5 * (BACK_M + BEYOND_M), 0.5 * (BACK_M + BEYOND_M)),
        caption="Dotted: one-sigma ellipse of the last plot. The true path is shown up to the "
        "time of that plot.",
        name=name,
    )


def _branching(run: Run) -> list[Plot]:
    if run.branch is None:
        return []
    track, branch = run.branch
    last = last_plot(run.plots, run.pictures[-1])
    leaves_s, now_s = float(branch.begin_s[-1]), float(run.plots.time_s[last])
    grid = np.append(np.arange(leaves_s - 6.0, now_s, 0.5), now_s)
    origin = run.plots.position_m[last]
    seen = (run.plots.time_s >= grid[0]) & (run.plots.time_s <= now_s)
    leaving = branch.geometric([leaves_s]).position_m - origin
    return [
        Plot(
            title="Figure 2.1: a track and its branch",
            x_label="east of the last plot, m",
            y_label="north of the last plot, m",
            series=(
                _line("track", track.geometric(grid).position_m - origin, "line", "tracks"),
                _line("branch", branch.geometric(grid).position_m - origin, "line", "best"),
                _line("true path", run.path.position(grid) - origin, "dashed", "ink"),
                _line("plots", run.plots.position_m[seen] - origin, "rings", "plots"),
                _line("branch point", leaving, "points", "best"),
            ),
            equal_axes=True,
            caption=f"The branch leaves the track {now_s - leaves_s:g} s before the last plot, "
            f"with a lateral acceleration of {branch.lateral_mps2[-1]:.2g} m/s² to the right and "
            "constant speed.",
            name="figure-2-1",
        )
    ]  # fmt: skip


def _accelerations(named: dict[str, Picture]) -> Plot:
    service = named[SERVICE]
    times = np.arange(0.0, service.time_s[-1], _STEP_S)
    mean = np.tensordot(
        service.weights, [_lateral_mps2(one, times) for one in service.controls], axes=1
    )
    return Plot(
        title="Lateral acceleration",
        x_label="t, s",
        y_label="to the right, m/s²",
        series=(
            Series(
                "best track after the search", times, _lateral_mps2(named[SEARCHED].best, times)
            ),
            Series(
                "best track of the service", times, _lateral_mps2(service.best, times), key="best"
            ),
            Series("mean track of the service", times, np.asarray(mean), key="tracks"),
            Series("true", times, true_lateral_mps2(times), "dashed", key="ink"),
        ),
        caption="Lateral acceleration over the window: best track from the report's search, best "
        "track of the service, and weighted mean of the service's tracks.",
        name="lateral-acceleration",
    )


def _lateral_mps2(controls: ControlTrack, time_s: Floats) -> Floats:
    segment = np.searchsorted(controls.begin_s, time_s, side="right") - 1
    return np.asarray(np.where(segment < 0, np.nan, controls.lateral_mps2[np.maximum(segment, 0)]))


def _ellipse(covariance_m2: Floats) -> Floats:
    angle = np.linspace(0.0, 2.0 * np.pi, 73)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    return np.asarray(circle @ np.linalg.cholesky(covariance_m2).T)


def _line(label: str, positions: Floats, style: Style, key: str) -> Series:
    return Series(label, positions[:, 0], positions[:, 1], style, key=key)
