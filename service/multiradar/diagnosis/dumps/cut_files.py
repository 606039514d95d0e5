"""Dumps with one file truncated: it ends long before the other."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import polars as pl

from multiradar.diagnosis.model import Diagnosis
from multiradar.diagnosis.times import utc
from multiradar_schemas.reject import RejectCode

#: Tracks coast for some scans after the last plot, and clutter continues after the last track: a
#: file is truncated where it ends earlier by this time, s, and this fraction of the recording.
EARLIER_MIN_S, EARLIER_MIN = 120.0, 0.02
#: ... and where this fraction of what is expected of the whole file is missing: of plots that
#: tracks reference, or of plots that no track references.
EXPECTED_MIN = 0.5


def check_last_lines(report: Mapping[str, Any]) -> list[Diagnosis]:
    """Diagnose files of a dump that end in the middle of a line.

    Parameters
    ----------
    report : mapping
        The report of the conversion.
    """
    return [
        Diagnosis(
            "",
            "file_cut",
            f"{name}: truncated: it ends in the middle of a line{_at(one.get('last_s'))}; copy the "
            "file again",
        )
        for name, one in report.get("figures", {}).get("files", {}).items()
        if "table" in one and RejectCode.TRUNCATED in one["rejected_by_code"]
    ]


def _at(last_s: float | None) -> str:
    return "" if last_s is None else f", after {utc(last_s)}"


def check_truncation(measurements: Path, report: Mapping[str, Any]) -> list[Diagnosis]:
    """Diagnose plots or tracks of a dump that were cut short.

    Parameters
    ----------
    measurements : Path
        The table of measurements that was written.
    report : mapping
        The report of the conversion.
    """
    files = {
        one["table"]: (name, one["last_s"])
        for name, one in report.get("figures", {}).get("files", {}).items()
        if one.get("last_s") is not None and "table" in one
    }
    if "plots" not in files or "tracks" not in files:
        return _no_plots(report) if "tracks" in files else []
    (plots, plots_end_s), (tracks, tracks_end_s) = files["plots"], files["tracks"]
    figures = report["figures"]
    apart_s = abs(plots_end_s - tracks_end_s)
    whole_s = max(plots_end_s, tracks_end_s) - figures["first_s"]
    if apart_s < max(EARLIER_MIN_S, EARLIER_MIN * whole_s):
        return []
    if plots_end_s < tracks_end_s:
        missing = figures["track_rows_whose_plot_is_missing"]
        named = figures["track_rows_naming_a_plot"]
        if missing <= EXPECTED_MIN * apart_s / whole_s * named:
            return []
        why = f"with rows that refer to missing plots ({missing / named:.0%})"
        return [_cut((plots, plots_end_s), (tracks, tracks_end_s), why)]
    if not _plots_go_on(measurements, tracks_end_s):
        return []
    why = "at the same plot rate"
    return [_cut((tracks, tracks_end_s), (plots, plots_end_s), why)]


def _no_plots(report: Mapping[str, Any]) -> list[Diagnosis]:
    return [
        Diagnosis(
            "",
            "file_cut",
            f"{name}: contains no plots, although the recording has tracks; copy the file again",
        )
        for name, one in report["figures"]["files"].items()
        if one.get("table") == "plots" and not one["rejected"]
    ]


# Whether plots continue at about the same rate after the end of the tracks, most of them named.
def _plots_go_on(measurements: Path, end_s: float) -> bool:
    plots = pl.scan_parquet(measurements).filter(pl.col("kind") == "radar")
    time_s, before = pl.col("time_s"), pl.col("time_s") <= end_s
    first_s, last_s, early, late, named = (
        plots.select(
            time_s.min().alias("first_s"),
            time_s.max().alias("last_s"),
            before.sum().alias("early"),
            (~before).sum().alias("late"),
            (before & pl.col("track_number").is_not_null()).sum().alias("named"),
        )
        .collect()
        .row(0)
    )
    if not early or end_s <= first_s:
        return False
    rates = np.array([early / (end_s - first_s), late / (last_s - end_s)])
    return bool(named >= EXPECTED_MIN * early and rates[1] >= EXPECTED_MIN * rates[0])


def _cut(short: tuple[str, float], whole: tuple[str, float], why: str) -> Diagnosis:
    return Diagnosis(
        "",
        "file_cut",
        f"{short[0]}: probably truncated: it ends at {utc(short[1])}, but {whole[0]} continues "
        f"until {utc(whole[1])}, {why}; copy the file again",
    )
