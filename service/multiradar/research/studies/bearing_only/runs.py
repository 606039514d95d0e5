"""Scenarios of the bearing-only study, and the filters that it compares.

The paper does not give a geometry. Here three sources stand some 40 km apart and measure an
aircraft 60 to 120 km away, each with its own scan.

References
----------
Nenartovich, Isakov, the section on the simulation: the usual scheme of comparison computes a
position from the angles first. It is not specified; two versions are the project's own.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters.bearings_only import BearingsState, initiate, predict, update
from multiradar.estimation.measurement.sights import Sight

Floats = NDArray[np.float64]

#: Schemes: angles one by one, angles as simultaneous position fixes, extrapolated to one time.
BEARINGS, POSITION_FIXES, EXTRAPOLATED = "bearings", "places", "places led on"
#: Names of the schemes in tables and plots.
SCHEME_LABELS = {
    BEARINGS: "bearings",
    POSITION_FIXES: "position fixes",
    EXTRAPOLATED: "extrapolated position fixes",
}
PERIOD_S = 5.0
#: White acceleration of the aircraft, m²/s³, known to the filters.
DENSITY = 0.05
SPEED_MPS = 220.0
SPEED_SIGMA_MPS = 300.0
AZIMUTH_SIGMA_RAD = float(np.radians(0.2))
ELEVATION_SIGMA_RAD = float(np.radians(0.2))
RANGE_SIGMA_M = 100.0
DURATION_S = 180.0
#: Errors count from this time on, s: before it is the initiation.
SETTLED_S = 60.0

SITES_M = np.array([[0.0, 0.0, 0.0], [40e3, -5e3, 100.0], [15e3, -30e3, 50.0]])
START_M = np.array([-10e3, 80e3, 9000.0])
VELOCITY_MPS = SPEED_MPS * np.array([np.cos(0.3), -np.sin(0.3), 0.0])


class Scenario(NamedTuple):
    """Geometry and detection pattern of a scenario.

    Attributes
    ----------
    name : str
        Name, see `SCENARIOS`.
    purpose : str
        Description.
    phases_s : tuple of float
        Time of each source within a scan, s.
    dimensions : int
        2 or 3; in space elevations are measured as well.
    source_speed_mps : float
        Speed of the sources, to the east.
    ranging : tuple of int
        Sources that also measure the range.
    detection_probability : float
        Probability of detection, from the third scan on.
    """

    name: str
    purpose: str
    phases_s: tuple[float, ...] = (0.0, 1.7, 3.3)
    dimensions: int = 2
    source_speed_mps: float = 0.0
    ranging: tuple[int, ...] = ()
    detection_probability: float = 1.0


SCENARIOS = (
    Scenario("turning", "three sensors with staggered scans"),
    Scenario("two", "two sensors with staggered scans", (0.0, 2.5)),
    Scenario("at once", "three sensors with simultaneous scans", (0.0, 0.0, 0.0)),
    Scenario("moving", "three sensors moving at 150 m/s", source_speed_mps=150.0),
    Scenario("space", "three sensors that also measure elevation", dimensions=3),
    Scenario("jammed", "one radar measuring range, two jammed radars", ranging=(0,)),
    Scenario(
        "missed",
        "three sensors with a probability of detection of 0.5",
        detection_probability=0.5,
    ),
)


@dataclass(frozen=True, slots=True, eq=False)
class Bearings:
    """Bearings of many runs at once, sorted by time.

    Attributes
    ----------
    times_s : (n,) float64
        Measurement times.
    sights : list of Sight
        Measurements, (runs,) angles each.
    scan, source : (n,) int64
        Scan number, and index of the source.
    truth : (n, runs, 2 d) float64
        State of the aircraft at each measurement.
    """

    times_s: Floats
    sights: list[Sight]
    scan: NDArray[np.int64]
    source: NDArray[np.int64]
    truth: Floats


class Filtered(NamedTuple):
    """Estimates at the end of each scan.

    Attributes
    ----------
    error : (k, runs, 2 d) float64
        Estimate minus truth.
    covariance : (k, runs, 2 d, 2 d) float64
        Covariance of the filter.
    time_s : (k,) float64
        Estimation times.
    crossing : (k, runs) float64
        Crossing of the lines of sight in units of their errors; NaN where not computed.
    """

    error: Floats
    covariance: Floats
    time_s: Floats
    crossing: Floats


def simulate_bearings(
    scenario: Scenario, runs: int, duration_s: float, rng: np.random.Generator
) -> Bearings:
    """Simulate flights and their measurements.

    Parameters
    ----------
    scenario : Scenario
        The scenario.
    runs : int
        Number of runs.
    duration_s : float
        Duration, s.
    rng : Generator
        Draws accelerations and errors.

    Returns
    -------
    Bearings
        All measurements.

    References
    ----------
    Nenartovich, Isakov, equations (2) to (4).
    """
    d = scenario.dimensions
    scans = int(duration_s / PERIOD_S)
    order = sorted(range(len(scenario.phases_s)), key=lambda one: scenario.phases_s[one])
    state = np.tile(np.r_[START_M[:d], VELOCITY_MPS[:d]], (runs, 1))
    now, times, sights, scan, sources, truth = 0.0, [], [], [], [], []
    for number in range(scans):
        for source in order:
            # One detection pattern for all runs; the first two scans initiate the track.
            if (
                scenario.detection_probability < 1.0
                and number > 1
                and rng.random() > scenario.detection_probability
            ):
                continue
            time = number * PERIOD_S + scenario.phases_s[source]
            state = _flown(state, time - now, rng)
            now = time
            times.append(time)
            scan.append(number)
            sources.append(source)
            truth.append(state)
            sights.append(_sight(scenario, source, time, state[:, :d], rng))
    return Bearings(np.array(times), sights, np.array(scan), np.array(sources), np.array(truth))


def fused(bearings: Bearings) -> Filtered:
    """Track with each angle as it arrives, in information form.

    Parameters
    ----------
    bearings : Bearings
        All measurements.

    Returns
    -------
    Filtered
        At the last angle of each scan.

    References
    ----------
    Nenartovich, Isakov, equations (6) and (11).
    """
    first = int((bearings.scan <= 1).sum())
    state = initiate(bearings.sights[:first], bearings.times_s[:first], SPEED_SIGMA_MPS)
    found = [(first - 1, state)]
    for index in range(first, len(bearings.sights)):
        state = update(
            predict(state, float(bearings.times_s[index]), DENSITY), bearings.sights[index]
        )
        found.append((index, state))
    return collected(bearings, found)


def _flown(state: Floats, interval_s: float, rng: np.random.Generator) -> Floats:
    d = state.shape[-1] // 2
    shape = (*state.shape[:-1], d)
    draw = rng.standard_normal(shape), rng.standard_normal(shape)
    position, velocity = state[..., :d], state[..., d:]
    gain = np.sqrt(DENSITY * interval_s)
    # White acceleration over the interval: velocity, and the correlated position.
    noise_v = gain * draw[0]
    noise_p = 0.5 * interval_s * noise_v + gain * interval_s / np.sqrt(12.0) * draw[1]
    moved = position + interval_s * velocity + noise_p
    return np.asarray(np.concatenate([moved, velocity + noise_v], axis=-1))


def _sight(
    scenario: Scenario, source: int, time_s: float, position: Floats, rng: np.random.Generator
) -> Sight:
    d = scenario.dimensions
    site = SITES_M[source, :d].copy()
    site[0] += scenario.source_speed_mps * time_s
    line = position - site
    ground = np.hypot(line[:, 0], line[:, 1])
    azimuth = np.arctan2(line[:, 0], line[:, 1])
    azimuth = azimuth + AZIMUTH_SIGMA_RAD * rng.standard_normal(len(ground))
    elevation, distance = None, None
    if d > 2:
        elevation = np.arctan2(line[:, 2], ground)
        elevation = elevation + ELEVATION_SIGMA_RAD * rng.standard_normal(len(ground))
    if source in scenario.ranging:
        distance = np.linalg.norm(line, axis=-1) + RANGE_SIGMA_M * rng.standard_normal(len(ground))
    return Sight(
        site, azimuth, AZIMUTH_SIGMA_RAD, elevation,
        None if elevation is None else ELEVATION_SIGMA_RAD, distance,
        None if distance is None else RANGE_SIGMA_M,
    )  # fmt: skip


def collected(bearings: Bearings, found: list[tuple[int, BearingsState]]) -> Filtered:
    """Return the states at the end of each scan, with the row of the measurement of each."""
    ends = set((np.flatnonzero(np.diff(bearings.scan, append=bearings.scan[-1] + 1))).tolist())
    chosen = [(index, state) for index, state in found if index in ends]
    estimates = [state.estimate() for _, state in chosen]
    indices = [index for index, _ in chosen]
    return Filtered(
        np.array([mean for mean, _ in estimates]) - bearings.truth[indices],
        np.array([covariance for _, covariance in estimates]),
        bearings.times_s[indices],
        np.array([state.crossing_strength for _, state in chosen]),
    )
