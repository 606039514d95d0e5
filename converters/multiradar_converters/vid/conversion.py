"""Conversion of a dump in four passes with bounded memory.

1. plots are read and sorted by time on disk;
2. ADS-B reports likewise, and partitioned by aircraft;
3. track rows are partitioned by aircraft, and those that reference a plot are sorted by time;
4. plots, associated with tracks, and reports are written to the table, and the plots partitioned by
   aircraft.

Then the points of each aircraft are sorted and written, a bucket of aircraft at a time.
"""

import datetime as dt
import errno
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.errors import ConversionError, LayoutError
from multiradar_converters.output_folder import OutputFolder
from multiradar_converters.vid import fields
from multiradar_converters.vid.accounting import Account, RejectsFile
from multiradar_converters.vid.fields import Table
from multiradar_converters.vid.naming import NamedPlots, PlotNamer
from multiradar_converters.vid.numbering import Numbering
from multiradar_converters.vid.options import Options
from multiradar_converters.vid.records import (
    NAMING_WORDS,
    PLOT_WORDS,
    REPORT_WORDS,
    SENSORS_MAX,
    Records,
    decimal,
    pack_identity,
    pack_track,
    points,
    sensor_of,
    times,
)
from multiradar_converters.vid.report import Findings, report_json
from multiradar_converters.vid.sensors import SensorFigures, sensors_toml
from multiradar_converters.vid.spool import Buckets, TimeSorter
from multiradar_converters.vid.survey import DumpFile, clocks, survey
from multiradar_converters.vid.table import table_rows, write_table
from multiradar_converters.vid.text.detection import first_times
from multiradar_converters.vid.text.reading import Progress, read_rows
from multiradar_converters.vid.text.time_filter import Rows
from multiradar_converters.vid.text.times import dates_of, unix_start
from multiradar_converters.vid.track_files import (
    TrackFileNames,
    TrackWriter,
    Written,
    bucket_bits,
    monoradar_file,
    plots_file,
)

#: How often each byte of a dump is counted as progress.
PASSES = 3

# System errors of a full or read-only disk.
_DISK_FULL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS})

_NUMBERS_MAX = 1 << 31
_SENSOR_BITS = 31

Item = TypeVar("Item")


def convert(
    dump: Path, out: Path, options: Options, progress: Progress = lambda _: None
) -> dict[str, object]:
    """Convert a dump into a new folder.

    Parameters
    ----------
    dump : Path
        Folder with the three text files.
    out : Path
        Folder to create; must not exist.
    options : Options
        Options.
    progress : callable
        Called with bytes processed; a byte counts `PASSES` times: read, joined and written.

    Returns
    -------
    dict
        Content of `report.json`.

    Raises
    ------
    OutputFolderExistsError
        `out` exists; nothing was changed.
    LayoutError
        A file is missing or does not match its layout; `out` does not exist.
    AccountingError
        A line or byte is unaccounted for; `out` does not exist.
    ConversionError
        The disk is full; `out` does not exist.
    """
    try:
        return _converted(dump, out, options, progress)
    except OSError as error:
        if error.errno not in _DISK_FULL:
            raise
        msg = f"{out}: cannot be written: {error.strerror}"
        raise ConversionError(msg) from error


def _converted(dump: Path, out: Path, options: Options, progress: Progress) -> dict[str, object]:
    with OutputFolder(out) as folder, ThreadPoolExecutor(options.threads) as pool:
        files = survey(dump, options)
        with RejectsFile(folder.path / "rejects.ndjson") as rejects:
            conversion = _Conversion(
                folder.path, files, options, pool=pool, rejects=rejects, progress=progress
            )
            try:
                report = conversion.run()
            finally:
                conversion.close()
        folder.finish()
    return report


