"""Compiled checks of young tracks: implausible velocities, and false first plots.

Symbols as in `multiradar.tracking.association._association_kernels`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.filters._kernels import NONE
from multiradar.estimation.filters.arrays import Aircraft, Rows
from multiradar.estimation.measurement.kinds import KIND_RADAR
from multiradar.tracking.association._grid_kernels import COARSE_SIGMAS, NEAR_COLUMN
from multiradar.tracking.association.track_grid import Candidates, PlotPosition, TrackGrid
from multiradar.tracking.lifecycle.lifecycle import (
    TENTATIVE,
    USUAL_SPEED,
    YOUNG_HITS,
    Lifecycle,
)
from multiradar_compiled.kernels import in_loop, kernel

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Softness of the usual maximum speed, m/s, and minimum log likelihood above it.
USUAL_SPEED_SIGMA = 50.0
LOG_FAST_MIN = -5.0
# Standard deviation of the velocity components of a new aircraft, m/s.
SPEED_SIGMA = 200.0
# Minimum time for a speed estimate, s.
SHORT_S = 0.5
# Log probability that the velocity of a young track is wrong.
LOG_REINITIALISED = -4.0
# Maximum search radius of two plots of one window that initiate one track, m.
TWIN_REACH_M = 3_000.0


@in_loop
def is_young(k: int, life: Lifecycle) -> bool:
    """Return whether the velocity of a track may be based on a false plot."""
    young: bool = life.stage[k] == TENTATIVE and life.hits[k] <= YOUNG_HITS
    return young


@in_loop
def slack_of(k: int, reach: float, grid: TrackGrid) -> float:
    """Return the position uncertainty, m, of a plot and of the last plot of a track."""
    near = grid.state[k, NEAR_COLUMN]
    return 0.5 * math.sqrt(reach * reach + near * near)


@in_loop
def log_of_speed(flown: float, since: float) -> float:
    """Return the log likelihood of the speed of a flight."""
    fast = (flown / max(since, SHORT_S) - USUAL_SPEED) / USUAL_SPEED_SIGMA
    return max(-0.5 * fast * fast, LOG_FAST_MIN) if fast > 0.0 else 0.0


@in_loop
def log_reinitialised(
    row: int, k: int, ahead: float, position: PlotPosition, rows: Rows, aircraft: Aircraft,
    grid: TrackGrid, log_clutter: float,
) -> float:  # fmt: skip
    """Return the score of a plot if only the last plot of the track was of the aircraft."""
    since = rows.time[row] - aircraft.updated[k]
    reach = position.reach
    # Back to the position of that plot.
    d0 = position.east - grid.state[k, 0] + (since - ahead) * grid.state[k, 2]
    d1 = position.north - grid.state[k, 1] + (since - ahead) * grid.state[k, 3]
    near = grid.state[k, NEAR_COLUMN]
    spread = (reach * reach + near * near) / (2.0 * COARSE_SIGMAS * COARSE_SIGMAS)
    spread += SPEED_SIGMA * SPEED_SIGMA * since * since
    score: float = -0.5 * (d0 * d0 + d1 * d1) / spread - math.log(2.0 * math.pi * spread)
    score += log_of_speed(math.hypot(d0, d1) - slack_of(k, reach, grid), since)
    # From the density on the ground to that in measurement coordinates.
    around = math.log(max(rows.z[row, 0], 1.0)) if rows.kind[row] == KIND_RADAR else 0.0
    return score + around - log_clutter + LOG_REINITIALISED


@kernel
def reset_velocity(k: int, speed_variance: float, aircraft: Aircraft, life: Lifecycle) -> None:
    """Reinitialise a tentative track with its last plot, at `Aircraft.updated`."""
    since = aircraft.time[k] - aircraft.updated[k]
    V = aircraft.sensitivity[k]
    for i in range(2):
        aircraft.mean[k, i] -= since * aircraft.mean[k, i + 2]
        aircraft.mean[k, i + 2] = 0.0
        for c in range(V.shape[1]):
            V[i, c] -= since * V[i + 2, c]
            V[i + 2, c] = 0.0
    P = aircraft.covariance[k]
    # The variance added by a rejected plot is kept: it is small and conservative.
    P[2] = 0.0
    P[3] = 0.0
    P[5] = 0.0
    P[6] = 0.0
    P[8] = 0.0
    P[7] = speed_variance
    P[9] = speed_variance
    aircraft.time[k] = aircraft.updated[k]
    aircraft.velocity[k] = np.nan
    aircraft.fading_nis[k] = 1.0
    if aircraft.mode_probability.shape[1] > 0:
        # All modes get the single state again.
        aircraft.mode_probability[k, 0] = np.nan
    life.hits[k] = 1
    life.score[k] = 0.0
    life.born[k] = aircraft.updated[k]
    # Its first plot remains counted as false.
    life.first_sensor[k] = NONE
    for s in range(life.last_seen.shape[1]):
        if life.last_seen[k, s] < aircraft.updated[k]:
            life.last_seen[k, s] = -np.inf


@kernel
def score_of_twin(i: int, j: int, candidates: Candidates, log_density: float) -> float:
    """Return the score of two plots of one window, by two sensors, as one new track.

    ``log_density`` is that of false plots on the ground, 1/m². −∞ where neither position is known
    well enough.
    """
    reach, other = candidates.position[i, 2], candidates.position[j, 2]
    if max(reach, other) > TWIN_REACH_M:
        return -np.inf
    d0 = candidates.position[i, 0] - candidates.position[j, 0]
    d1 = candidates.position[i, 1] - candidates.position[j, 1]
    spread = (reach * reach + other * other) / (2.0 * COARSE_SIGMAS * COARSE_SIGMAS)
    score: float = -0.5 * (d0 * d0 + d1 * d1) / spread - math.log(2.0 * math.pi * spread)
    return score - log_density
