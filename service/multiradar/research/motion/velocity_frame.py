"""Vasiliev and Mattis, (3)-(5): speed, course and climb angle as random walks.

The parameters belong to the kind of aircraft and do not depend on the directions of the axes. The
model serves as a simulator, `VelocityFrame.step`, and as the nonlinear model of a filter with the
state (east, north, up, V, K, φ).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from multiradar.estimation.array_checks import component_array
from multiradar.estimation.motion.axes import STATE_SIZE, Floats, canonical_frame, frame_to_velocity
from multiradar.estimation.motion.coordinates import (
    VELOCITY_FRAME,
    frame_jacobian,
    frame_transition,
)
from multiradar.estimation.motion.inputs import forward_interval, require_not_negative


@dataclass(frozen=True, slots=True)
class VelocityFrame:
    """Motion with random walks of speed, course and climb angle.

    Attributes
    ----------
    acceleration_mps2 : float
        a, standard deviation of the acceleration along the velocity, m/s².
    turn_rate_rad_per_s : float
        v_K, standard deviation of the rate of the course, rad/s.
    climb_rate_rad_per_s : float
        v_φ, standard deviation of the rate of the climb angle, rad/s; with 0 an aircraft in level
        flight stays level.

    Raises
    ------
    MotionParameterError
        A parameter is negative or not finite.

    Notes
    -----
    Acceleration and rates are constant over an interval and independent between intervals, as
    published: two half intervals add half the variance of one. The parameters are specific to the
    interval.

    References
    ----------
    Vasiliev, Mattis, equations (3), (4) and (5). What the text calls "equation (17)" is (3).
    """

    acceleration_mps2: float
    turn_rate_rad_per_s: float
    climb_rate_rad_per_s: float = 0.0

    coordinates = VELOCITY_FRAME
    transition = staticmethod(frame_transition)
    jacobian = staticmethod(frame_jacobian)

    def __post_init__(self) -> None:
        require_not_negative(self.acceleration_mps2, "acceleration")
        require_not_negative(self.turn_rate_rad_per_s, "turn rate")
        require_not_negative(self.climb_rate_rad_per_s, "climb rate")

    def _spreads(self) -> Floats:
        return np.array(
            [self.acceleration_mps2, self.turn_rate_rad_per_s, self.climb_rate_rad_per_s]
        )

    def step(self, state: ArrayLike, interval_s: float, draws: ArrayLike) -> Floats:
        """Advance aircraft by one interval, equation (5).

        Returns
        -------
        (..., 6) ndarray
            The new state, canonical (see `axes`: continuous where V crosses 0 or φ leaves its
            range). The position uses the old velocity.

        References
        ----------
        Vasiliev, Mattis, equation (5).
        """
        interval = forward_interval(interval_s)
        values = component_array(state, "state", STATE_SIZE)
        numbers = component_array(draws, "draws", 3)
        position = values[..., :3] + interval * frame_to_velocity(values[..., 3:])  # (5)
        frame = values[..., 3:] + interval * self._spreads() * numbers  # (4)
        parts = np.broadcast_arrays(position, canonical_frame(frame)[0])
        return np.concatenate(parts, axis=-1)

    def noise(self, state: ArrayLike, interval_s: float) -> Floats:
        """Return the process noise covariance of an interval, the same for every state.

        Returns
        -------
        (..., 6, 6) ndarray
            diag(0, 0, 0, a²T², v_K²T², v_φ²T²).

        References
        ----------
        Vasiliev, Mattis, the text after equation (4): ϑ squared, with ϑ = diag(a T, v_K T, v_φ T).
        """
        values = component_array(state, "state", STATE_SIZE)
        result = np.zeros((*values.shape, STATE_SIZE))
        result[..., [3, 4, 5], [3, 4, 5]] = (
            forward_interval(interval_s) * self._spreads()
        ) ** 2  # (4)
        return result
