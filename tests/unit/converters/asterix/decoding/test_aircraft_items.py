"""Items with aircraft-derived data are accepted by their own ages and ranges (021 and 062)."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.aircraft_data import quantities as q
from multiradar_converters.aircraft_data.checking import reason_counts
from multiradar_converters.asterix.decoding.editions import parse_editions
from multiradar_converters.asterix.decoding.gathering import Gathered, gather
from multiradar_converters.asterix.framing.containers import read_blocks
from multiradar_schemas.measurements.units import FOOT_M, KNOT_MPS
from support.aircraft.registers import item_250, write
from support.asterix.octets import block, record, time_of_day

#: Parts of 021/295, 062/380 and 062/295 by their order; of a value, and seconds in a step.
AGES_021 = {"SAL": 9, "FSA": 10, "AS": 11, "TAS": 12, "BVR": 14, "GVR": 15, "GV": 16}
DATA_062 = {
    "IAS": 4, "SAL": 6, "FSS": 7, "BVR": 13, "GVR": 14, "BDSDATA": 25, "IAR": 26, "MAC": 27,
}  # fmt: skip
AGES_062 = {
    "IAS": 8, "SAL": 10, "FSS": 11, "BVR": 16, "GVR": 17, "MB": 28, "IAR": 29, "MAC": 30,
}  # fmt: skip
ITEMS_021 = {"146": 32, "148": 33, "155": 24, "157": 25}


def compound(order: Mapping[str, int], parts: Mapping[str, str]) -> str:
    """Write a compound item of the given parts."""
    places = sorted((order[name], octets) for name, octets in parts.items())
    length = (places[-1][0] + 6) // 7
    bits = [0] * (8 * length)
    for place, _ in places:
        bits[(place - 1) // 7 * 8 + (place - 1) % 7] = 1
    for more in range(length - 1):
        bits[more * 8 + 7] = 1
    return f"{int(''.join(map(str, bits)), 2):0{2 * length}x}" + "".join(one for _, one in places)


def ages(order: Mapping[str, int], step_s: float, seconds: Mapping[str, float]) -> str:
    return compound(order, {name: f"{round(age / step_s):02x}" for name, age in seconds.items()})


def gathered(tmp_path: Path, octets: bytes) -> Gathered:
    (tmp_path / "recording").write_bytes(octets)
    return gather(read_blocks(tmp_path / "recording"), parse_editions(["021=2.4"]))


def rate(feet_per_min: float, bits: int = 16) -> str:
    return f"{round(feet_per_min / 6.25) % (1 << bits):04x}"


def altitude(feet: float) -> str:
    return f"{0x8000 + round(feet / 25):04x}"


@pytest.mark.parametrize(
    ("items", "seconds", "expected"),
    [
        # 157 is preferred; each has its own age.
        ({"157": rate(600), "155": rate(500)}, {}, 600),
        ({"157": rate(600)}, {"GVR": 20.0}, "age"),
        ({"157": rate(600)}, {"GVR": 0.1, "BVR": 20.0}, 600),
        ({"157": rate(600), "155": rate(500)}, {"GVR": 20.0, "BVR": 0.1}, 500),
        ({"157": rate(600), "155": rate(500)}, {"GVR": 20.0, "BVR": 9.0}, "age"),
        # A range that is exceeded is that of one item, too.
        ({"157": rate(600), "155": "8050"}, {}, 600),
        ({"157": "8060", "155": rate(500, 15)}, {}, 500),
        ({"157": "8060"}, {}, "range_exceeded"),
        ({"146": altitude(9000), "148": altitude(8000)}, {}, 9000),
        ({"148": altitude(8000)}, {"SAL": 25.5, "FSA": 1.0}, 8000),
    ],
)
def test_items_of_adsb_are_accepted_by_their_own_ages(
    tmp_path: Path,
    items: dict[str, str],
    seconds: dict[str, float],
    expected: float | str,
) -> None:
    """Regression: the first item was accepted by the age of the last, and the reverse."""
    known = [(1, "0a0b"), (2, "00"), (6, "215555 080000"), (11, "3c660c"), (12, time_of_day(10.0))]
    known += [(ITEMS_021[name], octets) for name, octets in items.items()]
    if seconds:
        known.append((42, ages(AGES_021, 0.1, seconds)))
    report = block(21, record(*sorted(known)))
    ((_, _, targets),) = gathered(tmp_path, report).targets
    is_rate = "155" in items or "157" in items
    quantity, step = (q.VERTICAL_RATE, FOOT_M / 60) if is_rate else (q.SELECTED_ALTITUDE, FOOT_M)
    value, reasons = (np.nan, {expected: 1}) if isinstance(expected, str) else (expected, {})
    np.testing.assert_allclose(targets.aircraft_data[:, quantity] / step, [value])
    assert reason_counts(targets.dropped) == reasons


AIR = item_250(bds60=write("6,0", indicated_airspeed=270.0))


@pytest.mark.parametrize(
    ("items", "seconds", "name", "value"),
    [
        ({"GVR": rate(600)}, {"GVR": 20.0}, "vertical_rate_m_s", None),
        ({"GVR": rate(600)}, {"GVR": 0.5, "BVR": 20.0}, "vertical_rate_m_s", 600 * FOOT_M / 60),
        (
            {"GVR": rate(600), "BVR": rate(500)}, {"GVR": 20.0}, "vertical_rate_m_s",
            500 * FOOT_M / 60,
        ),
        ({"FSS": altitude(8000)}, {"FSS": 40.0, "SAL": 1.0}, "selected_altitude_m", None),
        ({"FSS": altitude(8000)}, {"FSS": 1.0, "SAL": 40.0}, "selected_altitude_m", 8000 * FOOT_M),
        ({"IAR": "010e"}, {"IAR": 20.0, "IAS": 1.0}, "indicated_airspeed_m_s", None),
        ({"IAS": "0500"}, {"IAS": 20.0}, "indicated_airspeed_m_s", None),
        ({"IAS": "0500"}, {"IAR": 20.0}, "indicated_airspeed_m_s", 0x500 * 1852 / 16384),
        ({"IAS": "8320"}, {"IAS": 20.0}, "mach", None),
        ({"IAS": "8320"}, {"MAC": 20.0}, "mach", 0.8),
        ({"IAS": "8320", "MAC": "0065"}, {"MAC": 20.0}, "mach", 0.8),
        ({"BDSDATA": AIR}, {"MB": 1.0}, "indicated_airspeed_m_s", 270 * KNOT_MPS),
        ({"BDSDATA": AIR}, {"MB": 20.0}, "indicated_airspeed_m_s", None),
        ({"BDSDATA": AIR}, {"IAR": 20.0}, "indicated_airspeed_m_s", None),
        ({"BDSDATA": AIR, "IAR": "010e"}, {"IAR": 20.0}, "indicated_airspeed_m_s", None),
    ],
)  # fmt: skip
def test_items_of_system_tracks_are_accepted_by_their_own_ages(
    tmp_path: Path,
    items: dict[str, str],
    seconds: dict[str, float],
    name: str,
    value: float | None,
) -> None:
    track = block(
        62,
        record(
            (1, "14fa"), (4, time_of_day(1.0)), (5, "008e38e3 00222222"), (7, "00000000"),
            (11, compound(DATA_062, items)), (12, "0001"), (13, "00"),
            (16, ages(AGES_062, 0.25, seconds)),
        ),
    )  # fmt: skip
    ((_, table),) = gathered(tmp_path, track).tracks
    (found,) = table[name].to_list()
    assert found == (None if value is None else pytest.approx(value))
