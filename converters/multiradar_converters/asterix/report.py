"""`report.json` of a conversion."""

import dataclasses
import datetime as dt
import math
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

from multiradar_converters.asterix.decoding.bounds import DAY_S
from multiradar_converters.asterix.decoding.editions import source_name
from multiradar_converters.asterix.decoding.gathering import Broken
from multiradar_converters.asterix.decoding.local_plane import ReferencePoint, misplacement
from multiradar_converters.asterix.decoding.sensor_clocks import (
    Differences,
    clock_alarm,
    joined,
    receiver_zone_s,
    sensor_clocks,
)
from multiradar_converters.asterix.decoding.timing import AntennaStatus, reported_references
from multiradar_converters.asterix.options import Options
from multiradar_converters.asterix.reported_biases import ReportedBias
from multiradar_converters.errors import AccountingError
from multiradar_converters.report_file import Converted, write_report
from multiradar_converters.vid.fields import UNIX_TIME_MIN_S
from multiradar_schemas.reject import RejectCode

#: System tracks in the recording, if any.
SYSTEM_TRACKS_FILE = "system_tracks.parquet"
#: Biases reported by another processor, if any.
REPORTED_BIASES_FILE = "reported_biases.parquet"

#: Latency of a live capture, s.
_LATENCY_MAX_S = 600.0


@dataclass
class FileAccount:
    """Disposition of the octets and records of a file."""

    file: str
    form: str
    size: int
    octets: Counter[str]
    records: int
    broken: list[Broken]
    blocks_broken: int = 0

    def check(self) -> None:
        """Check that all octets are accounted for.

        Raises
        ------
        AccountingError
            An octet is unaccounted for.
        """
        accounted = sum(self.octets.values())
        if accounted != self.size:
            msg = f"{self.file}: read {self.size} octets, but accounted for {accounted}"
            raise AccountingError(msg)

    def counts(self) -> dict[str, int]:
        """Return record counts; an undecodable block counts as one record."""
        rejected = len(self.broken)
        return {
            "read": self.records + self.blocks_broken,
            "accepted": self.records + self.blocks_broken - rejected,
            "rejected": rejected,
        }


@dataclass(frozen=True)
class PlotFigures:
    """Figures from the plots of a sensor.

    Attributes
    ----------
    period_s : float
        Scan period, s; NaN for none.
    period_source : str
        Where it is from, or why there is none.
    range_max_m : float
        Maximum range, m.
    """

    period_s: float
    period_source: str
    range_max_m: float


@dataclass
class Findings:
    """Counts of a conversion."""

    files: list[FileAccount] = field(default_factory=list)
    records: Counter[tuple[int, int]] = field(default_factory=Counter)
    items: Counter[tuple[int, int, str]] = field(default_factory=Counter)
    antennas: dict[int, AntennaStatus] = field(default_factory=dict)
    time_origins: Counter[str] = field(default_factory=Counter)
    skipped: Counter[int] = field(default_factory=Counter)
    unfit: Counter[tuple[int, int]] = field(default_factory=Counter)
    differences: list[Differences] = field(default_factory=list)
    left_out: Counter[str] = field(default_factory=Counter)
    flags: Counter[str] = field(default_factory=Counter)
    measurements: dict[str, int] = field(default_factory=dict)
    middles: dict[str, tuple[float, float]] = field(default_factory=dict)
    references: dict[int, ReferencePoint] = field(default_factory=dict)
    unreferenced: Counter[tuple[int, int]] = field(default_factory=Counter)
    plot_figures: dict[str, PlotFigures] = field(default_factory=dict)
    exchanged_files: list[tuple[str, str]] = field(default_factory=list)
    moved_files: list[str] = field(default_factory=list)
    captured_s: float = math.nan
    first_s: float | None = None
    last_s: float | None = None
    duplicates: int = 0
    rows: int = 0
    system_tracks: int = 0
    status: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    biases: list[ReportedBias] = field(default_factory=list)
    bias_rows: int = 0
    aircraft_data: dict[str, dict[str, object]] = field(default_factory=dict)


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
    files = findings.files
    converted = Converted(
        command="convert asterix",
        inputs=[(account.file, account.size, account.counts()) for account in files],
        rejected_by_code=Counter(broken.code for account in files for broken in account.broken),
        measurements=findings.rows,
        outputs=_of_other_sdps(findings),
        settings=options.settings(),
        figures=_figures(findings, options),
        duplicates=findings.duplicates,
    )
    return write_report(path, converted)


