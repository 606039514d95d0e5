"""The conversion of a dump: four passes, each in bounded memory, into a folder that is complete.

1. plots are read and sorted by time on disk;
2. ADS-B reports likewise, and dealt to their aircraft;
3. rows of tracks are dealt to their aircraft, and those that name a plot sorted by time;
4. plots, now named, and reports go to the table, the plots to the aircraft that name them.

Then the points dealt to each aircraft are sorted and written, a bucket of aircraft at a time.
"""

import datetime as dt
import errno
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from multiradar_converters.errors import ConversionError, LayoutError
from multiradar_converters.output_folder import OutputFolder
from multiradar_converters.vid import fields
from multiradar_converters.vid.accounting import Account, RejectsFile
from multiradar_converters.vid.ahead import ahead
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
from multiradar_converters.vid.survey import DumpFile, survey
from multiradar_converters.vid.table import table_rows, write_table
from multiradar_converters.vid.text.detection import first_times
from multiradar_converters.vid.text.reading import Progress, read_rows
from multiradar_converters.vid.text.sieve import Rows
from multiradar_converters.vid.times import (
    Clockwork,
    agreed_start,
    agreeing,
    begins_before_midnight,
    dates_of,
    unix_start,
)
from multiradar_converters.vid.track_files import (
    TrackFileNames,
    TrackWriter,
    Written,
    bucket_bits,
    monoradar_file,
    plots_file,
)

#: How often each byte of a dump counts as progress.
PASSES = 3

# What the system says when what is written does not fit or cannot be stored.
_NO_ROOM = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS})

_NUMBERS_MAX = 1 << 31
_SENSOR_BITS = 31


