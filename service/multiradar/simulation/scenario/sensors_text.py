"""The sensors file of a scenario: the configuration of the tracker, without the truth."""

from typing import Any

import numpy as np

from multiradar.estimation.measurement.sensors import (
    PARAMETER_NAMES,
    PARAMETER_UNITS,
)
from multiradar.geodesy.system_plane import SystemPlane
from multiradar.simulation.scenario.model import SITED, Bias, Scenario, Sensor
from multiradar.simulation.scenario.toml_text import toml_text

# A picometre of angle: coordinates are written as given.
_DIGITS = 12

_HEAD = """\
# Sensors of a simulated scenario: sites, noise, scan periods and prior biases.
# The true biases are in truth_biases.parquet, not in this file.

"""


def sensors_text(scenario: Scenario) -> str:
    """Return the text of `sensors.toml`.

    Returns
    -------
    str
        Sites, sigmas, scan periods, priors and drifts, without the values of the biases.
    """
    plane = SystemPlane(*scenario.centre_rad)
    tables = [_sensor(one, plane) for one in scenario.sensors]
    if not any("latitude_deg" in one for one in tables):
        # Of ADS-B alone: the tracker needs one position.
        centre = np.round(np.degrees(scenario.centre_rad), _DIGITS).tolist()
        tables[0] |= dict(zip(("latitude_deg", "longitude_deg"), centre, strict=True))
    return _HEAD + toml_text({"sensor": tables})


def _sensor(sensor: Sensor, plane: SystemPlane) -> dict[str, Any]:
    table: dict[str, Any] = {"id": sensor.identifier, "kind": sensor.kind}
    latitude, longitude = plane.to_geodetic(sensor.east_m, sensor.north_m)
    if sensor.kind not in SITED:
        return _of_positions(sensor, float(latitude), float(longitude)) | _biases(sensor)
    table |= {
        "latitude_deg": round(float(np.degrees(latitude)), _DIGITS),
        "longitude_deg": round(float(np.degrees(longitude)), _DIGITS),
        "height_m": sensor.height_m,
        **({"range_sigma_m": sensor.range_sigma_m} if sensor.kind == "radar" else {}),
        "azimuth_sigma_deg": round(float(np.degrees(sensor.azimuth_sigma_rad)), _DIGITS),
        "rotation_period_s": sensor.rotation_period_s,
    }
    if sensor.elevation_sigma_rad is not None:
        sigma_deg = float(np.degrees(sensor.elevation_sigma_rad))
        table["elevation_sigma_deg"] = round(sigma_deg, _DIGITS)
    if sensor.moves:
        table["moving"] = True
    if sensor.earth_radius_factor is not None:
        table["earth_radius_factor"] = sensor.earth_radius_factor
    if sensor.transponder_delay_sigma_m is not None:
        table["transponder_delay_sigma_m"] = sensor.transponder_delay_sigma_m
    if np.isfinite(sensor.range_max_m):
        table["range_max_m"] = sensor.range_max_m
    return table | _biases(sensor)


# A sensor of reported positions has a reference point if its frame has biases.
def _of_positions(sensor: Sensor, latitude: float, longitude: float) -> dict[str, Any]:
    table: dict[str, Any] = {"id": sensor.identifier, "kind": sensor.kind}
    if sensor.has_frame:
        table["latitude_deg"] = round(float(np.degrees(latitude)), _DIGITS)
        table["longitude_deg"] = round(float(np.degrees(longitude)), _DIGITS)
    return table | {"position_sigma_m": sensor.position_sigma_m}


def _biases(sensor: Sensor) -> dict[str, Any]:
    biases = {
        PARAMETER_NAMES[kind]: _known(kind, sensor.biases[kind])
        for kind in sorted(sensor.specified_biases)
    }
    known = {name: one for name, one in biases.items() if one}
    return {"bias": known} if known else {}


# Configuration of the tracker for a parameter specified in the scenario.
def _known(kind: int, bias: Bias) -> dict[str, Any]:
    unit = 1.0 / PARAMETER_UNITS[kind]
    drift = bias.drift if bias.assumed_drift is None else bias.assumed_drift
    known: dict[str, Any] = {"estimate": bias.estimate is not False}
    if bias.prior != 0.0:
        known["prior"] = round(bias.prior * unit, _DIGITS)
    if bias.prior_sigma is not None:
        known["prior_sigma"] = round(bias.prior_sigma * unit, _DIGITS)
    if drift > 0.0:
        known["drift"] = round(drift * unit, _DIGITS)
    return known
