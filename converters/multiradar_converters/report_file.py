"""`report.json` of all conversions."""

import json
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from multiradar_schemas.report import Report


@dataclass(frozen=True)
class Converted:
    """Content of the report of a conversion.

    Attributes
    ----------
    command : str
        Its name.
    inputs : list of (str, int, dict)
        Of each file its name, its size in bytes, and the fields of `Counts` of its records.
    rejected_by_code : mapping
        Rejected records by code.
    measurements : int
        Rows of `measurements.parquet`.
    settings, figures : dict
        Options, and further figures.
    duplicates : int
        Records that were accepted while reading and later found to be duplicates.
    outputs : list of dict
        Files besides `measurements.parquet` and `rejects.ndjson`, and their rows.
    """

    command: str
    inputs: list[tuple[str, int, dict[str, int]]]
    rejected_by_code: Mapping[Any, int]
    measurements: int
    settings: dict[str, object]
    figures: dict[str, object]
    duplicates: int = 0
    outputs: list[dict[str, object]] = field(default_factory=list)


def write_report(path: Path, converted: Converted) -> dict[str, object]:
    """Write and return a report.

    Returns
    -------
    dict
        The report, ready for JSON.
    """
    counts = _summed(count for _, _, count in converted.inputs)
    counts["accepted"] -= converted.duplicates
    counts["duplicate"] += converted.duplicates
    document = {
        "command": converted.command,
        "version": version("multiradar"),
        "counts": counts,
        "rejected_by_code": dict(sorted(converted.rejected_by_code.items())),
        "inputs": [
            {"file": file, "bytes": size, "counts": count} for file, size, count in converted.inputs
        ],
        "outputs": [
            {"file": "measurements.parquet", "rows": converted.measurements},
            {"file": "rejects.ndjson", "rows": counts["rejected"]},
            *converted.outputs,
        ],
        "settings": converted.settings,
        "figures": converted.figures,
    }
    text = Report.model_validate(document).model_dump_json(indent=1)
    path.write_text(text + "\n", encoding="utf-8")
    loaded: dict[str, object] = json.loads(text)
    return loaded


def extremes(time_s: NDArray[np.float64]) -> tuple[float | None, float | None]:
    """Return the first and the last time, s; None without times."""
    if not len(time_s):
        return None, None
    return float(np.min(time_s)), float(np.max(time_s))


def _summed(counts: Iterable[dict[str, int]]) -> Counter[str]:
    total = Counter(read=0, accepted=0, rejected=0, duplicate=0)
    for count in counts:
        total.update(count)
    return total
