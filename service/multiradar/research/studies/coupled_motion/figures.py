"""Figures 1 and 3 of Vasiliev and Mattis, and accelerations of their models by heading."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from multiradar.estimation.motion.axes import frame_to_velocity
from multiradar.research.motion.cartesian_acceleration import CartesianAcceleration
from multiradar.research.motion.model import MotionSimulator
from multiradar.research.motion.relative_speed import RelativeSpeed
from multiradar.research.motion.velocity_frame import VelocityFrame
from multiradar.research.studies.coupled_motion.models import (
    ACCELERATION,
    FRAME,
    INITIAL_SPEED_MPS,
    INTERVAL_S,
    RELATIVE,
    RELATIVE_CHANGE,
    Scenario,
    initial_states,
)

Floats = NDArray[np.float64]

#: Number of realisations drawn in a figure, and used for its statistics.
DRAWN_RUNS = 8
STATISTICS_RUNS = 400
#: Maximum number of intervals of all realisations together, to limit memory.
STATISTICS_STEPS_MAX = 1_000_000
#: Headings at which accelerations are simulated, rad, and draws at each.
HEADINGS_RAD = np.radians(np.arange(0.0, 360.0, 15.0))
HEADING_DRAWS = 4000


@dataclass(frozen=True, slots=True, eq=False)
class Realisations:
    """Realisations of a model.

    Attributes
    ----------
    position_m : (steps + 1, DRAWN_RUNS, 2) ndarray
        East and north of the drawn realisations, m.
    along_mps2, across_mps2 : float
        Root mean square of the acceleration in the plane, over all runs and steps.
    speed_change_mps, turned_rad : float
        Root mean square over the runs of the change of ground speed, and of the change of course,
        from start to end.
    """

    position_m: Floats
    along_mps2: float
    across_mps2: float
    speed_change_mps: float
    turned_rad: float


@dataclass(frozen=True, slots=True, eq=False)
class HeadingSpread:
    """Root mean square acceleration of one interval by heading.

    Attributes
    ----------
    model, setting : str
        Name of the model, and its parameters.
    along, across : (headings,) ndarray
        Simulated, m/s².
    along_exact, across_exact : (headings,) ndarray
        Exact values for the model's parameters, m/s².
    """

    model: str
    setting: str
    along: Floats
    across: Floats
    along_exact: Floats
    across_exact: Floats


def realise(scenario: Scenario, steps: int, rng: np.random.Generator) -> Realisations:
    """Simulate a model from the origin, with initial headings evenly spaced over the circle.

    Parameters
    ----------
    scenario : Scenario
        The model.
    steps : int
        Number of intervals.
    rng : Generator
        Random generator.

    Returns
    -------
    Realisations
        Paths with their statistics.

    References
    ----------
    Vasiliev, Mattis, equations (2) and (5), as in its figures 1 and 3.
    """
    runs = max(DRAWN_RUNS, min(STATISTICS_RUNS, STATISTICS_STEPS_MAX // steps))
    first = initial_states(2.0 * np.pi * np.arange(runs) / DRAWN_RUNS)
    model = scenario.simulator(first)
    state = model.coordinates.from_cartesian(first)
    states = [first]
    for _ in range(steps):
        state = model.step(state, INTERVAL_S, rng.normal(size=(runs, 3)))
        states.append(model.coordinates.to_cartesian(state))
    path = np.array(states)
    velocity = path[..., 3:5]
    along, across = _by_track(velocity[:-1], velocity[1:])
    course = np.unwrap(np.arctan2(velocity[..., 0], velocity[..., 1]), axis=0)
    speed = np.linalg.norm(velocity, axis=-1)
    return Realisations(
        path[:, :DRAWN_RUNS, :2],
        _rms(along),
        _rms(across),
        _rms(speed[-1] - speed[0]),
        _rms(course[-1] - course[0]),
    )


def heading_spreads(rng: np.random.Generator) -> list[HeadingSpread]:
    """Return the accelerations of four models, at the initial speed in level flight.

    Parameters
    ----------
    rng : Generator
        Random generator.

    Returns
    -------
    list of HeadingSpread
        Model (2) with equal and with unequal parameters, its relative-speed variant, and (5).

    References
    ----------
    Vasiliev, Mattis, equations (2) and (5), and the text after (2). The moments of (5) follow from
    those of a normal angle.
    """
    return [
        _equal_axes(1.0, 1.0, rng),
        _equal_axes(2.0, 1.0, rng),
        _relative(rng),
        _frame(1.0, np.radians(3.0), rng),
    ]


def heading_band() -> tuple[float, float]:
    """Return the 99.9 % band of a simulated spread, in units of the exact one.

    References
    ----------
    The project's own: χ² of the sum of squares of normal draws.
    """
    low, high = np.sqrt(chi2.ppf([5e-4, 1.0 - 5e-4], HEADING_DRAWS) / HEADING_DRAWS)
    return float(low), float(high)


def _equal_axes(east: float, north: float, rng: np.random.Generator) -> HeadingSpread:
    exact = _on_track(np.full_like(HEADINGS_RAD, east), np.full_like(HEADINGS_RAD, north))
    found = _simulated([CartesianAcceleration((east, north, 0.0))] * len(HEADINGS_RAD), rng)
    setting = f"a_x = {north:g}, a_y = {east:g} m/s²"
    return HeadingSpread(ACCELERATION, setting, *found, *exact)


def _relative(rng: np.random.Generator) -> HeadingSpread:
    speeds = np.abs(_level_velocity())
    models = [RelativeSpeed((e, n, 0.0), RELATIVE_CHANGE) for e, n, _ in speeds.tolist()]
    unit = RelativeSpeed((1.0, 1.0, 1.0), RELATIVE_CHANGE).velocity_sigmas(INTERVAL_S)[0]
    exact = _on_track(unit / INTERVAL_S * speeds[:, 0], unit / INTERVAL_S * speeds[:, 1])
    setting = f"γ = {RELATIVE_CHANGE[0]:g}"
    return HeadingSpread(RELATIVE, setting, *_simulated(models, rng), *exact)


# The moments of (V + ξ_V) cos ξ_K and (V + ξ_V) sin ξ_K for normal ξ, exact.
def _frame(acceleration: float, turn_rate: float, rng: np.random.Generator) -> HeadingSpread:
    speed, spread = INITIAL_SPEED_MPS, acceleration * INTERVAL_S
    turned = (turn_rate * INTERVAL_S) ** 2
    square = speed**2 + spread**2
    along = square * (1.0 + np.exp(-2.0 * turned)) / 2.0
    along += speed**2 - 2.0 * speed**2 * np.exp(-turned / 2.0)
    across = square * (1.0 - np.exp(-2.0 * turned)) / 2.0
    exact = [np.full_like(HEADINGS_RAD, np.sqrt(value) / INTERVAL_S) for value in (along, across)]
    found = _simulated([VelocityFrame(acceleration, turn_rate)] * len(HEADINGS_RAD), rng)
    setting = f"a = {acceleration:g} m/s², v_K = {np.degrees(turn_rate):g} °/s"
    return HeadingSpread(FRAME, setting, *found, *exact)


def _level_velocity() -> Floats:
    speed = np.full_like(HEADINGS_RAD, INITIAL_SPEED_MPS)
    velocity = frame_to_velocity(np.stack([speed, HEADINGS_RAD, np.zeros_like(speed)], -1))
    # Rounding of π/2: 1e-14 m/s counts as 0.
    return np.where(np.abs(velocity) < 1e-9, 0.0, velocity)


# Standard deviations by axis, rotated to the track.
def _on_track(east: Floats, north: Floats) -> tuple[Floats, Floats]:
    sine, cosine = (_level_velocity() / INITIAL_SPEED_MPS).T[:2]
    return np.hypot(east * sine, north * cosine), np.hypot(east * cosine, north * sine)


def _simulated(
    models: Sequence[MotionSimulator], rng: np.random.Generator
) -> tuple[Floats, Floats]:
    result = np.empty((2, len(models)))
    for number, (model, velocity) in enumerate(zip(models, _level_velocity(), strict=True)):
        along, across = _one_interval(model, velocity, rng)
        result[:, number] = _rms(along), _rms(across)
    return result[0], result[1]


def _one_interval(
    model: MotionSimulator, velocity: Floats, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    first = np.concatenate([np.zeros(3), velocity])
    state = model.coordinates.from_cartesian(first)
    moved = model.step(state, INTERVAL_S, rng.normal(size=(HEADING_DRAWS, 3)))
    return _by_track(velocity[:2], model.coordinates.to_cartesian(moved)[:, 3:5])


# Acceleration between two velocities in the plane, along the first and across it to the right.
def _by_track(before: Floats, after: Floats) -> tuple[Floats, Floats]:
    acceleration = (after - before) / INTERVAL_S
    east, north = np.moveaxis(before / np.linalg.norm(before, axis=-1, keepdims=True), -1, 0)
    along = acceleration[..., 0] * east + acceleration[..., 1] * north
    across = acceleration[..., 0] * north - acceleration[..., 1] * east
    return along, across


def _rms(values: Floats) -> float:
    return float(np.sqrt((values**2).mean()))
