"""Registers are decoded as by an independent decoder and as in published examples."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from multiradar_converters.aircraft_data import quantities as q
from multiradar_converters.aircraft_data.registers import (
    ABSENT,
    BDS_4_0,
    BDS_5_0,
    BDS_6_0,
    CONTRADICTING,
    NAMES,
    decoded,
    encoded,
    read_registers,
    register_values,
)
from support.aircraft.registers import FIELDS, UNITS, item_250, read, write

SATURATED = ("track_angle_rate", 511 * 8 / 256)


@given(st.sampled_from(range(3)), st.integers(0, 2**56 - 1))
def test_fields_are_those_of_an_independent_decoder(register: int, content: int) -> None:
    expected = read(NAMES[register], content)
    units = {name: UNITS.get(unit, 1.0) for _, name, *_, unit in FIELDS}
    for name, values in decoded(np.array([content]), register).items():
        wanted = expected.get(name, math.nan) * units[name]
        if name == SATURATED[0] and abs(wanted) >= SATURATED[1]:
            wanted = math.nan
        assert values[0] == pytest.approx(wanted, nan_ok=True, abs=1e-9)


@given(st.sampled_from(range(3)), st.integers(0, 2**56 - 1))
def test_encoded_fields_are_decoded_again(register: int, content: int) -> None:
    fields = decoded(np.array([content]), register)
    again = decoded(encoded(fields, register), register)
    for name, values in fields.items():
        assert again[name][0] == pytest.approx(values[0], nan_ok=True, abs=1e-9)


@pytest.mark.parametrize(
    ("register", "content", "expected"),
    [
        # Worked examples of J. Sun, The 1090 Megahertz Riddle, chapters 16 to 18.
        (BDS_4_0, 0x85E42F31300000, {"panel_altitude": 3008 * 0.3048}),
        (
            BDS_5_0,
            0x81951536E024D4,
            {
                "roll": 2.1,
                "track_angle": 114.258,
                "ground_speed": 438 * 1852 / 3600,
                "track_angle_rate": 0.125,
                "true_airspeed": 424 * 1852 / 3600,
            },
        ),
        (
            BDS_6_0,
            0x8F39F91A7E27C4,
            {
                "magnetic_heading": 42.715,
                "indicated_airspeed": 252 * 1852 / 3600,
                "mach": 0.42,
                "barometric_rate": -1920 * 0.3048 / 60,
                "inertial_rate": -1920 * 0.3048 / 60,
            },
        ),
    ],
)
def test_published_examples(register: int, content: int, expected: dict[str, float]) -> None:
    found = decoded(np.array([content]), register)
    for name, value in expected.items():
        assert found[name][0] == pytest.approx(value, abs=0.02)


def rows(*items: str) -> np.ndarray:
    """Read items 048/250, one for each record; no digits for none."""
    data = bytearray.fromhex("".join(items))
    begins, place = [], 0
    for item in items:
        begins.append(place if item else -1)
        place += len(item) // 2
    return read_registers(np.frombuffer(data, np.uint8), np.array(begins, np.int64))


def test_registers_of_records_are_found_by_their_number() -> None:
    turn, air = write("5,0", roll=20.0), write("6,0", mach=0.8)
    found = rows(item_250(bds50=turn), "", item_250(bds10=7, bds60=air, bds50=turn), "00")
    assert found.tolist() == [
        [ABSENT, turn, ABSENT],
        [ABSENT, ABSENT, ABSENT],
        [ABSENT, turn, air],
        [ABSENT, ABSENT, ABSENT],
    ]


def test_contradicting_copies_of_a_register_are_dropped() -> None:
    first, second = write("5,0", roll=20.0), write("5,0", roll=-20.0)
    twice = f"02{first:014x}50{first:014x}50"
    other = f"02{first:014x}50{second:014x}50"
    found = rows(twice, other)
    assert found[:, BDS_5_0].tolist() == [first, CONTRADICTING]
    values, findings = register_values(found)
    assert values[:, q.ROLL] == pytest.approx([20.0, math.nan], nan_ok=True, abs=0.1)
    assert [(one.reason, one.where.tolist()) for one in findings] == [("copies", [False, True])]


def test_a_register_under_two_numbers_is_dropped_from_both() -> None:
    content = write("5,0", ground_speed=400.0, true_airspeed=410.0)
    values, findings = register_values(rows(item_250(bds50=content, bds60=content)))
    assert np.isnan(values).all()
    assert {one.reason for one in findings} >= {"equal_registers"}


def test_bits_without_their_status_drop_a_register() -> None:
    whole = write("6,0", magnetic_heading=90.0, mach=0.8)
    silent = whole & ~(1 << 55)
    values, findings = register_values(rows(item_250(bds60=whole), item_250(bds60=silent)))
    assert values[:, q.MACH] == pytest.approx([0.8, math.nan], nan_ok=True)
    assert [one.reason for one in findings] == ["unannounced_bits"]


def test_reserved_bits_drop_a_selected_altitude() -> None:
    content = write("4,0", panel_altitude=10_000.0)
    found = rows(item_250(bds40=content), item_250(bds40=content | 1 << (56 - 44)))
    values, _ = register_values(found)
    assert values[:, q.SELECTED_ALTITUDE] == pytest.approx([3048.0, math.nan], nan_ok=True)


def test_vertical_rates_that_contradict_each_other_drop_their_register() -> None:
    close = write("6,0", barometric_rate=1600.0, inertial_rate=1504.0, mach=0.5)
    apart = write("6,0", barometric_rate=1600.0, inertial_rate=-4000.0, mach=0.5)
    values, findings = register_values(rows(item_250(bds60=close), item_250(bds60=apart)))
    assert values[:, q.VERTICAL_RATE] == pytest.approx([7.640, math.nan], nan_ok=True, abs=1e-3)
    assert np.isnan(values[1]).all()
    assert [one.reason for one in findings] == ["vertical_rates"]


def test_inertial_rates_and_panel_altitudes_precede_the_others() -> None:
    found = rows(
        item_250(
            bds40=write("4,0", panel_altitude=16_000.0, managed_altitude=8000.0),
            bds60=write("6,0", barometric_rate=320.0, inertial_rate=640.0),
        ),
        item_250(
            bds40=write("4,0", managed_altitude=8000.0), bds60=write("6,0", barometric_rate=320.0)
        ),
    )
    values, _ = register_values(found)
    assert values[:, q.SELECTED_ALTITUDE] == pytest.approx([4876.8, 2438.4])
    assert values[:, q.VERTICAL_RATE] == pytest.approx([640 * 0.3048 / 60, 320 * 0.3048 / 60])
