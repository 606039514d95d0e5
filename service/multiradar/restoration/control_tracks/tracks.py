"""Measurement tracks, control tracks and geometric tracks, as arrays.

Positions are (east, north) in metres in the system plane; headings are clockwise from north and not
wrapped. The X of the report is north, its Z east.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import TimeOrderError
from multiradar.estimation.array_checks import finite_array, require_shape
from multiradar.estimation.gaussian import require_covariance
from multiradar.restoration.control_tracks.motion import advance

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True, eq=False)
class MeasurementTrack:
    """Plots of one aircraft by ascending time.

    Attributes
    ----------
    time_s : (n,) float64
        Times.
    position_m : (n, 2) float64
        East and north, corrected for the biases of the radar.
    covariance_m2 : (n, 2, 2) float64
        Covariances of the errors: noise of the radar, and uncertainty of its biases.
    radar : (n,) int64
        Radar of each plot.
    """

    time_s: Floats
    position_m: Floats
    covariance_m2: Floats
    radar: Integers

    def __len__(self) -> int:
        """Return the number of plots."""
        return len(self.time_s)


@dataclass(frozen=True, slots=True, eq=False)
class GeometricTrack:
    """Path of an aircraft at times on a grid.

    Attributes
    ----------
    time_s : (k,) float64
        Ascending times.
    position_m : (k, 2) float64
        East and north.
    speed_mps, heading_rad : (k,) float64
        Speed and heading of the velocity.
    """

    time_s: Floats
    position_m: Floats
    speed_mps: Floats
    heading_rad: Floats


@dataclass(frozen=True, slots=True, eq=False)
class ControlTrack:
    """A motion of piecewise constant accelerations: consecutive segments.

    Attributes
    ----------
    start : (4,) float64
        East, north (m), speed (m/s) and heading (rad) at the start of the first segment.
    begin_s : (s,) float64
        Start time of each segment, ascending; it ends at the start of the next.
    lateral_mps2, longitudinal_mps2 : (s,) float64
        Accelerations: to the right, and forwards.

    References
    ----------
    IMM UrO RAN report (2016), section 2.4.
    """

    start: Floats
    begin_s: Floats
    lateral_mps2: Floats
    longitudinal_mps2: Floats

    def geometric(self, time_s: ArrayLike) -> GeometricTrack:
        """Return the geometric track.

        Parameters
        ----------
        time_s : (k,) array_like
            Ascending times; before the first segment the motion is extrapolated backwards.

        Returns
        -------
        GeometricTrack
            At these times.

        Raises
        ------
        MotionParameterError
            If the speed would fall below its minimum.
        TimeOrderError
            If the times do not ascend.

        References
        ----------
        IMM UrO RAN report (2016), equation (2.3) and section 2.4.
        """
        times = finite_array(time_s, "geometric track times", (None,))
        if np.any(np.diff(times) < 0.0):
            first = int(np.argmax(np.diff(times) < 0.0))
            raise TimeOrderError(
                "geometric track times", float(times[first + 1]), float(times[first])
            )
        segment = np.maximum(np.searchsorted(self.begin_s, times, side="right") - 1, 0)
        states = self._states_at_begins()[segment]
        found = advance(
            states, self.lateral_mps2[segment], self.longitudinal_mps2[segment],
            times - self.begin_s[segment],
        )  # fmt: skip
        return GeometricTrack(times, found[:, :2], found[:, 2], found[:, 3])

    def _states_at_begins(self) -> Floats:
        states = [np.asarray(self.start, np.float64)]
        for i, length in enumerate(np.diff(self.begin_s)):
            states.append(
                advance(states[-1], self.lateral_mps2[i], self.longitudinal_mps2[i], length)
            )
        return np.array(states)


def whole_seconds(first_s: float, last_s: float) -> Floats:
    """Return the whole seconds between two times, the grid of geometric tracks.

    Parameters
    ----------
    first_s, last_s : float
        First and last time.

    Returns
    -------
    (k,) ndarray
        Seconds within them.

    References
    ----------
    IMM UrO RAN report (2016), section 2.3: a grid of all whole seconds.
    """
    return np.arange(np.ceil(first_s), np.floor(last_s) + 1.0)


def measurement_track(
    time_s: ArrayLike, position_m: ArrayLike, covariance_m2: ArrayLike, radar: ArrayLike
) -> MeasurementTrack:
    """Return a measurement track, with its arguments checked.

    Parameters
    ----------
    time_s : (n,) array_like
        Ascending times.
    position_m : (n, 2) array_like
        East and north.
    covariance_m2 : (n, 2, 2) array_like
        Covariances of the errors.
    radar : (n,) array_like
        Radar of each plot.

    Returns
    -------
    MeasurementTrack
        The same values.

    Raises
    ------
    ShapeError
        If shapes do not match or numbers are not finite.
    CovarianceError
        If a covariance is not valid.
    TimeOrderError
        If times do not ascend.

    References
    ----------
    IMM UrO RAN report (2016), section 2.4.
    """
    times = finite_array(time_s, "plot times", (None,))
    back = np.flatnonzero(np.diff(times) < 0.0)
    if len(back):
        at = int(back[0])
        raise TimeOrderError("plot times", float(times[at + 1]), float(times[at]))
    count = len(times)
    return MeasurementTrack(
        times,
        finite_array(position_m, "plot positions", (count, 2)),
        require_covariance(
            require_shape(covariance_m2, "plot covariances", (count, 2, 2)),
            "plot covariances",
        ),
        np.asarray(require_shape(radar, "plot radars", (count,)), np.int64),
    )
