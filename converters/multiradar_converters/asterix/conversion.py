"""Conversion of ASTERIX recordings: files in, one folder out."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TextIO

import numpy as np
import polars as pl

from multiradar_converters.aircraft_data.quantities import joined
from multiradar_converters.asterix import reported_biases, system_table, table
from multiradar_converters.asterix.aircraft_reports import screened
from multiradar_converters.asterix.decoding import clocks
from multiradar_converters.asterix.decoding.checks import (
    Rejection,
    aircraft,
    impossible_tracks,
    misplaced,
    unreferenced,
    untimed,
)
from multiradar_converters.asterix.decoding.editions import source_name
from multiradar_converters.asterix.decoding.gathering import (
    Broken,
    Gathered,
    Rows,
    gather,
    selected_rows,
)
from multiradar_converters.asterix.decoding.local_plane import local_only, located
from multiradar_converters.asterix.decoding.sensor_clocks import (
    Differences,
    differences,
    of_reports,
    of_services,
)
from multiradar_converters.asterix.decoding.sensor_status import last_status
from multiradar_converters.asterix.decoding.timing import (
    KINDS,
    AntennaStatus,
    FileDays,
    Timed,
    days_of_file,
    reported_references,
    services_in_order,
    time_targets,
)
from multiradar_converters.asterix.file_order import FileOrder, file_times
from multiradar_converters.asterix.framing.containers import CAPTURE, read_blocks
from multiradar_converters.asterix.layout.columns import Integers, Numbers
from multiradar_converters.asterix.options import Options
from multiradar_converters.asterix.records import RecordDump
from multiradar_converters.asterix.report import (
    REPORTED_BIASES_FILE,
    SYSTEM_TRACKS_FILE,
    FileAccount,
    Findings,
    PlotFigures,
    report_json,
)
from multiradar_converters.asterix.sensors import SensorNames, sensors_toml
from multiradar_converters.distinct import distinct
from multiradar_converters.errors import LayoutError
from multiradar_converters.output_folder import OutputFolder
from multiradar_converters.report_file import extremes
from multiradar_converters.scan_period import scan_period_s, why_no_period
from multiradar_converters.sensors_template import FROM_PLOTS, middle_of_reports
from multiradar_converters.vid.text.times import unix_start
from multiradar_schemas.reject import Reject, RejectCode

#: Octets of an undecodable block that are retained in the quarantine.
RAW_OCTETS_MAX = 4096

FAR_OFF = "a time that differs by more than an hour from neighbouring times"


@dataclass
class _Part:
    """Measurements of one file for the table."""

    rows: dict[str, Numbers | Integers]
    numbers: dict[str, Numbers]
    aircraft_data: Numbers


def convert(
    files: Sequence[Path], out: Path, options: Options, advance: Callable[[int], None]
) -> dict[str, object]:
    """Convert recordings.

    Parameters
    ----------
    files : sequence of Path
        Recordings in order of time.
    out : Path
        The folder to create.
    options : Options
        Options.
    advance : callable
        Called with the number of octets read, from time to time.

    Returns
    -------
    dict
        Content of `report.json`.

    Raises
    ------
    OutputFolderExistsError
        `out` exists.
    LayoutError
        A file cannot be read, or none contains a decodable block.
    AccountingError
        An octet or record is unaccounted for.
    """
    findings = Findings()
    parts: list[_Part] = []
    tracks: list[pl.DataFrame] = []
    biases: list[pl.DataFrame] = []
    order = FileOrder()
    with OutputFolder(out) as folder:
        with (folder.path / "rejects.ndjson").open("w", encoding="utf-8", newline="\n") as rejects:
            for path in files:
                gathered = _gathered(path, options, folder.path)
                timed, antennas = time_targets(gathered, options.scan_periods())
                days = days_of_file(gathered, timed)
                _retain(findings, antennas)
                account, part = _of_file(gathered, timed, days, options, findings)
                made = _system_tracks(gathered, days, account, options, findings)
                status = reported_biases.frame(
                    gathered.status, days.status_s, unix_start(options.date)
                )
                moved_s = order.add(account.file, [file_times(gathered, timed, days)])
                _write_rejects(rejects, gathered, account)
                account.check()
                findings.files.append(account)
                if part is not None:
                    part.numbers["time_s"] += moved_s
                    parts.append(part)
                tracks.append(made.with_columns(pl.col("time_s") + moved_s))
                biases.append(status.with_columns(pl.col("time_s") + moved_s))
                advance(gathered.blocks.size)
        _check_some_known(findings, options)
        findings.exchanged_files, findings.moved_files = order.exchanged, order.moved
        frames, names = _frames(parts, options, findings)
        findings.rows = table.write(folder.path / "measurements.parquet", frames)
        written = system_table.write(folder.path / SYSTEM_TRACKS_FILE, tracks)
        findings.system_tracks = written.height
        if not findings.rows:
            findings.first_s, findings.last_s = extremes(written["time_s"].to_numpy())
        reported = reported_biases.in_order(biases)
        findings.biases = reported_biases.reported_biases(reported)
        findings.bias_rows = reported_biases.write(folder.path / REPORTED_BIASES_FILE, reported)
        skeleton = sensors_toml(names, findings)
        (folder.path / "sensors.toml").write_text(skeleton, encoding="utf-8")
        report = report_json(folder.path / "report.json", findings, options)
        folder.finish()
    return report


_NO_ASTERIX = (
    "probably not an ASTERIX recording (a block starts with its category and its length in three "
    "octets), or encrypted or damaged; check which program wrote the file"
)


def _check_some_known(findings: Findings, options: Options) -> None:
    """Reject recordings without a decodable block."""
    if any(account.octets["decoded"] + account.octets["skipped"] for account in findings.files):
        return
    if options.editions.doubtful:
        raise LayoutError("; ".join(options.editions.doubtful.values()))
    for account in findings.files:
        if account.broken:
            first = min(account.broken, key=lambda one: one.offset)
            msg = (
                f"{account.file}: no ASTERIX block can be decoded; at offset {first.offset}: "
                f"{first.reason}; {_NO_ASTERIX}"
            )
            raise LayoutError(msg)
    names = ", ".join(account.file for account in findings.files)
    msg = f"{names}: no ASTERIX blocks found"
    raise LayoutError(msg)


def _system_tracks(
    gathered: Gathered,
    days: FileDays,
    account: FileAccount,
    options: Options,
    findings: Findings,
) -> pl.DataFrame:
    possible = []
    for (rows, part), time_s in zip(gathered.tracks, days.tracks_s, strict=True):
        kept = np.ones(part.height, dtype=np.bool_)
        for rejection in impossible_tracks(part):
            _reject_reports(account, rows, rejection)
            kept &= ~rejection[0]
        dated = part.with_columns(pl.Series("time_s", time_s, nan_to_null=True))
        possible.append((selected_rows(rows, kept), dated.filter(pl.Series(kept))))
    made = system_table.frame(possible, unix_start(options.date))
    total = sum(part.height for _, part in possible)
    if total > made.height:
        findings.left_out["system_track_without_time"] += total - made.height
    return made


def _gathered(path: Path, options: Options, folder: Path) -> Gathered:
    blocks = read_blocks(path)
    if not options.records:
        return gather(blocks, options.editions)
    dump = RecordDump(blocks)
    gathered = gather(blocks, options.editions, watch=dump.add)
    dump.append_to(folder / "records.ndjson")
    return gathered


def _write_rejects(rejects: TextIO, gathered: Gathered, account: FileAccount) -> None:
    for broken in sorted(account.broken, key=lambda one: one.offset):
        rejects.write(_reject(gathered, broken).model_dump_json(exclude_none=True) + "\n")


def _reject(gathered: Gathered, broken: Broken) -> Reject:
    octets = gathered.blocks.data[broken.begin : broken.begin + broken.octets]
    cut = len(octets) > RAW_OCTETS_MAX
    return Reject(
        file=gathered.blocks.file,
        offset=broken.offset,
        reason=broken.reason + (f"; the first {RAW_OCTETS_MAX} octets are retained" if cut else ""),
        code=broken.code,
        raw=octets[:RAW_OCTETS_MAX].tobytes().hex(),
    )


def _of_file(
    gathered: Gathered, timed: Timed | None, days: FileDays, options: Options, findings: Findings
) -> tuple[FileAccount, _Part | None]:
    """Reject invalid reports of a file, and count."""
    account = FileAccount(
        file=gathered.blocks.file,
        form=gathered.blocks.form,
        size=gathered.blocks.size,
        octets=gathered.octets,
        records=sum(gathered.records.values()),
        broken=list(gathered.broken),
    )
    account.blocks_broken = len(account.broken)
    if gathered.blocks.form == CAPTURE:
        received_s = [findings.captured_s, *gathered.blocks.received_s]
        findings.captured_s = float(np.fmin.reduce(received_s))
    findings.records.update(gathered.records)
    findings.items.update(gathered.items)
    for rows, status in gathered.status:
        for source in distinct(rows.source).tolist():
            last = last_status(status.filter(pl.Series(rows.source == source)))
            findings.status.setdefault(source_name(source), {}).update(last)
    findings.skipped.update(gathered.skipped)
    findings.unfit.update(gathered.unfit)
    findings.differences += _differences(gathered, timed)
    if timed is None:
        return account, None
    # Those of earlier files count, too.
    references = reported_references(findings.antennas) | options.reference_points()
    local = np.unique(timed.rows.source[local_only(timed.targets)]).tolist()
    findings.references |= {one: references[one] for one in local if one in references}
    targets = located(timed.targets, timed.rows.source, references)
    return account, _measured(replace(timed, targets=targets), days, account, options, findings)


def _differences(gathered: Gathered, timed: Timed | None) -> list[Differences]:
    """Return how much later messages were received than their times."""
    rows, services = services_in_order(gathered)
    found = [of_services(rows.source, services, rows.received_s)]
    if timed is not None:
        found.append(of_reports(timed))
    for tracks, part in gathered.tracks:
        time_s = part["time_s"].fill_null(np.nan).to_numpy()
        found.append(differences(tracks.source, time_s, tracks.received_s, reports=True))
    return found


def _retain(findings: Findings, antennas: dict[int, AntennaStatus]) -> None:
    """Retain the antenna status of the file with most north marks, and any site."""
    for source, one in antennas.items():
        before = findings.antennas.get(source)
        site = one.site if before is None else one.site or before.site
        if before is None or (one.north_marks, one.sectors) > (before.north_marks, before.sectors):
            before = one
        findings.antennas[source] = replace(before, site=site)


def _measured(
    timed: Timed, days: FileDays, account: FileAccount, options: Options, findings: Findings
) -> _Part | None:
    kept = days.kept
    measured, left_out, flags = aircraft(timed, all_targets=options.all_targets)
    findings.left_out.update(left_out)
    findings.flags.update(flags)
    far_off = (~np.isnan(days.time_s) & ~kept, RejectCode.OUT_OF_RANGE, FAR_OFF)
    rejections = [
        *untimed(timed),
        far_off,
        unreferenced(timed, kept & measured),
        misplaced(timed, kept & measured),
    ]
    own = kept & measured
    local, *_ = unreferenced(timed, own)
    findings.unreferenced.update(
        zip(timed.rows.source[local].tolist(), timed.kind[local].tolist(), strict=True)
    )
    for wrong, code, reason in rejections:
        _reject_reports(account, timed.rows, (wrong, code, reason))
        own &= ~wrong
    return _part(timed, np.flatnonzero(own), days.time_s + unix_start(options.date), findings)


def _part(timed: Timed, own: Integers, time_s: Numbers, findings: Findings) -> _Part:
    targets = timed.targets
    for origin, count in zip(*np.unique(timed.origin[own], return_counts=True), strict=True):
        findings.time_origins[clocks.ORIGINS[origin]] += int(count)
    whole = {name: getattr(targets, name) for name in table.WHOLE}
    whole |= {
        "same": timed.same,
        "source": timed.rows.source,
        "kind": timed.kind,
        "category": targets.category,
        "dropped": targets.dropped,
    }
    return _Part(
        rows={name: values[own] for name, values in whole.items()},
        numbers={"time_s": time_s[own]}
        | {name: getattr(targets, name)[own] for name in table.NUMBERS},
        aircraft_data=targets.aircraft_data[own],
    )


def _reject_reports(account: FileAccount, rows: Rows, rejection: Rejection) -> None:
    wrong, code, reason = rejection
    for k in np.flatnonzero(wrong).tolist():
        octets = int(rows.end[k] - rows.begin[k])
        account.broken.append(Broken(int(rows.offset[k]), octets, code, reason, int(rows.begin[k])))


def _frames(
    parts: list[_Part], options: Options, findings: Findings
) -> tuple[list[pl.DataFrame], SensorNames]:
    """Remove duplicates, assign sensor ids, build tables."""
    if not parts:
        return [], SensorNames(options.sensors, Counter())
    rows = {name: np.concatenate([part.rows[name] for part in parts]) for name in parts[0].rows}
    numbers = {
        name: np.concatenate([part.numbers[name] for part in parts]) for name in parts[0].numbers
    }
    again = table.repeated(
        rows["same"].astype(np.int64), rows["source"].astype(np.int64), numbers["time_s"]
    )
    again |= table.repeated_positions({**rows, **numbers})
    findings.duplicates = int(again.sum())
    whole = {name: values[~again].astype(np.int64) for name, values in rows.items()}
    kept = {name: values[~again] for name, values in numbers.items()}
    pairs, places = np.unique(
        np.stack([whole["source"], whole["kind"]], axis=1), axis=0, return_inverse=True
    )
    counts = np.bincount(places.ravel(), minlength=len(pairs)).tolist()
    found = Counter({(s, KINDS[k]): n for (s, k), n in zip(pairs.tolist(), counts, strict=True)})
    # Sensors without a reference point are among those to be completed.
    found.update({(s, KINDS[k]): 0 for s, k in findings.unreferenced})
    names = SensorNames(options.sensors, found)
    findings.measurements = {names.of(*pair): n for pair, n in names.counts.items()}
    ids = [names.of(source, KINDS[kind]) for source, kind in pairs.tolist()]
    findings.first_s, findings.last_s = extremes(kept["time_s"])
    for place, name in enumerate(ids):
        own = places.ravel() == place
        plots = kept["time_s"][own], kept["azimuth_deg"][own]
        period_s = scan_period_s(*plots)
        findings.plot_figures[name] = PlotFigures(
            period_s,
            why_no_period(*plots) if math.isnan(period_s) else FROM_PLOTS,
            float(np.max(np.nan_to_num(kept["range_m"][own]), initial=0.0)),
        )
        findings.middles[name] = middle_of_reports(
            kept["latitude_deg"][own], kept["longitude_deg"][own]
        )
    values = joined([part.aircraft_data for part in parts])[~again]
    data = screened(values, whole["dropped"], places.ravel(), whole["address"], kept)
    findings.aircraft_data = {ids[place]: one for place, one in data.documents.items()}
    sensor_ids = [ids[place] for place in places.ravel().tolist()]
    frame = table.frame(kept, sensor_ids, whole, data.values)
    return [frame], names
