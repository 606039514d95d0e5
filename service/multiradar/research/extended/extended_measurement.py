"""Measurement models of one aircraft in space, for the extended Kalman filter.

Flat axes (east, north, up), metres, without the curvature of the Earth, as in the studies. A
measurement depends on the position only, so it works with every motion model.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ShapeError
from multiradar.estimation.gaussian import require_covariance
from multiradar.estimation.motion.axes import Floats


class SpaceMeasurement(Protocol):
    """A sensor; positions and measurements may have leading axes, one per aircraft.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.5) without biases, for three axes; C^χ is `jacobian`, and
    D W Dᵀ is `noise`.
    """

    @property
    def noise(self) -> Floats:
        """Covariance of a measurement's random error, W, (m, m).

        References
        ----------
        IMM UrO RAN report (2016), equation (1.12): W.
        """

    def predict(self, position: Floats, /) -> Floats:
        """Return (..., m): the measurement of an aircraft at a position, without error.

        Parameters
        ----------
        position : (..., 3) ndarray
            East, north and up, m.

        Returns
        -------
        (..., m) ndarray
            In the units of `noise`.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.5): C^χ χ, or its equivalent where z is not linear in
        χ.
        """

    def jacobian(self, position: Floats, /) -> Floats:
        """Return (..., m, 3): the derivative of `predict`, finite wherever the position is.

        Parameters
        ----------
        position : (..., 3) ndarray
            East, north and up, m.

        Returns
        -------
        (..., m, 3) ndarray
            Components of the measurement by east, north and up.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.5): C^χ.
        """

    def residual(self, measured: Floats, predicted: Floats, /) -> Floats:
        """Return (..., m): measured minus predicted, angles wrapped.

        Parameters
        ----------
        measured, predicted : (..., m) ndarray
            In the units of `noise`.

        Returns
        -------
        (..., m) ndarray
            Their difference, in the same units.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.22): z − C ξ̄.
        """

    def usable(self, position: Floats, /) -> NDArray[np.bool_]:
        """Return (...) bool: whether the sensor can measure an aircraft at a position.

        Parameters
        ----------
        position : (..., 3) ndarray
            East, north and up, m.

        Returns
        -------
        (...) ndarray of bool
            One for each aircraft.

        References
        ----------
        The project's own: see `multiradar.estimation.measurement.cone_of_silence`.
        """


@dataclass(frozen=True, slots=True, eq=False)
class MeasuredPosition:
    """East, north and up, measured simultaneously.

    Attributes
    ----------
    noise : (3, 3) array
        Covariance of the error, m².

    Raises
    ------
    CovarianceError
        Not a covariance.
    ShapeError
        Wrong shape.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.11): C^χ = [I 0], for three axes; D = I.
    """

    noise: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "noise", _covariance(self.noise))

    def predict(self, position: Floats) -> Floats:
        """Return the position itself.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.11): C^χ χ.
        """
        return np.array(position, np.float64)

    def jacobian(self, position: Floats) -> Floats:
        """Return the identity.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.11): C^χ.
        """
        result = np.zeros((*np.shape(position), 3))
        result[...] = np.eye(3)
        return result

    def residual(self, measured: Floats, predicted: Floats) -> Floats:
        """Return the difference.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.22): z − C ξ̄.
        """
        return np.asarray(measured - predicted)

    def usable(self, position: Floats) -> NDArray[np.bool_]:
        """Return True everywhere.

        References
        ----------
        The project's own: a reported position has no cone of silence.
        """
        return np.ones(np.shape(position)[:-1], np.bool_)


def _covariance(noise: ArrayLike) -> Floats:
    values = require_covariance(noise, "measurement noise")
    if values.shape != (3, 3):
        raise ShapeError("measurement noise", "the shape (3, 3)", values.shape)
    return values
