"""Where an aircraft is by bearings alone, perhaps with elevations: least squares on the ellipsoid.

It flies straight meanwhile. With an elevation the height is looked for as well: what was heard of
it, or what is assumed of every aircraft, is its prior, so that a height that is known makes the
elevation a distance, and one that is not is told by elevations of a place that is.

A place is believed where the search came to rest, ahead of all sources, at a speed that aircraft
fly, with bearings that are as far from it as their errors; and where the distance is told as well
as asked.
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
from multiradar.estimation.measurement._kernels import (
    KIND_DIRECTION,
    expected_measurement,
    sine_by_height,
)
from multiradar.estimation.measurement.angles import wrapped
from multiradar.estimation.measurement.sensors import PARAMETER_AZIMUTH_OFFSET, SensorTable
from multiradar.estimation.measurement.sights import Sight
from multiradar.geodesy import _kernels as geodesy
from multiradar.tracking.bearings.bearings_seen import Seen
from multiradar.tracking.pool import Start

Floats = NDArray[np.float64]

# Rounds on the ellipsoid, each of them shortened until it fits better; a handful is usual. It is at
# rest when a round moves it by less than a hundredth of its errors.
_ROUNDS_MAX = 40
_HALVINGS_MAX = 12
_SETTLED_SIGMAS = 1e-2
# Bearings are of one aircraft that flies straight up to so many sigmas of the sum of their squares.
_MISFIT_SIGMAS_MAX = 5.0


class Bounds(NamedTuple):
    """What is asked of a place at which a track begins.

    Attributes
    ----------
    speed_sigma_mps : float
        What is known beforehand of each component of the velocity, m/s.
    speed_max_mps : float
        No aircraft is faster, m/s.
    distance_share_max : float
        Worst sigma of the place over the distance of the nearest source.
    """

    speed_sigma_mps: float
    speed_max_mps: float
    distance_share_max: float


def locate(
    seen: list[Seen],
    sensors: SensorTable,
    bounds: Bounds,
    model: Model,
    biases: BiasState,
) -> Start | None:
    """Return a track as these bearings begin it.

    Parameters
    ----------
    seen : list of Seen
        In the order of time.
    sensors : SensorTable
        The sensors.
    bounds : Bounds
        What is asked of the place.
    model : Model
        The sensors on the plane.
    biases : BiasState
        As published.

    Returns
    -------
    Start or None
        Of the time of the last bearing; None where the place would be too loose, or no aircraft
        flew as the bearings say.

    Raises
    ------
    BearingsError
        If the lines of sight do not cross, and no elevation tells a distance.
    LinAlgError
        If the search runs away.
    """
    fit = _Fit(seen, sensors, bounds.speed_sigma_mps, model, biases)
    mean, covariance, sensitivity = fit.solved()
    if not (np.hypot(*mean[2:4]) <= bounds.speed_max_mps and fit.explains(mean, biases)):
        return None
    spread = covariance + sensitivity @ biases.covariance @ sensitivity.T
    nearest = min(float(np.hypot(*(mean[:2] - _place(one.site)))) for one in seen)
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
    # Unknown: position and velocity on the plane, and the height where elevations are there.

    def __init__(
        self, seen: list[Seen], sensors: SensorTable, speed_sigma_mps: float, model: Model,
        biases: BiasState,
    ) -> None:  # fmt: skip
        self._seen, self._model, self._speed_sigma_mps = seen, model, speed_sigma_mps
        self.by_bias = np.zeros((len(seen), len(biases.estimate)))
        for place, one in enumerate(seen):
            own = slice(model.starts[one.sensor], model.starts[one.sensor + 1])
            self.by_bias[place, own] = model.parameters[own] == PARAMETER_AZIMUTH_OFFSET
        self._azimuth = np.array([one.azimuth_rad for one in seen]) - self.by_bias @ biases.estimate
        self._sigmas = sensors.azimuth_sigma_rad[[one.sensor for one in seen]]
        # Which of them have an elevation.
        self._raised = [place for place, one in enumerate(seen) if not np.isnan(one.elevation_rad)]
        self._elevation_sigmas = sensors.elevation_sigma_rad[[one.sensor for one in seen]]
        self._moving = any(one.moving for one in seen)
        heard = [one.height_m for one in seen if not np.isnan(one.height_m)]
        options = model.options
        self.height_m = heard[-1] if heard else float(options[ASSUMED_HEIGHT])
        self.height_sigma_m = COARSE_STEP_M if heard else float(options[ASSUMED_HEIGHT_SIGMA])
        if not self.elevated:
            # A bearing does not ask for the height.
            self.height_m = float(options[ASSUMED_HEIGHT])
            self.height_sigma_m = float(options[ASSUMED_HEIGHT_SIGMA])
        loose = [0.0, 0.0, speed_sigma_mps**-2, speed_sigma_mps**-2]
        known = [0.0, 0.0, 0.0, 0.0]
        if self.elevated:
            loose, known = [*loose, self.height_sigma_m**-2], [*known, self.height_m]
        self._prior, self._known = np.diag(loose), np.array(known)
        # An elevation has no bias.
        unbiased = np.zeros((len(self._raised), self.by_bias.shape[1]))
        self._all_by_bias = np.concatenate([self.by_bias, unbiased])

    @property
    def elevated(self) -> bool:
        return len(self._raised) > 0

    # Flat first, for a place to linearise at, then on the ellipsoid. The covariance is of the place
    # where the search is at rest: of the one before it may be of another distance altogether.
    def solved(self) -> tuple[Floats, Floats, Floats]:
        mean = self._guess()
        for _ in range(_ROUNDS_MAX):
            slopes, residual, sigmas = self._rows(mean)
            weighted = slopes.T / sigmas**2
            information = weighted @ slopes + self._prior
            step = np.linalg.solve(
                information, weighted @ residual + self._prior @ (self._known - mean)
            )
            if step @ information @ step <= _SETTLED_SIGMAS**2:
                covariance = symmetric_part(np.asarray(np.linalg.inv(information), np.float64))
                # A bias turns the lines: χ = a + V ς.
                return mean, covariance, np.asarray(-covariance @ weighted @ self._all_by_bias)
            mean = mean + self._shortened(mean, np.asarray(step), residual, sigmas) * step
        raise BearingsError("NOT_OBSERVABLE", f"expected a place after {_ROUNDS_MAX} rounds")

    def explains(self, mean: Floats, biases: BiasState) -> bool:
        """Whether bearings are as far from a place, and it from what is known, as errors are."""
        _, residual, sigmas = self._rows(mean)
        if not (np.abs(residual[: len(self._seen)]) < np.pi / 2.0).all():
            # Lines of sight cross behind a source as well, where it does not look.
            return False
        turned = self._all_by_bias
        noise = np.diag(sigmas**2) + turned @ biases.covariance @ turned.T
        off = self._known - mean
        misfit = residual @ np.linalg.solve(noise, residual) + off @ self._prior @ off
        n = len(residual)
        return bool(misfit <= n + _MISFIT_SIGMAS_MAX * np.sqrt(2.0 * n))

    # The share of a step that fits better than none, with the errors as they are.
    def _shortened(self, mean: Floats, step: Floats, residual: Floats, sigmas: Floats) -> float:
        before = self._misfit(mean, residual, sigmas)
        share = 1.0
        for _ in range(_HALVINGS_MAX):
            there = mean + share * step
            if self._misfit(there, self._rows(there)[1], sigmas) < before:
                return share
            share /= 2.0
        raise BearingsError("NOT_OBSERVABLE", "expected a place that fits better nearby")

    def _misfit(self, mean: Floats, residual: Floats, sigmas: Floats) -> float:
        off = self._known - mean
        return float(np.sum((residual / sigmas) ** 2) + off @ self._prior @ off)

    # Derivatives, what is measured more than expected, and sigmas, of azimuths and then elevations.
    def _rows(self, mean: Floats) -> tuple[Floats, Floats, Floats]:
        slopes = np.zeros((len(self._seen) + len(self._raised), len(mean)))
        residual, sigmas = np.empty(len(slopes)), np.empty(len(slopes))
        height_m = float(mean[4]) if self.elevated else self.height_m
        for place, one in enumerate(self._seen):
            ago, east, north = self._then(one, mean)
            at = geodesy.predict_polar(self._model.plane, one.site, east, north, height_m)
            slopes[place, :4] = at[4], at[5], ago * at[4], ago * at[5]
            residual[place] = wrapped(self._azimuth[place] - at[1])
            sigmas[place] = self._sigmas[place]
            if self._moving:
                sigmas[place] = np.sqrt(self._sigmas[place] ** 2 + self._strays(ago) / at[6] ** 2)
        for row, place in enumerate(self._raised, len(self._seen)):
            one, sigma = self._seen[place], self._elevation_sigmas[place]
            ago, east, north = self._then(one, mean)
            noise = np.array([sigma**2, 1.0, 0.0, one.site[geodesy.HEIGHT]])
            sine, _, ground, h, w = expected_measurement(
                KIND_DIRECTION, self._model.plane, one.site, noise, east, north, height_m, 0.0
            )
            slopes[row, :4] = h[0], h[1], ago * h[0], ago * h[1]
            slopes[row, 4] = sine_by_height(sine, ground)
            residual[row] = np.sin(one.elevation_rad) - sine
            sigmas[row] = np.sqrt(w[0])
        return slopes, residual, sigmas

    # How long before the end a bearing was taken, and where the aircraft was then.
    def _then(self, one: Seen, mean: Floats) -> tuple[float, float, float]:
        ago = one.time_s - self._seen[-1].time_s
        east, north = mean[:2] + ago * mean[2:4]
        return ago, float(east), float(north)

    # Variance, m², of a straight flight so long ago, by the white acceleration of the filter. It
    # counts over the minutes that a moving source takes.
    def _strays(self, ago: float) -> float:
        return float(self._model.options[ACCELERATION_DENSITY]) * abs(ago) ** 3 / 3.0

    def _guess(self) -> Floats:
        times = np.array([one.time_s for one in self._seen])
        sights = [
            _flat(one.site, angle, sigma)
            for one, angle, sigma in zip(
                self._seen, self._azimuth.tolist(), self._sigmas.tolist(), strict=True
            )
        ]
        try:
            mean, _ = initiate(sights, times, self._speed_sigma_mps).estimate()
        except BearingsError:
            if not self.elevated:
                raise
            mean = self._guess_by_elevation()
        return np.append(mean, self.height_m) if self.elevated else mean

    # In the middle of the places that each elevation alone tells at the height.
    def _guess_by_elevation(self) -> Floats:
        places = []
        for place in self._raised:
            one, azimuth = self._seen[place], float(self._azimuth[place])
            rise = self.height_m - float(one.site[geodesy.HEIGHT])
            slant = slant_of_direction(np.sin(one.elevation_rad), rise)
            found, east, north = geodesy.locate_polar(
                self._model.plane, one.site, slant, azimuth, self.height_m
            )
            if found:
                places.append((east, north))
        if not places:
            raise BearingsError("NOT_OBSERVABLE", "expected elevations that tell a distance")
        return np.append(np.median(np.array(places), axis=0), [0.0, 0.0])


def _place(site: Floats) -> Floats:
    return np.array([site[geodesy.PE], site[geodesy.PN]])


# A bearing as if the plane were flat: the azimuth at the site, turned to the plane's north.
def _flat(site: Floats, azimuth_rad: float, sigma_rad: float) -> Sight:
    sine, cosine = np.sin(azimuth_rad), np.cos(azimuth_rad)
    east = sine * site[geodesy.EE] + cosine * site[geodesy.NE]
    north = sine * site[geodesy.EN] + cosine * site[geodesy.NN]
    return Sight(_place(site), np.asarray(np.arctan2(east, north)), sigma_rad)
