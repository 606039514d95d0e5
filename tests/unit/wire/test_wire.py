"""The translation between wire and core: units, order, missing values, and rejected rows."""

import numpy as np
import polars as pl
import pytest

from multiradar.errors import InputError, MissingColumnError
from multiradar.estimation.measurement.kinds import KIND_BEARING, KIND_POSITION, KIND_RADAR
from multiradar.estimation.measurement.sensors import (
    PARAMETER_AZIMUTH_OFFSET,
    PARAMETER_RANGE_GAIN,
    PARAMETER_RANGE_OFFSET,
)
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.outputs import (
    STATE_COASTING,
    STATE_CONFIRMED,
    BiasRecords,
    TrackUpdates,
)
from multiradar.wire import (
    biases_frame,
    health_frame,
    measurement_batch,
    measurement_rows,
    sensor_table,
    tracks_frame,
)
from multiradar_schemas.errors import SchemaError
from multiradar_schemas.measurements.callsigns import callsign_texts, packed_callsigns
from multiradar_schemas.measurements.columns import MEASUREMENT_SCHEMA
from multiradar_schemas.products.bias import BIAS_SCHEMA, BiasEstimate
from multiradar_schemas.products.health import HEALTH_SCHEMA, RadarHealth
from multiradar_schemas.products.track import TRACK_SCHEMA, TrackUpdate
from multiradar_schemas.reject import RejectCode
from multiradar_schemas.sensors.sensor import parse_sensors
from support.fakes.health import health_records
from support.inputs.messages import adsb, radar, sensors

TABLE = sensor_table(sensors())
BEARING = {"time_s": 1.0, "sensor_id": "finder", "kind": "bearing", "azimuth_deg": 90.0}


def frame(*rows: dict[str, object]) -> pl.DataFrame:
    return pl.DataFrame(rows, schema=MEASUREMENT_SCHEMA)


def test_rows_are_shown_as_sent_without_missing_values() -> None:
    plot = radar(mode_3a="0012", mode_s_address="00c0fe", track_number=7)
    report = adsb(mode_3a=None, mode_s_address=None, track_number=None, callsign=None)
    batch, _ = measurement_batch(frame(plot, report), TABLE)
    shown, other = measurement_rows(batch, TABLE)
    assert {name: shown[name] for name in ("mode_3a", "mode_s_address", "track_number")} == {
        "mode_3a": "0012", "mode_s_address": "00c0fe", "track_number": 7,
    }  # fmt: skip
    assert shown["range_m"] == plot["range_m"]
    assert shown["azimuth_deg"] == pytest.approx(plot["azimuth_deg"])
    assert set(other) == {"time_s", "sensor_id", "latitude_deg", "longitude_deg"}


def test_a_ground_status_is_true_false_or_missing() -> None:
    rows = [radar(), radar(on_ground=True), radar(on_ground=False)]
    batch, _ = measurement_batch(frame(*rows), TABLE)
    assert batch.on_ground is not None
    assert batch.on_ground.tolist() == [-1, 1, 0]
    shown = [row.get("on_ground") for row in measurement_rows(batch, TABLE)]
    assert shown == [None, True, False]
    # Most batches have none.
    assert batch.select(slice(1)).on_ground is None
    assert measurement_batch(frame(radar()), TABLE)[0].on_ground is None
    both = MeasurementBatch.concatenate([batch.select(slice(1)), batch.select(slice(1, 2))])
    assert both.ground_status().tolist() == [-1, 1]


