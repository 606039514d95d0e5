"""Simulated measurements of a scenario on WGS 84, with the truth of each."""

from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError, OutsidePlaneError
from multiradar.estimation.measurement.sensors import (
    PARAMETER_FRAME_EAST,
    PARAMETER_FRAME_NORTH,
    PARAMETER_FRAME_ROTATION,
    PARAMETER_TIME_OFFSET,
)
from multiradar.geodesy.refraction import refracted_range
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.geodesy.wgs84 import (
    SEMI_MAJOR_AXIS_M,
    ecef_to_geodetic,
    enu_rotation,
    geodetic_to_ecef,
)
from multiradar.simulation.biases import TrueBiases, simulate_biases
from multiradar.simulation.observation.aircraft_data import avionics, received_registers
from multiradar.simulation.observation.clutter import clutter_plots
from multiradar.simulation.observation.detections import (
    LineOfSight,
    Plots,
    detection_opportunities,
    make_plots,
    outside_gaps,
)
from multiradar.simulation.observation.duplicates import duplicated
from multiradar.simulation.observation.heights import received_heights
from multiradar.simulation.observation.jamming import without_lost_ranges
from multiradar.simulation.observation.measurements import (
    NO_AIRCRAFT,
    Measurements,
    merged,
    no_measurements,
    no_registers,
)
from multiradar.simulation.observation.resolution import merge_unresolved
from multiradar.simulation.observation.sources import Site, site_of
from multiradar.simulation.paths import Path, fly
from multiradar.simulation.scenario.model import SITED, Aircraft, Scenario, Sensor
from multiradar.simulation.traffic import all_aircraft

Floats = NDArray[np.float64]

#: Maximum number of measurements of a scenario: they are held in memory.
MEASUREMENTS_MAX = 20_000_000

# Radius of the Earth for straight radio rays: refraction bends them by a quarter of the Earth's
# curvature. ITU-R P.834, section 3 (effective radius factor 4/3).
_RADIO_RADIUS_M = 4.0 / 3.0 * SEMI_MAJOR_AXIS_M


@dataclass(frozen=True, slots=True)
class Observation:
    """Simulation results of a scenario.

    Attributes
    ----------
    plane : SystemPlane
        The plane of the scenario on WGS 84.
    aircraft : tuple of Aircraft
        All aircraft, including the traffic.
    measurements : Measurements
        The measurements.
    biases : TrueBiases
        The true biases on a grid.
    opportunities : (m,) int64
        Detection opportunities of each sensor within its coverage, gaps included.
    copies : (m,) int64
        Measurements of each sensor that are received a second time.
    """

    plane: SystemPlane
    aircraft: tuple[Aircraft, ...]
    measurements: Measurements
    biases: TrueBiases
    opportunities: NDArray[np.int64]
    copies: NDArray[np.int64]


def observe(
    scenario: Scenario,
    rng: np.random.Generator,
    on_progress: Callable[[int], None] = lambda _: None,
) -> Observation:
    """Simulate the aircraft of a scenario over WGS 84 and the measurements of its sensors.

    Parameters
    ----------
    scenario : Scenario
        A flat one is placed on the ellipsoid around its centre: its coordinates become those of the
        system plane.
    rng : Generator
        For noise, detections, drift and random manoeuvres; it must be able to spawn. Every
        aircraft has its own stream.
    on_progress : callable
        Called with the number of aircraft done.

    Returns
    -------
    Observation
        Measurements and truth.

    Raises
    ------
    ConfigurationError
        If the scenario would give more than `MEASUREMENTS_MAX` measurements, or an aircraft flies
        too far from the centre.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.5) and (1.6), in polar form. Lines of sight over WGS 84
    are the project's own.
    """
    aircraft = all_aircraft(scenario)
    _check_size(scenario, aircraft)
    plane = SystemPlane(*scenario.centre_rad)
    bias_rng, phase_rng, clutter_rng, *own = rng.spawn(3 + len(aircraft))
    biases = simulate_biases(scenario.sensors, scenario.duration_s, bias_rng)
    phases = phase_rng.uniform(size=len(scenario.sensors))
    sky = _Sky(plane, scenario, biases, phases, _sites(scenario, plane, phase_rng))
    rows, (opportunities, copies) = [], np.zeros((2, len(scenario.sensors)), np.int64)
    for index, (one, stream) in enumerate(zip(aircraft, own, strict=True)):
        path = fly(one, scenario.duration_s, stream)
        own_rngs = stream.spawn(len(scenario.sensors))
        # Spawned after those of the sensors, whose numbers do not depend on it.
        (errors_rng,) = stream.spawn(1)
        for number, sensor_rng in enumerate(own_rngs):
            seen, count = _measured(sky, number, (index, one, path), sensor_rng)
            seen = _with_registers(sky, (one, path), seen, (errors_rng, sensor_rng))
            rows.append(seen)
            opportunities[number] += count
            feed = scenario.sensors[number].second_feed
            if feed is not None:
                rows.append(duplicated(seen, feed, *sensor_rng.spawn(1)))
                copies[number] += len(rows[-1])
        on_progress(index + 1)
    for number, stream in enumerate(clutter_rng.spawn(len(scenario.sensors))):
        plots = clutter_plots(scenario.sensors[number], scenario.duration_s, stream)
        rows.append(_row(sky, number, NO_AIRCRAFT, plots))
    made = without_lost_ranges(merge_unresolved(merged(rows), scenario.sensors), scenario.sensors)
    return Observation(plane, aircraft, made, biases, opportunities, copies)


