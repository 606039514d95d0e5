"""Scenes of the study of bearings only, and the filters that are compared on them.

The paper tells no geometry. Here three sources stand some 40 km apart and look at an aircraft 60 to
120 km away, each in its own turn.

References
----------
Nenartovich, Isakov, the section on the simulation: the usual scheme, which the paper's is compared
with, makes a place of the angles first. How it does so is not told; two ways are the project's own.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.bearings_only import BearingsState, initiate, predict, update
from multiradar.estimation.measurement.sights import Sight

Floats = NDArray[np.float64]

#: Each angle as it comes, angles made a place as if of one moment, and led on to one.
BEARINGS, PLACES, LED_ON = "bearings", "places", "places led on"
PERIOD_S = 5.0
#: White acceleration of the aircraft, m²/s³, which the filters know.
DENSITY = 0.05
SPEED_MPS = 220.0
SPEED_SIGMA_MPS = 300.0
AZIMUTH_SIGMA_RAD = float(np.radians(0.2))
ELEVATION_SIGMA_RAD = float(np.radians(0.2))
RANGE_SIGMA_M = 100.0
DURATION_S = 180.0
#: Errors count from here on, s: what comes before is the start.
SETTLED_S = 60.0

SITES_M = np.array([[0.0, 0.0, 0.0], [40e3, -5e3, 100.0], [15e3, -30e3, 50.0]])
START_M = np.array([-10e3, 80e3, 9000.0])
VELOCITY_MPS = SPEED_MPS * np.array([np.cos(0.3), -np.sin(0.3), 0.0])


class Scene(NamedTuple):
    """What is looked at, from where and when.

    Attributes
    ----------
    name : str
        In the order of `SCENES`.
    purpose : str
        What it shows, in words.
    phases_s : tuple of float
        When each source looks, after the beginning of each turn, s.
    dimensions : int
        2 or 3; in space elevations are measured too.
    source_speed_mps : float
        Sources fly east with it.
    ranging : tuple of int
        Sources that measure the range as well.
    seen : float
        Share of the looks that see the aircraft, from the third turn on.
    """

    name: str
    purpose: str
    phases_s: tuple[float, ...] = (0.0, 1.7, 3.3)
    dimensions: int = 2
    source_speed_mps: float = 0.0
    ranging: tuple[int, ...] = ()
    seen: float = 1.0


SCENES = (
    Scene("turning", "three sources, each in its turn"),
    Scene("two", "two sources, each in its turn", (0.0, 2.5)),
    Scene("at once", "three sources that look at one moment", (0.0, 0.0, 0.0)),
    Scene("moving", "three sources that fly at 150 m/s", source_speed_mps=150.0),
    Scene("space", "three sources that measure elevations too", dimensions=3),
    Scene("jammed", "one radar still ranges, two have lost it", ranging=(0,)),
    Scene("missed", "three sources, each of which misses the aircraft every other time", seen=0.5),
)


@dataclass(frozen=True, slots=True, eq=False)
class Looks:
    """Sights of many runs at once, in the order of time.

    Attributes
    ----------
    times_s : (n,) float64
        When.
    sights : list of Sight
        What was seen, (runs,) angles each.
    turn, source : (n,) int64
        Number of the turn of the sources, and of the source.
    truth : (n, runs, 2 d) float64
        State of the aircraft at each look.
    """

    times_s: Floats
    sights: list[Sight]
    turn: NDArray[np.int64]
    source: NDArray[np.int64]
    truth: Floats


class Filtered(NamedTuple):
    """Estimates at the end of each turn.

    Attributes
    ----------
    error : (k, runs, 2 d) float64
        Estimate minus truth.
    covariance : (k, runs, 2 d, 2 d) float64
        What the filter claims.
    time_s : (k,) float64
        When.
    crossing : (k, runs) float64
        By how many of their errors the lines of sight cross; NaN where nobody asks.
    """

    error: Floats
    covariance: Floats
    time_s: Floats
    crossing: Floats


def look(scene: Scene, runs: int, duration_s: float, rng: np.random.Generator) -> Looks:
    """Fly and look.

    Parameters
    ----------
    scene : Scene
        What is looked at.
    runs : int
        How many runs.
    duration_s : float
        How long, s.
    rng : Generator
        Draws accelerations and errors.

    Returns
    -------
    Looks
        All sights.

    References
    ----------
    Nenartovich, Isakov, equations (2) to (4).
    """
    d = scene.dimensions
    turns = int(duration_s / PERIOD_S)
    order = sorted(range(len(scene.phases_s)), key=lambda one: scene.phases_s[one])
    state = np.tile(np.r_[START_M[:d], VELOCITY_MPS[:d]], (runs, 1))
    now, times, sights, turn, sources, truth = 0.0, [], [], [], [], []
    for number in range(turns):
        for source in order:
            # One pattern for all runs; the first two turns begin the track.
            if scene.seen < 1.0 and number > 1 and rng.random() > scene.seen:
                continue
            time = number * PERIOD_S + scene.phases_s[source]
            state = _flown(state, time - now, rng)
            now = time
            times.append(time)
            turn.append(number)
            sources.append(source)
            truth.append(state)
            sights.append(_sight(scene, source, time, state[:, :d], rng))
    return Looks(np.array(times), sights, np.array(turn), np.array(sources), np.array(truth))


def fused(looks: Looks) -> Filtered:
    """Track with each sight as it comes, in information form.

    Parameters
    ----------
    looks : Looks
        All sights.

    Returns
    -------
    Filtered
        At the last sight of each turn.

    References
    ----------
    Nenartovich, Isakov, equations (6) and (11).
    """
    first = int((looks.turn <= 1).sum())
    state = initiate(looks.sights[:first], looks.times_s[:first], SPEED_SIGMA_MPS)
    found = [(first - 1, state)]
    for place in range(first, len(looks.sights)):
        state = update(predict(state, float(looks.times_s[place]), DENSITY), looks.sights[place])
        found.append((place, state))
    return collected(looks, found)


def _flown(state: Floats, interval_s: float, rng: np.random.Generator) -> Floats:
    d = state.shape[-1] // 2
    shape = (*state.shape[:-1], d)
    draw = rng.standard_normal(shape), rng.standard_normal(shape)
    position, velocity = state[..., :d], state[..., d:]
    gain = np.sqrt(DENSITY * interval_s)
    # White acceleration over the interval: velocity, and position that goes with it.
    noise_v = gain * draw[0]
    noise_p = 0.5 * interval_s * noise_v + gain * interval_s / np.sqrt(12.0) * draw[1]
    moved = position + interval_s * velocity + noise_p
    return np.asarray(np.concatenate([moved, velocity + noise_v], axis=-1))


def _sight(
    scene: Scene, source: int, time_s: float, position: Floats, rng: np.random.Generator
) -> Sight:
    d = scene.dimensions
    site = SITES_M[source, :d].copy()
    site[0] += scene.source_speed_mps * time_s
    line = position - site
    ground = np.hypot(line[:, 0], line[:, 1])
    azimuth = np.arctan2(line[:, 0], line[:, 1])
    azimuth = azimuth + AZIMUTH_SIGMA_RAD * rng.standard_normal(len(ground))
    elevation, distance = None, None
    if d > 2:
        elevation = np.arctan2(line[:, 2], ground)
        elevation = elevation + ELEVATION_SIGMA_RAD * rng.standard_normal(len(ground))
    if source in scene.ranging:
        distance = np.linalg.norm(line, axis=-1) + RANGE_SIGMA_M * rng.standard_normal(len(ground))
    return Sight(
        site, azimuth, AZIMUTH_SIGMA_RAD, elevation,
        None if elevation is None else ELEVATION_SIGMA_RAD, distance,
        None if distance is None else RANGE_SIGMA_M,
    )  # fmt: skip


def collected(looks: Looks, found: list[tuple[int, BearingsState]]) -> Filtered:
    """Return the states at the end of each scan, with the number of the sight before each."""
    ends = set((np.flatnonzero(np.diff(looks.turn, append=looks.turn[-1] + 1))).tolist())
    chosen = [(place, state) for place, state in found if place in ends]
    estimates = [state.estimate() for _, state in chosen]
    places = [place for place, _ in chosen]
    return Filtered(
        np.array([mean for mean, _ in estimates]) - looks.truth[places],
        np.array([covariance for _, covariance in estimates]),
        looks.times_s[places],
        np.array([state.crossing_strength for _, state in chosen]),
    )