def test_aircraft_derived_data_are_in_si_and_missing_numbers_are_nan() -> None:
    sent = {
        "magnetic_heading_deg": 350.0,
        "roll_deg": -25.0,
        "track_angle_deg": 10.0,
        "track_angle_rate_deg_s": -1.5,
        "ground_speed_m_s": 220.0,
        "true_airspeed_m_s": 210.0,
        "indicated_airspeed_m_s": 150.0,
        "mach": 0.7,
        "vertical_rate_m_s": -8.0,
        "selected_altitude_m": 3048.0,
    }
    rows = [radar(), radar(**sent), radar(mach=0.5)]
    batch, rejected = measurement_batch(frame(*rows), TABLE)
    assert len(rejected) == 0
    data = batch.aircraft_data
    assert data is not None
    whole = [float(column[1]) for column in data]
    expected = [np.radians(one) if "_deg" in name else one for name, one in sent.items()]
    assert whole == pytest.approx(expected)
    assert np.isnan([column[0] for column in data]).all()
    assert np.isnan(data.mach).tolist() == [True, False, False]
    shown = measurement_rows(batch, TABLE)
    assert {name: shown[1].get(name) for name in sent} == pytest.approx(sent)
    assert not set(sent) & set(shown[0])
    # Most batches have none.
    assert batch.select(slice(1)).aircraft_data is None
    assert measurement_batch(frame(radar()), TABLE)[0].aircraft_data is None
    both = MeasurementBatch.concatenate([batch.select(slice(1)), batch.select(slice(2, 3))])
    assert both.aircraft_data is not None
    assert both.aircraft_data.mach.tolist() == pytest.approx([np.nan, 0.5], nan_ok=True)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("magnetic_heading_deg", 360.0),
        ("roll_deg", 90.5),
        ("track_angle_deg", -0.1),
        ("track_angle_rate_deg_s", 45.1),
        ("ground_speed_m_s", -1.0),
        ("true_airspeed_m_s", 1501.0),
        ("indicated_airspeed_m_s", float("nan")),
        ("mach", 5.1),
        ("vertical_rate_m_s", -201.0),
        ("selected_altitude_m", 40_001.0),
    ],
)
def test_implausible_aircraft_derived_data_reject_the_row(name: str, value: float) -> None:
    batch, rejected = measurement_batch(frame(radar(), radar(**{name: value})), TABLE)
    assert len(batch) == 1
    assert rejected.index.tolist() == [1]
    assert rejected.reason[0].startswith(f"{name}: expected")


def test_sensors_are_sorted_and_in_radians() -> None:
    assert TABLE.ids == ("41-10", "adsb", "finder")
    assert TABLE.kinds.tolist() == [KIND_RADAR, KIND_POSITION, KIND_BEARING]
    np.testing.assert_allclose(np.degrees(TABLE.latitude_rad), [55.0, np.nan, -12.0])
    np.testing.assert_allclose(np.degrees(TABLE.azimuth_sigma_rad), 0.08)
    assert TABLE.range_max_m.tolist() == [400_000.0, np.inf, np.inf]
    assert np.isnan(TABLE.rotation_period_s).all()


def test_bias_parameters_are_columns_in_the_order_of_the_sensors() -> None:
    assert TABLE.parameter_sensor.tolist() == [0, 0, 0, 2]
    assert TABLE.parameter_kind.tolist() == [
        PARAMETER_RANGE_OFFSET,
        PARAMETER_AZIMUTH_OFFSET,
        PARAMETER_RANGE_GAIN,
        PARAMETER_AZIMUTH_OFFSET,
    ]
    half_degree = np.radians(0.5)
    np.testing.assert_allclose(TABLE.prior_sigma, [500.0, half_degree, 0.002, half_degree])
    assert TABLE.drift.tolist() == [0.0, 0.0, 1e-6, 0.0]


def test_a_time_offset_is_estimated_when_the_file_asks_for_it() -> None:
    radar_table = """
[[sensor]]
id = "a"
kind = "radar"
latitude_deg = 46.0
longitude_deg = 7.0
height_m = 500.0
[sensor.bias.time_offset_s]
estimate = true
prior_sigma = 0.2
"""
    table = sensor_table(parse_sensors(radar_table, source="sensors.toml"))
    assert table.parameter_kind.tolist() == [0, 1, 3]
    assert table.prior_sigma[2] == 0.2


def test_minus_zero_is_zero() -> None:
    rows = [radar(azimuth_deg=-0.0), radar(azimuth_deg=0.0)]
    batch, _ = measurement_batch(pl.DataFrame(rows, schema=MEASUREMENT_SCHEMA), TABLE)
    assert np.signbit(batch.azimuth_rad).tolist() == [False, False]


