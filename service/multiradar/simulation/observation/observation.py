"""What the sensors of a scene see of it on WGS 84, and the truth of every measurement."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import ConfigurationError, OutsidePlaneError
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.geodesy.wgs84 import (
    SEMI_MAJOR_AXIS_M,
    ecef_to_geodetic,
    enu_rotation,
    geodetic_to_ecef,
)
from multiradar.simulation.biases import TrueBiases, walk_biases
from multiradar.simulation.observation.clutter import clutter_plots
from multiradar.simulation.observation.copies import copied
from multiradar.simulation.observation.heights import heard_heights
from multiradar.simulation.observation.jamming import without_lost_ranges
from multiradar.simulation.observation.looks import (
    Line,
    Plots,
    look_times,
    make_plots,
    outside_gaps,
)
from multiradar.simulation.observation.measurements import NO_AIRCRAFT, Measurements, merged, none
from multiradar.simulation.observation.resolution import unresolved
from multiradar.simulation.observation.sources import Site, site_of
from multiradar.simulation.paths import Path, fly
from multiradar.simulation.scenario.scene import SITED, Aircraft, Scene, Sensor
from multiradar.simulation.traffic import all_aircraft

Floats = NDArray[np.float64]

#: A scene that may give more measurements than this is refused: they are made in memory.
MEASUREMENTS_MAX = 20_000_000

# Radius of the Earth on which rays of radio are straight: refraction bends them by a quarter of
# the Earth's curvature. ITU-R P.834, section 3 (effective radius factor 4/3).
_RADIO_RADIUS_M = 4.0 / 3.0 * SEMI_MAJOR_AXIS_M


@dataclass(frozen=True, slots=True)
class Observation:
    """All that comes of a scene.

    Attributes
    ----------
    plane : SystemPlane
        The plane of the scene on WGS 84.
    aircraft : tuple of Aircraft
        All of them, the traffic included.
    measurements : Measurements
        What was measured.
    biases : TrueBiases
        The true biases on a grid.
    looks : (m,) int64
        How often each sensor looked at an aircraft within its coverage, gaps included.
    copies : (m,) int64
        Measurements of each sensor that came a second time.
    """

    plane: SystemPlane
    aircraft: tuple[Aircraft, ...]
    measurements: Measurements
    biases: TrueBiases
    looks: NDArray[np.int64]
    copies: NDArray[np.int64]


def observe(
    scene: Scene, rng: np.random.Generator, on_progress: Callable[[int], None] = lambda _: None
) -> Observation:
    """Fly the aircraft of a scene over WGS 84 and let its sensors measure them.

    Parameters
    ----------
    scene : Scene
        A flat one is laid on the ellipsoid around its centre: its coordinates become those of the
        system plane.
    rng : Generator
        For noise, detections, drift and random manoeuvres; it must be able to spawn. Every
        aircraft has its own stream.
    on_progress : callable
        Is told the number of aircraft done.

    Returns
    -------
    Observation
        Measurements and truth.

    Raises
    ------
    ConfigurationError
        If the scene would give more than `MEASUREMENTS_MAX` measurements, or an aircraft flies too
        far from the centre.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.5) and (1.6), in polar form. Lines of sight over WGS 84
    are the project's own.
    """
    aircraft = all_aircraft(scene)
    _check_size(scene, aircraft)
    plane = SystemPlane(*scene.centre_rad)
    bias_rng, phase_rng, clutter_rng, *own = rng.spawn(3 + len(aircraft))
    biases = walk_biases(scene.sensors, scene.duration_s, bias_rng)
    phases = phase_rng.uniform(size=len(scene.sensors))
    sky = _Sky(plane, scene, biases, phases, _sites(scene, plane, phase_rng))
    rows, (looks, copies) = [], np.zeros((2, len(scene.sensors)), np.int64)
    for index, (one, stream) in enumerate(zip(aircraft, own, strict=True)):
        path = fly(one, scene.duration_s, stream)
        for number, sensor_rng in enumerate(stream.spawn(len(scene.sensors))):
            seen, looked = _watched(sky, number, (index, one, path), sensor_rng)
            rows.append(seen)
            looks[number] += looked
            feed = scene.sensors[number].second_feed
            if feed is not None:
                rows.append(copied(seen, feed, *sensor_rng.spawn(1)))
                copies[number] += len(rows[-1])
        on_progress(index + 1)
    for number, stream in enumerate(clutter_rng.spawn(len(scene.sensors))):
        plots = clutter_plots(scene.sensors[number], scene.duration_s, stream)
        rows.append(_row(sky, number, NO_AIRCRAFT, plots))
    made = without_lost_ranges(unresolved(merged(rows), scene.sensors), scene.sensors)
    return Observation(plane, aircraft, made, biases, looks, copies)


@dataclass(frozen=True, slots=True)
class _Sky:
    plane: SystemPlane
    scene: Scene
    biases: TrueBiases
    phases: Floats
    sites: tuple[Site, ...]

    # Measurements of one aircraft by one sensor, and the number of looks within its coverage.
    def watch(
        self, number: int, flown: tuple[int, Aircraft, Path], rng: np.random.Generator
    ) -> tuple[Measurements, int]:
        sensor, (_, _, path) = self.scene.sensors[number], flown
        life = (path.start_s, path.end_s)
        if life[0] >= life[1]:
            return none(), 0
        if sensor.kind != "adsb" and not flown[1].exists:
            return none(), 0
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
        sensor, (index, aircraft, path) = self.scene.sensors[number], flown
        look = partial(_line, sensor, self.sites[number], self.plane, path)
        turning = sensor.rotation_period_s is not None
        times = look_times(sensor, float(self.phases[number]) if turning else 0.0, life, look)
        plots, looks = make_plots(sensor, times, look, partial(self.biases.at, number), rng)
        height = heard_heights(sensor, aircraft, path.height(plots.true_s), rng)
        garble = _garble(sensor, len(plots.time_s), rng)
        return _row(self, number, index, plots, path=path, height_m=height, garble=garble), looks

    def _reports(
        self,
        number: int,
        flown: tuple[int, Aircraft, Path],
        life: tuple[float, float],
        rng: np.random.Generator,
    ) -> tuple[Measurements, int]:
        sensor, (index, aircraft, path) = self.scene.sensors[number], flown
        if sensor.kind == "adsb" and not (aircraft.reports_position and aircraft.transponder):
            return none(), 0
        times = look_times(sensor, rng.uniform(), life)
        chance = rng.uniform(size=(2, len(times)))
        noise = sensor.position_sigma_m * rng.normal(size=(2, len(times)))
        outlier = chance[1] < sensor.outlier_probability
        noise += outlier * _far(rng, len(times))
        if sensor.kind == "adsb":
            wrong = _wrong_by(aircraft, times)
            noise += wrong
            outlier |= (wrong != 0.0).any(axis=0) | (not aircraft.exists)
        seen = (chance[0] < sensor.detection_probability) & outside_gaps(sensor, times)
        times, height = times[seen], path.height(times[seen])
        latitude, longitude = _displaced(self.plane, path.place(times), noise[:, seen].T)
        nothing = np.full(len(times), np.nan)
        plots = Plots(times, times, nothing, nothing, outlier[seen])
        return _row(
            self, number, index, plots, path=path if aircraft.exists else None,
            position=(latitude, longitude),
            height_m=heard_heights(sensor, aircraft, height, rng),
        ), len(chance[0])  # fmt: skip


def _watched(
    sky: _Sky, number: int, flown: tuple[int, Aircraft, Path], rng: np.random.Generator
) -> tuple[Measurements, int]:
    try:
        return sky.watch(number, flown, rng)
    except OutsidePlaneError as error:
        aircraft, centre = flown[1], np.degrees(sky.scene.centre_rad)
        raise ConfigurationError(
            f"aircraft {aircraft.track_number}: expected a flight within {error.angle_max_deg:g} "
            f"degrees of the plane's centre {centre[0]:g}, {centre[1]:g}, flew beyond; see its "
            "place, speed_mps, end_s or life_s, and the scene's duration_s"
        ) from error


# The line of sight on WGS 84.
def _line(
    sensor: Sensor,
    site: Site,
    plane: SystemPlane,
    path: Path,
    time_s: Floats,
) -> Line:
    height = path.height(time_s)
    slant, azimuth, elevation = site.sees(time_s, *plane.to_geodetic(*path.place(time_s).T), height)
    visible = (slant >= sensor.range_min_m) & (slant <= sensor.range_max_m)
    visible &= elevation <= sensor.elevation_max_rad
    if sensor.horizon:
        heights = np.maximum(height, 0.0), np.maximum(site.at(time_s)[2], 0.0)
        visible &= slant <= sum(np.sqrt(2.0 * _RADIO_RADIUS_M * one) for one in heights)
    return Line(slant, azimuth, visible, elevation)


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
    rest = [*truth, elevation, *source]
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


# Geodetic positions of places on the plane, displaced by (n, 2) true metres east and north.
def _displaced(plane: SystemPlane, place: Floats, by_m: Floats) -> tuple[Floats, Floats]:
    latitude, longitude = plane.to_geodetic(*place.T)
    level = enu_rotation(latitude, longitude)[:, :2]
    foot = geodetic_to_ecef(latitude, longitude, 0.0) + np.einsum("ni,nij->nj", by_m, level)
    latitude, longitude, _ = ecef_to_geodetic(foot)
    return latitude, longitude


# By what the reported positions are wrong, (2, n) true metres east and north.
def _wrong_by(aircraft: Aircraft, time_s: Floats) -> Floats:
    wrong = np.zeros((2, len(time_s)))
    for error in aircraft.report_errors:
        since = time_s - error.start_s
        holds = (since >= 0.0) & (time_s < error.end_s)
        wrong[0, holds] += error.east_m + error.east_mps * since[holds]
        wrong[1, holds] += error.north_m + error.north_mps * since[holds]
    return wrong


# Bits of the codes that are heard wrongly: one to four of twelve. Drawn last, so that no other
# number of a stream depends on it.
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


def _sites(scene: Scene, plane: SystemPlane, rng: np.random.Generator) -> tuple[Site, ...]:
    latitude, longitude = plane.to_geodetic(
        np.array([one.east_m for one in scene.sensors]),
        np.array([one.north_m for one in scene.sensors]),
    )
    heights = [one.height_m for one in scene.sensors]
    return tuple(
        site_of(sensor, (float(a), float(b), h), plane, scene.duration_s, rng)
        for sensor, a, b, h in zip(scene.sensors, latitude, longitude, heights, strict=True)
    )


def _check_size(scene: Scene, aircraft: tuple[Aircraft, ...]) -> None:
    lives = sum(max(min(one.end_s, scene.duration_s) - one.start_s, 0.0) for one in aircraft)
    periods = [one.rotation_period_s or one.interval_s for one in scene.sensors]
    clutter = [
        one.clutter_per_turn + sum(storm.plots_per_turn for storm in one.storms)
        for one in scene.sensors
    ]
    feeds = [1.0 if one.second_feed is None else 2.0 for one in scene.sensors]
    count = sum(times * lives / period for times, period in zip(feeds, periods, strict=True))
    count += sum(
        scene.duration_s / period * plots for period, plots in zip(periods, clutter, strict=True)
    )
    if count > MEASUREMENTS_MAX:
        raise ConfigurationError(
            f"scene {scene.title!r}: expected at most {MEASUREMENTS_MAX} measurements, "
            f"was about {count:.3g}; shorten it or take fewer aircraft"
        )
