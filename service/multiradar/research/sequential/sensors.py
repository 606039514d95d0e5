"""Sensors of the sequential form: radars on a plane, or sensors on WGS 84."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import (
    ConfigurationError,
    PriorError,
    SensorPositionError,
    ShapeError,
)
from multiradar.estimation.array_checks import finite_array, require_shape
from multiradar.estimation.gaussian import require_covariance
from multiradar.estimation.measurement.bias_parameters import known_kinds
from multiradar.estimation.measurement.kinds import KIND_FLAT_POLAR, KIND_RADAR
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_NAMES,
    PARAMETER_RANGE_OFFSET,
    SensorTable,
)
from multiradar.estimation.measurement.sites import numbers_of_sites, site_numbers
from multiradar.geodesy._kernels import site_parameters
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.research.sequential.sensor_checks import (
    plot_variances,
    require_prior,
    require_sites,
)

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class BiasPrior:
    """Prior and drift of the biases.

    Parameters
    ----------
    mean : (c,) array_like
        Prior means, parameter by parameter, grouped by sensor (m, rad, 1 or s).
    covariance : (c, c) array_like
        Covariance of their errors.
    drift : (c,) array_like, optional
        Standard deviation of each random walk after one second; zero by default.

    Raises
    ------
    PriorError
        If a prior variance is not positive, or a drift is negative or not finite.
    ShapeError
        If the shapes do not match, or a mean is not finite.
    CovarianceError
        If the covariance is not symmetric or not positive definite.
    """

    mean: Floats
    covariance: Floats
    drift: Floats

    def __init__(
        self, mean: ArrayLike, covariance: ArrayLike, drift: ArrayLike | None = None
    ) -> None:
        means = finite_array(mean, "prior means of the biases", (None,))
        size = len(means)
        matrix = require_shape(covariance, "prior covariance of the biases", (size, size))
        rates = require_shape(
            np.zeros(size) if drift is None else drift, "drift of the biases", (size,)
        )
        for variance, rate in zip(np.diagonal(matrix), rates, strict=True):
            if not (variance > 0.0 and 0.0 <= rate < np.inf):
                raise PriorError(
                    "prior of the biases: expected variances above 0 and drifts of at least 0, "
                    f"was {variance} and {rate}"
                )
        if size:
            require_covariance(matrix, "prior covariance of the biases")
        object.__setattr__(self, "mean", means)
        object.__setattr__(self, "covariance", matrix)
        object.__setattr__(self, "drift", rates)

    @property
    def sigma(self) -> Floats:
        """Standard deviations, (c,)."""
        return np.asarray(np.sqrt(np.diagonal(self.covariance)))


@dataclass(frozen=True, slots=True)
class Sensors:
    """Sensors as arrays of the kernels; made by `flat_radars` or `earth_sensors`.

    Attributes
    ----------
    kind : (m,) int64
        What each measures, see `multiradar.estimation.measurement._kernels`.
    plane, sites, noises, site_numbers, starts, parameters
        See `multiradar.estimation.filters.arrays.Model`.
    prior : BiasPrior
        Prior of the biases.

    Raises
    ------
    ShapeError
        If the arrays differ in the number of sensors or of parameters.
    UnknownParameterError
        If a kind of parameter is unknown.
    ConfigurationError
        If a sensor has a parameter twice.
    PriorError
        If a prior or a drift is outside the bounds that
        `multiradar.estimation.measurement.sensor_bounds` has for sensors.
    """

    kind: Integers
    plane: Floats
    sites: Floats
    noises: Floats
    site_numbers: Integers
    starts: Integers
    parameters: Integers
    prior: BiasPrior

    def __post_init__(self) -> None:
        count, starts = len(self.kind), self.starts
        kinds = known_kinds(self.parameters)
        for name, array, length in (
            ("sensor sites", self.sites, count),
            ("sensor noise", self.noises, count),
            ("sensor site numbers", self.site_numbers, count),
            ("first parameter of each sensor", starts, count + 1),
            ("prior of the biases", self.prior.mean, len(kinds)),
        ):
            if len(array) != length:
                raise ShapeError(name, f"{length} rows", array.shape)
        if starts[0] != 0 or starts[-1] != len(kinds) or (np.diff(starts) < 0).any():
            expected = f"ascending indices from 0 to {len(kinds)}"
            raise ShapeError("first parameter of each sensor", expected, starts.shape)
        for sensor, (first, last) in enumerate(pairwise(starts.tolist())):
            _require_each_once(sensor, kinds[first:last].tolist())
        prior = self.prior
        require_prior(kinds, prior.mean, prior.sigma, prior.drift)

    def __len__(self) -> int:
        return len(self.kind)


def flat_radars(
    site_m: ArrayLike,
    range_sigma_m: ArrayLike,
    azimuth_sigma_rad: ArrayLike,
    prior: BiasPrior,
    parameters: ArrayLike = (PARAMETER_RANGE_OFFSET, PARAMETER_AZIMUTH_OFFSET),
) -> Sensors:
    """Return radars on a flat plane, all with the same bias parameters.

    Parameters
    ----------
    site_m : (m, 2) array_like
        East and north of the radars.
    range_sigma_m, azimuth_sigma_rad : (m,) array_like
        Standard deviations of the random errors; a scalar applies to all.
    prior : BiasPrior
        Of m × p parameters, radar by radar.
    parameters : (p,) array_like of int
        Kinds of the bias parameters, as in `SensorTable.parameter_kind`.

    Returns
    -------
    Sensors
        For `SequentialFilter` and `play`.

    Raises
    ------
    SensorPositionError
        If a radar has no position.
    PriorError
        If a noise, a prior or a drift is outside the bounds that
        `multiradar.estimation.measurement.sensor_bounds` has for sensors.
    UnknownParameterError
        If a kind of parameter is unknown.
    ConfigurationError
        If a kind of parameter is named twice, or a radar is too far from the origin.
    ShapeError
        If the shapes do not match, or there is no radar.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.5), (1.7), (1.11) and (1.13).
    """
    sites = require_sites(site_m)
    count = len(sites)
    kinds = known_kinds(parameters)
    variances = plot_variances(count, range_sigma_m, azimuth_sigma_rad)
    return Sensors(
        kind=np.full(count, KIND_FLAT_POLAR, np.int64),
        plane=np.zeros(1),
        sites=sites,
        noises=np.column_stack([variances, np.ones(count), np.zeros(count)]),
        site_numbers=site_numbers(sites, np.ones(count, np.bool_)),
        starts=len(kinds) * np.arange(count + 1, dtype=np.int64),
        parameters=np.tile(kinds, count),
        prior=prior,
    )


def earth_sensors(table: SensorTable, plane: SystemPlane) -> Sensors:
    """Return sensors on WGS 84.

    Parameters
    ----------
    table : SensorTable
        The sensors, with bias parameters, their priors and drifts.
    plane : SystemPlane
        The plane on which aircraft are estimated.

    Returns
    -------
    Sensors
        For `SequentialFilter` and `play`.

    Raises
    ------
    SensorPositionError
        If a radar has no position.
    UnknownParameterError
        If a kind of parameter is unknown.
    PriorError
        If a prior standard deviation is not positive or a drift is negative.

    References
    ----------
    IMM UrO RAN report (2016), equations (1.5), (1.7) and (1.13), in polar form and on the
    ellipsoid; the latter is the project's own.
    """
    kinds = table.kinds.astype(np.int64)
    geodetic = np.column_stack([table.latitude_rad, table.longitude_rad, table.height_m])
    located = np.isfinite(geodetic).all(axis=1)
    _require_positions(located | (kinds != KIND_RADAR), table.ids)
    parameters = np.array(plane.parameters)
    sites = [site_parameters(parameters, *one) for one in np.nan_to_num(geodetic)]
    noises = [table.range_sigma_m**2, table.azimuth_sigma_rad**2, table.position_sigma_m**2]
    starts = np.searchsorted(table.parameter_sensor, np.arange(len(table) + 1)).astype(np.int64)
    if not (table.prior_sigma > 0.0).all():
        raise PriorError(
            f"prior of the biases: expected sigmas above 0, was {table.prior_sigma.tolist()}"
        )
    return Sensors(
        kind=kinds,
        plane=parameters,
        sites=np.array(sites),
        noises=np.column_stack([*noises, np.nan_to_num(table.height_m)]),
        site_numbers=numbers_of_sites(table),
        starts=starts,
        parameters=known_kinds(table.parameter_kind),
        prior=BiasPrior(table.prior_mean, np.diag(table.prior_sigma**2), table.drift),
    )


def _require_positions(located: NDArray[np.bool_], names: tuple[str, ...] | list[str]) -> None:
    for name, there in zip(names, located, strict=True):
        if not there:
            raise SensorPositionError(name)


def _require_each_once(sensor: int, kinds: list[int]) -> None:
    for kind in kinds:
        if kinds.count(kind) > 1:
            raise ConfigurationError(
                f"sensor {sensor}: expected {PARAMETER_NAMES[kind]} once, found "
                f"{kinds.count(kind)} times"
            )