def test_callsigns_are_normalised_for_blanks_and_case() -> None:
    given = ["DLH8JW", " dlh8jw  ", None, "A", "ABCD1234"]
    batch, rejected = measurement_batch(frame(*(radar(callsign=one) for one in given)), TABLE)
    assert len(rejected) == 0
    # Letters count from 1, digits from 48, blanks are 32: ICAO Annex 10.
    codes = [4, 12, 8, 56, 10, 23, 32, 32]
    number = sum(code << 6 * (7 - place) for place, code in enumerate(codes))
    assert batch.callsign.tolist()[:3] == [number, number, -1]
    shown = [row.get("callsign") for row in measurement_rows(batch, TABLE)]
    assert shown == ["DLH8JW", "DLH8JW", None, "A", "ABCD1234"]


@pytest.mark.parametrize("callsign", ["AB CD", " ab cd ", "A      B"])
def test_inner_blanks_of_a_callsign_are_kept(callsign: str) -> None:
    batch, _ = measurement_batch(frame(radar(callsign=callsign)), TABLE)
    assert callsign_texts(batch.callsign).to_list() == [callsign.strip().upper()]


@pytest.mark.parametrize("callsign", ["", "   ", "ABCDEFGHI", "ABCD EFGH", "AB-1", "ÄB1", "AB1\n"])
def test_an_invalid_callsign_is_rejected(callsign: str) -> None:
    batch, rejected = measurement_batch(frame(radar(callsign=callsign), radar()), TABLE)
    assert len(batch) == 1
    assert rejected.code == (RejectCode.OUT_OF_RANGE,)
    assert rejected.reason[0].startswith("callsign: expected text of the form")


def test_a_sensor_is_identified_by_its_numbers_too() -> None:
    numbers = """
[[sensor]]
id = "Lausanne"
source = 26
sensor = 10
sac = 20
sic = 130
kind = "radar"
latitude_deg = 46.0
longitude_deg = 7.0
height_m = 500.0
"""
    table = sensor_table(parse_sensors(numbers))
    names = ["26-10", "20-130", "Lausanne", "10-26"]
    rows = [radar(sensor_id=name) for name in names]
    batch, rejected = measurement_batch(pl.DataFrame(rows, schema=MEASUREMENT_SCHEMA), table)
    assert batch.sensor.tolist() == [0, 0, 0]
    assert rejected.index.tolist() == [3]


def test_a_sensor_received_through_two_networks_is_one() -> None:
    text = """
[[sensor]]
id = "41-10"
source = 41
sensor = 10
also = ["43-10", "41-10"]
kind = "radar"
latitude_deg = 46.0
longitude_deg = 7.0
height_m = 500.0
"""
    table = sensor_table(parse_sensors(text))
    rows = [radar(sensor_id=name) for name in ("41-10", "43-10", "44-10")]
    batch, rejected = measurement_batch(pl.DataFrame(rows, schema=MEASUREMENT_SCHEMA), table)
    assert batch.sensor.tolist() == [0, 0]
    assert rejected.index.tolist() == [2]
    other = text.replace("41-10", "45-10").replace("source = 41", "source = 45")
    with pytest.raises(SchemaError, match="two sensors are named 43-10"):
        parse_sensors(text + other)


def test_a_batch_has_radians_numbers_for_codes_and_marks_what_is_missing() -> None:
    batch, rejected = measurement_batch(frame(radar(), adsb(), BEARING), TABLE)
    assert len(rejected) == 0
    assert batch.sensor.tolist() == [0, 1, 2]
    assert batch.kind.tolist() == [KIND_RADAR, KIND_POSITION, KIND_BEARING]
    np.testing.assert_array_equal(batch.range_m, [90_000.0, np.nan, np.nan])
    np.testing.assert_allclose(np.degrees(batch.azimuth_rad), [271.25, np.nan, 90.0])
    np.testing.assert_allclose(np.degrees(batch.latitude_rad), [np.nan, 55.25, np.nan])
    np.testing.assert_array_equal(batch.height_m, [9000.0, np.nan, np.nan])
    assert batch.mode_3a.tolist() == [0o7012, -1, -1]
    assert batch.mode_s_address.tolist() == [-1, 0x4B1A2C, -1]
    assert batch.track_number.tolist() == [-1, 7, -1]


