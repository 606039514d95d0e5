"""Sensor biases as reported in ASTERIX."""

from dataclasses import replace

import numpy as np
import pytest

from multiradar.estimation.measurement.known_biases import Measured, without_known_biases
from multiradar.estimation.measurement.sensors import SensorTable
from multiradar.runtime.asterix.sensor_picture import SensorPicture
from multiradar.tracking.health.health_records import ALARM_SILENT
from multiradar.tracking.outputs import BiasRecords
from multiradar.wire import sensor_table
from multiradar_converters.asterix.writing.status_reports import (
    DEGRADED,
    INITIALISING,
    NOT_CONNECTED,
    OPERATIONAL,
)
from multiradar_schemas.sensors.sensor import parse_sensors
from support.fakes.health import health_records

RANGE, AZIMUTH, GAIN, TIME = range(4)


def table(text: str = "") -> SensorTable:
    radar = 'kind = "radar"\nlatitude_deg = 50.0\nlongitude_deg = 15.0\nheight_m = 300.0\n'
    return sensor_table(
        parse_sensors(
            f'[[sensor]]\nid = "a"\nsac = 20\nsic = 130\n{radar}{text}\n'
            f'[[sensor]]\nid = "nameless"\n{radar}\n'
            '[[sensor]]\nid = "z"\nsac = 20\nsic = 9\nkind = "adsb"\n'
        )
    )


def biases(estimate: dict[int, float], sigma: float = 1e-6) -> BiasRecords:
    n = len(estimate)
    return BiasRecords(
        epoch=np.zeros(n, np.int64),
        time_s=np.zeros(n),
        sensor=np.zeros(n, np.int32),
        parameter=np.array(list(estimate), np.int8),
        estimate=np.array(list(estimate.values())),
        sigma=np.full(n, sigma),
    )


def heard(sensors: SensorTable, time_s: float = 100.0) -> SensorPicture:
    picture = SensorPicture(sensors, 60.0)
    picture.record_plots(
        np.array([0, 2], np.int32),
        np.full(2, time_s),
        secondary=np.array([True, False]),
        primary=np.array([False, False]),
    )
    return picture


def test_sensors_without_codes_are_not_reported() -> None:
    reports = heard(table()).reports(100.0)
    assert reports.sensor.tolist() == [20 << 8 | 130, 20 << 8 | 9]
    # Sensors of reported positions have no plot biases.
    assert (reports.secondary.tolist(), reports.primary.tolist()) == ([True, False], [False, False])


def test_a_bias_is_reported_when_it_has_settled() -> None:
    picture = heard(table())
    assert np.isnan(picture.reports(100.0).range_offset_m).all()
    assert picture.reports(100.0).condition.tolist() == [INITIALISING, OPERATIONAL]
    picture.update_biases(biases({RANGE: 120.0}, sigma=240.0))
    reports = picture.reports(100.0)
    assert reports.range_offset_m[0] == 120.0
    assert reports.range_gain[0] == 0.0
    # The azimuth has not been estimated yet.
    assert np.isnan(reports.azimuth_offset_deg[0])
    assert np.isnan(reports.time_offset_s[0])
    picture.update_biases(biases({RANGE: 120.0}, sigma=260.0))
    assert np.isnan(picture.reports(100.0).range_offset_m[0])


def test_known_and_estimated_biases_are_combined() -> None:
    """The correction by the standard's formula equals that of the tracker in two steps."""
    known = (
        "[sensor.bias]\nrange_offset_m = { prior = 300.0, estimate = false }\n"
        "range_gain = { prior = 0.002, estimate = false }\n"
        "azimuth_offset_deg = { prior = 0.3, estimate = false }\n"
        "time_offset_s = { prior = 0.25, estimate = false }\n"
    )
    sensors_known = table(known)
    # The parameters are known here; an estimate beside them is what one of the rest would be.
    picture = heard(sensors_known)
    picture.update_biases(biases({RANGE: 50.0, GAIN: 0.001, AZIMUTH: -0.001}))
    reports = picture.reports(100.0)
    measured = Measured(np.array([7.0]), np.array([250_000.0]), np.array([1.0]))
    first = without_known_biases(measured, sensors_known.known_bias[:1])
    range_m, azimuth_rad = picture.without_biases(
        np.zeros(1, np.int32), first.range_m, first.azimuth_rad
    )
    by_standard = (250_000.0 - reports.range_offset_m[0]) / (1.0 + reports.range_gain[0])
    assert by_standard == pytest.approx(range_m[0], abs=1e-6)
    assert 1.0 - np.radians(reports.azimuth_offset_deg[0]) == pytest.approx(azimuth_rad[0])
    assert reports.time_offset_s[0] == pytest.approx(0.25)


def test_a_sensor_without_measurements_is_silent() -> None:
    picture = heard(table())
    picture.update_biases(biases({RANGE: 0.0, AZIMUTH: 0.0}))
    assert picture.reports(160.0).silent.tolist() == [False, False]
    assert picture.reports(160.0).condition.tolist() == [OPERATIONAL, OPERATIONAL]
    assert picture.reports(161.0).silent.tolist() == [True, True]
    assert set(picture.reports(161.0).condition.tolist()) == {NOT_CONNECTED}


def test_the_alarms_of_a_sensor_are_its_condition() -> None:
    picture = heard(table())
    picture.update_biases(biases({RANGE: 0.0, AZIMUTH: 0.0}))
    picture.update_health(health_records(sensor=[0], alarms=[1 << ALARM_SILENT]))
    reports = picture.reports(100.0)
    assert reports.silent.tolist() == [True, False]
    assert reports.condition.tolist() == [NOT_CONNECTED, OPERATIONAL]
    every_other = sum(1 << bit for bit in range(8) if bit != ALARM_SILENT)
    picture.update_health(health_records(sensor=[0], alarms=[every_other]))
    reports = picture.reports(100.0)
    assert reports.silent.tolist() == [False, False]
    assert reports.condition.tolist() == [DEGRADED, OPERATIONAL]


def test_codes_are_those_of_asterix_before_those_of_dumps() -> None:
    text = '[[sensor]]\nid = "x"\nkind = "adsb"\nsource = 41\nsensor = 10\n'
    assert sensor_table(parse_sensors(text)).asterix_codes == (41 << 8 | 10,)
    assert sensor_table(parse_sensors(f"{text}sac = 1\nsic = 2\n")).asterix_codes == (0x0102,)
    large = text.replace("41", "410")
    assert sensor_table(parse_sensors(large)).asterix_codes == (-1,)
    by_id = '[[sensor]]\nid = "7-8"\nkind = "adsb"\n'
    assert sensor_table(parse_sensors(by_id)).asterix_codes == (0x0708,)
    assert replace(table(), asterix_codes=()).asterix_codes == (-1, -1, -1)