@dataclass(frozen=True, slots=True)
class _Sky:
    plane: SystemPlane
    scenario: Scenario
    biases: TrueBiases
    phases: Floats
    sites: tuple[Site, ...]

    # Measurements of one aircraft by one sensor, and its detection opportunities within coverage.
    def measure(
        self, number: int, flown: tuple[int, Aircraft, Path], rng: np.random.Generator
    ) -> tuple[Measurements, int]:
        sensor, (_, _, path) = self.scenario.sensors[number], flown
        life = (path.start_s, path.end_s)
        if life[0] >= life[1]:
            return no_measurements(), 0
        if sensor.kind != "adsb" and not flown[1].exists:
            return no_measurements(), 0
        if sensor.kind in SITED:
            return self._plots(number, flown, life, rng)
        return self._reports(number, flown, life, rng)

    def _plots(
        self,
        number: int,
        flown: tuple[int, Aircraft, Path],
        life: tuple[float, float],
        rng: np.random.Generator,
    ) -> tuple[Measurements, int]:
        sensor, (index, aircraft, path) = self.scenario.sensors[number], flown
        line_of_sight = partial(_line_of_sight, sensor, self.sites[number], self.plane, path)
        rotating = sensor.rotation_period_s is not None
        times = detection_opportunities(
            sensor, float(self.phases[number]) if rotating else 0.0, life, line_of_sight
        )
        plots, opportunities = make_plots(
            sensor, times, line_of_sight, partial(self.biases.at, number), rng
        )
        if sensor.kind == "radar" and sensor.secondary and aircraft.transponder:
            plots = replace(plots, range_m=plots.range_m + aircraft.transponder_delay_m)
        height = received_heights(sensor, aircraft, path.height(plots.true_s), rng)
        garble = _garble(sensor, len(plots.time_s), rng)
        return _row(
            self, number, index, plots, path=path, height_m=height, garble=garble
        ), opportunities

    def _reports(
        self,
        number: int,
        flown: tuple[int, Aircraft, Path],
        life: tuple[float, float],
        rng: np.random.Generator,
    ) -> tuple[Measurements, int]:
        sensor, (index, aircraft, path) = self.scenario.sensors[number], flown
        if sensor.kind == "adsb" and not (aircraft.reports_position and aircraft.transponder):
            return no_measurements(), 0
        times = detection_opportunities(sensor, rng.uniform(), life)
        draws = rng.uniform(size=(2, len(times)))
        noise = sensor.position_sigma_m * rng.normal(size=(2, len(times)))
        outlier = draws[1] < sensor.outlier_probability
        noise += outlier * _far(rng, len(times))
        if sensor.kind == "adsb":
            wrong = _wrong_by(aircraft, times)
            noise += wrong
            outlier |= (wrong != 0.0).any(axis=0) | (not aircraft.exists)
        seen = (draws[0] < sensor.detection_probability) & outside_gaps(sensor, times)
        times, height = times[seen], path.height(times[seen])
        bias = self.biases.at(number, times)
        latitude, longitude = _displaced(self.plane, path.position(times), noise[:, seen].T)
        latitude, longitude = self._in_frame(number, latitude, longitude, bias)
        nothing = np.full(len(times), np.nan)
        stamp = times + bias[PARAMETER_TIME_OFFSET]
        plots = Plots(times, stamp, nothing, nothing, outlier[seen])
        return _row(
            self, number, index, plots, path=path if aircraft.exists else None,
            position=(latitude, longitude),
            height_m=received_heights(sensor, aircraft, height, rng),
        ), len(draws[0])  # fmt: skip

    # Positions as computed in a displaced and turned frame about the position of the sensor.
    def _in_frame(
        self, number: int, latitude: Floats, longitude: Floats, bias: Floats
    ) -> tuple[Floats, Floats]:
        if not self.scenario.sensors[number].has_frame:
            return latitude, longitude
        plane = SystemPlane(*self.sites[number].fixed[:2])
        east, north = plane.to_plane(latitude, longitude)
        turn = bias[PARAMETER_FRAME_ROTATION]
        sine, cosine = np.sin(turn), np.cos(turn)
        return plane.to_geodetic(
            cosine * east + sine * north + bias[PARAMETER_FRAME_EAST],
            cosine * north - sine * east + bias[PARAMETER_FRAME_NORTH],
        )