def test_numbers_that_a_kind_does_not_use_do_not_reach_the_core() -> None:
    batch, rejected = measurement_batch(
        frame(radar(latitude_deg=1.0, longitude_deg=2.0), adsb(range_m=5.0, azimuth_deg=3.0)), TABLE
    )
    assert len(rejected) == 0
    assert np.isnan(batch.latitude_rad[0])
    assert np.isnan(batch.range_m[1])
    assert np.isnan(batch.azimuth_rad[1])


@pytest.mark.parametrize(
    ("row", "code", "named"),
    [
        (radar(sensor_id="99-1"), RejectCode.UNKNOWN_SENSOR, "99-1"),
        (radar(sensor_id="adsb"), RejectCode.UNKNOWN_KIND, "radar"),
        (adsb(sensor_id="finder"), RejectCode.UNKNOWN_KIND, "adsb"),
        (radar(kind="sonar"), RejectCode.UNKNOWN_KIND, "sonar"),
        (radar(range_m=420_001.0), RejectCode.OUT_OF_RANGE, "instrumented range"),
        (radar(range_m=-0.0), RejectCode.OUT_OF_RANGE, "range_m"),
        (radar(range_m=float("nan")), RejectCode.NON_FINITE, "range_m"),
        (radar(azimuth_deg=360.0), RejectCode.OUT_OF_RANGE, "azimuth_deg"),
        (radar(azimuth_deg=-1e-9), RejectCode.OUT_OF_RANGE, "azimuth_deg"),
        (radar(azimuth_deg=None), RejectCode.MISSING_FIELD, "azimuth_deg"),
        (radar(time_s=float("inf")), RejectCode.NON_FINITE, "time_s"),
        (radar(time_s=-1e11), RejectCode.OUT_OF_RANGE, "time_s"),
        (radar(time_s=None), RejectCode.MISSING_FIELD, "time_s"),
        (radar(height_m=-1000.5), RejectCode.OUT_OF_RANGE, "height_m"),
        (radar(track_number=-1), RejectCode.OUT_OF_RANGE, "track_number"),
        (radar(mode_3a="12345"), RejectCode.OUT_OF_RANGE, "mode_3a"),
        (adsb(mode_s_address="zzzzzz"), RejectCode.OUT_OF_RANGE, "mode_s_address"),
        (adsb(latitude_deg=None), RejectCode.MISSING_FIELD, "latitude_deg"),
        (adsb(longitude_deg=180.5), RejectCode.OUT_OF_RANGE, "longitude_deg"),
    ],
)
def test_an_implausible_row_is_rejected_and_the_others_are_accepted(
    row: dict[str, object], code: RejectCode, named: str
) -> None:
    batch, rejected = measurement_batch(frame(adsb(), row, radar()), TABLE)
    assert rejected.index.tolist() == [1]
    assert rejected.code == (code,)
    assert named in rejected.reason[0]
    assert batch.sensor.tolist() == [1, 0]


@pytest.mark.parametrize(
    "row",
    [
        radar(range_m=420_000.0),
        radar(azimuth_deg=0.0),
        radar(azimuth_deg=float(np.nextafter(360.0, 0.0))),
        radar(height_m=-1000.0),
        radar(height_m=40_000.0),
        adsb(latitude_deg=90.0, longitude_deg=-180.0),
        radar(time_s=float(np.nextafter(1e11, 0.0))),
    ],
)
def test_the_bounds_themselves_are_accepted(row: dict[str, object]) -> None:
    batch, rejected = measurement_batch(frame(row), TABLE)
    assert (len(batch), len(rejected)) == (1, 0)


