"""Estimates of a bundle: motion and manoeuvres of the aircraft."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.restoration.control_tracks.tracks import ControlTrack

Floats = NDArray[np.float64]

#: How the tracks of a bundle are combined to one estimate.
BEST = "best"
WEIGHTED = "weighted"


@dataclass(frozen=True, slots=True, eq=False)
class Trajectory:
    """A track of a bundle.

    Attributes
    ----------
    weight : float
        Its probability.
    controls : ControlTrack
        Segments from the start of the window. The last may start after the last plot, if a change
        of motion is expected.
    kinds : tuple of str
        Names of `settings.KIND_NAMES`, one for each segment.
    """

    weight: float
    controls: ControlTrack
    kinds: tuple[str, ...]


@dataclass(frozen=True, slots=True, eq=False)
class Estimate:
    """The motion at a time.

    Attributes
    ----------
    time_s : float
        Time of the state.
    state : (4,) float64
        East and north, m, and their rates, m/s.
    covariance : (4, 4) float64
        Covariance of the errors of `state`: of each track, and of the differences between tracks.
    lateral_mps2, longitudinal_mps2 : float
        Accelerations to the right and forwards.
    kind_probability : (5,) float64
        Probabilities of the kinds of `settings.KIND_NAMES`.
    """

    time_s: float
    state: Floats
    covariance: Floats
    lateral_mps2: float
    longitudinal_mps2: float
    kind_probability: Floats

    @property
    def speed_mps(self) -> float:
        """Ground speed."""
        return float(np.hypot(self.state[2], self.state[3]))

    @property
    def heading_rad(self) -> float:
        """Direction of the velocity, clockwise from north, 0 to 2π."""
        return float(np.arctan2(self.state[2], self.state[3]) % (2.0 * np.pi))


def velocity_states(flown: Floats) -> Floats:
    """Return states with velocities in place of speed and heading.

    Parameters
    ----------
    flown : (..., 4) ndarray
        East, north, speed, heading.

    Returns
    -------
    (..., 4) ndarray
        East, north, and their rates.

    References
    ----------
    IMM UrO RAN report (2016), equation (2.1).
    """
    speed, heading = flown[..., 2], flown[..., 3]
    return np.stack(
        [flown[..., 0], flown[..., 1], speed * np.sin(heading), speed * np.cos(heading)], axis=-1
    )
