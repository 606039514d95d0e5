"""A day as a job: one run of `track` in a process of its own."""

import shutil
import warnings
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

from multiradar.errors import DataWarning, FindingsError, InputError
from multiradar.report.times import time_text
from multiradar.storage.recording import Recording, measurements_path
from multiradar.toolbox.messages.sentences import error_sentence
from multiradar.toolbox.run import Run
from multiradar.toolbox.tracking.reprocessing.days import Day, input_sha256
from multiradar.toolbox.tracking.reprocessing.records import DayRecord, write_record
from multiradar.toolbox.tracking.track import track

#: Unix times are later: smaller ones are times of day.
_UNIX_MIN_S = 366.0 * 86_400.0


def day_job(day: Day, *, sensors: Path, out: Path, same: Mapping[str, Any]) -> dict[str, Any]:
    """Return the job of a day.

    Parameters
    ----------
    day : Day
        The day.
    sensors : Path
        Its sensors file.
    out : Path
        The folder to make.
    same : mapping of str to object
        What all days have in common: `options` of `track`, and fields of the record.
    """
    own = {"region": day.region, "date": day.date, "path": str(day.path)}
    return {**same, "day": own, "sensors": str(sensors), "out": str(out)}


def run_day(job: Mapping[str, Any]) -> dict[str, Any]:
    """Track a day, and write its record.

    Parameters
    ----------
    job : mapping of str to object
        As `day_job` returns.

    Returns
    -------
    dict
        The `record`, or an `error` as a sentence. Nothing is raised.
    """
    own = job["day"]
    day = Day(own["region"], own["date"], Path(own["path"]))
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            return {"record": asdict(_tracked(day, job, caught))}
        except Exception as error:
            return {"error": error_sentence(error)}


def _tracked(day: Day, job: Mapping[str, Any], caught: list[warnings.WarningMessage]) -> DayRecord:
    out = Path(job["out"])
    # Of an interrupted job, or from other inputs or settings.
    shutil.rmtree(out, ignore_errors=True)
    _check_dated(day)
    digest = input_sha256(day.path)
    options = {**job["options"], "date": day.date if day.is_dump else None}
    findings: tuple[str, ...] = ()
    try:
        run = track(day.path, job["sensors"], out=out, **options)
    except FindingsError as error:
        if not isinstance(error.output, Run) or not error.output.report["counts"]["accepted"]:
            raise
        run, findings = error.output, error.findings
    assert run.span_s is not None
    first_s, last_s = run.span_s
    sentences = [str(one.message) for one in caught if issubclass(one.category, DataWarning)]
    if not day.has(first_s, last_s, any_zone=False):
        when = f"not from {day.date}, but from {time_text(first_s)} to {time_text(last_s)}"
        if day.has(first_s, last_s, any_zone=True):
            sentences.append(
                f"{day.path}: its measurements are {when}; is the folder named after the local "
                "date?"
            )
        else:
            again = "rename the folder, or convert the recording again with the correct date"
            findings = (*findings, f"{day.path}: its measurements are {when}; {again}")
    record = DayRecord(
        **job["record"], input_sha256=digest, output_sha256=run.report["output_sha256"],
        first_s=first_s, last_s=last_s, findings=[*findings], warnings=sentences,
    )  # fmt: skip
    write_record(out, record)
    return record


# Days of a period are compared in time; a dump is converted with the date of its folder.
def _check_dated(day: Day) -> None:
    file = measurements_path(day.path)
    if not file.is_file():
        return
    span_s = Recording(file).span_s()
    if span_s is not None and span_s[0] < _UNIX_MIN_S:
        raise InputError(
            f"{day.path}: the recording has times of day only; convert it with --date {day.date}"
        )