def _measured(
    sky: _Sky, number: int, flown: tuple[int, Aircraft, Path], rng: np.random.Generator
) -> tuple[Measurements, int]:
    try:
        return sky.measure(number, flown, rng)
    except OutsidePlaneError as error:
        aircraft, centre = flown[1], np.degrees(sky.scenario.centre_rad)
        raise ConfigurationError(
            f"aircraft {aircraft.track_number}: the flight goes more than {error.angle_max_deg:g} "
            f"degrees away from the centre of the plane {centre[0]:g}, {centre[1]:g}; check its "
            "position, speed_mps, end_s or life_s, and the duration_s of the scenario"
        ) from error


# Registers of the aircraft, with the measurements of one sensor.
def _with_registers(
    sky: _Sky,
    flown: tuple[Aircraft, Path],
    seen: Measurements,
    rngs: tuple[np.random.Generator, np.random.Generator],
) -> Measurements:
    aircraft, path = flown
    number = int(seen.sensor[0]) if len(seen) else 0
    reports = sky.scenario.sensors[number].aircraft_data
    if reports is None or not len(seen) or not (aircraft.exists and aircraft.transponder):
        return seen
    # The errors of the aircraft are the same for every sensor.
    errors = avionics(reports, (path.start_s, path.end_s), deepcopy(rngs[0]))
    true_s = seen.time_s - sky.biases.at(number, seen.time_s)[PARAMETER_TIME_OFFSET]
    registers = received_registers(
        reports, sky.scenario.atmosphere, (sky.plane, path, errors), true_s, rngs[1].spawn(1)[0]
    )
    return replace(seen, registers=registers)


# The line of sight on WGS 84.
def _line_of_sight(
    sensor: Sensor,
    site: Site,
    plane: SystemPlane,
    path: Path,
    time_s: Floats,
) -> LineOfSight:
    height = path.height(time_s)
    slant, azimuth, elevation = site.line_of_sight(
        time_s, *plane.to_geodetic(*path.position(time_s).T), height
    )
    visible = (slant >= sensor.range_min_m) & (slant <= sensor.range_max_m)
    visible &= elevation <= sensor.elevation_max_rad
    if sensor.horizon:
        heights = np.maximum(height, 0.0), np.maximum(site.at(time_s)[2], 0.0)
        visible &= slant <= sum(np.sqrt(2.0 * _RADIO_RADIUS_M * one) for one in heights)
    if sensor.earth_radius_factor is not None:
        slant = refracted_range(slant, height, site.at(time_s)[2], sensor.earth_radius_factor)
    return LineOfSight(slant, azimuth, visible, elevation)


def _row(
    sky: _Sky,
    number: int,
    index: int,
    plots: Plots,
    *,
    path: Path | None = None,
    position: tuple[Floats, Floats] | None = None,
    height_m: Floats | None = None,
    garble: NDArray[np.int32] | None = None,
) -> Measurements:
    count = len(plots.time_s)
    nothing = np.full(count, np.nan)
    latitude, longitude = (nothing, nothing) if position is None else position
    truth = [nothing] * 5 if path is None else _truth(sky.plane, path, plots.time_s)
    site = sky.sites[number]
    source = [nothing] * 3 if site.path is None else list(site.at(plots.true_s))
    elevation = nothing if plots.elevation_rad is None else plots.elevation_rad
    rest: list[NDArray[Any]] = [*truth, elevation, *source, no_registers(count)]
    return Measurements(
        plots.time_s, np.full(count, number, np.int32), np.full(count, index, np.int32),
        plots.range_m, plots.azimuth_rad, latitude, longitude,
        nothing if height_m is None else height_m,
        np.zeros(count, np.int32) if garble is None else garble, plots.outlier, *rest,
    )  # fmt: skip


