"""Motion with constant lateral and longitudinal acceleration, in closed form."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import MotionParameterError
from multiradar.estimation.array_checks import finite_array, require_numbers
from multiradar.restoration.control_tracks._motion_kernels import SPEED_MIN, fly_all

Floats = NDArray[np.float64]


def advance(
    state: ArrayLike, lateral_mps2: ArrayLike, longitudinal_mps2: ArrayLike, interval_s: ArrayLike
) -> Floats:
    """Return states after an interval of constant accelerations.

    Parameters
    ----------
    state : (..., 4) array_like
        East and north, m; speed, m/s; heading, rad clockwise from north.
    lateral_mps2, longitudinal_mps2 : (...) array_like
        Accelerations to the right (u) and forwards (w), m/s².
    interval_s : (...) array_like
        Interval from the state, s; negative for the past.

    Returns
    -------
    (..., 4) ndarray
        States in the same order.

    Raises
    ------
    MotionParameterError
        If the speed is below 10 m/s at the start or the end.
    ShapeError
        If they are not finite, or their shapes do not match.

    Notes
    -----
    The displacement is accurate to 1e-9 of its length for all |u| ≤ 4 and |w| ≤ 2 m/s², including
    zero: (2.3) is evaluated with (e^z − 1) / z and ln(1 + a) / a.

    References
    ----------
    IMM UrO RAN report (2016), equations (2.1), (2.2) and (2.3).
    """
    states = finite_array(state, "state", (*np.shape(state)[:-1], 4))
    parts = [
        require_numbers(one, name)
        for one, name in (
            (lateral_mps2, "lateral acceleration"),
            (longitudinal_mps2, "longitudinal acceleration"),
            (interval_s, "prediction interval"),
        )
    ]
    shape = np.broadcast_shapes(states.shape[:-1], *(one.shape for one in parts))
    u, w, t = (np.broadcast_to(one, shape).ravel() for one in parts)
    flat = np.broadcast_to(states, (*shape, 4)).reshape(-1, 4).copy()
    for speed in (flat[:, 2], flat[:, 2] + w * t):
        slow = ~(speed >= SPEED_MIN)
        if slow.any():
            raise MotionParameterError(
                "speed", f"at least {SPEED_MIN:g} m/s", float(speed[slow][0])
            )
    fly_all(flat, u.copy(), w.copy(), t.copy())
    return flat.reshape(*shape, 4)
