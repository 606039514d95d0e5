"""The Rauch–Tung–Striebel smoother over all positions of many aircraft at once.

Constant velocity with white acceleration on each axis of the plane. The state of an aircraft is
(east, north, east velocity, north velocity).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.trajectories import Flags, Floats, Indices

#: Prior standard deviation of each component of the velocity, m/s.
_VELOCITY_PRIOR_MPS = 300.0
#: Normalised innovation squared of an outlier (two dimensions, 5 · 10⁻⁸).
_OUTLIER = 33.6
#: After this many consecutive outliers the next position is accepted.
_OUTLIERS_MAX = 3
#: Number of aircraft smoothed together, and of their steps in memory at once, 0.4 kB each.
_AIRCRAFT_MAX, _STEPS_MAX = 256, 262_144


@dataclass(frozen=True, slots=True, eq=False)
class Smoothed:
    """Smoothed states of aircraft at the times of their positions.

    Attributes
    ----------
    state : (n, 4) float64
        East, north, and their velocities; NaN for outliers.
    position_variance_m2 : (n,) float64
        Trace of the covariance of the position; NaN for outliers.
    used : (n,) bool
        False for outliers.
    position_covariance_m2 : (n, 2, 2) float64
        Covariance of the position; NaN for outliers.
    """

    state: Floats
    position_variance_m2: Floats
    used: Flags
    position_covariance_m2: Floats


@dataclass(frozen=True, slots=True, eq=False)
class PositionMeasurements:
    """Measured positions of aircraft.

    Attributes
    ----------
    aircraft : (n,) int64
        Index of the aircraft, ascending.
    time_s : (n,) float64
        Time, ascending within an aircraft.
    position_m : (n, 2) float64
        East and north.
    covariance_m2 : (n, 2, 2) float64
        Covariance of the errors.
    """

    aircraft: Indices
    time_s: Floats
    position_m: Floats
    covariance_m2: Floats

    def __len__(self) -> int:
        """Return the number of positions."""
        return len(self.time_s)

    def select(self, rows: Indices) -> "PositionMeasurements":
        """Return rows, in the given order."""
        return PositionMeasurements(
            self.aircraft[rows],
            self.time_s[rows],
            self.position_m[rows],
            self.covariance_m2[rows],
        )

    def backwards(self) -> "PositionMeasurements":
        """Return them with time reversed."""
        turned = self.select(np.arange(len(self))[::-1])
        return PositionMeasurements(
            -turned.aircraft, -turned.time_s, turned.position_m, turned.covariance_m2
        )


def smooth(measured: PositionMeasurements, density: float) -> Smoothed:
    """Smooth the positions of aircraft.

    Parameters
    ----------
    measured : PositionMeasurements
        Positions of all aircraft.
    density : float
        Spectral density of the acceleration on each axis, m²/s³.

    Returns
    -------
    Smoothed
        The exact mean given all positions without outliers, for linear motion.

    Notes
    -----
    An outlier is rejected by a gated filter both forwards and backwards in time: forwards alone it
    would accept an outlier as the first position.

    References
    ----------
    H. E. Rauch, F. Tung, C. T. Striebel, "Maximum likelihood estimates of linear dynamic systems",
    AIAA Journal 3 (1965) 1445-1450, equations (3.28) to (3.30).
    """
    count = len(measured)
    forwards = _run(measured, density, gated=True).used
    backwards = _run(measured.backwards(), density, gated=True).used[::-1]
    change = np.diff(measured.aircraft) != 0
    begins, ends = np.append(True, change)[:count], np.append(change, True)[-count:]
    used = (forwards & ~begins) | (backwards & ~ends) | (begins & ends)
    rows = np.flatnonzero(used)
    found = _run(measured.select(rows), density, gated=False)
    state, variance = np.full((count, 4), np.nan), np.full(count, np.nan)
    covariance = np.full((count, 2, 2), np.nan)
    state[rows], variance[rows] = found.state, found.position_variance_m2
    covariance[rows] = found.position_covariance_m2
    return Smoothed(state, variance, used, covariance)


def _run(measured: PositionMeasurements, density: float, *, gated: bool) -> Smoothed:
    count = len(measured)
    found = Smoothed(
        np.zeros((count, 4)), np.zeros(count), np.ones(count, np.bool_), np.zeros((count, 2, 2))
    )
    first = np.flatnonzero(np.append(True, np.diff(measured.aircraft) != 0)[:count])
    length = np.diff(np.append(first, count))
    for chosen in chunks(length, _AIRCRAFT_MAX, _STEPS_MAX):
        steps = np.arange(int(length[chosen].max()))
        # Padding: beyond its end an aircraft keeps its last position, without measuring it.
        row = first[chosen, None] + np.minimum(steps, length[chosen, None] - 1)
        _Chunk(measured, row, steps < length[chosen, None], density).run(found, gated=gated)
    return found


def chunks(length: Indices, aircraft_max: int, steps_max: int) -> Iterator[Indices]:
    """Divide aircraft into those that are smoothed together.

    Parameters
    ----------
    length : (k,) int64
        Number of positions of each aircraft.
    aircraft_max, steps_max : int
        Maximum number of aircraft together, and of their steps, padded to the longest; a longer
        aircraft is alone.

    Yields
    ------
    (j,) int64
        Indices of aircraft with similar numbers of positions: little padding.
    """
    order = np.argsort(length, kind="stable")
    begin = 0
    while begin < len(order):
        padded = np.arange(1, aircraft_max + 1)[: len(order) - begin]
        padded = padded * length[order[begin : begin + aircraft_max]]
        end = begin + max(int(np.count_nonzero(padded <= steps_max)), 1)
        yield order[begin:end]
        begin = end


class _Chunk:
    # Aircraft side by side: arrays (aircraft, step, …).
    def __init__(
        self, measured: PositionMeasurements, row: Indices, live: Flags, density: float
    ) -> None:
        self._row, self._live, self._density = row, live, density
        self._position = measured.position_m[row]
        self._noise = measured.covariance_m2[row]
        time_s = measured.time_s[row]
        self._step_s = np.diff(time_s, axis=1, prepend=time_s[:, :1])
        many, steps = row.shape
        self._mean, self._covariance = np.zeros((many, steps, 4)), np.zeros((many, steps, 4, 4))
        self._ahead_mean, self._ahead = np.zeros((many, steps, 4)), np.zeros((many, steps, 4, 4))
        self._used = np.zeros((many, steps), np.bool_)

    def run(self, found: Smoothed, *, gated: bool) -> None:
        self._filter(_OUTLIER if gated else np.inf)
        row, live = self._row[self._live], self._live
        found.used[row] = self._used[live]
        if gated:
            return
        self._smooth_back()
        found.state[row] = self._mean[live]
        variance = self._covariance[live]
        found.position_variance_m2[row] = variance[:, 0, 0] + variance[:, 1, 1]
        found.position_covariance_m2[row] = variance[:, :2, :2]

    def _filter(self, outlier: float) -> None:
        many, steps = self._row.shape
        self._mean[:, 0, :2] = self._position[:, 0]
        self._covariance[:, 0, :2, :2] = self._noise[:, 0]
        self._covariance[:, 0, 2:, 2:] = _VELOCITY_PRIOR_MPS**2 * np.eye(2)
        self._used[:, 0] = True
        rejected = np.zeros(many, np.int64)
        for step in range(1, steps):
            motion, noise = _motion(self._step_s[:, step], self._density)
            mean = np.einsum("aij,aj->ai", motion, self._mean[:, step - 1])
            spread = motion @ self._covariance[:, step - 1] @ motion.transpose(0, 2, 1) + noise
            self._ahead_mean[:, step], self._ahead[:, step] = mean, spread
            innovation = self._position[:, step] - mean[:, :2]
            total = spread[:, :2, :2] + self._noise[:, step]
            weighed = np.linalg.solve(total, innovation[..., None])[..., 0]
            near = np.einsum("ai,ai->a", innovation, weighed) <= outlier
            accepted = self._live[:, step] & (near | (rejected >= _OUTLIERS_MAX))
            rejected = np.where(accepted, 0, rejected + 1)
            gain = np.linalg.solve(total, spread[:, :2, :]).transpose(0, 2, 1)
            gain *= accepted[:, None, None]
            self._mean[:, step] = mean + np.einsum("aij,aj->ai", gain, innovation)
            self._covariance[:, step] = _symmetric(spread - gain @ spread[:, :2, :])
            self._used[:, step] = accepted

    def _smooth_back(self) -> None:
        for step in range(self._row.shape[1] - 2, -1, -1):
            motion, _ = _motion(self._step_s[:, step + 1], self._density)
            # Rauch et al. (1965): G = P Fᵀ P(k+1|k)⁻¹.
            back = np.linalg.solve(self._ahead[:, step + 1], motion @ self._covariance[:, step])
            back = back.transpose(0, 2, 1)
            later = self._mean[:, step + 1] - self._ahead_mean[:, step + 1]
            self._mean[:, step] += np.einsum("aij,aj->ai", back, later)
            change = self._covariance[:, step + 1] - self._ahead[:, step + 1]
            self._covariance[:, step] += _symmetric(back @ change @ back.transpose(0, 2, 1))


# Rounding errors of asymmetry grow over hundreds of steps.
def _symmetric(matrix: Floats) -> Floats:
    half: Floats = 0.5 * (matrix + matrix.transpose(0, 2, 1))
    return half


def _motion(step_s: Floats, density: float) -> tuple[Floats, Floats]:
    motion = np.tile(np.eye(4), (len(step_s), 1, 1))
    noise = np.zeros((len(step_s), 4, 4))
    for axis in (0, 1):
        motion[:, axis, axis + 2] = step_s
        noise[:, axis, axis] = density * step_s**3 / 3.0
        noise[:, axis, axis + 2] = noise[:, axis + 2, axis] = density * step_s**2 / 2.0
        noise[:, axis + 2, axis + 2] = density * step_s
    return motion, noise
