"""Vasiliev and Mattis, (7): Cartesian motion with the noise of the velocity frame.

The state is Cartesian and its transition linear; the acceleration is random along the velocity,
across it in the plane, and in climb, so that its covariance depends on the velocity. With
J = ∂v/∂(V, K, φ) (`axes.velocity_by_frame`) the paper's covariance of the acceleration is

    D(v) = J diag(a², v_K², v_φ²) Jᵀ = a² u uᵀ + v_K² w wᵀ + v_φ² c cᵀ,

    u = v / V,    w = (v_north, −v_east, 0),    c = (−v_up k, v_level),    k = h / v_level,

with h = (v_east, v_north) and v_level = |h|, and the velocity's share of Q is T² D(v).

**Where J degenerates.** u has no limit as V → 0, and k none as v_level → 0. An undefined direction
is gradually replaced by *all* directions, so that D is continuous everywhere, symmetric, positive
semi-definite and bounded by trace D ≤ 3 a² + (v_K² + 2 v_φ²) V²:

    u uᵀ  becomes  v vᵀ/m + (1 − V²/m) I,             m = max(V², V_s²)
    k kᵀ  becomes  h hᵀ/n + (1 − v_level²/n) I,       n = max(v_level², κ² V²)

with V_s = `slow_speed_mps` and κ = `STEEP_COSINE`. At V ≥ V_s and |φ| ≤ 84.26° this is (7) of the
paper to rounding. An aircraft at rest accelerates by a along each axis, as in model (2); one that
flies straight up pitches in any direction.

**In the plane** (v_up = 0, no climb) this is one expression without a branch or a division by zero,
used by the compiled step; with m as above, in the order (east, north),

    d_00 = a² (1 + (v_e² − V²)/m) + v_K² v_n²
    d_01 = (a²/m − v_K²) v_e v_n
    d_11 = a² (1 + (v_n² − V²)/m) + v_K² v_e²

**Intervals.** In the paper the acceleration is constant over an interval and its sigma belongs to
the interval: Q = [[0, 0], [0, T²]] ⊗ D, and two half intervals add half the variance of one. Plots
of several radars come at irregular times; the interval of the paper then becomes a constant of the
model, T₀ = `nominal_interval_s`, D T₀ is the density of white acceleration, and

    Q = [[T³/3, T²/2], [T²/2, T]] ⊗ (T₀ D),

the exact integral, additive over parts of an interval at constant velocity. The variance of the
velocity is that of the paper at T = T₀. The parameters of the compiled step are the densities
a² T₀ (m²/s³) and v_K² T₀ (rad²/s); with v_K² V² = a² this is the white acceleration of
constant velocity, with q = a² T₀.
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
from multiradar.estimation.motion.inputs import (
    forward_interval,
    require_not_negative,
    require_positive,
)

#: Below this speed the course is too uncertain for an acceleration along it: slower than aeroplanes
#: fly, and within the uncertainty of velocities from radars.
SLOW_SPEED_MPS = 10.0
#: Below this cosine of the climb angle (above 84.26°) the course is practically undefined.
STEEP_COSINE = 0.1


@dataclass(frozen=True, slots=True)
class VelocityFrameNoise:
    """Cartesian motion, disturbed along and across the velocity.

    Attributes
    ----------
    acceleration_mps2 : float
        a, standard deviation of the acceleration along the velocity, m/s².
    turn_rate_rad_per_s : float
        v_K, standard deviation of the rate of the course, rad/s.
    climb_rate_rad_per_s : float
        v_φ, standard deviation of the rate of the climb angle, rad/s.
    nominal_interval_s : float, optional
        T₀, s, above 0: the interval to which a, v_K and v_φ refer; None: each interval itself, as
        in the paper.
    slow_speed_mps : float
        V_s, m/s, above 0: below it the course is increasingly uncertain.

    Raises
    ------
    MotionParameterError
        A parameter is negative or not finite, or T₀ or V_s not above 0.

    References
    ----------
    Vasiliev, Mattis, equation (7).
    """

    acceleration_mps2: float
    turn_rate_rad_per_s: float
    climb_rate_rad_per_s: float = 0.0
    nominal_interval_s: float | None = None
    slow_speed_mps: float = SLOW_SPEED_MPS

    coordinates = CARTESIAN
    transition = staticmethod(cartesian_transition)
    jacobian = staticmethod(cartesian_jacobian)

    def __post_init__(self) -> None:
        require_not_negative(self.acceleration_mps2, "acceleration")
        require_not_negative(self.turn_rate_rad_per_s, "turn rate")
        require_not_negative(self.climb_rate_rad_per_s, "climb rate")
        require_positive(self.slow_speed_mps, "slow speed")
        if self.nominal_interval_s is not None:
            require_positive(self.nominal_interval_s, "nominal interval")

    def noise(self, state: ArrayLike, interval_s: float) -> Floats:
        """Return the covariance that an interval adds at the velocity of a state.

        Parameters
        ----------
        state : (..., 6) array_like
            East, north, up (m), v_east, v_north, v_up (m/s).
        interval_s : float
            T, s, not negative.

        Returns
        -------
        (..., 6, 6) ndarray
            Symmetric, positive semi-definite; m², m²/s and (m/s)².

        Raises
        ------
        ShapeError
            The state has a wrong number of components.
        TimeOrderError
            The interval is negative or not finite.

        References
        ----------
        Vasiliev, Mattis, equation (7), as in the paper or as a density: see the module.
        """
        values = component_array(state, "state", STATE_SIZE)
        spread = acceleration_covariance(
            values[..., 3:],
            self.acceleration_mps2,
            self.turn_rate_rad_per_s,
            self.climb_rate_rad_per_s,
            self.slow_speed_mps,
        )
        result = np.zeros((*values.shape, STATE_SIZE))
        result[...] = held_or_white(spread, forward_interval(interval_s), self.nominal_interval_s)
        return result


def acceleration_covariance(
    velocity: ArrayLike,
    acceleration_mps2: float,
    turn_rate_rad_per_s: float,
    climb_rate_rad_per_s: float = 0.0,
    slow_speed_mps: float = SLOW_SPEED_MPS,
) -> Floats:
    """Return D(v), the covariance of the acceleration at a velocity, for every velocity.

    Parameters
    ----------
    velocity : (..., 3) or (..., 2) array_like
        East, north, up, m/s; two components for motion in the plane.
    acceleration_mps2, turn_rate_rad_per_s, climb_rate_rad_per_s : float
        a (m/s²), v_K and v_φ (rad/s); not negative. In the plane v_φ is not used.
    slow_speed_mps : float
        V_s, m/s, above 0.

    Returns
    -------
    (..., 3, 3) or (..., 2, 2) ndarray
        m²/s⁴. In the plane it is the block (east, north) of that in space.

    Raises
    ------
    ShapeError
        The velocity has a wrong number of components.

    References
    ----------
    Vasiliev, Mattis, equation (7), modified where it degenerates: see the module.
    """
    values = np.asarray(velocity, np.float64)
    if values.ndim == 0 or values.shape[-1] != 2:
        values = component_array(values, "velocity", 3)
    size = values.shape[-1]
    along = _filled(values, slow_speed_mps**2)
    turn = np.zeros_like(values)
    turn[..., 0], turn[..., 1] = values[..., 1], -values[..., 0]
    result = acceleration_mps2**2 * along + turn_rate_rad_per_s**2 * _outer(turn, turn)
    if size == 3:
        result += climb_rate_rad_per_s**2 * _climb(values)
    return np.asarray(result)


def held_or_white(spread: Floats, interval_s: float, nominal_interval_s: float | None) -> Floats:
    """Return the covariance that accelerations add to position and velocity over an interval.

    Parameters
    ----------
    spread : (..., n, n) ndarray
        D, covariance of the acceleration, m²/s⁴.
    interval_s : float
        T, s.
    nominal_interval_s : float, optional
        T₀, s; None: the acceleration is constant over the interval, as in the paper.

    Returns
    -------
    (..., 2n, 2n) ndarray
        Position, then velocity.

    References
    ----------
    Vasiliev, Mattis, equation (7); with T₀, Y. Bar-Shalom, X. R. Li, T. Kirubarajan,
    "Estimation with Applications to Tracking and Navigation", Wiley 2001, equation (6.2.2-4).
    """
    size = spread.shape[-1]
    result = np.zeros((*spread.shape[:-2], 2 * size, 2 * size))
    if nominal_interval_s is None:
        result[..., size:, size:] = interval_s**2 * spread  # (7)
        return result
    density = nominal_interval_s * spread
    result[..., :size, :size] = interval_s**3 / 3.0 * density
    result[..., :size, size:] = interval_s**2 / 2.0 * density
    result[..., size:, :size] = result[..., :size, size:]
    result[..., size:, size:] = interval_s * density
    return result


# x xᵀ / m + (1 − x²/m) I with m = max(x², floor): the direction of x as far as it is defined. A
# floor of 0 occurs only for a velocity of 0, where I is used.
def _filled(vector: Floats, floor: float | Floats) -> Floats:
    squared = (vector**2).sum(axis=-1)
    largest = np.maximum(squared, floor)
    safe = np.where(largest > 0.0, largest, 1.0)
    unknown = 1.0 - squared / safe
    return np.asarray(
        _outer(vector, vector) / safe[..., None, None]
        + unknown[..., None, None] * np.eye(vector.shape[-1])
    )


# c cᵀ, with k kᵀ filled in near the vertical.
def _climb(velocity: Floats) -> Floats:
    level, up = velocity[..., :2], velocity[..., 2]
    floor = STEEP_COSINE**2 * (velocity**2).sum(axis=-1)
    result = np.empty((*velocity.shape, 3))
    result[..., :2, :2] = (up**2)[..., None, None] * _filled(level, floor)
    result[..., :2, 2] = -up[..., None] * level  # v_level k is the level velocity
    result[..., 2, :2] = result[..., :2, 2]
    result[..., 2, 2] = (level**2).sum(axis=-1)
    return result


def _outer(left: Floats, right: Floats) -> Floats:
    return np.asarray(left[..., :, None] * right[..., None, :])