def test_optional_columns_may_miss_and_further_ones_are_ignored() -> None:
    columns = ["time_s", "sensor_id", "kind", "latitude_deg", "longitude_deg"]
    some = frame(adsb()).select(columns).with_columns(index=pl.lit(3, pl.UInt32))
    batch, rejected = measurement_batch(some, TABLE)
    assert (len(batch), len(rejected)) == (1, 0)
    assert batch.mode_s_address.tolist() == [-1]


def test_a_table_with_a_missing_column_or_a_wrong_type_is_rejected() -> None:
    with pytest.raises(MissingColumnError, match="kind"):
        measurement_batch(frame(radar()).drop("kind"), TABLE)
    with pytest.raises(InputError, match="range_m to be Float64, was String"):
        measurement_batch(frame(radar()).with_columns(range_m=pl.lit("9")), TABLE)


def test_a_table_without_rows_is_a_batch_without_rows() -> None:
    batch, rejected = measurement_batch(frame(), TABLE)
    assert (len(batch), len(rejected)) == (0, 0)


UPDATES = TrackUpdates(
    sequence=np.array([1, 2]),
    time_s=np.array([1.0, 2.0]),
    track_id=np.array([1, 2]),
    sensor=np.array([0, 2], np.int32),
    track_number=np.array([-1, 7]),
    mode_s_address=np.array([0x00FFA0, -1]),
    mode_3a=np.array([-1, 0o0052], np.int32),
    latitude_rad=np.radians([55.0, -12.0]),
    longitude_rad=np.radians([37.0, 130.0]),
    height_m=np.array([np.nan, 9000.0]),
    speed_mps=np.array([210.0, 0.0]),
    heading_rad=np.array([-1e-20, np.radians(-90.0)]),
    position_sigma_m=np.array([50.0, 60.0]),
    velocity_sigma_mps=np.array([1.0, 2.0]),
    state=np.array([STATE_CONFIRMED, STATE_COASTING], np.int8),
    turn_right_probability=np.array([np.nan, 0.25]),
    turn_left_probability=np.array([np.nan, 0.0]),
    speed_change_probability=np.array([np.nan, 1.0]),
    vertical_rate_mps=np.array([np.nan, -7.5]),
    height_sigma_m=np.array([np.nan, 2.5]),
    adsb_implausible=np.array([False, True]),
    callsign=np.array([-1, packed_callsigns(pl.Series(["KLM1"]))[0]]),
    measured_mode_s_address=np.array([-1, 0x00FFA0]),
    on_ground=np.array([1, -1], np.int8),
)


def test_tracks_have_degrees_digits_and_null_for_what_is_missing() -> None:
    tracks = tracks_frame(UPDATES, TABLE)
    assert tracks.schema == TRACK_SCHEMA
    first, second = tracks.to_dicts()
    assert first["mode_s_address"] == "00ffa0"
    assert (first["measured_mode_s_address"], second["measured_mode_s_address"]) == (None, "00ffa0")
    assert (first["track_number"], first["mode_3a"], first["height_m"]) == (None, None, None)
    assert first["heading_deg"] == 0.0
    chances = ("turn_right_probability", "turn_left_probability", "speed_change_probability")
    assert [first[name] for name in chances] == [None] * 3
    assert [second[name] for name in chances] == [0.25, 0.0, 1.0]
    assert (first["vertical_rate_mps"], first["height_sigma_m"]) == (None, None)
    assert (second["vertical_rate_mps"], second["height_sigma_m"]) == (-7.5, 2.5)
    assert (first["adsb_implausible"], second["adsb_implausible"]) == (False, True)
    assert (first["callsign"], second["callsign"]) == (None, "KLM1")
    assert (first["on_ground"], second["on_ground"]) == (True, None)
    assert (second["mode_3a"], second["mode_s_address"]) == ("0052", None)
    assert second["heading_deg"] == pytest.approx(270.0)
    assert (second["state"], second["sensor_id"]) == ("coasting", "finder")
    for row in (first, second):
        TrackUpdate.model_validate(row)


