"""Rejects and reports keep account: one place each, and sums that add up."""

from typing import Any

import pytest
from pydantic import ValidationError

from multiradar_schemas.reject import Reject, RejectCode
from multiradar_schemas.report import Counts, Report

CODE = RejectCode.OUT_OF_RANGE


def test_a_reject_has_exactly_one_place() -> None:
    assert Reject(file="plots.txt", line=3, reason="r", code=CODE, raw="x").line == 3
    assert Reject(file="m.parquet", offset=0, reason="r", code=CODE, raw="x").offset == 0
    for places in ({}, {"line": 1, "offset": 1}):
        with pytest.raises(ValidationError, match="exactly one of line and offset"):
            Reject(file="f", reason="r", code=CODE, raw="x", **places)


def test_counts_that_lose_a_record_are_rejected() -> None:
    Counts(read=10, accepted=7, rejected=2, duplicate=1, blank=4)
    with pytest.raises(ValidationError, match="read = accepted"):
        Counts(read=10, accepted=7, rejected=2)


def test_codes_that_do_not_add_up_are_rejected() -> None:
    report: dict[str, Any] = {
        "command": "track",
        "version": "1",
        "counts": Counts(read=3, accepted=1, rejected=2),
        "inputs": [],
        "outputs": [],
    }
    assert Report(**report, rejected_by_code={CODE: 2}).counts.rejected == 2
    with pytest.raises(ValidationError, match="rejects by code to sum to 2, was 1"):
        Report(**report, rejected_by_code={CODE: 1})


def test_a_report_survives_json() -> None:
    counts = Counts(read=1, accepted=1, rejected=0)
    report = Report(
        command="track",
        version="1",
        counts=counts,
        rejected_by_code={},
        inputs=[],
        outputs=[],
        figures={"rms_m": 31.5, "by_sensor": {"41-10": [1, None]}},
    )
    assert Report.model_validate_json(report.model_dump_json()) == report
