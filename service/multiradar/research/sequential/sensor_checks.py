"""Checks of sensor parameters: the bounds of sensors files."""

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import ConfigurationError, PriorError, SensorPositionError, ShapeError
from multiradar.estimation.array_checks import positive_array, require_shape
from multiradar.estimation.measurement import sensor_bounds
from multiradar.estimation.measurement.sensor_bounds import Bounds
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, PARAMETER_UNITS

Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

#: Maximum distance of a radar on a flat plane from its origin, m.
SITE_MAX_M = 1e7

# Tolerance of the bounds for rounding, as between degrees and radians.
_ROUNDING = 1e-9


def require_sites(site_m: ArrayLike) -> Floats:
    """Return checked positions of radars on a flat plane.

    Parameters
    ----------
    site_m : (m, 2) array_like
        East and north, m.

    Returns
    -------
    (m, 2) float64
        The same, contiguous in memory.

    Raises
    ------
    SensorPositionError
        If a radar has no position.
    ConfigurationError
        If one is farther than `SITE_MAX_M` from the origin.
    ShapeError
        If they are of another shape, or there is no radar.
    """
    sites = require_shape(site_m, "radar sites", (None, 2))
    if not len(sites):
        raise ShapeError("radar sites", "at least one radar", sites.shape)
    for radar, site in enumerate(sites):
        if not np.isfinite(site).all():
            raise SensorPositionError(str(radar))
        if np.abs(site).max() > SITE_MAX_M:
            raise ConfigurationError(
                f"site of radar {radar}: expected within {SITE_MAX_M:g} m, was {site.tolist()}"
            )
    return np.ascontiguousarray(sites)


def plot_variances(count: int, range_sigma_m: ArrayLike, azimuth_sigma_rad: ArrayLike) -> Floats:
    """Return the variances of the random errors of radars.

    Parameters
    ----------
    count : int
        Number m of radars.
    range_sigma_m, azimuth_sigma_rad : (m,) array_like
        Standard deviations; a scalar applies to all.

    Returns
    -------
    (m, 2) float64
        Variances of range (m²) and azimuth (rad²).

    Raises
    ------
    PriorError
        If one is not within the bounds of sensors.
    ShapeError
        If the shapes do not match.

    References
    ----------
    IMM UrO RAN report (2016), equation (1.13).
    """
    azimuths = Bounds(*np.radians(sensor_bounds.AZIMUTH_SIGMA_DEG).tolist())
    columns = []
    for name, sigma, within in (
        ("range sigma, m", range_sigma_m, sensor_bounds.RANGE_SIGMA_M),
        ("azimuth sigma, rad", azimuth_sigma_rad, azimuths),
    ):
        values = positive_array(sigma, name, (count,), PriorError)
        _require_within(values, name, within, PriorError)
        columns.append(values**2)
    return np.column_stack(columns)


def require_prior(kinds: Integers, mean: Floats, sigma: Floats, drift: Floats) -> None:
    """Raise an error for a prior or drift of a bias parameter outside the bounds of sensors.

    Parameters
    ----------
    kinds : (c,) int64
        Kinds of the parameters.
    mean, sigma : (c,) float64
        Prior (m, rad, 1 or s by kind).
    drift : (c,) float64
        Standard deviation of each random walk after one second.

    Raises
    ------
    PriorError
        If one is not within the bounds of sensors.
    """
    for kind, name in enumerate(PARAMETER_NAMES):
        bounds, unit = sensor_bounds.PARAMETERS[kind], PARAMETER_UNITS[kind]
        if name.endswith("_deg"):
            name = f"{name.removesuffix('_deg')}, rad"
        own = kinds == kind
        most = bounds.value * unit
        _require_within(mean[own], f"prior mean of {name}", Bounds(-most, most), PriorError)
        within = Bounds(bounds.sigma.least * unit, bounds.sigma.most * unit)
        _require_within(sigma[own], f"prior sigma of {name}", within, PriorError)
        within = Bounds(0.0, bounds.drift * unit)
        _require_within(drift[own], f"drift of {name}", within, PriorError)


def _require_within(
    values: Floats, name: str, within: Bounds, error: Callable[[str], ConfigurationError]
) -> None:
    least = within.least - _ROUNDING * abs(within.least)
    most = within.most + _ROUNDING * abs(within.most)
    wrong = values[~((values >= least) & (values <= most))]
    if wrong.size:
        raise error(f"{name}: expected {within.least:g} to {within.most:g}, was {wrong[0]:g}")