def convert(
    dump: Path, out: Path, options: Options, progress: Progress = lambda _: None
) -> dict[str, object]:
    """Convert a dump into a new folder.

    Parameters
    ----------
    dump : Path
        Folder with the three text files.
    out : Path
        Folder to make; must not exist.
    options : Options
        The user's choices.
    progress : callable
        Told of bytes done; a byte counts `PASSES` times: when it is read, joined and written.

    Returns
    -------
    dict
        What `report.json` says.

    Raises
    ------
    OutputTakenError
        `out` exists; nothing was touched.
    LayoutError
        A file is missing or not laid out as expected; `out` does not exist.
    AccountingError
        A line or byte is unaccounted for; `out` does not exist.
    ConversionError
        There is no room for `out`; it does not exist.
    """
    try:
        return _converted(dump, out, options, progress)
    except OSError as error:
        if error.errno not in _NO_ROOM:
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
    """One run: what is known of the dump grows from pass to pass."""

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
        self._from_before_midnight = begins_before_midnight(
            time
            for file in files
            for time in agreeing(self._first_times[file.layout.table.name], file.layout.time_form)
        )
        self._check_date(files, options.date)
        self._sensors = Numbering("sensors", SENSORS_MAX)
        self._sources = Numbering("sources", SENSORS_MAX)
        self._aircraft = Numbering("aircraft", _NUMBERS_MAX)
        self._reports_of = np.zeros(0, dtype=np.int64)
        self._figures = SensorFigures()
        self._plots_repeated = 0
        # First and last time of each block of the table.
        self._times_s: list[float] = []
        # Of all files, or of none: a dump of dates and times of day is one of dates.
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
        """Refuse a date other than that of the dump."""
        for file in files:
            if date is None or file.layout.time_form == "seconds-of-day":
                continue
            days = dates_of(self._first_times[file.layout.table.name])
            if days is not None and not days[0] <= date <= days[1]:
                own = " or ".join(dict.fromkeys(map(str, days)))
                msg = f"{file.path}: expected a recording of {date}, was one of {own}"
                raise LayoutError(msg)

    def run(self) -> dict[str, object]:
        """Do all passes; return the report."""
        self._read(fields.PLOTS, self._take_plots)
        self._accounts[0].check_some_accepted()
        self._read(fields.REPORTS, self._take_reports)
        self._read(fields.TRACKS, self._take_tracks)
        source_of_sensor, names = self._sensor_names()
        self._check_sensor(names)
        self._figures.reserve(len(names))
        namer = PlotNamer(source_of_sensor, self._options.profile.naming_tolerance_s)
        reports = len(self._reports)
        named = self._named(namer, source_of_sensor, names)
        start_s = self._unix_start_s if self._of_day else 0.0
        rows = write_table(
            self._folder / "measurements.parquet",
            self._shown(
                table_rows(ahead(named, self._pool), self._reports.sorted()),
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
            aircraft=len(self._aircraft),
            aircraft_not_chosen=0 if chosen is None else len(self._aircraft) - len(chosen),
            table_rows=rows,
            of_day=self._of_day,
            first_s=None if not self._times_s else self._times_s[0] + start_s,
            last_s=None if not self._times_s else self._times_s[-1] + start_s,
        )
        return report_json(self._folder / "report.json", findings, self._options)

    def _check_sensor(self, names: list[tuple[int, int]]) -> None:
        """Refuse to write only the tracks of a sensor that is not in the dump."""
        only, found = self._options.sensor_only, sorted({sensor for _, sensor in names})
        if only is not None and only not in found:
            known = ", ".join(map(str, found))
            msg = f"--sensor-only: no row is of sensor {only}; found: {known}"
            raise LayoutError(msg)

    def close(self) -> None:
        """Close the working files, whatever has happened."""
        self._buckets.close()
        for sorter in (self._plots, self._reports, self._namings):
            sorter.close()

    def _read(self, table: Table, take: Callable[[Rows], None]) -> None:
        file = self._files.get(table.name)
        if file is None:
            return
        account = Account(file.path.name, file.size, table.name)
        self._accounts.append(account)
        clock = Clockwork(
            file.layout.time_form,
            start=agreed_start(self._first_times[table.name], file.layout.time_form),
            from_before_midnight=self._from_before_midnight,
        )
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
            clock=clock,
        ):
            time = rows.number(fields.TIME)
            time += moved_s
            if len(rows):
                account.see(float(time.max()) + (self._unix_start_s if self._of_day else 0.0))
            take(rows)

    def _sensor_numbers(self, rows: Rows) -> NDArray[np.int64]:
        source, sensor = rows.integer(fields.SOURCE), rows.integer(fields.SENSOR)
        return self._sensors.number((source << _SENSOR_BITS) | sensor)

    def _take_plots(self, rows: Rows) -> None:
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

    def _take_reports(self, rows: Rows) -> None:
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

    def _take_tracks(self, rows: Rows) -> None:
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
        """Return the number of the source of each sensor, and the dump's own names."""
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
        """Pass named plots on; deal them to the aircraft that name them on the way."""
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

    def _shown(self, blocks: Iterator[Records], count: int) -> Iterator[Records]:
        """Pass blocks on, telling of progress as if the dump were read once more."""
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
        """Return the track numbers to write files for, in order; None for all of them."""
        least, most = self._options.ads_measurements_min, self._options.aircraft_max
        if least == 0 and most is None:
            return None
        aircraft = self._aircraft.keys()
        reports = np.zeros(len(aircraft), dtype=np.int64)
        reports[: len(self._reports_of)] = self._reports_of
        enough = reports >= least
        aircraft, reports = aircraft[enough], reports[enough]
        # The largest ADS-B tracks first; of equal ones the lower number.
        order = np.lexsort((aircraft, -reports))
        return np.sort(aircraft[order][:most])


def _repeated(named: NamedPlots) -> int:
    """Count plots that equal one before in every field."""
    time = times(named.plots)
    same = np.concatenate([[False], time[1:] == time[:-1], [False]])
    candidates = named.plots[same[1:] | same[:-1]]
    if not len(candidates):
        return 0
    ordered = candidates[np.lexsort(candidates.T)]
    return int((ordered[1:] == ordered[:-1]).all(axis=1).sum())
