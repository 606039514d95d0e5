"""Damaged trajectories: no crash, no hang, every record accounted for, whatever is changed.

`TEST_ADSB_MUTATIONS` says how many files are tried in each form; the suite tries a few.
"""

import os
import random
from pathlib import Path

import pytest

from multiradar_converters.adsb.conversion import convert
from multiradar_converters.adsb.options import Options
from multiradar_converters.errors import LayoutError
from multiradar_schemas.reject import Reject
from multiradar_schemas.report import Report
from support.asterix.octets import mutated
from support.scenarios.trajectories import (
    csv_table,
    json_columns,
    json_lines,
    json_list,
    packed,
    report,
    trace,
)

COUNT = int(os.environ.get("TEST_ADSB_MUTATIONS", "30"))
REPORTS = [
    report(k, icao24=f"3c00{k % 7:02x}", squawk=k % 7, onground=False, geoaltitude=35_000)
    for k in range(60)
]
POINT = [47.0, 8.5, 35_000, 450.0, 0.0, 0, 0, {"flight": "DLH1", "squawk": "7421"}, "adsb_icao"]
FORMS = {
    "list": json_list(REPORTS),
    "lines": json_lines(REPORTS),
    "columns": json_columns(REPORTS),
    "csv": csv_table(REPORTS),
    "trace": trace([[float(k), *POINT] for k in range(60)]),
    "packed": packed(csv_table(REPORTS)),
}


@pytest.mark.parametrize("form", FORMS)
def test_damaged_files_are_rejected_or_accounted_for(form: str, tmp_path: Path) -> None:
    generator = random.Random(form)
    path = tmp_path / "file"
    for number in range(COUNT):
        path.write_bytes(mutated(FORMS[form], generator))
        out = tmp_path / f"out-{number}"
        try:
            convert([path], out, Options(), lambda _: None)
        except LayoutError:
            assert not out.exists()
            continue
        counts = Report.model_validate_json((out / "report.json").read_bytes()).counts
        lines = (out / "rejects.ndjson").read_text(encoding="utf-8").splitlines()
        assert [Reject.model_validate_json(line).file for line in lines] == ["file"] * len(lines)
        assert counts.rejected == len(lines)
    assert not [one for one in tmp_path.iterdir() if one.name.startswith(".")]
