"""The sensors file: defaults by kind, names by numbers, and one clear sentence for each fault."""

from pathlib import Path

import pytest

from multiradar_schemas.errors import DocumentError
from multiradar_schemas.sensors.sensor import load_sensors, parse_sensors
from support.inputs.messages import SENSORS_TOML

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


BIAS = "[sensor.bias.range_gain]\nestimate = true\n"


@pytest.mark.parametrize(
    ("numbers", "name"),
    [("source = 41\nsensor = 10", "41-10"), ("sac = 20\nsic = 130", "20-130")],
)
def test_a_sensor_without_id_is_named_by_its_numbers(numbers: str, name: str) -> None:
    assert parse_sensors(RADAR.replace('id = "a"', numbers)).sensor[0].id == name


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "toml: sensor: missing; write [[sensor]] before the keys of each sensor"),
        (RADAR.replace("[[sensor]]", "[[radar]]"), "unknown key 'radar'; known: sensor"),
        (RADAR + RADAR.replace("[[sensor]]", ""), "a header such as [[sensor]] may be missing"),
        ("sensor = []", "at least 1 item"),
        ("sensor = 3", "line 1: sensor: expected a list, was 3"),
        (
            RADAR + "colour = 3",
            "line 8: sensor a: unknown key 'colour'; known: id, kind, latitude_deg, longitude_deg,",
        ),
        (RADAR + "range_sigma = 3", "sensor a: unknown key 'range_sigma' (did you mean 'range_sig"),
        ("colour = 3", "line 1: unknown key 'colour'; known: sensor"),
        (
            RADAR + "range_max_m = 300",
            "range_max_m: expected a number from 500 to 1000000 (m), was",
        ),
        (RADAR + "range_sigma_m = inf", "range_sigma_m: expected a finite number, was inf"),
        (
            RADAR.replace("55.0", "true"),
            "latitude_deg: expected a number, was true",
        ),
        (
            RADAR.replace("55.0", "'55'"),
            "latitude_deg: expected a number, was '55'",
        ),
        (RADAR.replace("55.0", "nan"), "toml: 1 field to fill in: a latitude_deg (line 5)"),
        (RADAR.replace("55.0", "91"), "expected a number from -90 to 90 (degree), was 91"),
        (RADAR.replace("height_m = 100.0", ""), "1 field to fill in: a height_m (line 2)"),
        (RADAR.replace('"radar"', '"sonar"'), "line 4: sensor a: kind: unknown name 'sonar'; kn"),
        (RADAR.replace('id = "a"', ""), "line 2: sensor[0].id: missing"),
        (RADAR.replace('"a"', '"a b"'), "line 3: sensor a b: id: expected text of the form"),
        (RADAR + RADAR, "two sensors are named a: remove one"),
        (
            RADAR + "range_sigma_m = 0",
            "range_sigma_m: expected a number from 0.1 to 10000 (m), was 0",
        ),
        (
            RADAR + "[sensor.bias.wobble]",
            "line 8: sensor a: bias: unknown key 'wobble'; known: range_offset_m, azimuth_offset_d",
        ),
        (
            RADAR + "[sensor.bias.range_gain]\nprior = 5",
            "line 9: sensor a: bias.range_gain.prior: expected a number from -0.1 to 0.1, was 5",
        ),
        (
            RADAR + "[sensor.bias.range_gain]\nprior_sigma = -1",
            "bias.range_gain.prior_sigma: expected a number from 1e-09 to 0.05, was -1",
        ),
        (
            '[[sensor]]\nid="x"\nkind="adsb"\n[sensor.bias.range_gain]\nestimate = true',
            "bias.range_gain does not apply to the adsb x; remove it",
        ),
        (
            '[[sensor]]\nid="x"\nkind="adsb"\n[sensor.bias.range_gain]\nprior = 0.05',
            "bias.range_gain does not apply to the adsb x; remove it",
        ),
        (
            RADAR.replace("radar", "adsb") + "[sensor.bias.range_gain]\nprior = 0.05",
            'does not apply to the adsb a; remove it, or write kind = "radar"',
        ),
        ("[[sensor]", "not valid TOML: "),
        ("[[sensor]]\nlatitude_deg = 46,4247\n", "; write 46.4247 for 46,4247"),
        (
            '[sensor]\nid = "x"\n[sensor]\nid = "y"\n',
            "not valid TOML: Cannot declare ('sensor',) twice (at line 3, column 8); write "
            "[[sensor]] for each [sensor]",
        ),
        ('[sensor]\nid = "x"\n[[sensor]]\nid = "y"\n', "; write [[sensor]] for each [sensor]"),
        # Each sensor has a table of each bias: what is wrong is another line.
        (f"[[sensors]]\n{BIAS}[[sensors]]\n{BIAS}", "; write [[sensor]] for [[sensors]], as in ["),
        (f"[[sensor]]\nid = a\n{BIAS}[[sensor]]\n{BIAS}", '(at line 2, column 6); write "a" for a'),
        (f"[[sensor]]\n{BIAS}{BIAS}", "; [sensor.bias.range_gain] occurs twice in one [[sensor]]"),
        ("[[sensor]]\nenabled = True\n", "; write true for True"),
        (
            '[sensor]\nid = "x"\nkind = "adsb"\n',
            "line 1: sensor: expected a list of tables: write [[sensor]] for [sensor]",
        ),
    ],
)
def test_a_fault_is_reported_in_one_sentence(text: str, sentence: str, tmp_path: Path) -> None:
    path = tmp_path / "sensors.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DocumentError) as fault:
        load_sensors(path)
    assert sentence in str(fault.value)
    assert str(fault.value).startswith(f"{path}: ")
    assert "\n" not in str(fault.value)


