"""Position of an aircraft by triangulation of bearings, with elevations: least squares.

The aircraft is assumed to fly straight. With an elevation the height is estimated as well, with the
received or assumed height as prior. A known height then gives a distance; an unknown one is
determined by elevations at a known position.

A fit is accepted if it converged, lies ahead of all sources at a plausible speed, agrees with the
bearings within their errors, and has the required accuracy of distance.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import BearingsError
from multiradar.estimation.bias.store import BiasState
from multiradar.estimation.filters._kernels import (
    ACCELERATION_DENSITY,
    ASSUMED_HEIGHT,
    ASSUMED_HEIGHT_SIGMA,
    SEVERAL,
)
from multiradar.estimation.filters.arrays import Model
from multiradar.estimation.filters.bearings_only import initiate
from multiradar.estimation.filters.height._height_kernels import COARSE_STEP_M, slant_of_direction
from multiradar.estimation.gaussian import symmetric_part
from multiradar.estimation.measurement._kernels import expected_measurement, sine_by_height
from multiradar.estimation.measurement.angles import wrapped
from multiradar.estimation.measurement.kinds import KIND_DIRECTION
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_COSINE,
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_AZIMUTH_SINE,
    PARAMETER_TIME_OFFSET,
    SensorTable,
)
from multiradar.estimation.measurement.sights import Sight
from multiradar.geodesy import _kernels as geodesy
from multiradar.tracking.bearings.waiting_bearings import WaitingBearing
from multiradar.tracking.pool import Start

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

# Iterations on the ellipsoid, each shortened until the fit improves; a handful is usual. They have
# converged when a step is below a hundredth of the errors.
_ROUNDS_MAX = 40
_HALVINGS_MAX = 12
_SETTLED_SIGMAS = 1e-2
# Bound of the misfit of a straight flight, in standard deviations of the sum of squares.
_MISFIT_SIGMAS_MAX = 5.0


class Bounds(NamedTuple):
    """Requirements on the position of a new track.

    Attributes
    ----------
    speed_sigma_mps : float
        Prior standard deviation of each velocity component, m/s.
    speed_max_mps : float
        Maximum speed of aircraft, m/s.
    distance_share_max : float
        Largest ratio of the position error (worst axis) to the distance of the nearest source.
    """

    speed_sigma_mps: float
    speed_max_mps: float
    distance_share_max: float


def locate(
    seen: list[WaitingBearing],
    sensors: SensorTable,
    bounds: Bounds,
    model: Model,
    biases: BiasState,
) -> Start | None:
    """Return the initial state of a track by these bearings.

    Parameters
    ----------
    seen : list of WaitingBearing
        The bearings, by ascending time.
    sensors : SensorTable
        The sensors.
    bounds : Bounds
        Requirements on the position.
    model : Model
        The sensors on the plane.
    biases : BiasState
        Published biases.

    Returns
    -------
    Start or None
        State at the time of the last bearing; None where the position is not accurate enough, or
        the bearings do not fit a plausible flight.

    Raises
    ------
    BearingsError
        If the bearings do not intersect and no elevation gives a distance, or the fit did not
        converge.
    LinAlgError
        If the fit diverges.
    """
    fit = _Fit(seen, sensors, bounds.speed_sigma_mps, model, biases)
    mean, covariance, sensitivity = fit.solved()
    if not (np.hypot(*mean[2:4]) <= bounds.speed_max_mps and fit.explains(mean, biases)):
        return None
    spread = covariance + sensitivity @ biases.covariance @ sensitivity.T
    nearest = min(float(np.hypot(*(mean[:2] - _position(one.site)))) for one in seen)
    worst = float(np.sqrt(np.linalg.eigvalsh(spread[:2, :2])[-1]))
    if not worst <= bounds.distance_share_max * nearest:
        return None
    bare = mean - sensitivity @ biases.estimate
    height_m, height_variance_m2 = fit.height_m, fit.height_sigma_m**2
    if fit.elevated:
        height_m, height_variance_m2 = float(mean[4]), float(spread[4, 4])
    observers = {one.sensor for one in seen}
    return Start(
        seen[-1].time_s, bare[:4], covariance[:4, :4], sensitivity[:4], height_m,
        height_variance_m2,
        int(model.site_numbers[seen[-1].sensor]) if len(observers) == 1 else SEVERAL,
    )  # fmt: skip


class _Fit:
    # Unknowns: position and velocity on the plane, and the height if there are elevations.

    def __init__(
        self, seen: list[WaitingBearing], sensors: SensorTable, speed_sigma_mps: float,
        model: Model, biases: BiasState,
    ) -> None:  # fmt: skip
        self._seen, self._model, self._speed_sigma_mps = seen, model, speed_sigma_mps
        self._estimate = biases.estimate
        self._azimuth = np.array([one.azimuth_rad for one in seen])
        self._sigmas = sensors.azimuth_sigma_rad[[one.sensor for one in seen]]
        # Rows with an elevation.
        self._elevated = [
            index for index, one in enumerate(seen) if not np.isnan(one.elevation_rad)
        ]
        self._elevation_sigmas = sensors.elevation_sigma_rad[[one.sensor for one in seen]]
        self._moving = any(one.moving for one in seen)
        heard = [one.height_m for one in seen if not np.isnan(one.height_m)]
        options = model.options
        self.height_m = heard[-1] if heard else float(options[ASSUMED_HEIGHT])
        self.height_sigma_m = COARSE_STEP_M if heard else float(options[ASSUMED_HEIGHT_SIGMA])
        if not self.elevated:
            # A bearing does not depend on the height.
            self.height_m = float(options[ASSUMED_HEIGHT])
            self.height_sigma_m = float(options[ASSUMED_HEIGHT_SIGMA])
        loose = [0.0, 0.0, speed_sigma_mps**-2, speed_sigma_mps**-2]
        known = [0.0, 0.0, 0.0, 0.0]
        if self.elevated:
            loose, known = [*loose, self.height_sigma_m**-2], [*known, self.height_m]
        self._prior, self._known = np.diag(loose), np.array(known)

    @property
    def elevated(self) -> bool:
        return len(self._elevated) > 0

    # First on a flat plane, for a linearisation point, then on the ellipsoid. The covariance is
    # that at convergence: at an earlier iterate the distance may be quite different.
    def solved(self) -> tuple[Floats, Floats, Floats]:
        mean = self._guess()
        for _ in range(_ROUNDS_MAX):
            slopes, residual, sigmas, by_bias = self._rows(mean)
            weighted = slopes.T / sigmas**2
            information = weighted @ slopes + self._prior
            step = np.linalg.solve(
                information, weighted @ residual + self._prior @ (self._known - mean)
            )
            if step @ information @ step <= _SETTLED_SIGMAS**2:
                covariance = symmetric_part(np.asarray(np.linalg.inv(information), np.float64))
                # A bias rotates the bearings: χ = a + V ς.
                return mean, covariance, np.asarray(-covariance @ weighted @ by_bias)
            mean = mean + self._shortened(mean, np.asarray(step), residual, sigmas) * step
        raise BearingsError(
            "NOT_OBSERVABLE", f"position fit did not converge in {_ROUNDS_MAX} iterations"
        )

    def explains(self, mean: Floats, biases: BiasState) -> bool:
        """Whether residuals of bearings and of the prior agree with their errors."""
        _, residual, sigmas, by_bias = self._rows(mean)
        if not (np.abs(residual[: len(self._seen)]) < np.pi / 2.0).all():
            # Lines also intersect behind a source.
            return False
        noise = np.diag(sigmas**2) + by_bias @ biases.covariance @ by_bias.T
        off = self._known - mean
        misfit = residual @ np.linalg.solve(noise, residual) + off @ self._prior @ off
        n = len(residual)
        return bool(misfit <= n + _MISFIT_SIGMAS_MAX * np.sqrt(2.0 * n))

    # Step size that improves the fit, with fixed sigmas.
    def _shortened(self, mean: Floats, step: Floats, residual: Floats, sigmas: Floats) -> float:
        before = self._misfit(mean, residual, sigmas)
        share = 1.0
        for _ in range(_HALVINGS_MAX):
            there = mean + share * step
            if self._misfit(there, self._rows(there)[1], sigmas) < before:
                return share
            share /= 2.0
        raise BearingsError("NOT_OBSERVABLE", "position fit did not converge")

    def _misfit(self, mean: Floats, residual: Floats, sigmas: Floats) -> float:
        off = self._known - mean
        return float(np.sum((residual / sigmas) ** 2) + off @ self._prior @ off)

    # Derivatives, residuals, sigmas and columns J of the biases, of azimuths and then elevations.
    def _rows(self, mean: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        slopes = np.zeros((len(self._seen) + len(self._elevated), len(mean)))
        residual, sigmas = np.empty(len(slopes)), np.empty(len(slopes))
        by_bias = np.zeros((len(slopes), len(self._estimate)))
        height_m = float(mean[4]) if self.elevated else self.height_m
        for index, one in enumerate(self._seen):
            ago, east, north = self._position_at(one, mean)
            at = geodesy.predict_polar(self._model.plane, one.site, east, north, height_m)
            slopes[index, :4] = at[4], at[5], ago * at[4], ago * at[5]
            rate = at[4] * mean[2] + at[5] * mean[3]
            own = self._columns_of(one)
            by_bias[index, own] = _by_biases(self._model.parameters[own], at[1], rate)
            turned = by_bias[index, own] @ self._estimate[own]
            residual[index] = wrapped(self._azimuth[index] - turned - at[1])
            sigmas[index] = self._sigmas[index]
            if self._moving:
                sigmas[index] = np.sqrt(
                    self._sigmas[index] ** 2 + self._manoeuvre_variance(ago) / at[6] ** 2
                )
        for row, index in enumerate(self._elevated, len(self._seen)):
            one, sigma = self._seen[index], self._elevation_sigmas[index]
            ago, east, north = self._position_at(one, mean)
            noise = np.array([sigma**2, 1.0, 0.0, one.site[geodesy.HEIGHT]])
            sine, _, ground, h, w = expected_measurement(
                KIND_DIRECTION, self._model.plane, one.site, noise, east, north, height_m, 0.0
            )
            slopes[row, :4] = h[0], h[1], ago * h[0], ago * h[1]
            slopes[row, 4] = sine_by_height(sine, ground)
            own = self._columns_of(one)
            # Of all biases, only a late time stamp changes an elevation.
            late = self._model.parameters[own] == PARAMETER_TIME_OFFSET
            by_bias[row, own] = late * -(h[0] * mean[2] + h[1] * mean[3])
            turned = by_bias[row, own] @ self._estimate[own]
            residual[row] = np.sin(one.elevation_rad) - turned - sine
            sigmas[row] = np.sqrt(w[0])
        return slopes, residual, sigmas, by_bias

    def _columns_of(self, one: WaitingBearing) -> slice:
        return slice(self._model.starts[one.sensor], self._model.starts[one.sensor + 1])

    # Azimuths of a resting aircraft far away: its rate and its distance are not known yet.
    def _azimuth_far_away(self) -> Floats:
        turned = []
        for one in self._seen:
            own = self._columns_of(one)
            by_bias = _by_biases(self._model.parameters[own], one.azimuth_rad, 0.0)
            turned.append(by_bias @ self._estimate[own])
        return self._azimuth - np.array(turned)

    # Time of a bearing relative to the last one, and the position of the aircraft then.
    def _position_at(self, one: WaitingBearing, mean: Floats) -> tuple[float, float, float]:
        ago = one.time_s - self._seen[-1].time_s
        east, north = mean[:2] + ago * mean[2:4]
        return ago, float(east), float(north)

    # Variance, m², of straight flight over a time, by the white acceleration of the filter. It
    # matters over the minutes that a moving source needs.
    def _manoeuvre_variance(self, ago: float) -> float:
        return float(self._model.options[ACCELERATION_DENSITY]) * abs(ago) ** 3 / 3.0

    def _guess(self) -> Floats:
        times = np.array([one.time_s for one in self._seen])
        azimuth = self._azimuth_far_away()
        sights = [
            _flat(one.site, angle, sigma)
            for one, angle, sigma in zip(
                self._seen, azimuth.tolist(), self._sigmas.tolist(), strict=True
            )
        ]
        try:
            mean, _ = initiate(sights, times, self._speed_sigma_mps).estimate()
        except BearingsError:
            if not self.elevated:
                raise
            mean = self._guess_by_elevation(azimuth)
        return np.append(mean, self.height_m) if self.elevated else mean

    # Median of the positions given by each elevation at the height.
    def _guess_by_elevation(self, azimuths: Floats) -> Floats:
        positions = []
        for index in self._elevated:
            one, azimuth = self._seen[index], float(azimuths[index])
            rise = self.height_m - float(one.site[geodesy.HEIGHT])
            slant = slant_of_direction(np.sin(one.elevation_rad), rise)
            found, east, north = geodesy.locate_polar(
                self._model.plane, one.site, slant, azimuth, self.height_m
            )
            if found:
                positions.append((east, north))
        if not positions:
            raise BearingsError("NOT_OBSERVABLE", "no elevation yields a distance")
        return np.append(np.median(np.array(positions), axis=0), [0.0, 0.0])


# The azimuth part of the columns J of `bias_column` for bearings, of which the shift of a frame has
# none.
def _by_biases(kinds: Integers, azimuth_rad: float, rate: float) -> Floats:
    sine, cosine = np.sin(azimuth_rad), np.cos(azimuth_rad)
    turned = {
        PARAMETER_AZIMUTH_OFFSET: 1.0,
        PARAMETER_TIME_OFFSET: -rate,
        PARAMETER_AZIMUTH_SINE: sine,
        PARAMETER_AZIMUTH_COSINE: cosine,
    }
    return np.array([turned.get(kind, 0.0) for kind in kinds.tolist()], np.float64)


def _position(site: Floats) -> Floats:
    return np.array([site[geodesy.PE], site[geodesy.PN]])


# A bearing on a flat plane: azimuth at the site, rotated to the plane's north.
def _flat(site: Floats, azimuth_rad: float, sigma_rad: float) -> Sight:
    sine, cosine = np.sin(azimuth_rad), np.cos(azimuth_rad)
    east = sine * site[geodesy.EE] + cosine * site[geodesy.NE]
    north = sine * site[geodesy.EN] + cosine * site[geodesy.NN]
    return Sight(_position(site), np.asarray(np.arctan2(east, north)), sigma_rad)
