"""Paths of aircraft over the plane and in height, as functions of time."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicHermiteSpline

from multiradar.estimation.motion.axes import frame_to_velocity
from multiradar.simulation.scenario.model import Aircraft, CoupledNoise, Leg, Waypoints

Floats = NDArray[np.float64]
# Times, positions, velocities and heights at the knots, from the start of the flight.
_Knots = tuple[Floats, Floats, Floats, Floats]

# Cubic between knots: half a second in a turn of 6°/s at 300 m/s gives an error below 0.1 mm.
KNOT_S = 0.5
# Gauss-Legendre points of a knot interval; the rest is rounding.
_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True, slots=True)
class Path:
    """Path of an aircraft from the start to the end of its flight.

    Attributes
    ----------
    start_s, end_s : float
        Start and end of the flight, or the end of the scenario.
    time_s : (k,) ndarray
        Knots, from the start to a little beyond the end.
    position_m, velocity_mps : (k, 2) ndarray
        East and north at the knots, and their rates; between them the path is a cubic.
    height_m : (k,) ndarray
        Height at the knots; between them it is linear.

    References
    ----------
    The project's own: cubics between the knots of `fly`.
    """

    start_s: float
    end_s: float
    time_s: Floats
    position_m: Floats
    velocity_mps: Floats
    height_m: Floats
    _spline: CubicHermiteSpline = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        spline = CubicHermiteSpline(self.time_s, self.position_m, self.velocity_mps)
        object.__setattr__(self, "_spline", spline)

    def position(self, time_s: Floats) -> Floats:
        """Return (n, 2) east and north at times (n,), m.

        References
        ----------
        The project's own: cubics between the knots of `fly`.
        """
        return np.asarray(self._spline(time_s))

    def height(self, time_s: Floats) -> Floats:
        """Return (n,) heights at times (n,), m.

        References
        ----------
        The project's own: lines between the knots of `fly`.
        """
        return np.interp(time_s, self.time_s, self.height_m)

    def states(self, time_s: Floats) -> Floats:
        """Return (n, 4) east, north and their rates: the state order of the filters.

        References
        ----------
        IMM UrO RAN report (2016), equation (1.4): the order of χ.
        """
        return np.concatenate([self._spline(time_s), self._spline(time_s, 1)], axis=-1)


def fly(aircraft: Aircraft, duration_s: float, rng: np.random.Generator) -> Path:
    """Simulate the path of an aircraft.

    Parameters
    ----------
    aircraft : Aircraft
        Initial state and manoeuvres.
    duration_s : float
        End of the scenario.
    rng : Generator
        For random manoeuvres; legs do not use it.

    Returns
    -------
    Path
        From the start to the end of the flight or of the scenario; defined a little longer.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.4), for straight flight; Vasiliev, Mattis, equation (5),
    for random manoeuvres; Y. Bar-Shalom, X. R. Li, T. Kirubarajan, "Estimation with Applications to
    Tracking and Navigation", Wiley 2001, equation (6.2.2-4), for white acceleration. The legs are
    the project's own.
    """
    end_s = min(aircraft.end_s, duration_s)
    # The search for the time at which a beam meets the aircraft extends a little beyond.
    length_s = max(end_s - aircraft.start_s, 0.0) + 60.0
    if aircraft.waypoints is not None:
        knots = _by_waypoints(aircraft.waypoints, aircraft.start_s, end_s)
    elif aircraft.coupled is not None:
        knots = _coupled(aircraft, aircraft.coupled, length_s, rng)
    elif aircraft.acceleration_density > 0.0:
        knots = _white(aircraft, length_s, rng)
    else:
        knots = _legs(aircraft, length_s)
    time_s, position, velocity, height = knots
    return Path(aircraft.start_s, end_s, aircraft.start_s + time_s, position, velocity, height)


def start_velocity(aircraft: Aircraft) -> Floats:
    """Return (2,) the initial velocity, m/s.

    References
    ----------
    Vasiliev, Mattis, the projections after equation (5), in level flight.
    """
    return aircraft.speed_mps * np.array(
        [np.sin(aircraft.heading_rad), np.cos(aircraft.heading_rad)]
    )


# Straight between waypoints, with corners of one second: a knot half of it before and after.
def _by_waypoints(waypoints: Waypoints, start_s: float, end_s: float) -> _Knots:
    at = np.array(waypoints.time_s)
    point = np.stack([waypoints.east_m, waypoints.north_m, waypoints.height_m], axis=-1)
    rate = np.diff(point, axis=0) / np.diff(at)[:, None]
    corners = np.stack([at[1:-1] - KNOT_S, at[1:-1] + KNOT_S], axis=-1).ravel()
    # Extrapolated on each side: the search for a beam extends a little beyond.
    time_s = np.concatenate([[min(at[0], start_s) - 60.0], corners, [max(at[-1], end_s) + 60.0]])
    rates = np.repeat(rate, 2, axis=0)
    begin = np.repeat(np.arange(len(rate)), 2)
    flown = point[begin] + rates * (time_s - at[begin])[:, None]
    return time_s - start_s, flown[:, :2], rates[:, :2], flown[:, 2]


# Legs share their knots: velocity is continuous where speed and heading are.
def _legs(aircraft: Aircraft, length_s: float) -> _Knots:
    position = np.array([aircraft.east_m, aircraft.north_m])
    time_s, height = 0.0, aircraft.height_m
    speed, heading = aircraft.speed_mps, aircraft.heading_rad
    times, positions, velocities = [np.zeros(1)], [position[None]], [start_velocity(aircraft)[None]]
    heights = [height]
    for leg in (*aircraft.legs, Leg(length_s)):
        count = int(np.ceil(leg.duration_s / KNOT_S)) if leg.turn_rate_rad_per_s else 1
        inside = np.linspace(0.0, leg.duration_s, count + 1)
        path = position + np.cumsum(_moves(leg, speed, heading, inside), axis=0)
        times.append(time_s + inside[1:])
        positions.append(path)
        velocities.append(_velocity(leg, speed, heading, inside[1:]))
        heights.extend(height + leg.climb_mps * inside[1:])
        time_s, height, position = time_s + leg.duration_s, heights[-1], path[-1]
        speed += leg.acceleration_mps2 * leg.duration_s
        heading += leg.turn_rate_rad_per_s * leg.duration_s
    return (
        np.concatenate(times), np.concatenate(positions), np.concatenate(velocities),
        np.array(heights),
    )  # fmt: skip


# (..., 2) velocity at times within a leg with given initial speed and heading.
def _velocity(leg: Leg, speed: float, heading: float, time_s: Floats) -> Floats:
    now, course = speed + leg.acceleration_mps2 * time_s, heading + leg.turn_rate_rad_per_s * time_s
    return np.stack([now * np.sin(course), now * np.cos(course)], axis=-1)


# (k, 2) displacements between successive times, by quadrature: accurate for any turn rate.
def _moves(leg: Leg, speed: float, heading: float, time_s: Floats) -> Floats:
    half = np.diff(time_s)[:, None] / 2.0
    nodes = time_s[:-1, None] + half * (1.0 + _NODES)
    return np.asarray(
        np.einsum("kn,knc->kc", half * _WEIGHTS, _velocity(leg, speed, heading, nodes))
    )


# White acceleration integrated exactly over each knot interval.
def _white(aircraft: Aircraft, length_s: float, rng: np.random.Generator) -> _Knots:
    count = int(np.ceil(length_s / KNOT_S))
    density = aircraft.acceleration_density
    jumps = np.sqrt(density * KNOT_S) * rng.normal(size=(count, 2))
    apart = np.sqrt(density * KNOT_S**3 / 12.0) * rng.normal(size=(count, 2))
    velocity = np.vstack([np.zeros((1, 2)), np.cumsum(jumps, axis=0)]) + start_velocity(aircraft)
    moves = (velocity[:-1] + jumps / 2.0) * KNOT_S + apart
    position = np.vstack([np.zeros((1, 2)), np.cumsum(moves, axis=0)])
    position += [aircraft.east_m, aircraft.north_m]
    height = np.full(count + 1, aircraft.height_m)
    return KNOT_S * np.arange(count + 1.0), position, velocity, height


# Model (5), all intervals at once: the frame (V, K, φ) is a random walk, and the position follows
# with the previous velocity. `VelocityFrame.step` is the same for one interval.
def _coupled(
    aircraft: Aircraft, noise: CoupledNoise, length_s: float, rng: np.random.Generator
) -> _Knots:
    step, count = noise.step_s, int(np.ceil(length_s / noise.step_s))
    sigmas = [
        noise.acceleration_sigma_mps2,
        noise.course_rate_sigma_rad_per_s,
        noise.climb_rate_sigma_rad_per_s,
    ]
    changes = step * np.array(sigmas) * rng.normal(size=(count, 3))
    start = np.array([aircraft.speed_mps, aircraft.heading_rad, 0.0])
    velocity = frame_to_velocity(start + np.vstack([np.zeros(3), np.cumsum(changes, axis=0)]))
    path = np.vstack([np.zeros(3), np.cumsum(step * velocity[:-1], axis=0)])
    position = path + np.array([aircraft.east_m, aircraft.north_m, aircraft.height_m])
    return step * np.arange(count + 1.0), position[:, :2], velocity[:, :2], position[:, 2]
