"""An S-shaped flight, and bundles over its plots, step by step."""

import copy
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.research.bundle.printed import PrintedBundle
from multiradar.research.bundle.search_rules import SearchRules
from multiradar.restoration.bundle.bundle import Bundle
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
#: Straight on to the east, to the left, to the right, straight on: durations (s) and lateral
#: accelerations (m/s²).
LEGS = ((25.0, 0.0), (35.0, -2.0), (35.0, 2.0), (25.0, 0.0))
DURATION_S = sum(duration for duration, _ in LEGS)
#: The initial window ends, and the bundle of figure 2.3 is looked at, at these times, s.
INITIAL_S, LOOKED_AT_S = 30.0, 80.0
#: Tracks that are closer in the mean are one group for the report's thinning, m.
GROUP_M = 20.0
#: Variants of the search by which the report would keep tracks from ending at the last plot.
VARIANTS = (
    ("search of Hooke and Jeeves, as printed", SearchRules()),
    ("the same, last segment of 20 s at least", SearchRules(last_segment_s=20.0)),
    ("the same, last plot weighs a quarter", SearchRules(last_plot=0.25)),
    ("the same, a dimple for each plot", SearchRules(dimples=True)),
)


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """A bundle after a step: places (k, t, 2) of its tracks on the grid of its window.

    Attributes
    ----------
    name : str
        Of the step.
    time_s : (t,) float64
        The grid.
    places_m : (k, t, 2) float64
        The tracks, the best first.
    weights : (k,) float64
        Probabilities of the tracks; those of the report's weights, or the bundle's.
    evaluations : int
        How often the functional was computed for each track, of a search.
    misfit : float
        −ln of the likelihood of the plots with the best track, 0 where it is not told.
    ends_m : (k, 2) float64
        Where the tracks end.
    controls : tuple of ControlTrack
        Of the tracks.
    """

    name: str
    time_s: Floats
    places_m: Floats
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
        What the radars saw.
    path : Path
        Where the aircraft was.
    pictures : tuple of Picture
        The bundle after each step.
    branch : tuple of ControlTrack, or None
        A track, and the arc that leaves it and leads to the last plot: the best one there is.
    """

    plots: MeasurementTrack
    path: Path
    pictures: tuple[Picture, ...]
    branch: tuple[ControlTrack, ControlTrack] | None


def one_run(rng: np.random.Generator) -> Run:
    """Fly, see, and take all steps.

    Parameters
    ----------
    rng : Generator
        For noise and turns of the antennas.

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
    last = int(np.searchsorted(plots.time_s, LOOKED_AT_S))
    printed = PrintedBundle(plots, settings)
    printed.start(known)
    pictures = [_picture("initial window: arcs through triples", printed, plots, known)]
    alone = copy.deepcopy(printed)
    printed.thin(known)
    pictures.append(_picture("initial window, thinned", printed, plots, known))
    alone.thin(known, grouped=False)
    for count in range(known + 1, last):
        for bundle, grouped in ((printed, True), (alone, False)):
            bundle.branch(count)
            bundle.thin(count, grouped=grouped)
    pictures.append(_picture("before the last plot", printed, plots, last - 1))
    pictures.append(_picture("the same, thinned by weight alone", alone, plots, last - 1))
    old = printed.controls()
    printed.branch(last)
    pictures.append(_picture("after branching", printed, plots, last))
    branch = _best_branch(old, printed, last)
    pictures.append(_after("after thinning", printed, plots, last, _thinned))
    for name, rules in VARIANTS:
        pictures.append(_after(name, printed, plots, last, _searched(rules)))
    pictures.append(_after("least squares on the same", printed, plots, last, _settled))
    pictures.append(_of_bundle(plots, last))
    return Run(plots, path, tuple(pictures), branch)


def last_plot(plots: MeasurementTrack, picture: Picture) -> int:
    """Return the number of the newest plot that a step knows.

    References
    ----------
    The project's own: less than a second after the last whole one.
    """
    return int(np.searchsorted(plots.time_s, picture.time_s[-1] + 1.0)) - 1