class _Conversion:
    """State of a conversion, extended from pass to pass."""

    def __init__(
        self,
        folder: Path,
        files: list[DumpFile],
        options: Options,
        *,
        pool: Executor,
        rejects: RejectsFile,
        progress: Progress,
    ) -> None:
        self._folder = folder
        self._files = {file.layout.table.name: file for file in files}
        self._options = options
        self._pool = pool
        self._rejects = rejects
        self._progress = progress
        self._accounts: list[Account] = []
        self._first_times = {
            file.layout.table.name: first_times(file.path, file.layout) for file in files
        }
        self._clocks = clocks(files)
        self._check_date(files, options.date)
        self._sensors = Numbering("sensors", SENSORS_MAX)
        self._sources = Numbering("sources", SENSORS_MAX)
        self._aircraft = Numbering("aircraft", _NUMBERS_MAX)
        self._reports_of = np.zeros(0, dtype=np.int64)
        self._figures = SensorFigures()
        self._plots_repeated = 0
        # First and last time of each block of the table.
        self._times_s: list[float] = []
        # For all files or none: a dump with dates and times of day counts as one with dates.
        self._of_day = all(file.layout.time_form == "seconds-of-day" for file in files)
        self._unix_start_s = unix_start(options.date)
        work = folder / ".work"
        work.mkdir()
        self._size = sum(file.size for file in files)
        self._buckets = Buckets(work / "points", bucket_bits(self._size))
        self._plots = TimeSorter(work / "plots", PLOT_WORDS)
        self._reports = TimeSorter(work / "reports", REPORT_WORDS)
        self._namings = TimeSorter(work / "namings", NAMING_WORDS)
        self._work = work

    def _check_date(self, files: list[DumpFile], date: dt.date | None) -> None:
        """Reject a date other than that of the dump."""
        for file in files:
            if date is None or file.layout.time_form == "seconds-of-day":
                continue
            days = dates_of(self._first_times[file.layout.table.name])
            if days is not None and not days[0] <= date <= days[1]:
                own = " or ".join(dict.fromkeys(map(str, days)))
                msg = f"{file.path}: recording is dated {own}, expected {date}"
                raise LayoutError(msg)

    def run(self) -> dict[str, object]:
        """Run all passes; return the report."""
        self._read(fields.PLOTS, self._add_plots)
        self._accounts[0].check_some_accepted()
        self._read(fields.REPORTS, self._add_reports)
        self._read(fields.TRACKS, self._add_tracks)
        source_of_sensor, names = self._sensor_names()
        self._check_sensor(names)
        self._figures.reserve(len(names))
        namer = PlotNamer(source_of_sensor, self._options.profile.naming_tolerance_s)
        reports = len(self._reports)
        named = self._named(namer, source_of_sensor, names)
        start_s = self._unix_start_s if self._of_day else 0.0
        rows = write_table(
            self._folder / "measurements.parquet",
            self._with_progress(
                table_rows(prefetch(named, self._pool), self._reports.sorted()),
                len(self._plots) + reports,
            ),
            [f"{source}-{sensor}" for source, sensor in names],
            start_s,
        )
        chosen = self._chosen()
        written = self._write_tracks(chosen)
        self._work.rmdir()
        skeleton = sensors_toml(
            names, self._figures, reports, self._options.profile.multiradar_source
        )
        (self._folder / "sensors.toml").write_text(skeleton, encoding="utf-8")
        findings = Findings(
            accounts=self._accounts,
            written=written,
            naming=namer.counts,
            plots_repeated=self._plots_repeated,
            sensors_without_plots=self._figures.without_plots(
                names, self._options.profile.multiradar_source
            ),
            aircraft=len(self._aircraft),
            aircraft_not_chosen=0 if chosen is None else len(self._aircraft) - len(chosen),
            table_rows=rows,
            of_day=self._of_day,
            first_s=None if not self._times_s else self._times_s[0] + start_s,
            last_s=None if not self._times_s else self._times_s[-1] + start_s,
        )
        return report_json(self._folder / "report.json", findings, self._options)

    def _check_sensor(self, names: list[tuple[int, int]]) -> None:
        """Reject a selected sensor that is not in the dump."""
        only, found = self._options.sensor_only, sorted({sensor for _, sensor in names})
        if only is not None and only not in found:
            known = ", ".join(map(str, found))
            msg = f"--sensor-only: no rows from sensor {only}; sensors found: {known}"
            raise LayoutError(msg)

    def close(self) -> None:
        """Close the working files."""
        self._buckets.close()
        for sorter in (self._plots, self._reports, self._namings):
            sorter.close()

    def _read(self, table: Table, add: Callable[[Rows], None]) -> None:
        file = self._files.get(table.name)
        if file is None:
            return
        account = Account(file.path.name, file.size, table.name)
        self._accounts.append(account)
        moved_s = self._unix_start_s
        if self._of_day or file.layout.time_form != "seconds-of-day":
            moved_s = 0.0
        for rows in read_rows(
            file.path,
            file.layout,
            pool=self._pool,
            account=account,
            rejects=self._rejects,
            progress=self._progress,
            clock=self._clocks[table.name],
        ):
            time = rows.number(fields.TIME)
            time += moved_s
            if len(rows):
                account.add_time(float(time.max()) + (self._unix_start_s if self._of_day else 0.0))
            add(rows)

    def _sensor_numbers(self, rows: Rows) -> NDArray[np.int64]:
        source, sensor = rows.integer(fields.SOURCE), rows.integer(fields.SENSOR)
        return self._sensors.number((source << _SENSOR_BITS) | sensor)

    def _add_plots(self, rows: Rows) -> None:
        records = np.empty((len(rows), PLOT_WORDS), dtype=np.int64)
        bits = records.view(np.float64)
        for word, role in enumerate(
            (fields.TIME, fields.RANGE, fields.AZIMUTH, fields.LATITUDE, fields.LONGITUDE,
             fields.HEIGHT)
        ):  # fmt: skip
            bits[:, word] = rows.number(role)
        records[:, 6] = pack_identity(
            self._sensor_numbers(rows), rows.integer(fields.PLOT), rows.integer(fields.CODE)
        )
        self._plots.add(records)

    def _add_reports(self, rows: Rows) -> None:
        aircraft = rows.integer(fields.GLOBAL)
        columns = [
            rows.number(role)
            for role in (fields.TIME, fields.LATITUDE, fields.LONGITUDE, fields.HEIGHT)
        ]
        records = np.empty((len(rows), REPORT_WORDS), dtype=np.int64)
        for word, column in enumerate(columns):
            records.view(np.float64)[:, word] = column
        records[:, 4] = rows.integer(fields.ADDRESS)
        records[:, 5] = aircraft
        self._reports.add(records)
        numbers = self._aircraft.number(aircraft)
        counts = np.bincount(numbers, minlength=len(self._reports_of))
        counts[: len(self._reports_of)] += self._reports_of
        self._reports_of = counts
        if "ads" in self._options.kinds:
            self._buckets.add(points(columns, pack_track(aircraft, 0)))

    def _add_tracks(self, rows: Rows) -> None:
        aircraft = rows.integer(fields.GLOBAL)
        self._aircraft.number(aircraft)
        source, sensor = rows.integer(fields.SOURCE), rows.integer(fields.SENSOR)
        multiradar = source == self._options.profile.multiradar_source
        plot = rows.integer(fields.PLOT)
        names_plot = (plot > 0) & ~multiradar
        namings = np.empty((int(names_plot.sum()), NAMING_WORDS), dtype=np.int64)
        namings.view(np.float64)[:, 0] = rows.number(fields.TIME)[names_plot]
        identity = pack_identity(self._sensor_numbers(rows), plot, np.full(len(plot), -1))
        namings[:, 1] = identity[names_plot]
        namings[:, 2] = aircraft[names_plot]
        self._namings.add(namings)
        wanted = np.where(
            multiradar, "multiradar" in self._options.kinds, "monoradar" in self._options.kinds
        )
        if self._options.sensor_only is not None:
            wanted &= multiradar | (sensor == self._options.sensor_only)
        file = monoradar_file(self._sources.number(source))
        columns = [
            rows.number(role)
            for role in (fields.TIME, fields.LATITUDE, fields.LONGITUDE, fields.HEIGHT)
        ]
        records = points(columns, pack_track(aircraft, file))
        self._buckets.add(records if wanted.all() else records[wanted])

    def _sensor_names(self) -> tuple[NDArray[np.int64], list[tuple[int, int]]]:
        """Return the number of the source of each sensor, and its names in the dump."""
        keys = self._sensors.keys()
        source = keys >> _SENSOR_BITS
        sensor = keys & ((1 << _SENSOR_BITS) - 1)
        names = list(zip(source.tolist(), sensor.tolist(), strict=True))
        return self._sources.number(source), names

    def _named(
        self,
        namer: PlotNamer,
        source_of_sensor: NDArray[np.int64],
        names: list[tuple[int, int]],
    ) -> Iterator[NamedPlots]:
        """Yield plots associated with tracks, and partition them by aircraft."""
        only = self._options.sensor_only
        file_of_sensor = plots_file(source_of_sensor)
        in_files = np.array([only in (None, sensor) for _, sensor in names], dtype=np.bool_)
        for named in namer.run(self._plots.sorted(), self._namings.sorted()):
            self._figures.add(named)
            self._plots_repeated += _repeated(named)
            if "plots" in self._options.kinds:
                plots = named.plots[named.pair_plot]
                sensor = sensor_of(plots[:, 6])
                keep = in_files[sensor]
                plots, sensor, aircraft = plots[keep], sensor[keep], named.pair_aircraft[keep]
                columns = [times(plots), *(decimal(plots, word) for word in (3, 4, 5))]
                track = pack_track(aircraft, file_of_sensor[sensor])
                self._buckets.add(points(columns, track))
            yield named

    def _with_progress(self, blocks: Iterator[Records], count: int) -> Iterator[Records]:
        """Yield blocks, reporting progress as if the dump were read once more."""
        for block in blocks:
            self._times_s += [times(block)[0], times(block)[-1]] if len(block) else []
            yield block
            self._progress(self._size * len(block) // count)

    def _write_tracks(self, chosen: NDArray[np.int64] | None) -> Written:
        self._buckets.close()
        names = TrackFileNames(tuple(self._sources.keys().tolist()))
        writer = TrackWriter(
            self._folder,
            names,
            self._options.track_measurements_min,
            self._unix_start_s if self._of_day else 0.0,
            chosen,
        )
        share = self._size // len(self._buckets.paths)
        written = writer.write(self._buckets, self._pool, lambda: self._progress(share))
        self._buckets.remove()
        return written

    def _chosen(self) -> NDArray[np.int64] | None:
        """Return the track numbers to write files for, in order; None for all."""
        least, most = self._options.ads_measurements_min, self._options.aircraft_max
        if least == 0 and most is None:
            return None
        aircraft = self._aircraft.keys()
        reports = np.zeros(len(aircraft), dtype=np.int64)
        reports[: len(self._reports_of)] = self._reports_of
        enough = reports >= least
        aircraft, reports = aircraft[enough], reports[enough]
        # The tracks with most ADS-B reports first; for equal counts the lower number.
        order = np.lexsort((aircraft, -reports))
        return np.sort(aircraft[order][:most])


def _repeated(named: NamedPlots) -> int:
    """Count plots that equal an earlier one in every field."""
    time = times(named.plots)
    same = np.concatenate([[False], time[1:] == time[:-1], [False]])
    candidates = named.plots[same[1:] | same[:-1]]
    if not len(candidates):
        return 0
    ordered = candidates[np.lexsort(candidates.T)]
    return int((ordered[1:] == ordered[:-1]).all(axis=1).sum())


def prefetch(items: Iterator[Item], pool: Executor) -> Iterator[Item]:
    """Yield the items, each computed in another thread while the previous one is in use.

    Parameters
    ----------
    items : iterator
        Must not be used elsewhere.
    pool : Executor
        Must have a free thread.

    Yields
    ------
    item
        In order; exceptions of the iterator are raised here.
    """
    waiting = pool.submit(next, items, None)
    while (item := waiting.result()) is not None:
        waiting = pool.submit(next, items, None)
        yield item
