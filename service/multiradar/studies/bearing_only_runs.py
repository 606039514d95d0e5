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

from multiradar.estimation.filters.bearings_only import BearingsState, begin, predict, update
from multiradar.estimation.measurement.sights import Sight

Floats = NDArray[np.float64]

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

_SITES_M = np.array([[0.0, 0.0, 0.0], [40e3, -5e3, 100.0], [15e3, -30e3, 50.0]])
_START_M = np.array([-10e3, 80e3, 9000.0])
_VELOCITY_MPS = SPEED_MPS * np.array([np.cos(0.3), -np.sin(0.3), 0.0])


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
    """

    name: str
    purpose: str
    phases_s: tuple[float, ...] = (0.0, 1.7, 3.3)
    dimensions: int = 2
    source_speed_mps: float = 0.0
    ranging: tuple[int, ...] = ()


SCENES = (
    Scene("turning", "three sources, each in its turn"),
    Scene("two", "two sources, each in its turn", (0.0, 2.5)),
    Scene("at once", "three sources that look at one moment", (0.0, 0.0, 0.0)),
    Scene("moving", "three sources that fly at 150 m/s", source_speed_mps=150.0),
    Scene("space", "three sources that measure elevations too", dimensions=3),
    Scene("jammed", "one radar still ranges, two have lost it", ranging=(0,)),
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
    turn : (n,) int64
        Number of the turn of the sources.
    truth : (n, runs, 2 d) float64
        State of the aircraft at each look.
    """

    times_s: Floats
    sights: list[Sight]
    turn: NDArray[np.int64]
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
    state = np.tile(np.r_[_START_M[:d], _VELOCITY_MPS[:d]], (runs, 1))
    now, times, sights, turn, truth = 0.0, [], [], [], []
    for number in range(turns):
        for source in order:
            time = number * PERIOD_S + scene.phases_s[source]
            state = _flown(state, time - now, rng)
            now = time
            times.append(time)
            turn.append(number)
            truth.append(state)
            sights.append(_sight(scene, source, time, state[:, :d], rng))
    return Looks(np.array(times), sights, np.array(turn), np.array(truth))


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
    state = begin(looks.sights[:first], looks.times_s[:first], SPEED_SIGMA_MPS)
    found = [(first - 1, state)]
    for place in range(first, len(looks.sights)):
        state = update(predict(state, float(looks.times_s[place]), DENSITY), looks.sights[place])
        found.append((place, state))
    return _collected(looks, found)


def triangulated(looks: Looks, *, led_on: bool) -> Filtered:
    """Make a place of the angles of each turn first, and track with the places.

    Parameters
    ----------
    looks : Looks
        Sights without ranges.
    led_on : bool
        Whether the angles of a turn are led on to the moment of its last one, by the rate between
        the last two of each source; else they are taken as if of one moment.

    Returns
    -------
    Filtered
        At the last sight of each turn, from the second turn on.

    References
    ----------
    Nenartovich, Isakov, the section on the simulation: the usual scheme. Least squares over the
    lines of sight and a Kalman filter over the places are the project's own reading of it.
    """
    sources = int((looks.turn == 0).sum())
    d = looks.sights[0].dimensions
    found: list[tuple[int, BearingsState]] = []
    state: BearingsState | None = None
    for last in range(2 * sources - 1, len(looks.sights), sources):
        of_turn = range(last - sources + 1, last + 1)
        time_s = float(looks.times_s[last])
        sights = [
            _led_on(looks, place, sources, time_s) if led_on else looks.sights[place]
            for place in of_turn
        ]
        # Of one moment: the velocity has no part in the place.
        spot = begin(sights, np.full(sources, time_s), SPEED_SIGMA_MPS)
        if state is None:
            state = spot
        else:
            moved = predict(state, time_s, DENSITY)
            information, vector = moved.information.copy(), moved.vector.copy()
            information[..., :d, :d] += spot.information[..., :d, :d]
            vector[..., :d] += spot.vector[..., :d]
            state = BearingsState(time_s, information, vector, moved.crossing)
        found.append((last, state))
    return _collected(looks, found)


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
    site = _SITES_M[source, :d].copy()
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


# A sight at a later moment, by the rate since the one before of the same source.
def _led_on(looks: Looks, place: int, sources: int, time_s: float) -> Sight:
    now, before = looks.sights[place], looks.sights[place - sources]
    ahead = (time_s - looks.times_s[place]) / PERIOD_S
    noise = float(np.hypot(1.0 + ahead, ahead))
    elevation = elevation_sigma = None
    if now.elevation_rad is not None and before.elevation_rad is not None:
        elevation = now.elevation_rad + ahead * (now.elevation_rad - before.elevation_rad)
        elevation_sigma = noise * ELEVATION_SIGMA_RAD
    return Sight(
        now.source_m, now.azimuth_rad + ahead * (now.azimuth_rad - before.azimuth_rad),
        noise * AZIMUTH_SIGMA_RAD, elevation, elevation_sigma,
    )  # fmt: skip


def _collected(looks: Looks, found: list[tuple[int, BearingsState]]) -> Filtered:
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
