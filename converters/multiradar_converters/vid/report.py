"""`report.json` of a conversion."""

from collections import Counter
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from multiradar_converters.report_file import write_report
from multiradar_converters.vid.accounting import Account
from multiradar_converters.vid.naming import NamingCounts
from multiradar_converters.vid.options import Options
from multiradar_converters.vid.track_files import Written


@dataclass(frozen=True)
class Findings:
    """All that a conversion counted."""

    accounts: list[Account]
    written: Written
    naming: NamingCounts
    plots_repeated: int
    aircraft: int
    aircraft_not_chosen: int
    table_rows: int
    of_day: bool


def report_json(path: Path, findings: Findings, options: Options) -> dict[str, object]:
    """Write the report and return what it says.

    Parameters
    ----------
    path : Path
        The file.
    findings : Findings
        The counts.
    options : Options
        The user's choices.

    Returns
    -------
    dict
        The report, ready for JSON.
    """
    return write_report(path, _report(findings, options))


def _report(findings: Findings, options: Options) -> dict[str, Any]:
    accounts = findings.accounts
    by_code: Counter[Any] = Counter()
    for account in accounts:
        by_code.update(account.rejected)
    total = {
        name: sum(_counts(account)[name] for account in accounts)
        for name in ("read", "accepted", "rejected", "duplicate", "blank")
    }
    return {
        "command": "convert vid",
        "version": version("multiradar"),
        "counts": total,
        "rejected_by_code": dict(sorted(by_code.items())),
        "inputs": [
            {"file": account.file, "bytes": account.size, "counts": _counts(account)}
            for account in accounts
        ],
        "outputs": _outputs(findings),
        "settings": options.settings(),
        "figures": _figures(findings, options),
    }


def _counts(account: Account) -> dict[str, int]:
    rejected = account.rejected.total()
    return {
        "read": account.accepted + rejected,
        "accepted": account.accepted,
        "rejected": rejected,
        "duplicate": 0,
        "blank": account.blank,
    }


def _outputs(findings: Findings) -> list[dict[str, object]]:
    written = findings.written
    rejected = sum(account.rejected.total() for account in findings.accounts)
    tables: list[dict[str, object]] = [
        {"file": "measurements.parquet", "rows": findings.table_rows},
        {"file": "rejects.ndjson", "rows": rejected},
    ]
    tables.extend(
        {"file": f"*/{stem}.{ending}", "rows": written.points[stem]}
        for stem in sorted(written.points)
        for ending in ("new4", "plt")
    )
    return tables


def _figures(findings: Findings, options: Options) -> dict[str, object]:
    written, naming = findings.written, findings.naming
    skipped = {
        stem: {"tracks": written.short_tracks[stem], "points": written.short_points[stem]}
        for stem in sorted(written.short_tracks)
    }
    figures: dict[str, object] = {
        "files": {account.file: account.figures() for account in findings.accounts},
        "aircraft": findings.aircraft,
        "aircraft_not_chosen": findings.aircraft_not_chosen,
        "tracks_written": dict(sorted(written.tracks.items())),
        "tracks_too_short": skipped,
        "plots_named_by_no_track": naming.plots_unnamed,
        "plots_named_by_several_aircraft": naming.plots_named_by_several,
        "plots_repeated": findings.plots_repeated,
        "track_rows_naming_a_plot": naming.found + naming.lost,
        "track_rows_whose_plot_is_missing": naming.lost,
    }
    if findings.of_day and options.date is None:
        figures["note"] = "without a date, the .plt files count times of day from 1970-01-01"
    return figures
