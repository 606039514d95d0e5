"""Sensors by the codes under which ASTERIX names them."""

from multiradar.ingest.asterix_sensors import names_by_source, scan_periods_by_source
from multiradar.wire import sensor_table
from multiradar_schemas.sensors.sensor import parse_sensors

SENSORS = """
[[sensor]]
id = "hill"
kind = "radar"
sac = 20
sic = 130
also = ["20-131"]
latitude_deg = 50.0
longitude_deg = 14.0
height_m = 400.0
rotation_period_s = 4.5

[[sensor]]
kind = "mlat"
sac = 20
sic = 201

[[sensor]]
id = "20-201-adsb"
kind = "adsb"

[[sensor]]
id = "900-1"
kind = "adsb"
"""


def test_a_sensor_is_found_by_its_codes_and_aliases() -> None:
    table = sensor_table(parse_sensors(SENSORS))
    assert names_by_source(table) == {
        (20 << 8 | 130, "radar"): "hill",
        (20 << 8 | 131, "radar"): "hill",
        (20 << 8 | 201, "mlat"): "20-201",
        (20 << 8 | 201, "adsb"): "20-201-adsb",
    }


def test_stated_turns_are_known_by_every_name() -> None:
    table = sensor_table(parse_sensors(SENSORS))
    assert scan_periods_by_source(table) == {20 << 8 | 130: 4.5, 20 << 8 | 131: 4.5}
