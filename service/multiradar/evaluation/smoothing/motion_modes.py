"""Motion modes of the interacting-multiple-model smoother: straight, turning, changing speed.

Independent of the tracker's models, which the scorecard must not use. Arrays are of many aircraft
at once: (aircraft, mode, …); the state is (east, north, east velocity, north velocity).
"""

from dataclasses import dataclass

import numpy as np

from multiradar.evaluation.trajectories import Floats

GRAVITY_MPS2 = 9.80665
#: Below this speed an aircraft has no course, m/s.
SLOW_MPS = 10.0


@dataclass(frozen=True, slots=True, eq=False)
class MotionModes:
    """Modes of motion; all transitions go through the first, straight flight.

    Attributes
    ----------
    lateral_mps2 : (j,) float64
        Acceleration across the velocity, right positive.
    along, across : (j,) float64
        Spectral densities of the acceleration along the velocity and across it, m²/s³.
    straight_s, manoeuvre_s : float
        Mean duration of straight flight and of a manoeuvre.
    """

    lateral_mps2: Floats
    along: Floats
    across: Floats
    straight_s: float
    manoeuvre_s: float

    def __len__(self) -> int:
        """Return the number of modes."""
        return len(self.lateral_mps2)

    def transition_probabilities(self, step_s: Floats) -> Floats:
        """Return (a, j, j) transition probabilities over a time: from mode, to mode.

        Parameters
        ----------
        step_s : (a,) float64
            The time, s.
        """
        arms = len(self) - 1
        leave, back = 1.0 / self.straight_s, 1.0 / self.manoeuvre_s
        stays = np.exp(-back * step_s)
        turned = (1.0 - np.exp(-(leave + back) * step_s)) / (leave + back)
        to_hub, to_arm = back * turned, leave * turned / arms
        other = np.maximum(0.0, 1.0 - to_hub - stays) / arms
        probabilities: Floats = np.repeat(other, (arms + 1) ** 2).reshape(-1, arms + 1, arms + 1)
        probabilities[:, :, 0] = to_hub[:, None]
        probabilities[:, 0, :] = to_arm[:, None]
        probabilities[:, 0, 0] = 1.0 - arms * to_arm
        held = np.arange(1, arms + 1)
        probabilities[:, held, held] += stays[:, None]
        return probabilities

    def motion(self, step_s: Floats, velocity: Floats, variance: Floats) -> Floats:
        """Return (a, j, 4, 4) the transition matrices over a time.

        Parameters
        ----------
        step_s : (a,) float64
            The time, s.
        velocity : (a, j, 2) float64
            At its start, m/s.
        variance : (a, j) float64
            Sum of the variances of its components: an uncertain speed reduces the turn rate.
        """
        speed = np.hypot(velocity[..., 0], velocity[..., 1])
        rate = self.lateral_mps2 * speed / np.maximum(speed**2 + variance, SLOW_MPS**2)
        step = step_s[:, None]
        angle = rate * step
        turns = np.abs(angle) > 1e-6
        safe = np.where(turns, rate, 1.0)
        ahead = np.where(turns, np.sin(angle) / safe, step)
        aside = np.where(turns, (1.0 - np.cos(angle)) / safe, 0.0)
        matrix = np.zeros((*rate.shape, 4, 4))
        matrix[..., [0, 1], [0, 1]] = 1.0
        for first, part, cross in ((0, ahead, aside), (2, np.cos(angle), np.sin(angle))):
            matrix[..., first, 2] = matrix[..., first + 1, 3] = part
            matrix[..., first, 3], matrix[..., first + 1, 2] = cross, -cross
        return matrix

    def noise(self, step_s: Floats, velocity: Floats, more: Floats) -> Floats:
        """Return (a, j, 4, 4) the process noise covariances over a time.

        Parameters
        ----------
        step_s : (a,) float64
            The time, s.
        velocity : (a, j, 2) float64
            In the middle of the step, m/s: the accelerations are along and across it.
        more : (a,) float64
            Density added in every direction, m²/s³.
        """
        speed = np.hypot(velocity[..., 0], velocity[..., 1])
        unit = velocity / np.maximum(speed, SLOW_MPS)[..., None]
        # At rest the noise is the same in every direction.
        rest = 0.5 * (self.along + self.across) * (1.0 - np.sum(unit**2, axis=-1))
        right = np.stack([unit[..., 1], -unit[..., 0]], axis=-1)
        density = (rest + more[:, None])[..., None, None] * np.eye(2)
        for size, axis in ((self.along, unit), (self.across, right)):
            density = density + size[:, None, None] * axis[..., :, None] * axis[..., None, :]
        step = step_s[:, None, None, None]
        noise = np.zeros((*speed.shape, 4, 4))
        noise[..., :2, :2] = step**3 / 3.0 * density
        noise[..., :2, 2:] = noise[..., 2:, :2] = step**2 / 2.0 * density
        noise[..., 2:, 2:] = step * density
        return noise


def civil_modes() -> MotionModes:
    """Return modes that fit civil traffic.

    Returns
    -------
    MotionModes
        Straight flight, turns to both sides with 13°, 19° and 25° of bank, and a change of speed.
    """
    steepest = GRAVITY_MPS2 * np.tan(np.radians(25.0))
    sides = np.array([0.5, -0.5, 0.75, -0.75, 1.0, -1.0])
    return MotionModes(
        lateral_mps2=np.array([0.0, *(steepest * sides), 0.0]),
        along=np.array([0.01] * 7 + [20.0]),
        across=np.array([0.01, 2.0, 2.0, 2.0, 2.0, 8.0, 8.0, 0.01]),
        straight_s=45.0,
        manoeuvre_s=120.0,
    )
