"""`report.json` of a conversion."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from multiradar_converters.report_file import Converted, write_report
from multiradar_converters.vid.accounting import Account
from multiradar_converters.vid.naming import NamingCounts
from multiradar_converters.vid.options import Options
from multiradar_converters.vid.track_files import Written


@dataclass(frozen=True)
class Findings:
    """Counts of a conversion."""

    accounts: list[Account]
    written: Written
    naming: NamingCounts
    plots_repeated: int
    sensors_without_plots: list[str]
    aircraft: int
    aircraft_not_chosen: int
    table_rows: int
    of_day: bool
    first_s: float | None
    last_s: float | None


def report_json(path: Path, findings: Findings, options: Options) -> dict[str, object]:
    """Write and return the report.

    Parameters
    ----------
    path : Path
        The file.
    findings : Findings
        The counts.
    options : Options
        Options.

    Returns
    -------
    dict
        The report, ready for JSON.
    """
    by_code: Counter[Any] = Counter()
    for account in findings.accounts:
        by_code.update(account.rejected)
    converted = Converted(
        command="convert vid",
        inputs=[(one.file, one.size, _counts(one)) for one in findings.accounts],
        rejected_by_code=by_code,
        measurements=findings.table_rows,
        outputs=_tracks(findings.written),
        settings=options.settings(),
        figures=_figures(findings, options),
    )
    return write_report(path, converted)


def _counts(account: Account) -> dict[str, int]:
    rejected = account.rejected.total()
    return {
        "read": account.accepted + rejected,
        "accepted": account.accepted,
        "rejected": rejected,
        "duplicate": 0,
        "blank": account.blank,
    }


def _tracks(written: Written) -> list[dict[str, object]]:
    return [
        {"file": f"*/{stem}.{ending}", "rows": written.points[stem]}
        for stem in sorted(written.points)
        for ending in ("new4", "plt")
    ]


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
        "sensors_without_plots": findings.sensors_without_plots,
        "track_rows_naming_a_plot": naming.found + naming.lost,
        "track_rows_whose_plot_is_missing": naming.lost,
        "first_s": findings.first_s,
        "last_s": findings.last_s,
    }
    if findings.of_day and options.date is None:
        figures["note"] = "without a date, times of day in the .plt files are dated 1970-01-01"
    return figures
