"""The walk through records: every kind of item, every way in which a block can be wrong."""

from typing import Any

import numpy as np
import pytest

from multiradar_converters.asterix.layout import _kernels
from multiradar_converters.asterix.layout.catalogue import layout_of
from multiradar_converters.asterix.layout.fields import record_fields
from multiradar_converters.asterix.layout.notation import Layout, read_layout
from multiradar_converters.asterix.layout.program import Walked, program_of, walk
from support.asterix.octets import block, octets, plot_048, record

SMALL = """\
010 fixed SAC:8 SIC:8
020 extended A:3 B:4 | C:7
030 list W:7
040 repetitive X:8s
050 explicit
060 compound
    ONE fixed V:8
    -
    TWO repetitive V:16
    SIX extended V:7 | W:7
070 fixed OCT:12o -:4
080 fixed NAME:48c
-
090 rfs
"""


def walked(layout: Layout, body: bytes) -> tuple[Walked, np.ndarray[Any, np.dtype[np.uint8]]]:
    data = np.frombuffer(bytearray(block(layout.category, body)), dtype=np.uint8)
    return walk(program_of(layout), data, np.array([3]), np.array([len(data)])), data


def fields(body: bytes, text: str = SMALL) -> list[dict[str, object]]:
    layout = read_layout(200, ("1.0",), text)
    result, data = walked(layout, body)
    assert result.faults[0, 0] == _kernels.FITS
    return [record_fields(result.program, data, starts) for starts in result.starts]


def fault(body: bytes, text: str = SMALL) -> tuple[int, str, int]:
    result, _ = walked(read_layout(200, ("1.0",), text), body)
    reason, place, node = result.faults[0].tolist()
    assert len(result.records) == 0
    return reason, result.program.wrong_item(node), place


@pytest.mark.parametrize(
    ("place", "text", "name", "value"),
    [
        (1, "14 82", "010", {"SAC": 20, "SIC": 130}),
        (2, "54", "020", {"A": 2, "B": 10}),
        (2, "55 80", "020", {"A": 2, "B": 10, "C": 64}),
        (2, "55 81 03 02", "020", {"A": 2, "B": 10, "C": 64}),
        (3, "02", "030", [{"W": 1}]),
        (3, "03 05 06", "030", [{"W": 1}, {"W": 2}, {"W": 3}]),
        (4, "00", "040", []),
        (4, "02 7f 80", "040", [{"X": 127}, {"X": -128}]),
        (5, "01", "050", ""),
        (5, "03 ab cd", "050", "abcd"),
        (6, "80 07", "060", {"ONE": {"V": 7}}),
        (6, "a0 07 02 0001 0102", "060", {"ONE": {"V": 7}, "TWO": [{"V": 1}, {"V": 258}]}),
        (6, "10 03 04", "060", {"SIX": {"V": 1, "W": 2}}),
        (6, "01 00", "060", {}),
        (7, "a740", "070", {"OCT": "5164"}),
        (8, "0420 e0c7 0830", "080", {"NAME": "ABC 10 0"}),
    ],
)
def test_each_kind_of_item_is_read(place: int, text: str, name: str, value: object) -> None:
    after = (7, "0010") if place < 7 else (8, "041041041041")
    expected: dict[str, object] = {name: value}
    if place < 7:
        expected["070"] = {"OCT": "0001"}
    assert fields(record((place, text), *([after] if place < 7 else []))) == [expected]


def test_records_follow_one_another_in_a_block() -> None:
    body = record((1, "0102")) + record((1, "0304"), (7, "fff0"))
    assert fields(body) == [
        {"010": {"SAC": 1, "SIC": 2}},
        {"010": {"SAC": 3, "SIC": 4}, "070": {"OCT": "7777"}},
    ]


def test_items_in_random_order_are_read() -> None:
    assert fields(record((10, "02 07 fff0 01 0304"))) == [
        {"090": 2, "070": {"OCT": "7777"}, "010": {"SAC": 3, "SIC": 4}}
    ]


