"""The sensors and their bias parameters as columns."""

from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from multiradar.errors import (
    ConfigurationError,
    PriorError,
    SensorPositionError,
    ShapeError,
    UnknownParameterError,
)
from multiradar.estimation.measurement import sensor_bounds as bounds
from multiradar.estimation.measurement.sensor_bounds import Bounds

PARAMETER_RANGE_OFFSET = 0
PARAMETER_AZIMUTH_OFFSET = 1
PARAMETER_RANGE_GAIN = 2
PARAMETER_TIME_OFFSET = 3
PARAMETER_AZIMUTH_SINE = 4
PARAMETER_AZIMUTH_COSINE = 5
PARAMETER_FRAME_EAST = 6
PARAMETER_FRAME_NORTH = 7
PARAMETER_FRAME_ROTATION = 8

#: Names of the bias parameters on the wire, by kind.
PARAMETER_NAMES = (
    "range_offset_m", "azimuth_offset_deg", "range_gain", "time_offset_s", "azimuth_sine_deg",
    "azimuth_cosine_deg", "frame_east_m", "frame_north_m", "frame_rotation_deg",
)  # fmt: skip
#: Value in the core of one unit on the wire, by kind: angles are degrees there, radians here.
PARAMETER_UNITS = tuple(
    float(np.radians(1.0)) if name.endswith("_deg") else 1.0 for name in PARAMETER_NAMES
)

# The kinds of `MeasurementBatch.kind`; reported positions need a site only for biases of a frame.
_KINDS = range(3)
_RADAR, _REPORTED_POSITION, _BEARING = 0, 1, 2
# Those that refer to a reference point.
_OF_FRAMES = (PARAMETER_FRAME_EAST, PARAMETER_FRAME_NORTH, PARAMETER_FRAME_ROTATION)
# Bias parameters that a kind of sensor cannot have.
_FOREIGN: dict[int, tuple[int, ...]] = {
    _RADAR: (PARAMETER_FRAME_ROTATION,),
    _REPORTED_POSITION: (
        PARAMETER_RANGE_OFFSET,
        PARAMETER_AZIMUTH_OFFSET,
        PARAMETER_RANGE_GAIN,
        PARAMETER_AZIMUTH_SINE,
        PARAMETER_AZIMUTH_COSINE,
    ),
    _BEARING: (
        PARAMETER_RANGE_OFFSET,
        PARAMETER_RANGE_GAIN,
        PARAMETER_FRAME_EAST,
        PARAMETER_FRAME_NORTH,
        PARAMETER_FRAME_ROTATION,
    ),
}
# Columns that are NaN where unknown.
_OPTIONAL = {
    "earth_radius_factor": bounds.EARTH_RADIUS_FACTOR,
    "rotation_period_s": bounds.ROTATION_PERIOD_S,
    "plots_per_scan_max": bounds.PLOTS_PER_SCAN_MAX,
    "clock_tolerance_s": bounds.CLOCK_TOLERANCE_S,
}
_WORDS = {_RADAR: "radars", _REPORTED_POSITION: "reported positions", _BEARING: "bearings"}
_RADIAN_DEG = float(np.degrees(1.0))
# Relative tolerance of bounds that were converted to radians.
_ROUNDING = 1e-9


#: Columns added later, with defaults: not moving, no elevations, no refraction, no delays, bounds
#: on plots by coverage, tolerances of clocks by the horizon, all enabled.
LATER_FIELDS = (
    "moving", "elevation_sigma_rad", "earth_radius_factor", "transponder_delay_sigma_m",
    "plots_per_scan_max", "clock_tolerance_s", "disabled",
)  # fmt: skip


def _no_known_bias() -> NDArray[np.float64]:
    return np.zeros((0, len(PARAMETER_NAMES)))


def _every_kind(known: NDArray[np.float64]) -> NDArray[np.float64]:
    absent = max(len(PARAMETER_NAMES) - known.shape[-1], 0)
    return np.pad(known, ((0, 0), (0, absent))) if known.ndim == 2 and absent else known


