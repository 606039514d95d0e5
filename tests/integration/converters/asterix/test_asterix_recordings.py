"""Recordings of others, which the project does not hold: `TEST_ASTERIX_RECORDINGS=FOLDER`.

The folder has the recordings that `COUNTS` names and `single-records/`.
"""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from multiradar.cli.main import EXIT_DONE, run
from multiradar_converters.asterix.framing.containers import split
from multiradar_converters.asterix.layout.catalogue import layout_of
from multiradar_converters.asterix.layout.fields import record_fields
from multiradar_converters.asterix.layout.program import program_of, walk
from support.asterix.artas_records import ARTAS
from support.asterix.single_records import SINGLE

RECORDS = SINGLE | ARTAS

FOLDER = Path(os.environ.get("TEST_ASTERIX_RECORDINGS", "recordings-not-given"))

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="no folder of recordings is given")

#: Records by category; octets that cannot be decoded; measurements.
COUNTS = {
    "iberia-16radars-6s.gps": (
        {"001": 853, "002": 66, "008": 10, "019": 2, "020": 8, "034": 5, "048": 453},
        0,
        1307,
    ),
    "valencia-cat001-48min.gps": ({"001": 30651, "002": 716}, 0, 30648),
    "asturias-wam-cat020-34min.ast": ({"019": 513, "020": 2844}, 0, 1833),
    "croatia-7radars-two-lans.pcap": ({"034": 34, "048": 128}, 0, 63),
    "gran-canaria-cat048-10s.gps": ({"034": 3, "048": 15}, 0, 11),
    # Categories 032 and 255 have no table; no category 001 record has a time.
    "mixed-categories.ast": (
        {"001": 5, "002": 1, "030": 12, "034": 1, "048": 11},
        34,
        9,
    ),
    # The flight plan of the system track has eight letters where the standard has seven.
    "cat021-cat062-special-purpose.ast": ({"021": 2, "062": 1}, 0, 1),
}


def alike(found: object, expected: object) -> bool:
    if isinstance(expected, dict) and isinstance(found, dict):
        return found.keys() == expected.keys() and all(
            alike(found[name], expected[name]) for name in expected
        )
    if isinstance(expected, list) and isinstance(found, list):
        return len(found) == len(expected) and all(
            alike(*pair) for pair in zip(found, expected, strict=True)
        )
    if isinstance(expected, int | float) and isinstance(found, int | float):
        return abs(found - expected) <= 1e-9 * max(1.0, abs(expected))
    return found == expected


@pytest.mark.parametrize("name", RECORDS)
def test_a_single_record_has_the_values_of_its_octets(name: str) -> None:
    category, edition, expected = RECORDS[name]
    data = np.fromfile(FOLDER / "single-records" / name, dtype=np.uint8)
    begins, ends, gaps = split(data, 0, 0)
    assert gaps == []
    walked = walk(program_of(layout_of(category, edition)), data, begins + 3, ends)
    found = [record_fields(walked.program, data, starts) for starts in walked.starts]
    assert alike(found, expected), (found, expected)


@pytest.mark.parametrize("name", COUNTS)
def test_a_recording_gives_the_counts_that_are_known(name: str, tmp_path: Path) -> None:
    records, quarantined, measurements = COUNTS[name]
    out = tmp_path / "out"
    assert run(["convert", "asterix", str(FOLDER / name), "--out", str(out)]) == EXIT_DONE
    report = json.loads((out / "report.json").read_text())
    assert report["figures"]["records"] == records
    octets = report["figures"]["bytes"][name]
    assert octets["quarantined"] == quarantined
    assert sum(count for name, count in octets.items() if name != "form") == (
        (FOLDER / name).stat().st_size
    )
    assert report["outputs"][0]["rows"] == measurements
