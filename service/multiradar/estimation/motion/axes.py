"""Axes, course and climb angle of all motion in three dimensions.

Components are ordered (east, north, up), m and m/s. Vasiliev and Mattis measure the course K from
their axis X towards Y, the climb angle φ from the plane XY towards Z; here their X is north, their
Y east and their Z up, so that the course is clockwise from north as everywhere. With the speed V,

    v_east = V cos φ sin K,    v_north = V cos φ cos K,    v_up = V sin φ.

A state is either *Cartesian*, (east, north, up, v_east, v_north, v_up), or of the *velocity frame*,
(east, north, up, V, K, φ).

Several triples (V, K, φ) represent the same velocity. In the *canonical* form V is not negative, φ
lies in [−π/2, π/2] and K in [−π, π). Equations (4) add Gaussian numbers to all three and may leave
that region; the triple then still represents the velocity of the formula above, which
`canonical_frame` converts:

    V < 0          (V, K, φ) → (−V, K + π, −φ)         the aircraft flies backwards
    |φ| > π/2      (V, K, φ) → (V, K + π, π − φ)       it has flown over the top of a loop

Neither changes the velocity, so nothing jumps. Neither changes the distribution of the motion
afterwards: the next increments of V and φ are equally likely with the other sign.
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

STATE_SIZE = 6

Floats = NDArray[np.float64]


def frame_to_velocity(frame: ArrayLike) -> Floats:
    """Return the Cartesian velocity of a speed, course and climb angle.

    Parameters
    ----------
    frame : (..., 3) array_like
        V (m/s), K and φ (rad); any real values.

    Returns
    -------
    (..., 3) ndarray
        East, north, up, m/s.

    References
    ----------
    Vasiliev, Mattis, the projections after equation (5).
    """
    speed, course, climb = np.moveaxis(np.asarray(frame, np.float64), -1, 0)
    level = speed * np.cos(climb)
    return np.stack([level * np.sin(course), level * np.cos(course), speed * np.sin(climb)], -1)


def velocity_to_frame(velocity: ArrayLike) -> Floats:
    """Return speed, course and climb angle of a Cartesian velocity, in canonical form.

    Parameters
    ----------
    velocity : (..., 3) array_like
        East, north, up, m/s.

    Returns
    -------
    (..., 3) ndarray
        V ≥ 0 (m/s), K in [−π, π), φ in [−π/2, π/2] (rad). Where no course is defined (straight up
        or down, or no speed) it is 0, and so is the climb angle where there is no speed.

    References
    ----------
    Vasiliev, Mattis, the projections after equation (5), solved for V, K and φ.
    """
    values = np.asarray(velocity, np.float64)
    east, north, up = np.moveaxis(values, -1, 0)
    level = np.hypot(east, north)
    course = _wrapped(np.arctan2(east, north))
    return np.stack([np.hypot(level, up), course, np.arctan2(up, level)], -1)


def velocity_by_frame(frame: ArrayLike) -> Floats:
    """Return ∂(v_east, v_north, v_up)/∂(V, K, φ), the matrix I_xK of equation (7).

    Parameters
    ----------
    frame : (..., 3) array_like
        V (m/s), K and φ (rad).

    Returns
    -------
    (..., 3, 3) ndarray
        Columns: per m/s of speed, per radian of course, per radian of climb.

    References
    ----------
    Vasiliev, Mattis, equation (7), with rows in the order of axes used here.
    """
    speed, course, climb = np.moveaxis(np.asarray(frame, np.float64), -1, 0)
    sin_k, cos_k, sin_c, cos_c = np.sin(course), np.cos(course), np.sin(climb), np.cos(climb)
    along = [cos_c * sin_k, cos_c * cos_k, sin_c]
    turn = [speed * cos_c * cos_k, -speed * cos_c * sin_k, np.zeros_like(speed)]
    pitch = [-speed * sin_c * sin_k, -speed * sin_c * cos_k, speed * cos_c]
    return np.stack([np.stack(column, -1) for column in (along, turn, pitch)], -1)


def canonical_frame(frame: ArrayLike) -> tuple[Floats, Floats]:
    """Return the same velocity with V ≥ 0, K in [−π, π) and φ in [−π/2, π/2].

    Parameters
    ----------
    frame : (..., 3) array_like
        V (m/s), K and φ (rad); any real values.

    Returns
    -------
    frame : (..., 3) ndarray
        The canonical form. Canonical triples are returned unchanged.
    signs : (..., 3) ndarray
        Derivative of each component by its old value, 1 or −1: a covariance C becomes
        signs · C · signsᵀ element by element.

    References
    ----------
    Vasiliev, Mattis, follows from the projections after equation (5); the range of φ is that of the
    text before (3).
    """
    speed, course, climb = np.moveaxis(np.asarray(frame, np.float64), -1, 0)
    backwards = speed < 0.0
    climb = _wrapped(np.where(backwards, -climb, climb))
    over = np.abs(climb) > np.pi / 2.0
    # Wrapped first, so that a small angle near the end of the range keeps its digits.
    climb = np.where(over, np.copysign(np.pi, climb) - climb, climb)
    course = _wrapped(np.where(backwards != over, course + np.pi, course))
    one = np.ones_like(speed)
    signs = np.stack(
        [np.where(backwards, -1.0, one), one, np.where(backwards != over, -1.0, one)], -1
    )
    return np.stack([np.abs(speed), course, climb], -1), signs


# In [−π, π); angles within are unchanged. Models of motion and of measurement are independent of
# each other, so each has its own.
def _wrapped(angle: Floats) -> Floats:
    turn = 2.0 * np.pi
    inside = (angle >= -np.pi) & (angle < np.pi)
    moved = angle - turn * np.floor((angle + np.pi) / turn)
    return np.where(inside, angle, np.where(moved >= np.pi, -np.pi, moved))
