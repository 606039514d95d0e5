"""Models of the coupled-motion study: for simulation and for the filters.

Every filter has the same information on an aircraft, in the terms of its model: the accelerations
of the kind of aircraft along, across and upwards at its initial speed, for any heading.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import degrees, radians

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.estimation.motion.axes import frame_to_velocity
from multiradar.estimation.motion.coordinates import (
    CARTESIAN,
    cartesian_jacobian,
    cartesian_transition,
)
from multiradar.estimation.motion.velocity_frame_noise import VelocityFrameNoise
from multiradar.research.motion.cartesian_acceleration import (
    CartesianAcceleration,
    advance_with_noise,
    velocity_noise,
)
from multiradar.research.motion.model import MotionModel, MotionSimulator
from multiradar.research.motion.relative_speed import RelativeSpeed
from multiradar.research.motion.velocity_frame import VelocityFrame
from multiradar.research.motion.white_acceleration import WhiteAcceleration

Floats = NDArray[np.float64]

#: T, s.
INTERVAL_S = 1.0
#: Initial speed of all trajectories; not published.
INITIAL_SPEED_MPS = 100.0
INITIAL_CLIMB_RAD = np.radians(2.0)
#: Vertical part of the simulated models, small beside the horizontal one.
UPWARD_MPS2 = 0.2
CLIMB_RATE_RAD_PER_S = np.radians(0.1)
#: v_K of the paper's figures 3 a and 3 b: 3 and 6 °/s.
PUBLISHED_TURN_RATES_RAD_PER_S = (radians(3.0), radians(6.0))
#: γ of the relative-speed variant: 30 % of the initial speed in T_np = 1000 s.
RELATIVE_CHANGE = (0.3, 0.3, 0.3)

ACCELERATION = "cartesian-acceleration"
RELATIVE = "relative-speed"
NOISE = "velocity-frame-noise"
FRAME = "velocity-frame"
WHITE = "white-acceleration"


@dataclass(frozen=True, slots=True, eq=False)
class IndividualSpeeds:
    """The relative-speed model with an individual initial velocity for each run.

    Attributes
    ----------
    unit : RelativeSpeed
        The model for an initial speed of 1 m/s along each axis.
    speeds_mps : (runs, 3) ndarray
        The initial speeds along the axes.

    References
    ----------
    Vasiliev, Mattis, the text after equation (2), with the v_xo of each run.
    """

    unit: RelativeSpeed
    speeds_mps: Floats

    coordinates = CARTESIAN
    transition = staticmethod(cartesian_transition)
    jacobian = staticmethod(cartesian_jacobian)

    def step(self, state: ArrayLike, interval_s: float, draws: ArrayLike) -> Floats:
        """Return (runs, 6) states after an interval.

        References
        ----------
        Vasiliev, Mattis, the text after equation (2).
        """
        return advance_with_noise(state, interval_s, self.velocity_sigmas(interval_s), draws)

    def noise(self, state: ArrayLike, interval_s: float) -> Floats:
        """Return (runs, 6, 6) process noise covariances of an interval.

        References
        ----------
        Vasiliev, Mattis, the text after equation (2): ϑ ϑᵀ of (1) with its σ.
        """
        return velocity_noise(state, self.velocity_sigmas(interval_s))

    def velocity_sigmas(self, interval_s: float) -> Floats:
        """Return (runs, 3) standard deviations of the change of velocity, m/s.

        References
        ----------
        Vasiliev, Mattis, the text after equation (2): γ_x σ_xi.
        """
        return self.unit.velocity_sigmas(interval_s) * self.speeds_mps


@dataclass(frozen=True, slots=True)
class Scenario:
    """A kind of motion.

    Attributes
    ----------
    model : str
        Name of the simulated model.
    setting : str
        Its parameters, as text.
    along_mps2, across_mps2, upward_mps2 : float
        Root mean square of the acceleration at the initial speed, over all headings.
    simulator : callable
        (runs, 6) initial Cartesian states → the model.
    """

    model: str
    setting: str
    along_mps2: float
    across_mps2: float
    upward_mps2: float
    simulator: Callable[[Floats], MotionSimulator]


def initial_states(heading_rad: Floats) -> Floats:
    """Return (runs, 6) Cartesian states at the origin, with the initial speed and climb.

    References
    ----------
    Vasiliev, Mattis, the projections after equation (5).
    """
    speed = np.full_like(heading_rad, INITIAL_SPEED_MPS)
    climb = np.full_like(heading_rad, INITIAL_CLIMB_RAD)
    velocity = frame_to_velocity(np.stack([speed, heading_rad, climb], -1))
    return np.concatenate([np.zeros_like(velocity), velocity], axis=-1)


def acceleration_scenario(acceleration_mps2: float) -> Scenario:
    """Return model (2) with a_x = a_y.

    References
    ----------
    Vasiliev, Mattis, equation (2), and its figure 1.
    """
    model = CartesianAcceleration((acceleration_mps2, acceleration_mps2, UPWARD_MPS2))
    setting = f"a = {acceleration_mps2:g} m/s²"
    return Scenario(
        ACCELERATION, setting, acceleration_mps2, acceleration_mps2, UPWARD_MPS2, lambda _: model
    )


def relative_scenario() -> Scenario:
    """Return the relative-speed variant.

    With σ on each axis in proportion to the velocity along it, the mean square over all headings is
    σ²·⟨sin⁴ + cos⁴⟩ = 3/4 σ² along the track and σ²·⟨2 sin² cos²⟩ = 1/4 σ² across it.

    References
    ----------
    Vasiliev, Mattis, the text after equation (2). The means over the headings are the project's
    own.
    """
    one = RelativeSpeed((1.0, 1.0, 1.0), RELATIVE_CHANGE).velocity_sigmas(INTERVAL_S) / INTERVAL_S
    level = one[0] * INITIAL_SPEED_MPS * np.cos(INITIAL_CLIMB_RAD)
    upward = one[2] * INITIAL_SPEED_MPS * np.sin(INITIAL_CLIMB_RAD)
    return Scenario(
        RELATIVE,
        f"γ = {RELATIVE_CHANGE[0]:g}",
        float(level * np.sqrt(0.75)),
        float(level * np.sqrt(0.25)),
        float(upward),
        lambda states: relative_model(states, RELATIVE_CHANGE),
    )


def frame_scenario(turn_rate_rad_per_s: float) -> Scenario:
    """Return model (5) with a = 1 m/s².

    References
    ----------
    Vasiliev, Mattis, equation (5), and its figure 3.
    """
    model = VelocityFrame(1.0, turn_rate_rad_per_s, CLIMB_RATE_RAD_PER_S)
    return Scenario(
        FRAME,
        f"a = 1 m/s², v_K = {degrees(turn_rate_rad_per_s):g} °/s",
        1.0,
        turn_rate_rad_per_s * INITIAL_SPEED_MPS * float(np.cos(INITIAL_CLIMB_RAD)),
        CLIMB_RATE_RAD_PER_S * INITIAL_SPEED_MPS,
        lambda _: model,
    )


def relative_model(states: Floats, change: Sequence[float]) -> IndividualSpeeds:
    """Return the relative-speed model for the initial velocities of these states.

    References
    ----------
    Vasiliev, Mattis, the text after equation (2).
    """
    unit = RelativeSpeed((1.0, 1.0, 1.0), (change[0], change[1], change[2]))
    return IndividualSpeeds(unit, np.abs(states[:, 3:]))


def filter_model(name: str, scenario: Scenario, states: Floats) -> MotionModel:
    """Return the motion model of a filter for a kind of motion.

    Parameters
    ----------
    name : str
        One of `FILTERS`.
    scenario : Scenario
        The tracked motion; its accelerations are known to the filter, headings are not.
    states : (runs, 6) ndarray
        Initial Cartesian states, for the relative-speed variant.

    Returns
    -------
    MotionModel
        Models by axes use the root mean square of along and across for both horizontal axes;
        models of the velocity frame use them directly, as rates divided by the initial speed.

    References
    ----------
    Vasiliev, Mattis, equations (2), (5) and (7), and the text after (2). The choice of equivalent
    parameters is the project's own.
    """
    return FILTERS[name](scenario, states)


def _level(scenario: Scenario) -> float:
    return float(np.sqrt((scenario.along_mps2**2 + scenario.across_mps2**2) / 2.0))


def _acceleration(scenario: Scenario, _: Floats) -> MotionModel:
    level = _level(scenario)
    return CartesianAcceleration((level, level, scenario.upward_mps2))


def _white(scenario: Scenario, _: Floats) -> MotionModel:
    level = _level(scenario) ** 2 * INTERVAL_S
    return WhiteAcceleration((level, level, scenario.upward_mps2**2 * INTERVAL_S))


# γ from the same accelerations: averaged over headings, |v_xo|² and |v_yo|² are half of the
# squared level speed.
def _relative(scenario: Scenario, states: Floats) -> MotionModel:
    unit = RelativeSpeed((1.0, 1.0, 1.0), (1.0, 1.0, 1.0)).velocity_sigmas(INTERVAL_S)[0]
    speed = INITIAL_SPEED_MPS * unit / INTERVAL_S
    level = np.sqrt(2.0) * _level(scenario) / (speed * np.cos(INITIAL_CLIMB_RAD))
    upward = scenario.upward_mps2 / (speed * np.sin(INITIAL_CLIMB_RAD))
    return relative_model(states, (level, level, upward))


def _noise(scenario: Scenario, _: Floats) -> MotionModel:
    return VelocityFrameNoise(scenario.along_mps2, *_rates(scenario))


def _frame(scenario: Scenario, _: Floats) -> MotionModel:
    return VelocityFrame(scenario.along_mps2, *_rates(scenario))


def _rates(scenario: Scenario) -> tuple[float, float]:
    level = INITIAL_SPEED_MPS * float(np.cos(INITIAL_CLIMB_RAD))
    return scenario.across_mps2 / level, scenario.upward_mps2 / INITIAL_SPEED_MPS


#: Motion models of the filters, by name.
FILTERS: dict[str, Callable[[Scenario, Floats], MotionModel]] = {
    ACCELERATION: _acceleration,
    RELATIVE: _relative,
    NOISE: _noise,
    FRAME: _frame,
    WHITE: _white,
}
#: The models of figures 1 (a, b) and 3 (a, b).
DRAWN = (
    acceleration_scenario(1.0),
    acceleration_scenario(2.0),
    frame_scenario(PUBLISHED_TURN_RATES_RAD_PER_S[0]),
    frame_scenario(PUBLISHED_TURN_RATES_RAD_PER_S[1]),
)
#: v_K of the tracked flights of model (5), °/s.
TURN_RATES_RAD_PER_S = tuple(radians(rate) for rate in (1.0, 2.0, 3.0, 4.5, 6.0))
#: The tracked motions.
TRACKED = (
    acceleration_scenario(1.0),
    relative_scenario(),
    *(frame_scenario(turn_rate) for turn_rate in TURN_RATES_RAD_PER_S),
)
