"""What a filter asks of a motion model, and what a simulation does."""

from typing import Protocol

from numpy.typing import ArrayLike

from multiradar.estimation.motion.axes import Floats
from multiradar.estimation.motion.coordinates import Coordinates


class MotionModel(Protocol):
    """A model that a filter predicts with; all arrays may have leading axes, one for each aircraft.

    Attributes
    ----------
    coordinates : Coordinates
        How its states are written.
    """

    coordinates: Coordinates

    def transition(self, state: ArrayLike, interval_s: float, /) -> Floats:
        """Return the (..., 6) state expected after an interval."""

    def jacobian(self, state: ArrayLike, interval_s: float, /) -> Floats:
        """Return the (..., 6, 6) derivative of `transition` by the state, F."""

    def noise(self, state: ArrayLike, interval_s: float, /) -> Floats:
        """Return the (..., 6, 6) covariance that the interval adds, Q."""


class MotionSimulator(Protocol):
    """A model that trajectories are made with.

    Attributes
    ----------
    coordinates : Coordinates
        How its states are written.
    """

    coordinates: Coordinates

    def step(self, state: ArrayLike, interval_s: float, draws: ArrayLike, /) -> Floats:
        """Return the (..., 6) state after an interval, given (..., 3) standard normal draws."""
