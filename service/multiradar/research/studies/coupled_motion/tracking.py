"""What each motion model is worth in a filter: errors, and whether the filter knows them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from multiradar.research.extended.extended import predict, start, update
from multiradar.research.extended.extended_measurement import MeasuredPlace
from multiradar.research.motion.model import MotionModel
from multiradar.research.studies.coupled_motion.models import INTERVAL_S, Scenario, initial_states

Floats = NDArray[np.float64]

#: Noise of each measured coordinate, m.
PLACE_SIGMA_M = 30.0
#: How well a filter knows the state at the start: m and m/s.
START_SIGMAS = np.array([30.0, 30.0, 30.0, 10.0, 10.0, 3.0])
#: Intervals of all flights that are held in memory at once, some 100 bytes each.
STEPS_MAX = 1_000_000
#: The share of a run that is left out of means, for a filter to settle.
SETTLING = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Flights:
    """Simulated flights and their measurements.

    Attributes
    ----------
    start : (runs, 6) ndarray
        True Cartesian state at time 0.
    guess : (runs, 6) ndarray
        What filters start from.
    truth : (steps, runs, 6) ndarray
        True Cartesian states after each interval.
    measured : (steps, runs, 3) ndarray
        Measured places.
    """

    start: Floats
    guess: Floats
    truth: Floats
    measured: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Tracked:
    """Errors of a filter over some flights.

    Attributes
    ----------
    position_squared, velocity_squared : (steps,) ndarray
        Squared lengths of the errors at each time, summed over the flights, m² and (m/s)².
    position_claimed, velocity_claimed : (steps,) ndarray
        What the filter expects of them, summed: traces of its covariance.
    nees : (steps,) ndarray
        Normalised estimation error squared of position and velocity, divided by 6, summed.
    nees_by_run : (runs,) ndarray
        The same for each flight, its mean after the filter has settled.
    """

    position_squared: Floats
    velocity_squared: Floats
    position_claimed: Floats
    velocity_claimed: Floats
    nees: Floats
    nees_by_run: Floats

    def __add__(self, other: "Tracked") -> "Tracked":
        """Return what both say together of flights of the same length."""
        return Tracked(
            self.position_squared + other.position_squared,
            self.velocity_squared + other.velocity_squared,
            self.position_claimed + other.position_claimed,
            self.velocity_claimed + other.velocity_claimed,
            self.nees + other.nees,
            np.concatenate([self.nees_by_run, other.nees_by_run]),
        )

    def means(self, sums: Floats) -> Floats:
        """Return (steps,) means over the flights of one of the sums."""
        return sums / len(self.nees_by_run)


def settled(values: Floats) -> Floats:
    """Return the rows, one for each interval, after filters have settled."""
    return values[int(SETTLING * len(values)) :]


def batches(runs: int, steps: int) -> list[Floats]:
    """Return the initial headings of all flights, in batches that fit into memory.

    Parameters
    ----------
    runs, steps : int
        Flights, and intervals of each.

    Returns
    -------
    list of arrays
        In [0, 2π), spread evenly over the circle; none along an axis for an even number.
    """
    every = 2.0 * np.pi * (np.arange(runs) + 0.5) / runs
    size = max(1, STEPS_MAX // steps)
    return [every[first : first + size] for first in range(0, runs, size)]


def fly(scenario: Scenario, headings_rad: Floats, steps: int, rng: np.random.Generator) -> Flights:
    """Simulate flights.

    Parameters
    ----------
    scenario : Scenario
        How they move.
    headings_rad : (runs,) ndarray
        Their initial headings.
    steps : int
        How many intervals long they are.
    rng : Generator
        Draws of motion, measurement and start.

    Returns
    -------
    Flights
        Truth and measurements.

    References
    ----------
    Vasiliev, Mattis, equations (1) and (6), whichever the motion is of.
    """
    runs = len(headings_rad)
    first = initial_states(headings_rad)
    model = scenario.simulator(first)
    state = model.coordinates.from_cartesian(first)
    truth = np.empty((steps, runs, 6))
    for step in range(steps):
        state = model.step(state, INTERVAL_S, rng.normal(size=(runs, 3)))
        truth[step] = model.coordinates.to_cartesian(state)
    measured = truth[..., :3] + PLACE_SIGMA_M * rng.normal(size=(steps, runs, 3))
    return Flights(first, first + START_SIGMAS * rng.normal(size=first.shape), truth, measured)


def track(model: MotionModel, flights: Flights) -> Tracked:
    """Track all flights with one filter.

    Parameters
    ----------
    model : MotionModel
        What the filter assumes.
    flights : Flights
        What it is told, and the truth to judge it by.

    Returns
    -------
    Tracked
        Its errors, in Cartesian terms whatever its coordinates.

    References
    ----------
    Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
    Navigation", Wiley 2001, sections 5.4.2 (NEES) and 10.3 (the extended Kalman filter); Vasiliev,
    Mattis, equations (2), (5) and (7), for its motion.
    """
    steps, runs = flights.truth.shape[:2]
    place = MeasuredPlace(PLACE_SIGMA_M**2 * np.eye(3))
    prior = np.broadcast_to(np.diag(START_SIGMAS**2), (runs, 6, 6))
    estimate = start(flights.guess, prior, model.coordinates)
    squared, claimed = np.empty((2, steps, runs, 2))
    nees = np.empty((steps, runs))
    for step, (truth, measured) in enumerate(zip(flights.truth, flights.measured, strict=True)):
        estimate = update(predict(estimate, model, INTERVAL_S), place, measured).estimate
        known = estimate.cartesian()
        error = known.mean - truth
        squared[step] = _by_part(error**2)
        claimed[step] = _by_part(np.diagonal(known.covariance, axis1=-2, axis2=-1))
        scaled = np.linalg.solve(known.covariance, error[..., None])[..., 0]
        nees[step] = (error * scaled).sum(axis=-1) / 6.0
    position_squared, velocity_squared = squared.sum(axis=1).T
    position_claimed, velocity_claimed = claimed.sum(axis=1).T
    return Tracked(
        position_squared,
        velocity_squared,
        position_claimed,
        velocity_claimed,
        nees.sum(axis=1),
        settled(nees).mean(axis=0),
    )


# Sums of the components of position and of velocity.
def _by_part(values: Floats) -> Floats:
    return np.stack([values[:, :3].sum(axis=-1), values[:, 3:].sum(axis=-1)], -1)


def nees_band(runs: int) -> tuple[float, float]:
    """Return the 95 % band of the mean over runs of NEES / 6 at one time.

    References
    ----------
    Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
    Navigation", Wiley 2001, section 5.4.2.
    """
    low, high = chi2.ppf([0.025, 0.975], 6 * runs) / (6 * runs)
    return float(low), float(high)
