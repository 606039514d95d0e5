"""Scenarios are read as written, or rejected with the key and what was expected."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from multiradar.errors import ConfigurationError
from multiradar.simulation.scenario.file import (
    builtin_names,
    builtin_scenario,
    builtin_table,
    changed,
    load_scenario,
    scenario_of,
    scenario_table,
    table_text,
)
from multiradar.simulation.scenario.model import (
    Aircraft,
    ClutterBurst,
    CoupledNoise,
    Leg,
    ReportError,
    SecondFeed,
    Sensor,
    Traffic,
)
from multiradar.simulation.scenario.toml_text import toml_text
from multiradar.simulation.traffic import all_aircraft

GOOD = """\
seed = 5
duration_s = 60

[plane]
latitude_deg = 56.0
longitude_deg = 61.0

[[aircraft]]
latitude_deg = 56.5
longitude_deg = 61.5
speed_mps = 200
heading_deg = 90
mode_3a = "1234"
mode_s_address = "abcdef"

[[aircraft.leg]]
duration_s = 30
turn_rate_deg_per_s = -1.5

[[sensor]]
id = "A"
latitude_deg = 56.0
longitude_deg = 61.0
rotation_period_s = 4
azimuth_sigma_deg = 0.05
gaps_s = [[10, 20]]
bias.range_offset_m = 100
bias.azimuth_offset_deg = { value = -0.2, drift = 0.01, prior_sigma = 0.4 }
"""


def _load(folder: Path, text: str) -> None:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    load_scenario(path)


def test_units_are_si_and_radians_inside(tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(GOOD, encoding="utf-8")
    scenario = load_scenario(path)
    (sensor,), (aircraft,) = scenario.sensors, scenario.aircraft
    assert sensor.azimuth_sigma_rad == pytest.approx(np.radians(0.05), rel=1e-15)
    assert [bias.value for bias in sensor.biases] == [100.0, np.radians(-0.2)] + 7 * [0.0]
    assert sensor.biases[1].drift == pytest.approx(np.radians(0.01))
    assert sensor.biases[1].prior_sigma == pytest.approx(np.radians(0.4))
    assert sensor.specified_biases == {0, 1}
    assert sensor.horizon
    assert (sensor.east_m, sensor.north_m) == pytest.approx((0.0, 0.0), abs=1e-6)
    # Half a degree of each is about 31 km east, 56 km north.
    assert aircraft.east_m == pytest.approx(30.8e3, abs=300.0)
    assert aircraft.north_m == pytest.approx(55.8e3, abs=300.0)
    assert aircraft.legs[0].turn_rate_rad_per_s == pytest.approx(np.radians(-1.5))
    assert (aircraft.mode_3a, aircraft.mode_s_address) == (0o1234, 0xABCDEF)
    assert aircraft.track_number == 1


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("seed = 5", "sead = 5", "line 1: unknown key 'sead' (did you mean 'seed'?); known: title"),
        ("seed = 5", "seed = -1", "seed: expected a number from 0 to 9223372036854775807, was"),
        ("seed = 5", "seed = 1.5", "seed: "),
        ("duration_s = 60", "", "toml: duration_s: missing"),
        ("duration_s = 60", "duration_s = 0", "duration_s: expected a number above 0, was 0"),
        ("duration_s = 60", "duration_s = inf", "duration_s: "),
        ("duration_s = 60", "duration_s = nan", "duration_s: "),
        ("duration_s = 60", 'duration_s = "60"', "duration_s: "),
        ("duration_s = 60", "duration_s = 1e9", "duration_s: expected a number of at most 604800,"),
        ("speed_mps = 200", "speed_kt = 200", "aircraft[0]: unknown key 'speed_kt' (did you mean "),
        ("speed_mps = 200", "speed_mps = -3", "line 11: aircraft[0].speed_mps: expected a number "),
        ("speed_mps = 200", "speed_mps = true", "aircraft[0].speed_mps: "),
        ("latitude_deg = 56.5", "east_m = 5.0", "aircraft[0]: expected the position of the "),
        ("latitude_deg = 56.5", "latitude_deg = 91", "aircraft[0].latitude_deg: expected a number"),
        ("latitude_deg = 56.5", "latitude_deg = -80", "longitude_deg within 60 degrees"),
        ('"1234"', '"1289"', "aircraft[0].mode_3a: expected text of the form"),
        ("speed_mps = 200", "speed_mps = 200\nend_s = 0", "aircraft[0]: expected end_s after"),
        ("duration_s = 30", "duration_s = -30", "aircraft[0].leg[0].duration_s: expected a num"),
        ("duration_s = 30", "length_s = 30", "aircraft[0].leg[0]: unknown key 'length_s'; known: "),
        (
            "speed_mps = 200",
            'speed_mps = 200\nlater_mode_3a = "4321"',
            "aircraft[0]: expected later_mode_3a and code_change_s together, found only one",
        ),
        (
            "speed_mps = 200",
            "speed_mps = 200\nacceleration_density = 1",
            "aircraft[0]: expected only one of legs, coupled and acceleration_density",
        ),
        ('id = "A"', 'id = "A B"', "line 21: sensor A B: id: expected text of the form"),
        ('id = "A"', 'id = "A"\nkind = "sonar"', "sensor A: kind: unknown name 'sonar'; known: r"),
        ('id = "A"', 'id = "A"\nkind = "adsb"', "latitude_deg does not apply to the adsb A"),
        ('id = "A"', 'id = "A"\ninterval_s = 2', "expected either rotation_period_s or interval_s"),
        ('id = "A"', 'id = "A"\nposition_sigma_m = 2', "position_sigma_m does not apply to the"),
        ('id = "A"', 'id = "A"\ndetection_probability = 1.1', "detection_probability: expected a"),
        ('id = "A"', 'id = "A"\nreports = ["hight"]', "reports[0]: unknown name 'hight' (did you "),
        ("[[10, 20]]", "[[20, 10]]", "sensor A: gaps_s[0]: expected two numbers in ascending"),
        ("[[10, 20]]", "[[20]]", "sensor A: gaps_s[0]"),
        ("= 0.05", "= 0", "sensor A: azimuth_sigma_deg: expected a number from 0.0001 to 10, was "),
        ("bias.range_offset_m", "bias.range_m", "A: bias: unknown key 'range_m' (did you mean"),
        ("drift = 0.01", "drift = -1", "sensor A: bias.azimuth_offset_deg.drift: expected a num"),
        ("drift = 0.01", "drift_rate = 1", "unknown key 'drift_rate' (did you mean 'drift'?)"),
        ("drift = 0.01", "jump = 0.3", "missing jump_s, the time at which the bias jumps by 0.3"),
        ("[plane]", '[plane]\nkind = "flat"', "expected positions as east_m and north_m on a"),
        ("[plane]", '[plane]\nkind = "round"', "plane.kind: unknown name 'round'; known: flat, wg"),
        ("latitude_deg = 56.0\nlongitude_deg = 61.0\n\n[[air", "latitude_deg = 56.0\n\n[[air",
         "plane: expected both latitude_deg and longitude_deg"),
        ("seed = 5", "seed = ", "not valid TOML: "),
        ("[[sensor]]", "[[sensors]]", "unknown key 'sensors' (did you mean 'sensor'?)"),
    ],
)  # fmt: skip
def test_invalid_values_are_reported_with_key_and_expectation(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    assert old in GOOD
    with pytest.raises(ConfigurationError) as caught:
        _load(tmp_path, GOOD.replace(old, new, 1))
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_empty_scenarios_and_duplicate_names_are_rejected(tmp_path: Path) -> None:
    aircraft = GOOD[GOOD.index("[[aircraft]]") : GOOD.index("[[sensor]]")]
    sensor = GOOD[GOOD.index("[[sensor]]") :]
    with pytest.raises(ConfigurationError, match="expected 1 to 20000 aircraft, found 0"):
        _load(tmp_path, GOOD.replace(aircraft, ""))
    with pytest.raises(ConfigurationError, match="sensor: missing"):
        _load(tmp_path, GOOD.replace(sensor, ""))
    with pytest.raises(ConfigurationError, match="id of a sensor A is given twice"):
        _load(tmp_path, GOOD + sensor)
    numbered = aircraft.replace("speed_mps", "track_number = 4\nspeed_mps")
    with pytest.raises(ConfigurationError, match="track_number 4 is given twice"):
        _load(tmp_path, GOOD.replace(aircraft, numbered + numbered))
    nowhere = "duration_s = 9\n[[traffic]]\ncount = 1\neast_m = 0\nnorth_m = 0\n"
    with pytest.raises(ConfigurationError, match="of the plane's centre or of a radar"):
        _load(tmp_path, nowhere + '[[sensor]]\nid = "A"\neast_m = 0\nnorth_m = 0\n')


def test_a_missing_or_binary_file_is_reported(tmp_path: Path) -> None:
    missing = tmp_path / "no.toml"
    with pytest.raises(ConfigurationError, match=r"no\.toml: no such file$"):
        load_scenario(missing)
    missing.write_bytes(b"title = '\xff'")
    with pytest.raises(ConfigurationError, match="not UTF-8 text"):
        load_scenario(missing)


@pytest.mark.parametrize("name", builtin_names())
def test_every_builtin_scenario_survives_a_round_trip(name: str) -> None:
    table = builtin_table(name)
    assert table.title
    again = scenario_table(tomllib.loads(table_text(table)), source="again")
    assert scenario_of(again) == builtin_scenario(name)
    assert len(all_aircraft(scenario_of(again))) >= 15


def test_an_unknown_scenario_is_reported_with_the_known_ones() -> None:
    with pytest.raises(ConfigurationError, match=r"unknown scenario 'x'; known: .*report-1-6"):
        builtin_scenario("x")


def test_another_seed_draws_other_aircraft_and_is_checked() -> None:
    table = builtin_table("report-1-6")
    scenario = scenario_of(changed(table, seed=99, duration_s=12.5))
    assert (scenario.seed, scenario.duration_s) == (99, 12.5)
    first, other = all_aircraft(builtin_scenario("report-1-6")), all_aircraft(scenario)
    assert all(a.east_m != b.east_m for a, b in zip(first, other, strict=True))
    with pytest.raises(ConfigurationError, match="duration_s: expected a number above 0, was 0"):
        changed(table, duration_s=0.0)


def test_traffic_stays_within_its_spans_and_has_identities_of_its_own() -> None:
    aircraft = all_aircraft(builtin_scenario("manoeuvring-traffic"))
    drawn = aircraft[1:]
    assert len(drawn) == 30
    assert all(abs(one.east_m) <= 100e3 and 3000 <= one.height_m <= 11_000 for one in drawn)
    assert len({one.track_number for one in aircraft}) == 31
    assert len({one.mode_s_address for one in aircraft}) == 31
    assert all(one.mode_3a is not None and 0 <= one.mode_3a <= 0o7777 for one in aircraft)
    for one in drawn:
        rates = [abs(leg.turn_rate_rad_per_s) for leg in one.legs]
        assert rates[0] == 0.0
        assert np.all(np.radians(0.999) <= np.array(rates[1::2]))
        assert np.all(np.array(rates) <= np.radians(3.0))
        assert sum(leg.duration_s for leg in one.legs) >= 1200.0
        speeds = one.speed_mps + np.cumsum(
            [leg.acceleration_mps2 * leg.duration_s for leg in one.legs]
        )
        assert np.all((speeds > 50.0) & (speeds < 400.0))


def test_text_survives_a_round_trip() -> None:
    table = {
        "text": 'quote " back\\slash \t tab \x7f é\n', "yes": True, "whole": -3, "small": 1e-30,
        "pairs": [[1.5, 2.0], [3.0, 4.0]], "none": [], "inner": {"deep": {"x": 1.0}, "y": "z"},
        "many": [{"a": 1, "b": {"c": [True]}}, {"a": 2}],
    }  # fmt: skip
    assert tomllib.loads(toml_text(table | {"absent": None})) == table


def test_defaults_of_files_and_code_agree() -> None:
    values = {
        "duration_s": 60.0,
        "plane": {"kind": "flat", "latitude_deg": 50.0, "longitude_deg": 15.0},
        "aircraft": [
            {
                "east_m": 1.0, "north_m": 2.0, "height_m": 3.0, "speed_mps": 4.0,
                "heading_deg": 0.0, "leg": [{"duration_s": 5.0}], "report_error": [{}],
            }
        ],
        "traffic": [
            {
                "count": 7, "east_m": [8.0, 9.0], "north_m": [10.0, 11.0],
                "coupled": {"acceleration_sigma_mps2": 6.0, "course_rate_sigma_deg_per_s": 0.0},
            }
        ],
        "sensor": [
            {
                "id": "A", "east_m": 0.0, "north_m": 0.0, "azimuth_sigma_deg": 0.08,
                "second_feed": {}, "storm": [{"start_s": 1.0, "end_s": 2.0, "plots_per_turn": 3.0}],
            }
        ],
    }  # fmt: skip
    found = scenario_of(scenario_table(values, source="scene"))
    (aircraft,), (traffic,), (sensor,) = found.aircraft, found.traffic, found.sensors
    assert found.start_time_s == 0.0
    assert aircraft == Aircraft(
        aircraft.track_number, 1.0, 2.0, 3.0, 4.0, 0.0, legs=(Leg(5.0),),
        report_errors=(ReportError(),),
    )  # fmt: skip
    assert traffic == Traffic(
        7, (8.0, 9.0), (10.0, 11.0), (9000.0, 9000.0), (150.0, 250.0), (0.0, 2.0 * np.pi),
        coupled=CoupledNoise(6.0, 0.0),
    )  # fmt: skip
    assert sensor == Sensor(
        "A", "radar", azimuth_sigma_rad=sensor.azimuth_sigma_rad,
        second_feed=SecondFeed(1.0), clutter_bursts=(ClutterBurst(1.0, 2.0, 3.0),),
    )  # fmt: skip