def _figures(findings: Findings, options: Options) -> dict[str, object]:
    records: dict[str, dict[str, int]] = {}
    for (category, source), count in sorted(findings.records.items()):
        records.setdefault(f"{category:03d}", {})[source_name(source)] = count
    items: dict[str, dict[str, dict[str, int]]] = {}
    for (category, source, item), count in sorted(findings.items.items()):
        of_category = items.setdefault(f"{category:03d}", {})
        of_category.setdefault(source_name(source), {})[item] = count
    return {
        "bytes": {
            account.file: {"form": account.form, **dict(sorted(account.octets.items()))}
            for account in findings.files
        },
        "cut_short": {
            account.file: broken.reason
            for account in findings.files
            for broken in account.broken
            if broken.code == RejectCode.TRUNCATED
        },
        "exchanged_files": [list(pair) for pair in findings.exchanged_files],
        "moved_files": findings.moved_files,
        "records": {category: sum(of.values()) for category, of in records.items()},
        "records_by_sensor": records,
        "items": items,
        "skipped_blocks": {
            f"{category:03d}": count for category, count in sorted(findings.skipped.items())
        },
        "editions": options.editions.names(),
        "unknown_editions": [
            {"blocks": count, "reason": options.editions.why_unfit(category, source)}
            for (category, source), count in sorted(findings.unfit.items())
        ],
        **_doubts(options),
        "measurements": dict(sorted(findings.measurements.items())),
        "left_out": dict(sorted(findings.left_out.items())),
        "unreferenced": _unreferenced(findings),
        **_contradictions(findings, options),
        "flags": dict(sorted(findings.flags.items())),
        "time_from": dict(sorted(findings.time_origins.items())),
        "sensor_status": findings.status,
        "reported_biases": [dataclasses.asdict(one) for one in findings.biases],
        "first_s": findings.first_s,
        "last_s": findings.last_s,
        "antennas": {source_name(s): _antenna(t) for s, t in sorted(findings.antennas.items())},
        **({"aircraft_data": findings.aircraft_data} if findings.aircraft_data else {}),
        **_clocks(findings),
    }


# Options that the recording contradicts.
def _contradictions(findings: Findings, options: Options) -> dict[str, object]:
    reported = reported_references(findings.antennas)
    sites = [
        ReferencePoint(one.latitude_deg, one.longitude_deg)
        for one in (options.sensors.sensor if options.sensors else ())
        if one.latitude_deg is not None and one.longitude_deg is not None
    ]
    wrong = {}
    for source, given in options.references.items():
        name = source_name(source)
        middles = [ReferencePoint(*one) for of, one in findings.middles.items() if of != name]
        others = [one for one in middles if not math.isnan(sum(one))] + sites
        if why := misplacement(given, reported.get(source), others):
            wrong[name] = why
    found: dict[str, object] = {"misplaced_references": wrong} if wrong else {}
    captured = _captured_date(findings, options)
    return found | ({"captured_date": captured.isoformat()} if captured else {})


# The date of a capture whose packets have the times of day of their reports, if it is not the one
# of the options; a recording that was replayed later was captured at another time of day.
def _captured_date(findings: Findings, options: Options) -> dt.date | None:
    first_s, captured_s = findings.first_s, findings.captured_s
    if options.date is None or first_s is None or not captured_s >= UNIX_TIME_MIN_S:
        return None
    days = round((captured_s - first_s) / DAY_S)
    if not days or abs(captured_s - first_s - days * DAY_S) > _LATENCY_MAX_S:
        return None
    return options.date + dt.timedelta(days=days)


def _unreferenced(findings: Findings) -> dict[str, int]:
    """Return the reports with local coordinates of which the reference point is unknown."""
    counts: Counter[str] = Counter()
    for (source, _kind), count in sorted(findings.unreferenced.items()):
        counts[source_name(source)] += count
    return dict(counts)


def _clocks(findings: Findings) -> dict[str, object]:
    clocks = sensor_clocks(joined(findings.differences))
    zone_s = receiver_zone_s(clocks)
    alarms = {source: clock_alarm(one, zone_s) for source, one in clocks.items()}
    return {
        "clocks": {source_name(source): one.document() for source, one in sorted(clocks.items())},
        "receiver_zone_s": zone_s,
        "sensor_alarms": [
            {"sensor_id": source_name(source), "alarm": alarm[0], "reason": alarm[1]}
            for source, alarm in sorted(alarms.items())
            if alarm is not None
        ],
    }


def _of_other_sdps(findings: Findings) -> list[dict[str, object]]:
    written = {
        SYSTEM_TRACKS_FILE: findings.system_tracks,
        REPORTED_BIASES_FILE: findings.bias_rows,
    }
    return [{"file": file, "rows": rows} for file, rows in written.items() if rows]


# Only where there are any: the report of a good conversion stays as it is.
def _doubts(options: Options) -> dict[str, object]:
    found = [one for _, one in sorted(options.editions.doubtful.items())]
    return {"doubtful_editions": found} if found else {}


def _antenna(status: AntennaStatus) -> dict[str, object]:
    known = status.period_s == status.period_s
    return {
        "north_marks": status.north_marks,
        "sectors": status.sectors,
        "turn_s": round(status.period_s, 4) if known else None,
    }
