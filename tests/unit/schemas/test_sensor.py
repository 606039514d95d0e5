"""The sensors file: defaults by kind, names by numbers, and one clear sentence for each fault."""

from pathlib import Path

import pytest

from multiradar_schemas.errors import DocumentError
from multiradar_schemas.sensor import load_sensors, parse_sensors
from support.messages import SENSORS_TOML

RADAR = """
[[sensor]]
id = "a"
kind = "radar"
latitude_deg = 55.0
longitude_deg = 37.0
height_m = 100.0
"""


def test_a_radar_without_tables_estimates_range_and_azimuth_offset() -> None:
    biases = parse_sensors(RADAR).sensor[0].estimated_biases()
    assert [(bias.parameter, bias.prior, bias.prior_sigma, bias.drift) for bias in biases] == [
        ("range_offset_m", 0.0, 500.0, 0.0),
        ("azimuth_offset_deg", 0.0, 0.5, 0.0),
    ]


def test_tables_switch_parameters_and_keep_the_other_defaults() -> None:
    text = f"""{RADAR}
    [sensor.bias.range_offset_m]
    estimate = false
    [sensor.bias.azimuth_offset_deg]
    prior = 0.25
    [sensor.bias.time_offset_s]
    estimate = true
    drift = 1e-4
    """
    biases = parse_sensors(text).sensor[0].estimated_biases()
    assert [(bias.parameter, bias.prior, bias.prior_sigma, bias.drift) for bias in biases] == [
        ("azimuth_offset_deg", 0.25, 0.5, 0.0),
        ("time_offset_s", 0.0, 0.5, 1e-4),
    ]


def test_sources_of_positions_have_no_biases_and_thirty_metres() -> None:
    sensor = parse_sensors(SENSORS_TOML).sensor[1]
    assert sensor.estimated_biases() == ()
    assert sensor.position_sigma_m == 30.0


@pytest.mark.parametrize(
    ("numbers", "name"),
    [("source = 41\nsensor = 10", "41-10"), ("sac = 20\nsic = 130", "20-130")],
)
def test_a_sensor_without_id_is_named_by_its_numbers(numbers: str, name: str) -> None:
    assert parse_sensors(RADAR.replace('id = "a"', numbers)).sensor[0].id == name


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "sensor: expected a value, was absent"),
        ("sensor = []", "at least 1 item"),
        ("sensor = 3", "sensor: expected a valid tuple, was 3"),
        (
            RADAR + "colour = 3",
            "sensor[0]: expected a key of id, kind, latitude_deg, longitude_deg,",
        ),
        (RADAR + "colour = 3", "sac, sic, bias, was 'colour'"),
        ("colour = 3", "toml: expected a key of sensor, was 'colour'"),
        (
            RADAR.replace("55.0", "true"),
            "latitude_deg: expected a valid number, was true",
        ),
        (
            RADAR.replace("55.0", "'55'"),
            "latitude_deg: expected a valid number, was '55'",
        ),
        (RADAR.replace("55.0", "nan"), "sensor[0].latitude_deg: expected a finite number, was nan"),
        (RADAR.replace("55.0", "91"), "latitude_deg: expected a value less than or equal to 90"),
        (RADAR.replace("height_m = 100.0", ""), "expected height_m for the radar a, was absent"),
        (RADAR.replace('"radar"', '"sonar"'), "sensor[0].kind: expected 'radar', 'adsb'"),
        (RADAR.replace('id = "a"', ""), "sensor[0].id: expected a value, was absent"),
        (RADAR.replace('"a"', '"a b"'), "sensor[0].id: expected text of the form"),
        (RADAR + RADAR, "expected each id and each pair of numbers once, was twice a"),
        (
            RADAR + "range_sigma_m = 0",
            "range_sigma_m: expected a value greater than or equal to 0.1",
        ),
        (
            RADAR + "[sensor.bias.wobble]",
            "sensor[0].bias: expected a key of range_offset_m, azimuth_offset_deg, range_gain, "
            "time_offset_s, was 'wobble'",
        ),
        (
            RADAR + "[sensor.bias.range_gain]\nprior = 5",
            "sensor[0].bias.range_gain.prior: expected a value less than or equal to 0.1, was 5",
        ),
        (
            RADAR + "[sensor.bias.range_gain]\nprior_sigma = -1",
            "sensor[0].bias.range_gain.prior_sigma: expected a value greater than or equal to",
        ),
        (
            '[[sensor]]\nid="x"\nkind="adsb"\n[sensor.bias.range_gain]\nestimate = true',
            "expected no estimate of range_gain for the adsb x, has one",
        ),
        (
            '[[sensor]]\nid="x"\nkind="adsb"\n[sensor.bias.range_gain]\nprior = 0.05',
            "expected no prior of range_gain for the adsb x, was 0.05",
        ),
        ("[[sensor]", "expected TOML, was not"),
    ],
)
def test_a_fault_is_told_in_one_sentence(text: str, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "sensors.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DocumentError) as fault:
        load_sensors(path)
    assert sentence in str(fault.value)
    assert str(fault.value).startswith(f"{path}: ")
    assert "\n" not in str(fault.value)


def test_a_file_that_cannot_be_read_is_told(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match="expected a file, was: No such file"):
        load_sensors(tmp_path / "absent.toml")
    (tmp_path / "latin.toml").write_bytes(b"# \xe9")
    with pytest.raises(DocumentError, match="another encoding at byte 2"):
        load_sensors(tmp_path / "latin.toml")


def test_what_is_not_estimated_is_known() -> None:
    text = RADAR + "\n".join(
        [
            "[sensor.bias.range_offset_m]\nestimate = false\nprior = 250.0",
            "[sensor.bias.azimuth_offset_deg]\nprior = 0.2",
            "[sensor.bias.range_gain]\nprior = 0.001",
        ]
    )
    radar = parse_sensors(text).sensor[0]
    assert radar.known_biases() == {"range_offset_m": 250.0, "range_gain": 0.001}
    assert [one.parameter for one in radar.estimated_biases()] == ["azimuth_offset_deg"]
