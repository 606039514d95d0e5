"""Records of ARTAS and of the French STR octet by octet, and which layout a source gets."""

from pathlib import Path

import numpy as np
import pytest

from multiradar_converters.asterix.decoding.editions import Editions
from multiradar_converters.asterix.decoding.gathering import gather
from multiradar_converters.asterix.framing.containers import read_blocks
from multiradar_converters.asterix.layout.catalogue import layout_of
from multiradar_converters.asterix.layout.fields import record_fields
from multiradar_converters.asterix.layout.program import program_of, walk
from support.asterix.octets import block, record

ARTAS_TRACK = block(
    30,
    record(
        (1, "0803"),
        (8, "ffc0 0040"),
        (15, "01 0f 11 80"),
        (19, "f8"),
        (25, "03 0405"),
        (33, "02 0a0c 0fff"),
        (50, "006003 00a004"),
        (56, "02 ff"),
    ),
)
STR_TRACK = block(
    30, record((1, "0884"), (3, "4800e0"), (4, "3aace4"), (11, "4000 c000"), (14, "17 08"))
)
SERVICE = block(
    252,
    record((1, "0007"), (4, "32"), (5, "05 80"), (7, "8001 0003 0001 0200"), (18, "080301 080400")),
)
CONNECTION = block(
    252,
    record((1, "0007"), (4, "11"), (5, "01 45"), (6, "4152544153202020"), (9, "01 b01e0f 07 8f0a")),
)


def fields(octets: bytes, edition: str) -> dict[str, object]:
    data = np.frombuffer(bytearray(octets), dtype=np.uint8)
    program = program_of(layout_of(octets[0], edition))
    walked = walk(program, data, np.array([3]), np.array([len(data)]))
    assert walked.faults[0, 0] == 0
    (starts,) = walked.starts
    return record_fields(program, data, starts)


def test_a_track_of_artas_is_read_to_its_last_octet() -> None:
    found = fields(ARTAS_TRACK, "7.0")
    assert found["100"] == {"X": -1.0, "Y": 1.0}
    assert found["240"] == -2.0
    assert found["460"] == [{"MODE3A": "5014"}, {"MODE3A": "7777"}]
    assert found["050"] == [{"AUI": 3, "STN": 1}, {"AUI": 5, "STN": 2}]
    assert list(found) == ["010", "100", "080", "240", "RE1", "460", "050", "RE"]


def test_a_track_of_str_is_read_in_its_own_order() -> None:
    found = fields(STR_TRACK, "5.1-str")
    assert found["050"] == {"VERSION": 2, "NAP": 1, "ST": 0, "NS": 0, "NUMBER": 112}
    assert found["181"] == {"VX": 1.0, "VY": -1.0}
    assert found["020"] == 0x3AACE4 / 128


def test_services_and_connections_of_artas_are_read_in_their_own_order() -> None:
    service = fields(SERVICE, "7.0")
    assert service["110"] == {"BS": 1, "C1": 0, "C2": 1, "C3": 0, "C4": 0, "C5": 0}
    assert service["230"] == {"MSAC": 8, "MSIC": 3, "NOP": 0, "BSAC": 8, "BSIC": 4}
    connection = fields(CONNECTION, "7.0-connection")
    assert connection["100"] == [{"NATURE": 2, "CODE": 5}]
    assert connection["040"] == "ARTAS"
    latitude = {"NS": 1, "LATDEG": 48, "LATMIN": 30, "LATSEC": 15}
    longitude = {"LONDEG": 7, "EW": 1, "LONMIN": 15, "LONSEC": 10}
    assert connection["060"] == [latitude | longitude]


@pytest.mark.parametrize(
    ("octets", "edition"),
    [
        (ARTAS_TRACK, "7.0"),
        (STR_TRACK, "5.1-str"),
        (SERVICE, "7.0"),
        (CONNECTION, "7.0-connection"),
    ],
)
def test_a_source_gets_the_layout_that_fits_and_its_records_are_counted(
    tmp_path: Path, octets: bytes, edition: str
) -> None:
    path = tmp_path / "artas.ast"
    path.write_bytes(octets * 3)
    editions = Editions()
    gathered = gather(read_blocks(path), editions)
    (layout,) = editions.found.values()
    assert edition in layout.editions
    assert sum(gathered.records.values()) == 3
    assert gathered.octets["decoded"] == 3 * len(octets)
    assert (gathered.targets, gathered.tracks, gathered.broken) == ([], [], [])
