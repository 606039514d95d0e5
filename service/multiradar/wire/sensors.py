"""The sensors of a sensors file as the sensor table of the core."""

import re
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.sensors import PARAMETER_NAMES, PARAMETER_UNITS, SensorTable
from multiradar_schemas.sensors.sensor import Sensor, SensorsFile

#: Numbers of the kinds of measurement and of sensor in the core.
KIND_NUMBER = {
    "radar": KIND_RADAR,
    "adsb": KIND_POSITION,
    "mlat": KIND_POSITION,
    "bearing": KIND_BEARING,
    "direction-finder": KIND_BEARING,
}


def sensor_table(sensors: SensorsFile, *, in_order: bool = False) -> SensorTable:
    """Translate a sensors file.

    Parameters
    ----------
    sensors : SensorsFile
        The sensors in the order of the file, angles in degrees.
    in_order : bool
        Whether the order is kept; otherwise they are sorted by identifier.

    Returns
    -------
    SensorTable
        The sensors, angles in radians, the bias parameters to estimate, and
        the biases that are known.
    """
    ordered = sensors.sensor if in_order else in_order_of_ids(sensors).sensor
    biases = [(row, bias) for row, one in enumerate(ordered) for bias in one.estimated_biases()]
    kinds = np.array([PARAMETER_NAMES.index(bias.parameter) for _, bias in biases], np.int8)
    unit = np.array([parameter_unit(bias.parameter) for _, bias in biases], np.float64)
    return SensorTable(
        ids=tuple(one.id for one in ordered),
        kinds=np.array([KIND_NUMBER[one.kind] for one in ordered], np.int8),
        latitude_rad=np.radians(_numbers([one.latitude_deg for one in ordered])),
        longitude_rad=np.radians(_numbers([one.longitude_deg for one in ordered])),
        height_m=_numbers([one.height_m for one in ordered]),
        range_sigma_m=_numbers([one.range_sigma_m for one in ordered]),
        azimuth_sigma_rad=np.radians(_numbers([one.azimuth_sigma_deg for one in ordered])),
        position_sigma_m=_numbers([one.position_sigma_m for one in ordered]),
        range_max_m=_numbers([one.range_max_m for one in ordered], np.inf),
        rotation_period_s=_numbers([one.rotation_period_s for one in ordered]),
        parameter_sensor=np.array([row for row, _ in biases], np.int32),
        parameter_kind=kinds,
        prior_mean=np.array([bias.prior for _, bias in biases], np.float64) * unit,
        prior_sigma=np.array([bias.prior_sigma for _, bias in biases], np.float64) * unit,
        drift=np.array([bias.drift for _, bias in biases], np.float64) * unit,
        aliases=tuple(
            (name, row)
            for row, one in enumerate(ordered)
            for name in dict.fromkeys((*one.names_by_numbers(), *one.also))
            if name != one.id
        ),
        known_bias=np.array(
            [
                [known.get(name, 0.0) * parameter_unit(name) for name in PARAMETER_NAMES]
                for known in (one.known_biases() for one in ordered)
            ]
        ),
        self_reported=np.array([one.kind == "adsb" for one in ordered], np.bool_),
        asterix_codes=tuple(_asterix_code(one) for one in ordered),
        moving=np.array([one.moving for one in ordered], np.bool_),
        elevation_sigma_rad=np.radians(_numbers([one.elevation_sigma_deg for one in ordered])),
        earth_radius_factor=_numbers([one.earth_radius_factor for one in ordered]),
        transponder_delay_sigma_m=_numbers([one.transponder_delay_sigma_m for one in ordered]),
        plots_per_scan_max=_numbers([one.plots_per_scan_max for one in ordered]),
        clock_tolerance_s=_numbers([one.clock_tolerance_s for one in ordered]),
        disabled=np.array([not one.enabled for one in ordered], np.bool_),
    )


def in_order_of_ids(sensors: SensorsFile) -> SensorsFile:
    """Return the sensors sorted by identifier, the order of their table."""
    return SensorsFile(sensor=tuple(sorted(sensors.sensor, key=lambda sensor: sensor.id)))


def _numbers(values: Sequence[float | None], missing: float = np.nan) -> NDArray[np.float64]:
    return np.array([missing if value is None else value for value in values], np.float64)


def _asterix_code(sensor: Sensor) -> int:
    """Return SAC times 256 plus SIC, or the numbers of a dump where they fit."""
    pairs = [(sensor.sac, sensor.sic), (sensor.source, sensor.sensor)]
    if match := re.fullmatch(r"(\d{1,3})-(\d{1,3})", sensor.id):
        pairs.append((int(match[1]), int(match[2])))
    for area, own in pairs:
        if area is not None and own is not None and max(area, own) <= 255:
            return area << 8 | own
    return -1


def parameter_unit(parameter: str) -> float:
    """Return the internal value of one unit of a bias parameter: rad for 1°, otherwise 1."""
    return PARAMETER_UNITS[PARAMETER_NAMES.index(parameter)]