@pytest.mark.parametrize(
    ("body", "reason", "item", "place"),
    [
        (record((1, "14")), _kernels.TOO_SHORT, "010", 4),
        (record((2, "55")), _kernels.TOO_SHORT, "020", 4),
        (record((3, "03 05")), _kernels.TOO_SHORT, "030", 4),
        (record((4, "03 01 02")), _kernels.TOO_SHORT, "040", 4),
        (record((4, "")), _kernels.TOO_SHORT, "040", 4),
        (record((5, "04 01 02")), _kernels.TOO_SHORT, "050", 4),
        (record((5, "00")), _kernels.ZERO_LENGTH, "050", 4),
        (record((6, "81")), _kernels.TOO_SHORT, "060", 4),
        (record((6, "80")), _kernels.TOO_SHORT, "060/ONE", 5),
        (record((6, "40 01")), _kernels.NO_ITEM, "060", 5),
        (record((6, "08 01")), _kernels.NO_ITEM, "060", 5),
        (record((6, "0101010101010101010100")), _kernels.LONG_FIELD_SPECIFICATION, "060", 4),
        (record((9, "00")), _kernels.NO_ITEM, "FRN 9", 5),
        (record((20, "00")), _kernels.NO_ITEM, "FRN 20", 6),
        (octets("00"), _kernels.EMPTY_RECORD, "", 3),
        (octets("0101"), _kernels.TOO_SHORT, "", 3),
        (octets("01010101010101010101 00"), _kernels.LONG_FIELD_SPECIFICATION, "", 3),
        (record((10, "01 0b 00")), _kernels.NO_ITEM, "090", 6),
        (record((10, "01 0a 00")), _kernels.NO_ITEM, "090", 6),
        (record((10, "01")), _kernels.TOO_SHORT, "090", 6),
        (record((1, "0102")) + record((1, "14")), _kernels.TOO_SHORT, "010", 7),
    ],
)
def test_a_block_that_does_not_fit_is_rejected_with_item_and_place(
    body: bytes, reason: int, item: str, place: int
) -> None:
    assert fault(body) == (reason, item, place)


def test_the_type_of_a_report_of_category_001_chooses_its_profile() -> None:
    plot = record((1, "1482"), (2, "20"), (3, "1900 4000"))
    track = record((1, "1482"), (2, "a0"), (3, "00bb"), (4, "1900 4000"))
    result, data = walked(layout_of(1, "1.1"), plot + track)
    first, second = (record_fields(result.program, data, starts) for starts in result.starts)
    assert first["040"] == second["040"] == {"RHO": 50.0, "THETA": 90.0}
    assert "161" not in first
    assert second["161"] == 187


def test_blocks_after_a_broken_one_are_read() -> None:
    good, bad = block(48, plot_048(1.0)), block(48, plot_048(2.0)[:-1])
    data = np.frombuffer(bytearray(good + bad + good), dtype=np.uint8)
    ends = np.cumsum([len(good), len(bad), len(good)])
    begins = np.array([0, *ends[:-1]]) + 3
    result = walk(program_of(layout_of(48, "1.15")), data, begins, ends)
    assert result.records[:, 0].tolist() == [0, 2]
    assert (result.faults[:, 0] != 0).tolist() == [False, True, False]


@pytest.mark.parametrize("records_max", [1, 2, 3, 7, 100])
def test_the_records_do_not_depend_on_how_many_are_noted_at_once(records_max: int) -> None:
    blocks = [block(48, *[plot_048(k + n) for n in range(k % 4 + 1)]) for k in range(9)]
    data = np.frombuffer(bytearray().join(blocks), dtype=np.uint8)
    ends = np.cumsum([len(one) for one in blocks])
    begins = np.array([0, *ends[:-1]]) + 3
    program = program_of(layout_of(48, "1.15"))
    some, whole = (walk(program, data, begins, ends, count) for count in (records_max, 1 << 12))
    assert np.array_equal(some.records, whole.records)
    assert np.array_equal(some.starts, whole.starts)


@pytest.mark.parametrize("signed", [False, True])
def test_bits_are_read_as_from_one_large_number(signed: bool) -> None:
    data = np.frombuffer(bytearray(octets("8f3a 55c1 7e02 99f0")), dtype=np.uint8)
    whole = int.from_bytes(data.tobytes(), "big")
    for begin in range(0, 24):
        for bits in range(1, 40):
            out = np.empty(2, dtype=np.int64)
            places = np.array([0, -1], dtype=np.int32)
            _kernels.read_bits(data, places, begin, bits, signed, -5, out)
            expected = whole >> (64 - begin - bits) & ((1 << bits) - 1)
            if signed and expected >> (bits - 1):
                expected -= 1 << bits
            assert out.tolist() == [expected, -5]
