"""The sensors and their bias parameters as columns."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from multiradar.errors import (
    ConfigurationError,
    PriorError,
    SensorPositionError,
    ShapeError,
    UnknownParameterError,
)

PARAMETER_RANGE_OFFSET = 0
PARAMETER_AZIMUTH_OFFSET = 1
PARAMETER_RANGE_GAIN = 2
PARAMETER_TIME_OFFSET = 3

#: Names of the bias parameters on the wire, by kind (azimuth: degrees there, radians here).
PARAMETER_NAMES = ("range_offset_m", "azimuth_offset_deg", "range_gain", "time_offset_s")

# The kind of `MeasurementBatch.kind` that needs neither a site nor biases.
_REPORTED_POSITION = 1


@dataclass(frozen=True, slots=True)
class SensorTable:
    """All sensors, sorted by identifier, and the bias vector they share.

    A bias is *measured minus true*. The bias vector stacks the named parameters of all sensors;
    its columns are grouped by sensor, in the order of the sensors.

    Attributes
    ----------
    ids : tuple of str
        Identifiers, sorted.
    kinds : (m,) int8
        What the sensor measures: the kinds of `MeasurementBatch.kind`.
    latitude_rad, longitude_rad, height_m : (m,) float64
        WGS 84 site; NaN where the kind of sensor has none.
    range_sigma_m, azimuth_sigma_rad, position_sigma_m : (m,) float64
        Standard deviations of the random errors (position: per horizontal axis).
    range_max_m, rotation_period_s : (m,) float64
        Instrumented range (infinite when unknown) and antenna turn time (NaN when unknown).
    parameter_sensor : (c,) int32
        Sensor of each bias parameter.
    parameter_kind : (c,) int8
        `PARAMETER_RANGE_OFFSET` (m), `PARAMETER_AZIMUTH_OFFSET` (rad), `PARAMETER_RANGE_GAIN`
        (ratio) or `PARAMETER_TIME_OFFSET` (s).
    prior_mean, prior_sigma : (c,) float64
        What is known of each parameter beforehand.
    drift : (c,) float64
        Random walk of each parameter: standard deviation after one second.
    aliases : tuple of (str, int)
        Further names that measurements may use, with the index of the sensor.

    Raises
    ------
    ShapeError
        If the columns are not of one length, or the parameters are not grouped by sensor.
    SensorPositionError
        If a sensor that is no reporter of positions has no site.
    UnknownParameterError
        If a kind of bias parameter is unknown.
    PriorError
        If a standard deviation of noise or of a prior is not positive, a drift is negative, or a
        prior mean is no number.
    ConfigurationError
        If a parameter is named twice, or belongs to a sensor that reports positions.
    """

    ids: tuple[str, ...]
    kinds: NDArray[np.int8]
    latitude_rad: NDArray[np.float64]
    longitude_rad: NDArray[np.float64]
    height_m: NDArray[np.float64]
    range_sigma_m: NDArray[np.float64]
    azimuth_sigma_rad: NDArray[np.float64]
    position_sigma_m: NDArray[np.float64]
    range_max_m: NDArray[np.float64]
    rotation_period_s: NDArray[np.float64]
    parameter_sensor: NDArray[np.int32]
    parameter_kind: NDArray[np.int8]
    prior_mean: NDArray[np.float64]
    prior_sigma: NDArray[np.float64]
    drift: NDArray[np.float64]
    aliases: tuple[tuple[str, int], ...] = ()

    def __len__(self) -> int:
        return len(self.ids)

    def __post_init__(self) -> None:
        _require_shapes(self)
        for row in range(len(self)):
            _require_usable(self, row)
        for column in range(len(self.parameter_kind)):
            _require_prior(self, column)
        named = list(zip(self.parameter_sensor.tolist(), self.parameter_kind.tolist(), strict=True))
        for sensor, kind in named:
            if named.count((sensor, kind)) > 1:
                raise ConfigurationError(
                    f"sensor {self.ids[sensor]}: expected {PARAMETER_NAMES[kind]} once, was "
                    f"{named.count((sensor, kind))} times"
                )


def _require_shapes(table: SensorTable) -> None:
    count, parameters = len(table.ids), len(table.parameter_kind)
    for name in (
        "kinds", "latitude_rad", "longitude_rad", "height_m", "range_sigma_m", "azimuth_sigma_rad",
        "position_sigma_m", "range_max_m", "rotation_period_s",
    ):  # fmt: skip
        _require_shape(name, getattr(table, name), count)
    for name in ("parameter_sensor", "prior_mean", "prior_sigma", "drift"):
        _require_shape(name, getattr(table, name), parameters)
    owners = table.parameter_sensor
    if parameters and not (
        (np.diff(owners) >= 0).all() and owners[0] >= 0 and owners[-1] < max(count, 1)
    ):
        what = "parameter_sensor of the sensors"
        raise ShapeError(what, f"indices of {count} sensors, ascending", owners.shape)


def _require_shape(name: str, column: NDArray[np.generic], count: int) -> None:
    if column.shape != (count,):
        raise ShapeError(f"{name} of the sensors", f"({count},)", column.shape)


def _require_usable(table: SensorTable, row: int) -> None:
    sensor = table.ids[row]
    noises = {"range_sigma_m": table.range_sigma_m, "azimuth_sigma_rad": table.azimuth_sigma_rad}
    if table.kinds[row] == _REPORTED_POSITION:
        noises = {"position_sigma_m": table.position_sigma_m}
        if (table.parameter_sensor == row).any():
            raise ConfigurationError(
                f"sensor {sensor}: expected no bias parameters of reported positions, has some"
            )
    elif not np.isfinite(
        [table.latitude_rad[row], table.longitude_rad[row], table.height_m[row]]
    ).all():
        raise SensorPositionError(sensor)
    for name, values in noises.items():
        if not 0.0 < values[row] < np.inf:
            raise PriorError(f"{name} of sensor {sensor}: expected more than 0, was {values[row]}")


def _require_prior(table: SensorTable, column: int) -> None:
    kind = int(table.parameter_kind[column])
    if not 0 <= kind < len(PARAMETER_NAMES):
        raise UnknownParameterError(kind, PARAMETER_NAMES)
    mean, sigma, drift = table.prior_mean[column], table.prior_sigma[column], table.drift[column]
    what = f"{PARAMETER_NAMES[kind]} of sensor {table.ids[table.parameter_sensor[column]]}"
    if not np.isfinite(mean):
        raise PriorError(f"{what}: expected a prior mean that is a number, was {mean}")
    if not (0.0 < sigma < np.inf and 0.0 <= drift < np.inf):
        raise PriorError(
            f"{what}: expected a prior sigma above 0 and a drift of at least 0, was {sigma} and "
            f"{drift}"
        )
