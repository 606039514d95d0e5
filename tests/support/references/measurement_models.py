"""What the reference filters know of the radars: three ways to read a plot."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.angles import wrapped
from multiradar.estimation.measurement.linearised import cartesian_plot
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.geodesy import _kernels as kernels
from multiradar.geodesy.system_plane import SystemPlane
from support.references.linearised import bias_matrix, cartesian_bias_matrix, cartesian_noise
from support.references.reference_filters import Linearised, Observation
from support.scenarios.scenes import flat_sites

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FlatRadars:
    """Radars on a flat plane, range and azimuth offset each; ς is ordered radar by radar."""

    sites_m: Floats
    range_sigma_m: float
    azimuth_sigma_rad: float

    def columns(self, radar: int) -> slice:
        return slice(2 * radar, 2 * radar + 2)


@dataclass(frozen=True)
class FlatCartesian(FlatRadars):
    """The linearised form (1.11): the plot as a place, linearised at the estimate."""

    def linearise(self, observation: Observation, state: Floats) -> Linearised:
        site = self.sites_m[observation.radar]
        matrix = cartesian_bias_matrix(site, state[:2])
        by_bias = np.zeros((2, 2 * len(self.sites_m)))
        by_bias[:, self.columns(observation.radar)] = matrix
        place = cartesian_plot(site, observation.value[0], observation.value[1])
        noise = cartesian_noise(matrix, self.range_sigma_m, self.azimuth_sigma_rad)
        return Linearised(place - state[:2], np.eye(2, 4), by_bias, noise)


@dataclass(frozen=True)
class FlatPolar(FlatRadars):
    """Range and azimuth as they are; biases enter as J = I."""

    def linearise(self, observation: Observation, state: Floats) -> Linearised:
        line = state[:2] - self.sites_m[observation.radar]
        length = float(np.hypot(*line))
        by_state = np.zeros((2, 4))
        by_state[0, :2] = line / length
        by_state[1, :2] = np.array([line[1], -line[0]]) / length**2
        by_bias = np.zeros((2, 2 * len(self.sites_m)))
        by_bias[:, self.columns(observation.radar)] = np.eye(2)
        miss = observation.value - np.array([length, np.arctan2(line[0], line[1])])
        miss[1] = wrapped(miss[1])
        noise = np.diag([self.range_sigma_m**2, self.azimuth_sigma_rad**2])
        return Linearised(miss, by_state, by_bias, noise)


class Flat:
    """A flat plane with any bias parameters; plots as they are, or as the places they point to."""

    def __init__(self, plane: SystemPlane, sensors: SensorTable, *, as_places: bool) -> None:
        self._sensors, self._as_places = sensors, as_places
        self._sites = flat_sites(plane, sensors)

    def linearise(self, observation: Observation, state: Floats) -> Linearised:
        sensors, radar = self._sensors, observation.radar
        by_bias = np.zeros((2, len(sensors.parameter_kind)))
        if observation.is_position:
            noise = np.eye(2) * sensors.position_sigma_m[radar] ** 2
            return Linearised(observation.value - state[:2], np.eye(2, 4), by_bias, noise)
        site, own = self._sites[radar], np.flatnonzero(sensors.parameter_sensor == radar)
        matrix = cartesian_bias_matrix(site, state[:2])  # D: place by range and azimuth
        by_state = np.zeros((2, 4))
        by_state[:, :2] = np.linalg.inv(matrix)
        line = state[:2] - site
        seen = np.array([np.hypot(*line), np.arctan2(*line)])
        rates = by_state[:, :2] @ state[2:]
        by_bias[:, own] = bias_matrix(sensors.parameter_kind[own], seen[0], rates[0], rates[1])
        sigmas = sensors.range_sigma_m[radar], sensors.azimuth_sigma_rad[radar]
        if self._as_places:
            place = cartesian_plot(site, observation.value[0], observation.value[1])
            noise = cartesian_noise(matrix, *sigmas)
            return Linearised(place - state[:2], np.eye(2, 4), matrix @ by_bias, noise)
        miss = observation.value - seen
        miss[1] = wrapped(miss[1])
        return Linearised(miss, by_state, by_bias, np.diag(np.square(sigmas)))


class EllipsoidPolar:
    """Slant range and azimuth on WGS 84 with any bias parameters; also reported positions."""

    def __init__(self, plane: SystemPlane, sensors: SensorTable) -> None:
        self._plane, self._sensors = plane, sensors
        self._sites = [
            kernels.site_parameters(plane.parameters, *site)
            for site in zip(
                sensors.latitude_rad, sensors.longitude_rad, sensors.height_m, strict=True
            )
        ]

    def linearise(self, observation: Observation, state: Floats) -> Linearised:
        sensors, radar = self._sensors, observation.radar
        if observation.is_position:
            none = np.zeros((2, len(sensors.parameter_kind)))
            noise = np.eye(2) * sensors.position_sigma_m[radar] ** 2
            return Linearised(observation.value - state[:2], np.eye(2, 4), none, noise)
        seen = kernels.predict_polar(
            self._plane.parameters, self._sites[radar], state[0], state[1], observation.height_m
        )
        by_state = np.zeros((2, 4))
        by_state[:, :2] = np.array(seen[2:6]).reshape(2, 2)
        rates = by_state[:, :2] @ state[2:]
        by_bias = np.zeros((2, len(sensors.parameter_kind)))
        own = np.flatnonzero(sensors.parameter_sensor == radar)
        by_bias[:, own] = bias_matrix(sensors.parameter_kind[own], seen[0], rates[0], rates[1])
        miss = observation.value - np.array(seen[:2])
        miss[1] = wrapped(miss[1])
        noise = np.diag([sensors.range_sigma_m[radar] ** 2, sensors.azimuth_sigma_rad[radar] ** 2])
        return Linearised(miss, by_state, by_bias, noise)
