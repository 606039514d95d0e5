"""Warnings and findings of a run: missing settings, exhausted capacity, no accepted rows."""

from pathlib import Path
from typing import TYPE_CHECKING

from multiradar.toolbox.diagnoses import findings_of
from multiradar.toolbox.inputs import counts_by_code

if TYPE_CHECKING:
    from multiradar.estimation.measurement.sensors import SensorTable
    from multiradar.runtime.offline.offline_job import OfflineResult
    from multiradar.storage.recording import Recording
    from multiradar_schemas.report import Report


def missing_periods(recording: "Recording", sensors: "SensorTable") -> list[str]:
    """Return a sentence for each radar without a scan period that its plots show.

    It is tracked with a default, and its near duplicates stay.
    """
    import numpy as np
    import polars as pl

    from multiradar.estimation.measurement.kinds import KIND_RADAR
    from multiradar_converters.scan_period import PLOTS_MAX, scan_period_s

    lacking = np.flatnonzero((sensors.kinds == KIND_RADAR) & np.isnan(sensors.rotation_period_s))
    plots = {sensors.ids[number]: pl.DataFrame() for number in lacking.tolist()}
    for block in recording.blocks({"radar"}):
        open_ = [name for name, own in plots.items() if len(own) < PLOTS_MAX]
        if not open_:
            break
        known = block.select("sensor_id", "time_s", "azimuth_deg").drop_nulls()
        for name in open_:
            plots[name] = pl.concat([plots[name], known.filter(sensor_id=name)], how="diagonal")
    found = []
    for name, own in plots.items():
        columns = [own[column].to_numpy() for column in own.columns if column != "sensor_id"]
        period_s = scan_period_s(columns[0], columns[1]) if columns else np.nan
        if np.isfinite(period_s):
            found.append(
                f"{name}: rotation_period_s is missing in the sensors file (5 s is assumed); "
                f"add the value derived from the plots: {period_s:.3f} s"
            )
    return found


def run_findings(report: "Report", result: "OfflineResult", out: Path) -> list[str]:
    """Return what makes the recording or the sensors suspect, a sentence each."""
    from multiradar.runtime.offline.offline_job import REJECTS_FILE

    findings = findings_of(result.diagnoses)
    if report.counts.accepted == 0:
        codes = counts_by_code({str(code): n for code, n in report.rejected_by_code.items()})
        findings.append(
            f"none of {report.counts.read} measurements were accepted: {codes}; see "
            f"{out / REJECTS_FILE}"
        )
    return findings


def exhausted(result: "OfflineResult", filter_name: str) -> list[str]:
    """Return a warning if there were more aircraft than the filter tracks."""
    from multiradar.estimation.filters.bank import find_filter
    from multiradar.tracking.pool import CAPACITY_MAX

    untracked = result.tracker["no_room"]
    if not untracked:
        return []
    most = find_filter(filter_name).aircraft_max or CAPACITY_MAX
    return [
        f"track capacity exhausted: {filter_name} tracks at most {most} aircraft; "
        f"{untracked} measurements were not used (no_room)"
    ]
