"""`report.json` of a conversion: one way to write it, whatever was converted."""

import json
from pathlib import Path
from typing import Any

from multiradar_schemas.report import Report


def write_report(path: Path, document: dict[str, Any]) -> dict[str, object]:
    """Write a report and return what it says.

    Parameters
    ----------
    path : Path
        The file.
    document : dict
        The fields of `Report`.

    Returns
    -------
    dict
        The report, ready for JSON.
    """
    text = Report.model_validate(document).model_dump_json(indent=1)
    path.write_text(text + "\n", encoding="utf-8")
    loaded: dict[str, object] = json.loads(text)
    return loaded
