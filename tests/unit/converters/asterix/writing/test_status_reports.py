"""Records of categories 063 and 065 octet by octet, and the sign of each bias."""

import numpy as np
import pytest

from multiradar_converters.asterix.writing.status_reports import (
    NOT_CONNECTED,
    OPERATIONAL,
    SERVICE_ENDED,
    SensorReports,
    batch_record,
    sensor_records,
    service_record,
    status_record,
)
from support.asterix.reports import SENDER, read

MILE_M = 1852.0


def sensors(**said: object) -> SensorReports:
    column = {
        "time_s": 28_800.0,
        "sensor": np.array([20 << 8 | 130]),
        "condition": np.array([OPERATIONAL]),
        "silent": np.array([False]),
        "time_offset_s": np.array([-0.053]),
        "range_gain": np.array([0.00011]),
        "range_offset_m": np.array([-128.4]),
        "azimuth_offset_deg": np.array([0.17]),
        "secondary": np.array([True]),
        "primary": np.array([False]),
    }
    return SensorReports(**(column | said))  # type: ignore[arg-type]


def test_a_sensor_is_written_as_the_tables_of_the_standard_say() -> None:
    octets = sensor_records(sensors(), SENDER).written().data.tobytes()
    expected = (
        "ff 80"  # 010 015 030 050 060 070 080, 081
        "14 fa  07  38 40 00  14 82  00"
        "ff cb"  # -53 ms
        "00 0b  ff f7"  # gain 11 · 10⁻⁵, -128.4 m = -9 / 128 NM
        "00 1f"  # 0.17° = 31 / 65 536 of a turn
    )
    assert octets == bytes.fromhex(expected)


def test_biases_are_those_that_the_formula_of_the_standard_takes_off() -> None:
    """ρ = (measured - SRB) / (1 + SRG), θ = measured - 081 give the true plot back."""
    gain, offset_m, turned_deg = 0.0008, 185.0, -0.19
    true_m, true_deg = 240_000.0, 123.4
    measured_m = true_m * (1.0 + gain) + offset_m
    reported = sensors(
        range_gain=np.array([gain]),
        range_offset_m=np.array([offset_m]),
        azimuth_offset_deg=np.array([turned_deg]),
    )
    (record,) = read(63, "1.7", sensor_records(reported, SENDER).written())
    straight = measured_m - record["080"]["SRB"] * MILE_M
    # Half a unit of the offset (1/128 NM) and, at this range, of the gain (10⁻⁵).
    assert straight / (1.0 + record["080"]["SRG"]) == pytest.approx(true_m, abs=7.3 + 1.2)
    assert true_deg + turned_deg - record["081"] == pytest.approx(true_deg, abs=0.5 * 360 / 2**16)


def test_biases_are_those_of_the_plots_that_a_radar_gives() -> None:
    def items(*, secondary: bool, primary: bool) -> set[str]:
        reported = sensors(secondary=np.array([secondary]), primary=np.array([primary]))
        (record,) = read(63, "1.7", sensor_records(reported, SENDER).written())
        return set(record) & {"080", "081", "090", "091", "092"}

    assert items(secondary=True, primary=False) == {"080", "081"}
    assert items(secondary=False, primary=True) == {"090", "091"}
    assert items(secondary=True, primary=True) == {"080", "081", "090", "091"}
    assert items(secondary=False, primary=False) == set()


def test_what_is_not_estimated_is_absent_and_silence_is_reported() -> None:
    nothing = np.array([np.nan])
    reported = sensors(
        time_offset_s=nothing,
        range_gain=nothing,
        range_offset_m=nothing,
        azimuth_offset_deg=nothing,
        condition=np.array([NOT_CONNECTED]),
        silent=np.array([True]),
    )
    (record,) = read(63, "1.7", sensor_records(reported, SENDER).written())
    assert set(record) == {"010", "015", "030", "050", "060"}
    assert (record["060"]["CON"], record["060"]["NPW"]) == (3, 1)


def test_a_bias_beyond_its_item_is_left_out_and_counted() -> None:
    records = sensor_records(sensors(time_offset_s=np.array([40.0])), SENDER)
    assert "070" not in read(63, "1.7", records.written())[0]
    assert records.left_out == {"070": 1}


def test_the_service_is_written_as_the_tables_of_the_standard_say() -> None:
    head = "14 fa  {}  07  38 40 00"
    status = status_record(28_800.0, SENDER, overload=False)
    assert status.written().data.tobytes() == bytes.fromhex("f4" + head.format("01") + "00")
    lost = status_record(28_800.0, SENDER, overload=True)
    assert lost.written().data.tobytes() == bytes.fromhex("f4" + head.format("01") + "60")
    batch = batch_record(28_800.0, SENDER)
    assert batch.written().data.tobytes() == bytes.fromhex("f8" + head.format("02") + "00")
    ended = service_record(28_800.0, SENDER, SERVICE_ENDED)
    assert ended.written().data.tobytes() == bytes.fromhex("f2" + head.format("03") + "07")
