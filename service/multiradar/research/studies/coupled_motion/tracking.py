"""Accuracy of each motion model in a filter: errors and consistency."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from multiradar.research.extended.extended_filter import predict, start, update
from multiradar.research.extended.extended_measurement import MeasuredPosition
from multiradar.research.motion.model import MotionModel
from multiradar.research.studies.coupled_motion.models import INTERVAL_S, Scenario, initial_states

Floats = NDArray[np.float64]

#: Noise of each measured coordinate, m.
POSITION_SIGMA_M = 30.0
#: Initial sigmas of a filter: m and m/s.
START_SIGMAS = np.array([30.0, 30.0, 30.0, 10.0, 10.0, 3.0])
#: Maximum number of intervals of all flights held in memory, some 100 bytes each.
STEPS_MAX = 1_000_000
#: Fraction of a run left out of means, for a filter to settle.
SETTLING = 0.2


@dataclass(frozen=True, slots=True, eq=False)
class Flights:
    """Simulated flights and their measurements.

    Attributes
    ----------
    start : (runs, 6) ndarray
        True Cartesian state at time 0.
    guess : (runs, 6) ndarray
        Initial state of the filters.
    truth : (steps, runs, 6) ndarray
        True Cartesian states after each interval.
    measured : (steps, runs, 3) ndarray
        Measured positions.
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
    position_reported, velocity_reported : (steps,) ndarray
        Sums of the traces of the filter's covariance.
    nees : (steps,) ndarray
        NEES of position and velocity per dimension, summed.
    nees_by_run : (runs,) ndarray
        The same for each flight, averaged after settling.
    """

    position_squared: Floats
    velocity_squared: Floats
    position_reported: Floats
    velocity_reported: Floats
    nees: Floats
    nees_by_run: Floats

    def __add__(self, other: "Tracked") -> "Tracked":
        """Return the combined errors of flights of the same length."""
        return Tracked(
            self.position_squared + other.position_squared,
            self.velocity_squared + other.velocity_squared,
            self.position_reported + other.position_reported,
            self.velocity_reported + other.velocity_reported,
            self.nees + other.nees,
            np.concatenate([self.nees_by_run, other.nees_by_run]),
        )

    def means(self, sums: Floats) -> Floats:
        """Return (steps,) means over the flights of one of the sums."""
        return sums / len(self.nees_by_run)


def settled(values: Floats) -> Floats:
    """Return the rows, one per interval, after settling."""
    return values[int(SETTLING * len(values)) :]


def batches(runs: int, steps: int) -> list[Floats]:
    """Return the initial headings of all flights, in batches that fit into memory.

    Parameters
    ----------
    runs, steps : int
        Number of flights, and of intervals of each.

    Returns
    -------
    list of arrays
        In [0, 2π), evenly spaced over the circle; none along an axis for an even number.
    """
    every = 2.0 * np.pi * (np.arange(runs) + 0.5) / runs
    size = max(1, STEPS_MAX // steps)
    return [every[first : first + size] for first in range(0, runs, size)]


def fly(scenario: Scenario, headings_rad: Floats, steps: int, rng: np.random.Generator) -> Flights:
    """Simulate flights.

    Parameters
    ----------
    scenario : Scenario
        Their motion.
    headings_rad : (runs,) ndarray
        Their initial headings.
    steps : int
        Number of intervals.
    rng : Generator
        Random generator of motion, measurements and initial errors.

    Returns
    -------
    Flights
        Truth and measurements.

    References
    ----------
    Vasiliev, Mattis, equations (1) and (6), depending on the motion.
    """
    runs = len(headings_rad)
    first = initial_states(headings_rad)
    model = scenario.simulator(first)
    state = model.coordinates.from_cartesian(first)
    truth = np.empty((steps, runs, 6))
    for step in range(steps):
        state = model.step(state, INTERVAL_S, rng.normal(size=(runs, 3)))
        truth[step] = model.coordinates.to_cartesian(state)
    measured = truth[..., :3] + POSITION_SIGMA_M * rng.normal(size=(steps, runs, 3))
    return Flights(first, first + START_SIGMAS * rng.normal(size=first.shape), truth, measured)


def track(model: MotionModel, flights: Flights) -> Tracked:
    """Track all flights with one filter.

    Parameters
    ----------
    model : MotionModel
        Motion model of the filter.
    flights : Flights
        Measurements, and the truth for the errors.

    Returns
    -------
    Tracked
        Its errors, in Cartesian coordinates.

    References
    ----------
    Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
    Navigation", Wiley 2001, sections 5.4.2 (NEES) and 10.3 (the extended Kalman filter); Vasiliev,
    Mattis, equations (2), (5) and (7), for its motion.
    """
    steps, runs = flights.truth.shape[:2]
    sensor = MeasuredPosition(POSITION_SIGMA_M**2 * np.eye(3))
    prior = np.broadcast_to(np.diag(START_SIGMAS**2), (runs, 6, 6))
    estimate = start(flights.guess, prior, model.coordinates)
    squared, reported = np.empty((2, steps, runs, 2))
    nees = np.empty((steps, runs))
    for step, (truth, measured) in enumerate(zip(flights.truth, flights.measured, strict=True)):
        estimate = update(predict(estimate, model, INTERVAL_S), sensor, measured).estimate
        known = estimate.cartesian()
        error = known.mean - truth
        squared[step] = _by_part(error**2)
        reported[step] = _by_part(np.diagonal(known.covariance, axis1=-2, axis2=-1))
        scaled = np.linalg.solve(known.covariance, error[..., None])[..., 0]
        nees[step] = (error * scaled).sum(axis=-1) / 6.0
    position_squared, velocity_squared = squared.sum(axis=1).T
    position_reported, velocity_reported = reported.sum(axis=1).T
    return Tracked(
        position_squared,
        velocity_squared,
        position_reported,
        velocity_reported,
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
