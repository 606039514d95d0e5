"""Constant velocity in three dimensions with white acceleration.

It has the interface of the models of Vasiliev and Mattis.
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
class WhiteAcceleration:
    """Constant velocity with white acceleration along each axis.

    Attributes
    ----------
    density : tuple of three floats
        Spectral density of the acceleration east, north and up, m²/s³: the variance of the
        velocity after one second.

    Raises
    ------
    ShapeError
        Not three values.
    MotionParameterError
        One is negative or not finite.

    References
    ----------
    Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
    Navigation", Wiley 2001, equation (6.2.2-4).
    """

    density: tuple[float, float, float]

    coordinates = CARTESIAN
    transition = staticmethod(cartesian_transition)
    jacobian = staticmethod(cartesian_jacobian)

    def __post_init__(self) -> None:
        object.__setattr__(self, "density", axis_parameters(self.density, "density"))

    def noise(self, state: ArrayLike, interval_s: float) -> Floats:
        """Return the process noise covariance of an interval, the same for every state.

        Returns
        -------
        (..., 6, 6) ndarray
            [[T³/3, T²/2], [T²/2, T]] for each axis, times its density: exact for any interval.

        References
        ----------
        Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
        Navigation", Wiley 2001, equation (6.2.2-4).
        """
        values = component_array(state, "state", STATE_SIZE)
        interval = forward_interval(interval_s)
        powers = [[interval**3 / 3.0, interval**2 / 2.0], [interval**2 / 2.0, interval]]
        result = np.zeros((*values.shape, STATE_SIZE))
        result[...] = np.kron(powers, np.diag(self.density))  # (6.2.2-4)
        return result
