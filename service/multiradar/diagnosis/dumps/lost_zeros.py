"""Codes and addresses of a dump that a spreadsheet read as numbers, without their leading zeros."""

import json
from itertools import islice
from pathlib import Path

from multiradar.diagnosis.cross_sensor.comparison import TESTED_MIN
from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.names import counted
from multiradar_converters.vid.text.lines import ZEROS_LOST

#: Rejects that are read.
_REJECTS_MAX = 100_000


def check_lost_zeros(rejects: Path) -> list[Diagnosis]:
    """Diagnose values that lack digits: all plots of the aircraft that have them are missing.

    Parameters
    ----------
    rejects : Path
        The file of what was rejected, which may be missing.

    Returns
    -------
    list of Diagnosis
        One for each file and column with `TESTED_MIN` such values or more.
    """
    if not rejects.is_file():
        return []
    lost: dict[tuple[str, str], list[str]] = {}
    with rejects.open(encoding="utf-8") as lines:
        for one in map(json.loads, islice(lines, _REJECTS_MAX)):
            reason = str(one.get("reason", ""))
            if reason.endswith(ZEROS_LOST) and "line" in one:
                key = str(one["file"]), reason.partition(":")[0]
                lost.setdefault(key, []).append(f"line {one['line']}: {reason}")
    return [
        Diagnosis(
            "",
            "codes",
            f"{file}: {counted(len(reasons))} values of {column} have too few digits and were "
            f"rejected, such as {reasons[0]}; write all digits (a spreadsheet removes leading "
            "zeros: import the column as text)",
        )
        for (file, column), reasons in lost.items()
        if len(reasons) >= TESTED_MIN
    ]
