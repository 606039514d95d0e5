"""An S-shaped flight, and trajectory bundles from its plots, step by step."""

import copy
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.research.bundle.published import PublishedBundle
from multiradar.research.bundle.search_rules import SearchRules
from multiradar.restoration.bundle.trajectory_bundle import Bundle
from multiradar.restoration.control_tracks.settings import BundleSettings
from multiradar.restoration.control_tracks.tracks import (
    ControlTrack,
    MeasurementTrack,
    measurement_track,
    whole_seconds,
)
from multiradar.simulation.flat import flat_plots
from multiradar.simulation.paths import Path, fly
from multiradar.simulation.scenario.model import Aircraft, Leg, Scenario, Sensor

Floats = NDArray[np.float64]

SPEED_MPS = 180.0
#: Straight to the east, left turn, right turn, straight: durations (s) and lateral accelerations
#: (m/s²).
LEGS = ((25.0, 0.0), (35.0, -2.0), (35.0, 2.0), (25.0, 0.0))
DURATION_S = sum(duration for duration, _ in LEGS)
#: End of the initial window, and time of the bundle of figure 2.3, s.
INITIAL_S, BUNDLE_TIME_S = 30.0, 80.0
#: Tracks with a smaller mean distance are one group for the report's thinning, m.
GROUP_M = 20.0
#: Variants of the search that the report proposes against tracks that end at the last plot.
VARIANTS = (
    ("search of Hooke and Jeeves, as printed", SearchRules()),
    ("the same, last segment of 20 s at least", SearchRules(last_segment_s=20.0)),
    ("the same, last plot weighs a quarter", SearchRules(last_plot=0.25)),
    ("the same, a dimple for each plot", SearchRules(dimples=True)),
)
#: Names of the steps in tables and plots, where they differ from those in the rows.
STEP_LABELS = {
    "the same, thinned by weight alone": "before the last plot, thinned by weight alone",
    VARIANTS[0][0]: "Hooke–Jeeves search, as published",
    VARIANTS[1][0]: "Hooke–Jeeves search, last segment at least 20 s",
    VARIANTS[2][0]: "Hooke–Jeeves search, last plot weighted by 1/4",
    VARIANTS[3][0]: "Hooke–Jeeves search, one dimple per plot",
    "least squares on the same": "least squares, same functional",
    "the bundle: priors, least squares, Laplace": "service: priors, least squares, Laplace",
}


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A bundle after a step: positions (k, t, 2) of its tracks on the grid of its window.

    Attributes
    ----------
    name : str
        Name of the step.
    time_s : (t,) float64
        Times of the grid.
    positions_m : (k, t, 2) float64
        Positions of the tracks, the best first.
    weights : (k,) float64
        Probabilities of the tracks, by the weights of the report or of the bundle.
    evaluations : int
        Evaluations of the functional per track, of a search.
    misfit : float
        −ln of the likelihood of the plots with the best track, 0 where undefined.
    ends_m : (k, 2) float64
        Ends of the tracks.
    controls : tuple of ControlTrack
        Controls of the tracks.
    """

    name: str
    time_s: Floats
    positions_m: Floats
    weights: Floats
    evaluations: int
    misfit: float
    ends_m: Floats
    controls: tuple[ControlTrack, ...]

    @property
    def best(self) -> ControlTrack:
        """Controls of the best track."""
        return self.controls[0]


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """One realisation.

    Attributes
    ----------
    plots : MeasurementTrack
        The plots of the radars.
    path : Path
        The path of the aircraft.
    pictures : tuple of Picture
        The bundle after each step.
    branch : tuple of ControlTrack, or None
        A track, and its best branch to the last plot.
    """

    plots: MeasurementTrack
    path: Path
    pictures: tuple[Picture, ...]
    branch: tuple[ControlTrack, ControlTrack] | None


def one_run(rng: np.random.Generator) -> Run:
    """Simulate the flight and its plots, and run all steps.

    Parameters
    ----------
    rng : Generator
        Random generator of noise and antenna phases.

    Returns
    -------
    Run
        Pictures in the order of the steps.

    References
    ----------
    IMM UrO RAN report (2016), section 2.7.1: figures 2.2, 2.3 and 2.4.
    """
    aircraft = _aircraft()
    plots = _plots(aircraft, rng)
    path = fly(aircraft, DURATION_S, rng)
    settings = BundleSettings(apart_m=GROUP_M)
    known = int(np.searchsorted(plots.time_s, INITIAL_S))
    last = int(np.searchsorted(plots.time_s, BUNDLE_TIME_S))
    published = PublishedBundle(plots, settings)
    published.start(known)
    pictures = [_picture("initial window: arcs through triples", published, plots, known)]
    alone = copy.deepcopy(published)
    published.thin(known)
    pictures.append(_picture("initial window, thinned", published, plots, known))
    alone.thin(known, grouped=False)
    for count in range(known + 1, last):
        for bundle, grouped in ((published, True), (alone, False)):
            bundle.branch(count)
            bundle.thin(count, grouped=grouped)
    pictures.append(_picture("before the last plot", published, plots, last - 1))
    pictures.append(_picture("the same, thinned by weight alone", alone, plots, last - 1))
    old = published.controls()
    published.branch(last)
    pictures.append(_picture("after branching", published, plots, last))
    branch = _best_branch(old, published, last)
    pictures.append(_after("after thinning", published, plots, last, _thinned))
    for name, rules in VARIANTS:
        pictures.append(_after(name, published, plots, last, _searched(rules)))
    pictures.append(_after("least squares on the same", published, plots, last, _fitted))
    pictures.append(_of_bundle(plots, last))
    return Run(plots, path, tuple(pictures), branch)


def last_plot(plots: MeasurementTrack, picture: Picture) -> int:
    """Return the row of the newest plot used in a step.

    References
    ----------
    The project's own: within a second after the last whole one.
    """
    return int(np.searchsorted(plots.time_s, picture.time_s[-1] + 1.0)) - 1


def step_label(name: str) -> str:
    """Return the name of a step in tables and plots."""
    return STEP_LABELS.get(name, name)


def true_lateral_mps2(time_s: Floats) -> Floats:
    """Return the true lateral acceleration at times, m/s².

    References
    ----------
    The project's own: `LEGS`.
    """
    begins = np.cumsum([0.0, *(duration for duration, _ in LEGS)])[:-1]
    return np.array([lateral for _, lateral in LEGS])[np.searchsorted(begins, time_s, "right") - 1]


def distance_from_truth(run: Run, picture: Picture) -> Floats:
    """Return the mean distance of each track of a picture from the true path.

    Parameters
    ----------
    run : Run
        The run of the picture.
    picture : Picture
        One of its steps.

    Returns
    -------
    (k,) ndarray
        Averaged over the grid, m.

    References
    ----------
    IMM UrO RAN report (2016), section 2.2.4.
    """
    off = picture.positions_m - run.path.position(picture.time_s)
    return np.asarray(np.mean(np.hypot(off[..., 0], off[..., 1]), axis=1))


def _aircraft() -> Aircraft:
    legs = tuple(Leg(duration, lateral / SPEED_MPS) for duration, lateral in LEGS)
    return Aircraft(1, -10e3, 40e3, 8000.0, SPEED_MPS, np.pi / 2.0, legs=legs)


def _plots(aircraft: Aircraft, rng: np.random.Generator) -> MeasurementTrack:
    radars = (
        Sensor("1", "radar", -30e3, 0.0, 0.0, 40.0, 0.0011, rotation_period_s=4.0),
        Sensor("2", "radar", 40e3, 10e3, 0.0, 40.0, 0.0011, rotation_period_s=5.0),
    )
    flat = flat_plots(Scenario("", 1, DURATION_S, "flat", (0.0, 0.0), (aircraft,), (), radars), rng)
    away = np.stack([np.sin(flat.azimuth_rad), np.cos(flat.azimuth_rad)], axis=-1)
    across = np.stack([away[:, 1], -away[:, 0]], axis=-1)
    position = flat.site_m[flat.radar] + flat.range_m[:, None] * away
    range_m2 = np.array([one.range_sigma_m**2 for one in radars])[flat.radar]
    sigma = np.array([one.azimuth_sigma_rad for one in radars])[flat.radar]
    noise = range_m2[:, None, None] * away[:, :, None] * away[:, None, :]
    across_m2 = (sigma * flat.range_m) ** 2
    noise = noise + across_m2[:, None, None] * across[:, :, None] * across[:, None, :]
    return measurement_track(flat.time_s, position, noise, flat.radar)


# The branch with the smallest misfit, and its parent track.
def _best_branch(
    old: tuple[ControlTrack, ...], bundle: PublishedBundle, count: int
) -> tuple[ControlTrack, ControlTrack] | None:
    controls, misfits = bundle.controls(), bundle.misfits(count)
    if len(controls) == len(old):
        return None
    branch = controls[len(old) + int(np.argmin(misfits[len(old) :]))]
    shared = len(branch.begin_s) - 1
    parent = next(
        one
        for one in controls[: len(old)]
        if np.array_equal(one.start, branch.start)
        and np.array_equal(one.begin_s[:shared], branch.begin_s[:shared])
        and np.array_equal(one.lateral_mps2[:shared], branch.lateral_mps2[:shared])
    )
    return parent, branch


def _searched(rules: SearchRules) -> Callable[[PublishedBundle, int], int]:
    return lambda bundle, count: bundle.optimise(count, rules) // len(bundle)


def _fitted(bundle: PublishedBundle, count: int) -> int:
    bundle.fit_least_squares(count)
    return 0


def _thinned(bundle: PublishedBundle, count: int) -> int:
    bundle.thin(count)
    return 0


# The bundle after a step, leaving the original unchanged.
def _after(
    name: str, bundle: PublishedBundle, plots: MeasurementTrack, count: int,
    step: Callable[[PublishedBundle, int], int],
) -> Picture:  # fmt: skip
    changed = copy.deepcopy(bundle)
    evaluations = step(changed, count)
    return _picture(name, changed, plots, count, evaluations)


def _picture(
    name: str, bundle: PublishedBundle, plots: MeasurementTrack, count: int, evaluations: int = 0
) -> Picture:
    misfits = bundle.misfits(count)
    order = np.argsort(misfits, kind="stable")
    controls = [bundle.controls()[index] for index in order]
    weights = np.exp(misfits[order[0]] - misfits[order])
    return _of_tracks(
        name, controls, weights / weights.sum(), float(plots.time_s[count - 1]),
        (evaluations, float(misfits.min()), bundle.ends(count)[order]),
    )  # fmt: skip


def _of_tracks(
    name: str, controls: list[ControlTrack], weights: Floats, now_s: float,
    results: tuple[int, float, Floats],
) -> Picture:  # fmt: skip
    grid = whole_seconds(float(controls[0].begin_s[0]), now_s)
    positions = np.array([one.geometric(grid).position_m for one in controls])
    return Picture(name, grid, positions, weights, *results, tuple(controls))


def _of_bundle(plots: MeasurementTrack, count: int) -> Picture:
    bundle = Bundle(BundleSettings())
    for row in range(count):
        bundle.push(float(plots.time_s[row]), plots.position_m[row], plots.covariance_m2[row])
    found = bundle.trajectories()
    controls = [one.controls for one in found]
    now_s = float(plots.time_s[count - 1])
    ends = np.array([one.geometric([now_s]).position_m[0] for one in controls])
    return _of_tracks(
        "the bundle: priors, least squares, Laplace", controls, bundle.weights(), now_s,
        (0, 0.0, ends),
    )  # fmt: skip
