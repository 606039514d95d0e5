"""`multiradar convert adsb` of a JSON list that is a member of an object."""

import json
from pathlib import Path
from typing import Any

import polars as pl
import pytest

from multiradar.cli.main import EXIT_DONE, run
from multiradar_schemas.report import Report
from support.scenarios.trajectories import BEGIN_S, report


@pytest.mark.parametrize("form", [{}, {"indent": 1}])
def test_no_record_is_lost(form: dict[str, Any], tmp_path: Path) -> None:
    # More than one record may have: the first 64 KB were rejected as one.
    reports = [report(k) for k in range(1000)]
    path, out = tmp_path / "reports.json", tmp_path / "out"
    path.write_text(json.dumps({"data": reports, "count": 1000}, **form), encoding="utf-8")
    assert path.stat().st_size > 1 << 17
    assert run(["convert", "adsb", str(path), "--out", str(out)]) == EXIT_DONE
    counts = Report.model_validate_json((out / "report.json").read_bytes()).counts
    assert (counts.read, counts.accepted, counts.rejected) == (1000, 1000, 0)
    times = pl.read_parquet(out / "measurements.parquet")["time_s"].to_list()
    assert times == [BEGIN_S + k for k in range(1000)]
