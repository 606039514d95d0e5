"""Vasiliev and Mattis, the text after (2): a random walk of velocity, relative to the initial one.

The state is Cartesian, (east, north, up, v_east, v_north, v_up). The model serves as a simulator,
`RelativeSpeed.step`, and as the linear model of a filter.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from multiradar.estimation.motion.axes import Floats
from multiradar.estimation.motion.coordinates import (
    CARTESIAN,
    cartesian_jacobian,
    cartesian_transition,
)
from multiradar.estimation.motion.inputs import axis_parameters, forward_interval, require_positive
from multiradar.research.motion.cartesian_acceleration import advance_with_noise, velocity_noise

#: T_np, the paper's example of the reference time of γ, s.
REFERENCE_TIME_S = 1000.0


@dataclass(frozen=True, slots=True)
class RelativeSpeed:
    """Motion whose velocity changes, along each axis, by a fraction of its initial value.

    Attributes
    ----------
    initial_speed_mps : tuple of three floats
        |v_xo|, |v_yo|, |v_zo|: initial speed along east, north and up, m/s, not negative.
    relative_change : tuple of three floats
        γ_x, γ_y, γ_z: standard deviation of the change of velocity over T_np, as a fraction of the
        initial speed along the axis; 0.01 is one per cent.
    reference_time_s : float
        T_np, s, above 0.

    Raises
    ------
    ShapeError
        Not three speeds or fractions.
    MotionParameterError
        A speed or fraction is negative, T_np is not above 0, or one is not finite.

    Notes
    -----
    The change over an interval T has σ = γ |v_o| √(T / T_np), so that variances of successive
    intervals add up. *An initial speed of 0 along an axis gives no noise there*: that velocity
    component stays constant, and its variance in a filter shrinks towards 0. This follows the
    published formula, which depends on the axes and not on the aircraft: flying due north nothing
    changes across the track, flying north-east both components do. For noise independent of the
    heading give the whole speed for each axis.

    References
    ----------
    Vasiliev, Mattis, the text after equation (2).
    """

    initial_speed_mps: tuple[float, float, float]
    relative_change: tuple[float, float, float]
    reference_time_s: float = REFERENCE_TIME_S

    coordinates = CARTESIAN
    transition = staticmethod(cartesian_transition)
    jacobian = staticmethod(cartesian_jacobian)

    def __post_init__(self) -> None:
        speeds = axis_parameters(self.initial_speed_mps, "initial speed")
        object.__setattr__(self, "initial_speed_mps", speeds)
        changes = axis_parameters(self.relative_change, "relative change")
        object.__setattr__(self, "relative_change", changes)
        require_positive(self.reference_time_s, "reference time")

    def step(self, state: ArrayLike, interval_s: float, draws: ArrayLike) -> Floats:
        """Advance aircraft by one interval.

        Returns
        -------
        (..., 6) ndarray
            The new state; the position uses the old velocity.

        References
        ----------
        Vasiliev, Mattis, the text after equation (2): v_xi = v_x(i−1) + γ_x σ_xi ξ_xi.
        """
        return advance_with_noise(state, interval_s, self.velocity_sigmas(interval_s), draws)

    def noise(self, state: ArrayLike, interval_s: float) -> Floats:
        """Return the process noise covariance of an interval, the same for every state.

        Returns
        -------
        (..., 6, 6) ndarray
            diag(0, 0, 0, γ_x²σ_x², γ_y²σ_y², γ_z²σ_z²) with σ_x² = v_xo² T / T_np.

        References
        ----------
        Vasiliev, Mattis, the text after equation (2): ϑ ϑᵀ of (1) with its σ.
        """
        return velocity_noise(state, self.velocity_sigmas(interval_s))

    def velocity_sigmas(self, interval_s: float) -> Floats:
        """Return (3,) γ_x σ_x, γ_y σ_y, γ_z σ_z, m/s.

        Parameters
        ----------
        interval_s : float
            T, s, not negative.

        Returns
        -------
        (3,) ndarray
            East, north and up, m/s.

        Raises
        ------
        TimeOrderError
            If the interval is negative or not finite.

        References
        ----------
        Vasiliev, Mattis, the text after equation (2): σ_xi² = v_xo² T_i / T_np.
        """
        speeds = np.array(self.initial_speed_mps)
        share = np.sqrt(forward_interval(interval_s) / self.reference_time_s)
        return np.asarray(np.array(self.relative_change) * speeds * share)
