"""Measurements as messages: JSON objects, Arrow streams, and the sensors they name."""

import io
import json
from typing import Any

import polars as pl

from multiradar_schemas.sensors.sensor import SensorsFile, parse_sensors

SENSORS_TOML = """
[[sensor]]
source = 41
sensor = 10
kind = "radar"
latitude_deg = 55
longitude_deg = 37.5
height_m = 200
range_max_m = 400_000
[sensor.bias.range_gain]
estimate = true
drift = 1e-6

[[sensor]]
id = "adsb"
kind = "adsb"

[[sensor]]
id = "finder"
kind = "direction-finder"
latitude_deg = -12
longitude_deg = 130.5
height_m = 20
"""


def sensors() -> SensorsFile:
    """Return a radar `41-10`, `adsb` and a direction finder `finder`."""
    return parse_sensors(SENSORS_TOML)


def radar(**changes: Any) -> dict[str, Any]:
    """Return a radar plot as a JSON object, with changes; None leaves a field null."""
    plot = {
        "time_s": 100.5,
        "sensor_id": "41-10",
        "kind": "radar",
        "range_m": 90_000.0,
        "azimuth_deg": 271.25,
        "height_m": 9000.0,
        "mode_3a": "7012",
    }
    return {**plot, **changes}


def adsb(**changes: Any) -> dict[str, Any]:
    """Return an ADS-B report as a JSON object, with changes."""
    report = {
        "time_s": 101.0,
        "sensor_id": "adsb",
        "kind": "adsb",
        "latitude_deg": 55.25,
        "longitude_deg": 37.5,
        "mode_s_address": "4b1a2c",
        "track_number": 7,
    }
    return {**report, **changes}


def without(row: dict[str, Any], *names: str) -> dict[str, Any]:
    """Return an object without some of its fields."""
    return {name: value for name, value in row.items() if name not in names}


def array(*rows: object) -> bytes:
    """Return rows as a JSON array; a row that is a str is inserted unchanged."""
    texts = [row if isinstance(row, str) else json.dumps(row) for row in rows]
    return ("[" + ",".join(texts) + "]").encode()


def stream(frame: pl.DataFrame, **options: Any) -> bytes:
    """Return a table as an Arrow IPC stream."""
    body = io.BytesIO()
    frame.write_ipc_stream(body, **options)
    return body.getvalue()
