"""Summaries common to all conversions."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from multiradar.cli.terminal.findings import with_findings

if TYPE_CHECKING:
    from multiradar.toolbox.conversion.convert import Conversion


def print_conversion(
    convert: "Callable[[], Conversion]",
    summary: Callable[[dict[str, Any], Path], str],
    *,
    as_json: bool,
) -> None:
    """Convert and print the report or a summary of it.

    Raises
    ------
    FindingsError
        The recording is truncated or at fault; what was read is on standard output.
    """
    done, findings = with_findings(convert)
    text = json.dumps(done.report, indent=1, ensure_ascii=False) if as_json else ""
    print(text or summary(done.report, done.folder))
    if findings is not None:
        raise findings


def times_line(first_s: float | None, last_s: float | None) -> str:
    """Return the time span of a recording as text, in UTC if its date is known.

    Parameters
    ----------
    first_s, last_s : float, optional
        First and last time, s; None without times.

    Returns
    -------
    str
        One line.
    """
    from multiradar.report.times import is_dated, time_text

    if first_s is None or last_s is None:
        return "times: none"
    span = f"times: {time_text(first_s)} to {time_text(last_s)}"
    if is_dated(last_s):
        return span
    return f"{span}, without a date; convert with --date YYYY-MM-DD to compare with other data"


def records_line(report: dict[str, Any]) -> str:
    """Return the counts of the records of a conversion as text."""
    counts = report["counts"]
    by_code = ", ".join(f"{code} {count}" for code, count in report["rejected_by_code"].items())
    return (
        f"read {counts['read']} records: accepted {counts['accepted']}, rejected "
        f"{counts['rejected']}{f' ({by_code})' if by_code else ''}, "
        f"duplicate {counts['duplicate']}"
    )
