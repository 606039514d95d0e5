"""The two coordinate systems of motion states, and the conversion between them.

Axes, signs and the canonical form are those of `multiradar.estimation.motion.axes`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from multiradar.estimation.array_checks import component_array
from multiradar.estimation.motion.axes import (
    STATE_SIZE,
    Floats,
    canonical_frame,
    frame_to_velocity,
    velocity_by_frame,
    velocity_to_frame,
)
from multiradar.estimation.motion.inputs import forward_interval


@dataclass(frozen=True, slots=True)
class Coordinates:
    """A coordinate system of states.

    Attributes
    ----------
    name : str
        `cartesian` or `velocity frame`.
    transition : callable
        (state, interval_s) → the state after straight flight at constant velocity.
    jacobian : callable
        (state, interval_s) → (..., 6, 6), the derivative of `transition` by the state.
    to_cartesian : callable
        state → (east, north, up, v_east, v_north, v_up).
    to_cartesian_jacobian : callable
        state → (..., 6, 6), the derivative of `to_cartesian`.
    from_cartesian : callable
        The inverse, in canonical form.
    canonical : callable
        (state, covariance) → the same estimate in canonical form.
    """

    name: str
    transition: Callable[[ArrayLike, float], Floats]
    jacobian: Callable[[ArrayLike, float], Floats]
    to_cartesian: Callable[[ArrayLike], Floats]
    to_cartesian_jacobian: Callable[[ArrayLike], Floats]
    from_cartesian: Callable[[ArrayLike], Floats]
    canonical: Callable[[ArrayLike, ArrayLike], tuple[Floats, Floats]]


def cartesian_transition(state: ArrayLike, interval_s: float) -> Floats:
    """Return a Cartesian state after straight flight, φ of equation (1).

    Parameters
    ----------
    state : (..., 6) array_like
        East, north, up (m), v_east, v_north, v_up (m/s).
    interval_s : float
        T, s, not negative.

    Returns
    -------
    (..., 6) ndarray
        The position changed by velocity × interval.

    Raises
    ------
    ShapeError
        The state has a wrong number of components.
    TimeOrderError
        The interval is negative or not finite.

    References
    ----------
    Vasiliev, Mattis, equations (1), (2).
    """
    values = component_array(state, "state", STATE_SIZE).copy()
    values[..., :3] += forward_interval(interval_s) * values[..., 3:]  # (2)
    return values


def cartesian_jacobian(state: ArrayLike, interval_s: float) -> Floats:
    """Return the transition matrix φ of equation (1), the same for every state.

    Parameters
    ----------
    state : (..., 6) array_like
        Only its shape is used.
    interval_s : float
        T, s, not negative.

    Returns
    -------
    (..., 6, 6) ndarray
        Identity, with T in the block of position by velocity.

    Raises
    ------
    ShapeError, TimeOrderError
        As for `cartesian_transition`.

    References
    ----------
    Vasiliev, Mattis, equation (1), the matrix φ after (2).
    """
    result = _identity(component_array(state, "state", STATE_SIZE))
    result[..., [0, 1, 2], [3, 4, 5]] = forward_interval(interval_s)  # φ_i after (2)
    return result


def frame_transition(state: ArrayLike, interval_s: float) -> Floats:
    """Return a state of the velocity frame after straight flight: (5) without its random terms.

    Parameters
    ----------
    state : (..., 6) array_like
        East, north, up (m), V (m/s), K, φ (rad).
    interval_s : float
        T, s, not negative.

    Returns
    -------
    (..., 6) ndarray
        The position changed by velocity × interval.

    Raises
    ------
    ShapeError, TimeOrderError
        As for `cartesian_transition`.

    References
    ----------
    Vasiliev, Mattis, equation (5).
    """
    values = component_array(state, "state", STATE_SIZE).copy()
    values[..., :3] += forward_interval(interval_s) * frame_to_velocity(values[..., 3:])  # (5)
    return values


def frame_jacobian(state: ArrayLike, interval_s: float) -> Floats:
    """Return the exact derivative of `frame_transition` by the state.

    Parameters
    ----------
    state : (..., 6) array_like
        State of the linearisation.
    interval_s : float
        T, s, not negative.

    Returns
    -------
    (..., 6, 6) ndarray
        Identity, with T · I_xK of equation (7) in the block of position by (V, K, φ).

    Raises
    ------
    ShapeError, TimeOrderError
        As for `cartesian_transition`.

    References
    ----------
    Vasiliev, Mattis, follows from equation (5), with the matrix I_xK of (7).
    """
    values = component_array(state, "state", STATE_SIZE)
    result = _identity(values)
    result[..., :3, 3:] = forward_interval(interval_s) * velocity_by_frame(values[..., 3:])
    return result


def frame_to_cartesian(state: ArrayLike) -> Floats:
    """Return (east, north, up, v_east, v_north, v_up) of a state of the velocity frame.

    Parameters
    ----------
    state : (..., 6) array_like
        East, north, up (m), V (m/s), K, φ (rad).

    Returns
    -------
    (..., 6) ndarray
        m and m/s.

    Raises
    ------
    ShapeError
        The state has a wrong number of components.

    References
    ----------
    Vasiliev, Mattis, the projections after equation (5).
    """
    values = component_array(state, "state", STATE_SIZE)
    return np.concatenate([values[..., :3], frame_to_velocity(values[..., 3:])], axis=-1)


def cartesian_to_frame(state: ArrayLike) -> Floats:
    """Return (east, north, up, V, K, φ) of a Cartesian state, canonical.

    Parameters
    ----------
    state : (..., 6) array_like
        East, north, up (m), v_east, v_north, v_up (m/s).

    Returns
    -------
    (..., 6) ndarray
        m, m/s and rad.

    Raises
    ------
    ShapeError
        The state has a wrong number of components.

    References
    ----------
    Vasiliev, Mattis, the projections after equation (5), solved for V, K and φ.
    """
    values = component_array(state, "state", STATE_SIZE)
    return np.concatenate([values[..., :3], velocity_to_frame(values[..., 3:])], axis=-1)


def _frame_to_cartesian_jacobian(state: ArrayLike) -> Floats:
    values = component_array(state, "state", STATE_SIZE)
    result = _identity(values)
    result[..., 3:, 3:] = velocity_by_frame(values[..., 3:])
    return result


def _canonical_state(state: ArrayLike, covariance: ArrayLike) -> tuple[Floats, Floats]:
    values = component_array(state, "state", STATE_SIZE).copy()
    values[..., 3:], signs = canonical_frame(values[..., 3:])
    every = np.concatenate([np.ones_like(signs), signs], axis=-1)
    transformed = np.asarray(covariance, np.float64) * every[..., :, None] * every[..., None, :]
    return values, transformed


# The canonical form of a Cartesian state is the state itself.
def _as_it_is(state: ArrayLike) -> Floats:
    return component_array(state, "state", STATE_SIZE).copy()


def _both_as_they_are(state: ArrayLike, covariance: ArrayLike) -> tuple[Floats, Floats]:
    return _as_it_is(state), np.array(covariance, np.float64)


def _identity_jacobian(state: ArrayLike) -> Floats:
    return _identity(component_array(state, "state", STATE_SIZE))


def _identity(values: Floats) -> Floats:
    result = np.zeros((*values.shape, STATE_SIZE))
    result[...] = np.eye(STATE_SIZE)
    return result


#: (east, north, up, v_east, v_north, v_up).
CARTESIAN = Coordinates(
    "cartesian",
    cartesian_transition,
    cartesian_jacobian,
    _as_it_is,
    _identity_jacobian,
    _as_it_is,
    _both_as_they_are,
)
#: (east, north, up, V, K, φ).
VELOCITY_FRAME = Coordinates(
    "velocity frame",
    frame_transition,
    frame_jacobian,
    frame_to_cartesian,
    _frame_to_cartesian_jacobian,
    cartesian_to_frame,
    _canonical_state,
)