def test_biases_have_degrees_for_azimuth_only() -> None:
    records = BiasRecords(
        epoch=np.array([4, 4]),
        time_s=np.array([16.0, 16.0]),
        sensor=np.array([0, 0], np.int32),
        parameter=np.array([PARAMETER_RANGE_OFFSET, PARAMETER_AZIMUTH_OFFSET], np.int8),
        estimate=np.array([120.0, np.radians(0.25)]),
        sigma=np.array([2.0, np.radians(0.01)]),
    )
    biases = biases_frame(records, TABLE)
    assert biases.schema == BIAS_SCHEMA
    offset, azimuth = biases.to_dicts()
    assert (offset["parameter"], offset["estimate"]) == ("range_offset_m", 120.0)
    assert azimuth["estimate"] == pytest.approx(0.25)
    assert azimuth["sigma"] == pytest.approx(0.01)
    prior = TABLE.prior_sigma[
        (TABLE.parameter_sensor == 0) & (TABLE.parameter_kind <= PARAMETER_AZIMUTH_OFFSET)
    ]
    assert offset["prior_ratio"] == pytest.approx(2.0 / prior[0])
    assert azimuth["prior_ratio"] == pytest.approx(np.radians(0.01) / prior[1])
    for row in (offset, azimuth):
        BiasEstimate.model_validate(row)


def test_health_is_in_degrees_and_per_hour_and_missing_values_are_null() -> None:
    records = health_records(
        time_s=[8.0, 8.0],
        sensor=[0, 0],
        alarms=[0b0011, 0],
        azimuth_trend_rad_per_s=[np.radians(0.001), np.nan],
        range_trend_mps=[0.5, np.nan],
        detection_probability=[0.9, np.nan],
    )
    found = health_frame(records, TABLE)
    assert found.schema == HEALTH_SCHEMA
    ill, unknown = found.to_dicts()
    assert (ill["sensor_id"], ill["alarms"]) == ("41-10", "silent,bias_jump")
    assert ill["azimuth_trend_deg_per_h"] == pytest.approx(3.6)
    assert ill["range_trend_m_per_h"] == pytest.approx(1800.0)
    assert unknown["alarms"] == ""
    assert unknown["detection_probability"] is None
    for row in (ill, unknown):
        RadarHealth.model_validate(row)


def test_the_accuracy_of_a_report_and_the_detection_are_kept() -> None:
    rows = [
        adsb(position_sigma_m=12.5),
        adsb(),
        radar(detection="psr_mode_s"),
        # A radar has no reported position: its accuracy has no meaning.
        radar(position_sigma_m=5.0),
    ]
    batch, rejected = measurement_batch(frame(*rows), TABLE)
    assert len(rejected) == 0
    assert batch.position_sigma_m is not None
    assert batch.detection is not None
    assert batch.position_sigma_m.tolist() == pytest.approx([12.5] + [np.nan] * 3, nan_ok=True)
    assert batch.detection.tolist() == [-1, -1, 4, -1]
    shown = measurement_rows(batch, TABLE)
    assert (shown[0]["position_sigma_m"], shown[2]["detection"]) == (12.5, "psr_mode_s")
    assert "position_sigma_m" not in shown[3]
    part = batch.select(slice(1, 2))
    assert (part.position_sigma_m, part.detection) == (None, None)
    both = MeasurementBatch.concatenate([part, batch.select(slice(2, 3))])
    assert both.position_sigma_m is None
    assert both.detections().tolist() == [-1, 4]


@pytest.mark.parametrize(
    ("field", "value"), [("position_sigma_m", 0.0), ("position_sigma_m", 2e4), ("detection", "x")]
)
def test_impossible_accuracies_and_detections_are_rejected(field: str, value: object) -> None:
    _, rejected = measurement_batch(frame(adsb(**{field: value})), TABLE)
    assert rejected.code == (RejectCode.OUT_OF_RANGE,)
    assert rejected.reason[0].startswith(f"{field}: expected")