def _truth(plane: SystemPlane, path: Path, time_s: Floats) -> list[Floats]:
    east, north, east_rate, north_rate = path.states(time_s).T
    height = path.height(time_s)
    latitude, longitude = plane.to_geodetic(east, north)
    speed, heading = plane.ground_velocity(east, north, east_rate, north_rate, height)
    return [latitude, longitude, height, speed, heading]


# Geodetic positions of points on the plane, displaced by (n, 2) true metres east and north.
def _displaced(plane: SystemPlane, position: Floats, by_m: Floats) -> tuple[Floats, Floats]:
    latitude, longitude = plane.to_geodetic(*position.T)
    level = enu_rotation(latitude, longitude)[:, :2]
    foot = geodetic_to_ecef(latitude, longitude, 0.0) + np.einsum("ni,nij->nj", by_m, level)
    latitude, longitude, _ = ecef_to_geodetic(foot)
    return latitude, longitude


# Errors of the reported positions, (2, n) true metres east and north.
def _wrong_by(aircraft: Aircraft, time_s: Floats) -> Floats:
    wrong = np.zeros((2, len(time_s)))
    for error in aircraft.report_errors:
        since = time_s - error.start_s
        holds = (since >= 0.0) & (time_s < error.end_s)
        wrong[0, holds] += error.east_m + error.east_mps * since[holds]
        wrong[1, holds] += error.north_m + error.north_mps * since[holds]
    return wrong


# Garbled bits of the codes: one to four of twelve. Drawn last, so that no other number of a
# stream depends on it.
def _garble(sensor: Sensor, count: int, rng: np.random.Generator) -> NDArray[np.int32]:
    if sensor.garbled_probability == 0.0:
        return np.zeros(count, np.int32)
    chosen = rng.uniform(size=count) < sensor.garbled_probability
    bits = rng.integers(0, 12, size=(4, count))
    masks = np.bitwise_or.reduce(1 << bits, axis=0)
    return np.where(chosen, masks, 0).astype(np.int32)


def _far(rng: np.random.Generator, count: int) -> Floats:
    course, metres = rng.uniform(0.0, 2.0 * np.pi, count), rng.uniform(2e3, 2e4, count)
    return np.asarray(metres * np.stack([np.sin(course), np.cos(course)]))


def _sites(scenario: Scenario, plane: SystemPlane, rng: np.random.Generator) -> tuple[Site, ...]:
    latitude, longitude = plane.to_geodetic(
        np.array([one.east_m for one in scenario.sensors]),
        np.array([one.north_m for one in scenario.sensors]),
    )
    heights = [one.height_m for one in scenario.sensors]
    return tuple(
        site_of(sensor, (float(a), float(b), h), plane, scenario.duration_s, rng)
        for sensor, a, b, h in zip(scenario.sensors, latitude, longitude, heights, strict=True)
    )


def _check_size(scenario: Scenario, aircraft: tuple[Aircraft, ...]) -> None:
    lives = sum(max(min(one.end_s, scenario.duration_s) - one.start_s, 0.0) for one in aircraft)
    periods = [one.rotation_period_s or one.interval_s for one in scenario.sensors]
    clutter = [
        one.clutter_per_turn + sum(storm.plots_per_turn for storm in one.clutter_bursts)
        for one in scenario.sensors
    ]
    feeds = [1.0 if one.second_feed is None else 2.0 for one in scenario.sensors]
    count = sum(times * lives / period for times, period in zip(feeds, periods, strict=True))
    count += sum(
        scenario.duration_s / period * plots for period, plots in zip(periods, clutter, strict=True)
    )
    if count > MEASUREMENTS_MAX:
        raise ConfigurationError(
            f"scenario {scenario.title!r}: expected at most {MEASUREMENTS_MAX} measurements, "
            f"found about {count:.3g}; reduce the duration or the number of aircraft"
        )