@dataclass(frozen=True, slots=True)
class SensorTable:
    """All sensors, and the bias vector they share.

    A bias is *measured minus true*. The bias vector stacks the named parameters of all sensors;
    its columns are grouped by sensor, in the order of the sensors. Biases that are known instead of
    estimated are corrected before the measurements are used
    (`multiradar.estimation.measurement.known_biases`).

    Attributes
    ----------
    ids : tuple of str
        Unique identifiers, in the order of the other columns: sorted, but for sensors that were
        added while a service runs, which follow.
    kinds : (m,) int8
        Kind of measurement, as in `MeasurementBatch.kind`.
    latitude_rad, longitude_rad, height_m : (m,) float64
        WGS 84 site; NaN where the kind of sensor has none.
    range_sigma_m, azimuth_sigma_rad, position_sigma_m : (m,) float64
        Standard deviations of the random errors (position: per horizontal axis).
    range_max_m, rotation_period_s : (m,) float64
        Instrumented range (infinite if unknown) and antenna rotation period (NaN if unknown).
    parameter_sensor : (c,) int32
        Sensor of each bias parameter.
    parameter_kind : (c,) int8
        Index into `PARAMETER_NAMES`; metres, radians, seconds or a ratio.
    prior_mean, prior_sigma : (c,) float64
        Prior of each parameter.
    drift : (c,) float64
        Random walk of each parameter: standard deviation after one second.
    aliases : tuple of (str, int)
        Additional names in measurements, with the index of the sensor.
    known_bias : (m, p) float64
        Known biases by kind of parameter, 0 if unknown; the last ones may be absent. By default
        none is known.
    self_reported : (m,) bool
        Whether the sensor relays self-reported positions (ADS-B). By default none does.
    asterix_codes : tuple of int
        256 × SAC + SIC of each sensor in ASTERIX, −1 for none. By default none has any.
    moving : (m,) bool
        Whether the sensor moves and reports its position with each bearing. By default none moves.
    elevation_sigma_rad : (m,) float64
        Standard deviation of the random error of elevations; NaN for sensors without elevations,
        the default.
    earth_radius_factor : (m,) float64
        Factor of the effective radius of the Earth for refraction of ranges, which are corrected
        before they are used (`multiradar.geodesy.refraction`); NaN for none, the default.
    transponder_delay_sigma_m : (m,) float64
        Standard deviation of the delays of transponders (range, one way) where ranges include them
        and they are estimated, the same for all such sensors; NaN for none, the default.
    plots_per_scan_max : (m,) float64
        Greatest number of plots in a scan; NaN, the default, for that by coverage
        (`multiradar.estimation.measurement.plot_rates`).
    clock_tolerance_s : (m,) float64
        Lead over the data time up to which measurements need no other clock to agree, s; NaN, the
        default, for half of the reorder horizon.
    disabled : (m,) bool
        Whether measurements of the sensor are rejected. By default those of none are.

    Raises
    ------
    ShapeError
        If the columns differ in length, or the parameters are not grouped by sensor.
    SensorPositionError
        If a radar or direction finder has no site, or reported positions with biases of their
        frame.
    UnknownParameterError
        If a kind of bias parameter is unknown.
    PriorError
        If a standard deviation of noise or of a prior, a drift, a prior mean or a known bias is not
        a number or outside the bounds of `multiradar.estimation.measurement.sensor_bounds`.
    ConfigurationError
        If another number is outside these bounds, an identifier or a parameter occurs twice, a kind
        of sensor is unknown, or a parameter is not applicable to its sensor, or both estimated and
        known.
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
    known_bias: NDArray[np.float64] = field(default_factory=_no_known_bias)
    self_reported: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))
    asterix_codes: tuple[int, ...] = ()
    moving: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))
    elevation_sigma_rad: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    earth_radius_factor: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    transponder_delay_sigma_m: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    plots_per_scan_max: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    clock_tolerance_s: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))
    disabled: NDArray[np.bool_] = field(default_factory=lambda: np.zeros(0, np.bool_))

    @property
    def delayed(self) -> NDArray[np.bool_]:
        """Whether the ranges of each sensor include delays that are estimated, (m,) bool."""
        return ~np.isnan(self.transponder_delay_sigma_m)

    @property
    def delay_sigma_m(self) -> float:
        """Standard deviation of the delays of transponders, m; 0 where none is estimated."""
        given = self.transponder_delay_sigma_m[self.delayed]
        return float(given[0]) if len(given) else 0.0

    def __len__(self) -> int:
        return len(self.ids)

    def position_sigmas(self, sensor: ArrayLike, reported_m: ArrayLike) -> NDArray[np.float64]:
        """Return the accuracies of reported positions, 1 sigma on each axis, m.

        Parameters
        ----------
        sensor : (n,) integers
            By which sensor they were measured.
        reported_m : (n,) array_like
            Their own accuracies, m; NaN where a report has none.

        Returns
        -------
        (n,) float64
            The reported accuracy, else that of the sensor.
        """
        own = np.asarray(reported_m, np.float64)
        return np.where(np.isnan(own), self.position_sigma_m[np.asarray(sensor)], own)

    def __post_init__(self) -> None:
        count = len(self)
        defaults = {
            "known_bias": np.zeros((count, len(PARAMETER_NAMES))),
            "self_reported": np.zeros(count, np.bool_),
            "asterix_codes": (-1,) * count,
            "moving": np.zeros(count, np.bool_),
            "elevation_sigma_rad": np.full(count, np.nan),
            "earth_radius_factor": np.full(count, np.nan),
            "transponder_delay_sigma_m": np.full(count, np.nan),
            "plots_per_scan_max": np.full(count, np.nan),
            "clock_tolerance_s": np.full(count, np.nan),
            "disabled": np.zeros(count, np.bool_),
        }
        for name, value in defaults.items():
            if not len(getattr(self, name)):
                object.__setattr__(self, name, value)
        object.__setattr__(self, "known_bias", _every_kind(self.known_bias))
        _require_shapes(self)
        _require_each_once(self)
        for row in range(len(self)):
            _require_usable(self, row)
            _require_known(self, row)
        for column in range(len(self.parameter_kind)):
            _require_prior(self, column)


def _require_each_once(table: SensorTable) -> None:
    for sensor, times in Counter(table.ids).items():
        if times > 1:
            raise ConfigurationError(f"sensor {sensor}: id occurs {times} times; list it once")
    named = zip(table.parameter_sensor.tolist(), table.parameter_kind.tolist(), strict=True)
    for (owner, kind), times in Counter(named).items():
        if not 0 <= kind < len(PARAMETER_NAMES):
            raise UnknownParameterError(kind, PARAMETER_NAMES)
        if times > 1:
            raise ConfigurationError(
                f"sensor {table.ids[owner]}: {PARAMETER_NAMES[kind]} occurs {times} times; "
                "list it once"
            )


def _require_shapes(table: SensorTable) -> None:
    count, parameters = len(table.ids), len(table.parameter_kind)
    for name in (
        "kinds", "latitude_rad", "longitude_rad", "height_m", "range_sigma_m", "azimuth_sigma_rad",
        "position_sigma_m", "range_max_m", "rotation_period_s", "self_reported",
        "moving", "elevation_sigma_rad", "earth_radius_factor", "transponder_delay_sigma_m",
        "plots_per_scan_max", "clock_tolerance_s", "disabled",
    ):  # fmt: skip
        _require_shape(name, getattr(table, name), (count,))
    _require_shape("known_bias", table.known_bias, (count, len(PARAMETER_NAMES)))
    for name in ("parameter_sensor", "prior_mean", "prior_sigma", "drift"):
        _require_shape(name, getattr(table, name), (parameters,))
    owners = table.parameter_sensor
    if parameters and not (
        (np.diff(owners) >= 0).all() and owners[0] >= 0 and owners[-1] < max(count, 1)
    ):
        what = "parameter_sensor of the sensors"
        raise ShapeError(what, f"ascending indices of {count} sensors", owners.shape)


def _require_shape(name: str, column: NDArray[np.generic], shape: tuple[int, ...]) -> None:
    if column.shape != shape:
        raise ShapeError(f"{name} of the sensors", f"{shape}", column.shape)


def _require_usable(table: SensorTable, row: int) -> None:
    sensor, kind = table.ids[row], int(table.kinds[row])
    if kind not in _KINDS:
        raise ConfigurationError(
            f"sensor {sensor}: kind: expected 0 (radar), 1 (positions) or 2 (bearings), was {kind}"
        )
    if kind != _REPORTED_POSITION or _has_frame(table, row):
        _require_site(table, row)
    noises = {
        "range_sigma_m": bounds.RANGE_SIGMA_M,
        "azimuth_sigma_rad": _radians(bounds.AZIMUTH_SIGMA_DEG),
    }
    if kind == _REPORTED_POSITION:
        noises = {"position_sigma_m": bounds.POSITION_SIGMA_M}
    for name, within in noises.items():
        _require_within(f"{name} of sensor {sensor}", getattr(table, name)[row], within, PriorError)
    _require_direction(table, row)
    # Infinite and NaN stand for unknown.
    if table.range_max_m[row] != np.inf:
        what = f"range_max_m of sensor {sensor}"
        _require_within(what, table.range_max_m[row], bounds.RANGE_MAX_M)
    _require_delay(table, row)
    for name, within in _OPTIONAL.items():
        if not np.isnan(getattr(table, name)[row]):
            _require_within(f"{name} of sensor {sensor}", getattr(table, name)[row], within)


def _has_frame(table: SensorTable, row: int) -> bool:
    own = table.parameter_kind[table.parameter_sensor == row]
    known = table.known_bias[row, list(_OF_FRAMES)]
    return bool(np.isin(own, _OF_FRAMES).any() or (known != 0.0).any())


def _require_direction(table: SensorTable, row: int) -> None:
    sensor = table.ids[row]
    if table.moving[row] and table.kinds[row] != _BEARING:
        raise ConfigurationError(
            f"sensor {sensor}: only a direction finder (kind 2) may be moving, found kind "
            f"{table.kinds[row]}"
        )
    own = table.parameter_kind[table.parameter_sensor == row]
    clock = PARAMETER_TIME_OFFSET in own or table.known_bias[row, PARAMETER_TIME_OFFSET] != 0.0
    if table.moving[row] and clock:
        name = PARAMETER_NAMES[PARAMETER_TIME_OFFSET]
        raise ConfigurationError(f"sensor {sensor}: {name} is not supported for a moving sensor")
    if np.isnan(table.elevation_sigma_rad[row]):
        return
    if table.kinds[row] == _REPORTED_POSITION:
        raise ConfigurationError(
            f"sensor {sensor}: elevations are not supported for reported positions"
        )
    what = f"elevation_sigma_rad of sensor {sensor}"
    within = _radians(bounds.AZIMUTH_SIGMA_DEG)
    _require_within(what, table.elevation_sigma_rad[row], within, PriorError)


def _require_delay(table: SensorTable, row: int) -> None:
    sensor, sigma = table.ids[row], table.transponder_delay_sigma_m[row]
    if np.isnan(sigma):
        return
    if table.kinds[row] != _RADAR:
        raise ConfigurationError(
            f"sensor {sensor}: transponder_delay_sigma_m is not supported for "
            f"{_WORDS[int(table.kinds[row])]}"
        )
    what = f"transponder_delay_sigma_m of sensor {sensor}"
    _require_within(what, sigma, bounds.TRANSPONDER_DELAY_SIGMA_M, PriorError)
    if sigma != table.delay_sigma_m:
        raise PriorError(
            f"{what}: expected {table.delay_sigma_m:g}, as for the other radars (the delay is a "
            f"property of the aircraft), was {sigma:g}"
        )


def _require_site(table: SensorTable, row: int) -> None:
    site = {
        "latitude_rad": _radians(bounds.LATITUDE_DEG),
        "longitude_rad": _radians(bounds.LONGITUDE_DEG),
        "height_m": bounds.HEIGHT_M,
    }
    if table.kinds[row] == _REPORTED_POSITION:
        del site["height_m"]  # A frame has none.
    if not np.isfinite([getattr(table, name)[row] for name in site]).all():
        raise SensorPositionError(table.ids[row])
    for name, within in site.items():
        _require_within(f"{name} of sensor {table.ids[row]}", getattr(table, name)[row], within)


def _require_known(table: SensorTable, row: int) -> None:
    sensor, kinds = table.ids[row], table.parameter_kind[table.parameter_sensor == row]
    for kind, name in enumerate(PARAMETER_NAMES):
        known = table.known_bias[row, kind]
        foreign = kind in _FOREIGN.get(int(table.kinds[row]), ())
        if foreign and (kind in kinds or known != 0.0):
            what = _WORDS[int(table.kinds[row])]
            raise ConfigurationError(f"sensor {sensor}: {name} is not supported for {what}")
        if kind in kinds and known != 0.0:
            raise ConfigurationError(
                f"sensor {sensor}: {name} is both estimated and known; specify only one of these"
            )
        most = bounds.PARAMETERS[kind].value * PARAMETER_UNITS[kind]
        what = f"known {name} of sensor {sensor}"
        _require_within(what, known, Bounds(-most, most), PriorError)


def _require_prior(table: SensorTable, column: int) -> None:
    kind = int(table.parameter_kind[column])
    limits, unit = bounds.PARAMETERS[kind], PARAMETER_UNITS[kind]
    what = f"{PARAMETER_NAMES[kind]} of sensor {table.ids[table.parameter_sensor[column]]}"
    within = {
        "prior_mean": Bounds(-limits.value * unit, limits.value * unit),
        "prior_sigma": Bounds(limits.sigma.least * unit, limits.sigma.most * unit),
        "drift": Bounds(0.0, limits.drift * unit),
    }
    for name, one in within.items():
        _require_within(f"{name} of {what}", getattr(table, name)[column], one, PriorError)


def _radians(degrees: Bounds) -> Bounds:
    return Bounds(degrees.least / _RADIAN_DEG, degrees.most / _RADIAN_DEG)


def _require_within(
    what: str, value: float, within: Bounds, error: type[ConfigurationError] = ConfigurationError
) -> None:
    near = _ROUNDING * abs(within.least), _ROUNDING * abs(within.most)
    # Written so that NaN is outside.
    if not within.least - near[0] <= value <= within.most + near[1]:
        raise error(f"{what}: expected {within.least:g} to {within.most:g}, was {value:g}")
