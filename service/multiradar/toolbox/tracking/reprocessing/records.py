"""The record of a completed day, written last: what it was made from, and its digest."""

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from multiradar.storage.output_file import replaced_file

#: In the output directory of a day, and in that of all days.
RECORD_FILE = "reprocess.json"


@dataclass(frozen=True, slots=True)
class DayRecord:
    """What the output of a day was made from. A day without a record is not complete.

    Attributes
    ----------
    version : str
        Version of the program.
    input_sha256, settings_sha256 : str
        Of the recording, and of sensors, settings and rules.
    start, start_sha256 : str
        The day from whose biases it started, and the digest of its output; empty for the priors.
    output_sha256 : str
        As in its report.
    first_s, last_s : float
        First and last time of its measurements, Unix time, s.
    findings, warnings : list of str
        Sentences of its run.
    """

    version: str
    input_sha256: str
    settings_sha256: str
    start: str
    start_sha256: str
    output_sha256: str
    first_s: float
    last_s: float
    findings: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


def read_record(folder: Path) -> DayRecord | None:
    """Return the record of a day; None if there is none that can be read."""
    found = read_json(folder / RECORD_FILE)
    try:
        return None if found is None else DayRecord(**found)
    except TypeError:
        return None


def write_record(folder: Path, record: DayRecord) -> None:
    """Write the record of a day, whole or not at all."""
    write_json(folder / RECORD_FILE, asdict(record))


def read_json(path: Path) -> dict[str, Any] | None:
    """Return an object of JSON in a file; None if there is none that can be read."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if isinstance(found, dict) else None


def write_json(path: Path, document: dict[str, Any]) -> None:
    """Write an object as JSON, whole or not at all, in place of what is there."""
    with replaced_file(path) as partial:
        text = json.dumps(document, indent=2, ensure_ascii=False, allow_nan=False)
        partial.write_text(text + "\n", encoding="utf-8")
