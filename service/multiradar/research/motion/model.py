"""Interfaces of motion models: for filters and for simulation."""

from typing import Protocol

from numpy.typing import ArrayLike

from multiradar.estimation.motion.axes import Floats
from multiradar.estimation.motion.coordinates import Coordinates


class MotionModel(Protocol):
    """A motion model for prediction; all arrays may have leading axes, one per aircraft.

    Attributes
    ----------
    coordinates : Coordinates
        Coordinates of its states.

    References
    ----------
    Vasiliev, Mattis, equations (1) and (6), without control: φ, and ϑ V_ξ ϑᵀ.
    """

    coordinates: Coordinates

    def transition(self, state: ArrayLike, interval_s: float, /) -> Floats:
        """Return the (..., 6) expected state after an interval.

        Parameters
        ----------
        state : (..., 6) array_like
            In the coordinates of the model, m, m/s and rad.
        interval_s : float
            T, s, not negative.

        Returns
        -------
        (..., 6) ndarray
            f(x), in the same coordinates.

        Raises
        ------
        ShapeError
            If the state has another number of components.
        TimeOrderError
            If the interval is negative or no finite number.

        References
        ----------
        Vasiliev, Mattis, equation (1): φ x; (5) without its random terms.
        """

    def jacobian(self, state: ArrayLike, interval_s: float, /) -> Floats:
        """Return the (..., 6, 6) derivative of `transition` by the state, F.

        Parameters
        ----------
        state : (..., 6) array_like
            In the coordinates of the model, m, m/s and rad.
        interval_s : float
            T, s, not negative.

        Returns
        -------
        (..., 6, 6) ndarray
            F, evaluated at the state.

        Raises
        ------
        ShapeError
            If the state has another number of components.
        TimeOrderError
            If the interval is negative or no finite number.

        References
        ----------
        Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to Tracking and
        Navigation", Wiley 2001, section 10.3: F of the extended Kalman filter.
        """

    def noise(self, state: ArrayLike, interval_s: float, /) -> Floats:
        """Return the (..., 6, 6) process noise covariance of the interval, Q.

        Parameters
        ----------
        state : (..., 6) array_like
            In the coordinates of the model, m, m/s and rad.
        interval_s : float
            T, s, not negative.

        Returns
        -------
        (..., 6, 6) ndarray
            Symmetric, positive semi-definite.

        Raises
        ------
        ShapeError
            If the state has another number of components.
        TimeOrderError
            If the interval is negative or no finite number.

        References
        ----------
        Vasiliev, Mattis, equation (1): ϑ V_ξ ϑᵀ.
        """


class MotionSimulator(Protocol):
    """A motion model for simulation.

    Attributes
    ----------
    coordinates : Coordinates
        Coordinates of its states.

    References
    ----------
    Vasiliev, Mattis, equations (1) and (6), without control.
    """

    coordinates: Coordinates

    def step(self, state: ArrayLike, interval_s: float, draws: ArrayLike, /) -> Floats:
        """Return the (..., 6) state after an interval, given (..., 3) standard normal draws.

        Parameters
        ----------
        state : (..., 6) array_like
            In the coordinates of the model, m, m/s and rad.
        interval_s : float
            T, s, not negative.
        draws : (..., 3) array_like
            Independent standard normal numbers.

        Returns
        -------
        (..., 6) ndarray
            The new state, in the same coordinates.

        Raises
        ------
        ShapeError
            If the state has another number of components.
        TimeOrderError
            If the interval is negative or no finite number.

        References
        ----------
        Vasiliev, Mattis, equations (1) and (6): φ x + ϑ ξ.
        """
