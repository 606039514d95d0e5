"""What each motion model is worth in a filter: errors, and whether the filter knows them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from multiradar.estimation.filters.extended import Outcome, predict, start, update
from multiradar.estimation.filters.extended_measurement import MeasuredPlace
from multiradar.estimation.motion.model import MotionModel
from multiradar.studies.coupled_motion_models import INTERVAL_S, Scenario, initial_states

Floats = NDArray[np.float64]

#: Noise of each measured coordinate, m.
PLACE_SIGMA_M = 30.0
#: How well a filter knows the state at the start: m and m/s.
START_SIGMAS = np.array([30.0, 30.0, 30.0, 10.0, 10.0, 3.0])
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
    """Errors of a filter over the flights, (steps, runs) each.

    Attributes
    ----------
    position_squared, velocity_squared : ndarray
        Squared lengths of the errors, m² and (m/s)².
    position_claimed, velocity_claimed : ndarray
        What the filter expects of them: traces of its covariance.
    nees : ndarray
        Normalised estimation error squared of position and velocity, divided by 6.
    """

    position_squared: Floats
    velocity_squared: Floats
    position_claimed: Floats
    velocity_claimed: Floats
    nees: Floats

    def settled(self, values: Floats) -> Floats:
        """Return the rows after the filter has settled."""
        return values[int(SETTLING * len(values)) :]


def fly(scenario: Scenario, runs: int, steps: int, rng: np.random.Generator) -> Flights:
    """Simulate flights with `headings` spread evenly over the circle.

    Parameters
    ----------
    scenario : Scenario
        How they move.
    runs, steps : int
        How many, and how many intervals long.
    rng : Generator
        Draws of motion, measurement and start.

    Returns
    -------
    Flights
        Truth and measurements.
    """
    first = initial_states(headings(runs))
    model = scenario.simulator(first)
    state = model.coordinates.from_cartesian(first)
    truth = np.empty((steps, runs, 6))
    for step in range(steps):
        state = model.step(state, INTERVAL_S, rng.normal(size=(runs, 3)))
        truth[step] = model.coordinates.to_cartesian(state)
    measured = truth[..., :3] + PLACE_SIGMA_M * rng.normal(size=(steps, runs, 3))
    return Flights(first, first + START_SIGMAS * rng.normal(size=first.shape), truth, measured)


def headings(runs: int) -> Floats:
    """Return (runs,) initial headings in [0, 2π), none of them along an axis for an even number."""
    return np.asarray(2.0 * np.pi * (np.arange(runs) + 0.5) / runs)


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
    """
    steps, runs = flights.truth.shape[:2]
    place = MeasuredPlace(PLACE_SIGMA_M**2 * np.eye(3))
    prior = np.broadcast_to(np.diag(START_SIGMAS**2), (runs, 6, 6))
    estimate = start(flights.guess, prior, model.coordinates)
    result = Tracked(*np.empty((5, steps, runs)))
    for step, (truth, measured) in enumerate(zip(flights.truth, flights.measured, strict=True)):
        found = update(predict(estimate, model, INTERVAL_S), place, measured)
        assert (found.outcome == Outcome.UPDATED).all(), "a place is never refused"
        estimate = found.estimate
        known = estimate.cartesian()
        error = known.mean - truth
        variances = np.diagonal(known.covariance, axis1=-2, axis2=-1)
        result.position_squared[step] = (error[:, :3] ** 2).sum(axis=-1)
        result.velocity_squared[step] = (error[:, 3:] ** 2).sum(axis=-1)
        result.position_claimed[step] = variances[:, :3].sum(axis=-1)
        result.velocity_claimed[step] = variances[:, 3:].sum(axis=-1)
        scaled = np.linalg.solve(known.covariance, error[..., None])[..., 0]
        result.nees[step] = (error * scaled).sum(axis=-1) / 6.0
    return result


def nees_band(runs: int) -> tuple[float, float]:
    """Return the 95 % band of the mean over runs of NEES / 6 at one time."""
    low, high = chi2.ppf([0.025, 0.975], 6 * runs) / (6 * runs)
    return float(low), float(high)
