"""The files of all days: tables of biases, the report, and sensors files with merged biases."""

import json
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl

from multiradar.storage.output_file import replaced_file
from multiradar.storage.recording import measurements_path
from multiradar.toolbox.alignment.sensors_file import aligned_sensors
from multiradar.toolbox.inputs import read_sensors
from multiradar.toolbox.output import REPORT_FILE
from multiradar.toolbox.tracking.reprocessing.periods import MERGED_FILE, Frames, Period
from multiradar.toolbox.tracking.reprocessing.schedule import Outcome
from multiradar_schemas.alignment import AlignedBias
from multiradar_schemas.report import Counts, InputFile, OutputFile, Report

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable

#: With `days="merged"`: the biases of all days as priors, of each region.
SENSORS_MERGED_FILE = "sensors_merged.toml"


@dataclass(frozen=True, slots=True)
class Region:
    """The sensors of a region.

    Attributes
    ----------
    sensors : Path
        Their file.
    table : SensorTable
        Its contents.
    """

    sensors: Path
    table: "SensorTable"


def write_outputs(
    out: Path,
    outcomes: Sequence[Outcome],
    regions: Mapping[str, Region],
    settings: Mapping[str, Any],
    *,
    merged: bool,
) -> dict[str, Any]:
    """Write tables and report of all days, in place of those of an earlier call.

    Parameters
    ----------
    out : Path
        The output directory.
    outcomes : sequence of Outcome
        Of all days.
    regions : mapping of str to Region
        The sensors of each region.
    settings : mapping
        For the report.
    merged : bool
        Whether to write sensors files with the biases of all days.

    Returns
    -------
    dict
        The report.
    """
    periods = [
        Period(
            name,
            [
                (one.day, out / one.day.name, one.record)
                for one in outcomes
                if one.day.region == name and one.record is not None
            ],
            region.table,
        )
        for name, region in regions.items()
    ]
    frames: Frames = {}
    for period in periods:
        for file, frame in period.frames().items():
            frames[file] = pl.concat([frames[file], frame]) if file in frames else frame
    for file, frame in frames.items():
        with replaced_file(out / file) as partial:
            frame.write_parquet(partial)
    if merged:
        for name, region in regions.items():
            rows = frames[MERGED_FILE].filter(region=name)
            _write_sensors(out / name, region.sensors, rows)
    tests = [test for period in periods for test in period.tests()]
    report = _report(out, outcomes, frames, settings, tests)
    text = report.model_dump_json(indent=2)
    with replaced_file(out / REPORT_FILE) as partial:
        partial.write_text(text + "\n", encoding="utf-8")
    found: dict[str, Any] = json.loads(text)
    return found


def _write_sensors(folder: Path, sensors: Path, merged: pl.DataFrame) -> None:
    biases = [
        AlignedBias(
            sensor_id=row["sensor_id"], parameter=row["parameter"], estimate=row["estimate"],
            sigma=row["sigma"], prior_ratio=0.0, drift_per_h=None, drift_sigma_per_h=None,
            drifts=False,
        )
        for row in merged.iter_rows(named=True)
    ]  # fmt: skip
    folder.mkdir(exist_ok=True)
    with replaced_file(folder / SENSORS_MERGED_FILE) as partial:
        text = aligned_sensors(read_sensors(sensors), biases, "multiradar reprocess --days merged")
        partial.write_text(text, encoding="utf-8")


def _report(
    out: Path,
    outcomes: Sequence[Outcome],
    frames: Frames,
    settings: Mapping[str, Any],
    tests: list[dict[str, Any]],
) -> Report:
    inputs, rejected = [], Counter[Any]()
    for one in outcomes:
        if one.record is None:
            continue
        text = (out / one.day.name / REPORT_FILE).read_text(encoding="utf-8")
        own = Report.model_validate_json(text)
        rejected.update(own.rejected_by_code)
        inputs.append(InputFile(file=one.day.name, bytes=_octets(one.day.path), counts=own.counts))
    counts = [one.counts for one in inputs]
    return Report(
        command="reprocess",
        version=version("multiradar"),
        counts=Counts(
            **{
                name: sum(getattr(one, name) for one in counts)
                for name in ("read", "accepted", "rejected", "duplicate")
            }
        ),
        rejected_by_code=dict(rejected),
        inputs=inputs,
        outputs=[OutputFile(file=file, rows=len(frame)) for file, frame in frames.items()],
        settings={**settings},
        figures={"days": [_document(one) for one in outcomes], "tests": [*tests]},
    )


def _document(outcome: Outcome) -> dict[str, Any]:
    record = outcome.record
    document: dict[str, Any] = {
        "region": outcome.day.region, "day": outcome.day.date, "status": outcome.status,
        "reason": outcome.reason,
    }  # fmt: skip
    if record is not None:
        document |= {
            "first_s": record.first_s, "last_s": record.last_s, "start": record.start,
            "output_sha256": record.output_sha256, "findings": record.findings,
            "warnings": record.warnings,
        }  # fmt: skip
    return document


def _octets(path: Path) -> int:
    file = measurements_path(path)
    files = [file] if file.is_file() else [one for one in path.rglob("*") if one.is_file()]
    return sum(one.stat().st_size for one in files)
