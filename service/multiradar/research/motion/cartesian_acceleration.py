"""Vasiliev and Mattis, (1) and (2): a random acceleration along each axis.

The state is Cartesian, (east, north, up, v_east, v_north, v_up). The model serves as a simulator,
`CartesianAcceleration.step`, and as the linear model of a filter.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from multiradar.estimation.array_checks import component_array
from multiradar.estimation.motion.axes import STATE_SIZE, Floats
from multiradar.estimation.motion.coordinates import (
    CARTESIAN,
    cartesian_jacobian,
    cartesian_transition,
)
from multiradar.estimation.motion.inputs import axis_parameters, forward_interval


@dataclass(frozen=True, slots=True)
class CartesianAcceleration:
    """Motion with an acceleration that is constant over an interval, along each axis.

    Attributes
    ----------
    acceleration_mps2 : tuple of three floats
        a_x, a_y, a_z: standard deviations of the acceleration east, north and up, m/s².

    Raises
    ------
    Not three values.
        There are not three.
    One is negative or not finite.
        One is negative or no finite number.

    Notes
    -----
    As published, the acceleration changes the velocity only: the position uses the old velocity,
    and Q has rank three at most. Two half intervals add half the variance of one: the parameters
    are specific to the interval.

    References
    ----------
    Vasiliev, Mattis, equations (1) and (2).
    """

    acceleration_mps2: tuple[float, float, float]

    coordinates = CARTESIAN
    transition = staticmethod(cartesian_transition)
    jacobian = staticmethod(cartesian_jacobian)

    def __post_init__(self) -> None:
        checked = axis_parameters(self.acceleration_mps2, "acceleration")
        object.__setattr__(self, "acceleration_mps2", checked)

    def step(self, state: ArrayLike, interval_s: float, draws: ArrayLike) -> Floats:
        """Advance aircraft by one interval, equation (2).

        Returns
        -------
        (..., 6) ndarray
            The new state.

        References
        ----------
        Vasiliev, Mattis, equation (2).
        """
        return advance_with_noise(state, interval_s, self.velocity_sigmas(interval_s), draws)

    def noise(self, state: ArrayLike, interval_s: float) -> Floats:
        """Return ϑ ϑᵀ of equation (1), the same for every state.

        Returns
        -------
        (..., 6, 6) ndarray
            diag(0, 0, 0, a_x²T², a_y²T², a_z²T²).

        References
        ----------
        Vasiliev, Mattis, equation (1), with the ϑ after (2) and V_ξ = E.
        """
        return velocity_noise(state, self.velocity_sigmas(interval_s))

    def velocity_sigmas(self, interval_s: float) -> Floats:
        """Return (3,) a_x T, a_y T, a_z T, m/s: the entries of ϑ after (2).

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
        Vasiliev, Mattis, the matrix ϑ after equation (2).
        """
        return forward_interval(interval_s) * np.array(self.acceleration_mps2)


def advance_with_noise(
    state: ArrayLike, interval_s: float, sigmas: Floats, draws: ArrayLike
) -> Floats:
    """Advance with the old velocity, then change each velocity by its sigma times its draw.

    Parameters
    ----------
    state : (..., 6) array_like
        Cartesian.
    interval_s : float
        T, s.
    sigmas : (3,) ndarray
        Of the change of velocity, m/s.
    draws : (..., 3) array_like
        Standard normal numbers.

    Returns
    -------
    (..., 6) ndarray
        The new state.

    Raises
    ------
    ShapeError, TimeOrderError
        See `CartesianAcceleration.step`.

    References
    ----------
    Vasiliev, Mattis, equation (2) and the text after it, which differ in σ only.
    """
    moved = cartesian_transition(state, interval_s)
    change = sigmas * component_array(draws, "draws", 3)
    parts = np.broadcast_arrays(moved[..., :3], moved[..., 3:] + change)
    return np.concatenate(parts, axis=-1)


def velocity_noise(state: ArrayLike, sigmas: Floats) -> Floats:
    """Return the covariance of independent changes of the three velocities.

    Parameters
    ----------
    state : (..., 6) array_like
        Gives the number of aircraft.
    sigmas : (3,) ndarray
        Of the change of velocity, m/s.

    Returns
    -------
    (..., 6, 6) ndarray
        diag(0, 0, 0, σ_x², σ_y², σ_z²).

    References
    ----------
    Vasiliev, Mattis, equation (1): ϑ V_ξ ϑᵀ, with the ϑ after (2).
    """
    values = component_array(state, "state", STATE_SIZE)
    result = np.zeros((*values.shape, STATE_SIZE))
    result[..., [3, 4, 5], [3, 4, 5]] = sigmas**2
    return result