def true_lateral_mps2(time_s: Floats) -> Floats:
    """Return the lateral acceleration that is flown at times, m/s².

    References
    ----------
    The project's own: `LEGS`.
    """
    begins = np.cumsum([0.0, *(duration for duration, _ in LEGS)])[:-1]
    return np.array([lateral for _, lateral in LEGS])[np.searchsorted(begins, time_s, "right") - 1]


def apart_from_truth(run: Run, picture: Picture) -> Floats:
    """Return the mean distance of each track of a picture from the true path.

    Parameters
    ----------
    run : Run
        Where the picture is from.
    picture : Picture
        One of its steps.

    Returns
    -------
    (k,) ndarray
        Over the grid, m.

    References
    ----------
    IMM UrO RAN report (2016), section 2.2.4.
    """
    off = picture.places_m - run.path.position(picture.time_s)
    return np.asarray(np.mean(np.hypot(off[..., 0], off[..., 1]), axis=1))


def _aircraft() -> Aircraft:
    legs = tuple(Leg(duration, lateral / SPEED_MPS) for duration, lateral in LEGS)
    return Aircraft(1, -10e3, 40e3, 8000.0, SPEED_MPS, np.pi / 2.0, legs=legs)


def _plots(aircraft: Aircraft, rng: np.random.Generator) -> MeasurementTrack:
    radars = (
        Sensor("1", "radar", -30e3, 0.0, 0.0, 40.0, 0.0011, rotation_period_s=4.0),
        Sensor("2", "radar", 40e3, 10e3, 0.0, 40.0, 0.0011, rotation_period_s=5.0),
    )
    seen = flat_plots(Scenario("", 1, DURATION_S, "flat", (0.0, 0.0), (aircraft,), (), radars), rng)
    away = np.stack([np.sin(seen.azimuth_rad), np.cos(seen.azimuth_rad)], axis=-1)
    across = np.stack([away[:, 1], -away[:, 0]], axis=-1)
    place = seen.site_m[seen.radar] + seen.range_m[:, None] * away
    range_m2 = np.array([one.range_sigma_m**2 for one in radars])[seen.radar]
    sigma = np.array([one.azimuth_sigma_rad for one in radars])[seen.radar]
    noise = range_m2[:, None, None] * away[:, :, None] * away[:, None, :]
    across_m2 = (sigma * seen.range_m) ** 2
    noise = noise + across_m2[:, None, None] * across[:, :, None] * across[:, None, :]
    return measurement_track(seen.time_s, place, noise, seen.radar)


# The branch of least misfit, and the track that it leaves.
def _best_branch(
    old: tuple[ControlTrack, ...], bundle: PrintedBundle, count: int
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


def _searched(rules: SearchRules) -> Callable[[PrintedBundle, int], int]:
    return lambda bundle, count: bundle.optimise(count, rules) // len(bundle)


def _settled(bundle: PrintedBundle, count: int) -> int:
    bundle.settle(count)
    return 0


def _thinned(bundle: PrintedBundle, count: int) -> int:
    bundle.thin(count)
    return 0


# The bundle after a step that leaves the original as it is.
def _after(
    name: str, bundle: PrintedBundle, plots: MeasurementTrack, count: int,
    step: Callable[[PrintedBundle, int], int],
) -> Picture:  # fmt: skip
    taken = copy.deepcopy(bundle)
    evaluations = step(taken, count)
    return _picture(name, taken, plots, count, evaluations)


def _picture(
    name: str, bundle: PrintedBundle, plots: MeasurementTrack, count: int, evaluations: int = 0
) -> Picture:
    misfits = bundle.misfits(count)
    order = np.argsort(misfits, kind="stable")
    controls = [bundle.controls()[place] for place in order]
    weights = np.exp(misfits[order[0]] - misfits[order])
    return _of_tracks(
        name, controls, weights / weights.sum(), float(plots.time_s[count - 1]),
        (evaluations, float(misfits.min()), bundle.ends(count)[order]),
    )  # fmt: skip


def _of_tracks(
    name: str, controls: list[ControlTrack], weights: Floats, now_s: float,
    told: tuple[int, float, Floats],
) -> Picture:  # fmt: skip
    grid = whole_seconds(float(controls[0].begin_s[0]), now_s)
    places = np.array([one.geometric(grid).position_m for one in controls])
    return Picture(name, grid, places, weights, *told, tuple(controls))


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