def test_a_file_that_cannot_be_read_is_reported(tmp_path: Path) -> None:
    with pytest.raises(DocumentError, match=r"absent\.toml: no such file$"):
        load_sensors(tmp_path / "absent.toml")
    (tmp_path / "latin.toml").write_bytes(b"# \xe9")
    with pytest.raises(DocumentError, match="not UTF-8 text \\(byte 2\\)"):
        load_sensors(tmp_path / "latin.toml")
    for name, content, words in (
        ("table.toml", b"PAR1\x15\x00\xe9", "expected TOML, was Parquet"),
        ("image.toml", b"\x89PNG\x00\x00", "expected TOML, was binary"),
        ("wide.toml", "# radar\n".encode("utf-16"), "not UTF-8 text"),
    ):
        (tmp_path / name).write_bytes(content)
        with pytest.raises(DocumentError, match=words):
            load_sensors(tmp_path / name)


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


def test_all_mistakes_are_reported_at_once_each_with_its_line_and_sensor() -> None:
    text = """# Two radars.
[[sensor]]
id = "26-10"
kind = "radar"
latitude_deg = 4642
longitud_deg = 6.1
range_sigma_m = -3

[[sensor]]
source = 35
sensor = 10
kind = "radr"
also = [
    "9-9",
    "a b",
]
bias.range_gain = { prior = 5 }
"""
    with pytest.raises(DocumentError) as fault:
        parse_sensors(text)
    assert [one.partition("; known")[0] for one in fault.value.reasons] == [
        "line 2: sensor 26-10: longitude_deg: missing",
        "line 2: sensor 26-10: height_m: missing",
        "line 5: sensor 26-10: latitude_deg: expected a number from -90 to 90 (degree), was 4642",
        "line 6: sensor 26-10: unknown key 'longitud_deg' (did you mean 'longitude_deg'?)",
        "line 7: sensor 26-10: range_sigma_m: expected a number from 0.1 to 10000 (m), was -3",
        "line 12: sensor 35-10: kind: unknown name 'radr' (did you mean 'radar'?)",
        "line 13: sensor 35-10: also[1]: expected text of the form ^[A-Za-z0-9._-]{1,64}$, "
        "was 'a b'",
        "line 17: sensor 35-10: bias.range_gain.prior: expected a number from -0.1 to 0.1, was 5",
    ]


def test_fields_that_are_left_to_fill_in_are_reported_in_one_sentence() -> None:
    text = RADAR.replace("55.0", "nan").replace("37.0", "nan").replace("height_m = 100.0", "")
    with pytest.raises(DocumentError) as fault:
        parse_sensors(text + text.replace('"a"', '"b"'), source="s.toml")
    assert str(fault.value) == (
        "s.toml: 6 fields to fill in: a height_m (line 2), a latitude_deg (line 5), "
        "a longitude_deg (line 6), b height_m (line 9), b latitude_deg (line 12), "
        "b longitude_deg (line 13)"
    )


def test_a_byte_order_mark_and_other_line_ends_are_no_mistake(tmp_path: Path) -> None:
    path = tmp_path / "sensors.toml"
    path.write_bytes(b"\xef\xbb\xbf" + RADAR.replace("\n", "\r\n").encode())
    assert load_sensors(path) == parse_sensors(RADAR)
