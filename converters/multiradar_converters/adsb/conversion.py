"""Conversion of ADS-B trajectories: files in, one folder out."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TextIO

import numpy as np

from multiradar_converters.adsb import table
from multiradar_converters.adsb.consistency import ConsistencyCheck
from multiradar_converters.adsb.day_times import DayClock, day_clocks
from multiradar_converters.adsb.options import Options
from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.batches import Batch, RejectedRecord
from multiradar_converters.adsb.reading.files import Source, open_source
from multiradar_converters.adsb.report import FileAccount, report_json
from multiradar_converters.adsb.sensors import sensors_toml
from multiradar_converters.errors import LayoutError
from multiradar_converters.output_folder import OutputFolder
from multiradar_converters.vid.spool import TimeSorter
from multiradar_converters.vid.text.times import dates_of, unix_start
from multiradar_schemas.reject import Reject

_UNREADABLE = {"code": roles.CODE, "callsign": roles.CALLSIGN}


def convert(
    files: Sequence[Path], out: Path, options: Options, advance: Callable[[int], None]
) -> dict[str, object]:
    """Convert trajectories.

    Parameters
    ----------
    files : sequence of Path
        Files; all with dates or all without.
    out : Path
        The folder to create.
    options : Options
        Options.
    advance : callable
        Called with the number of bytes read, from time to time.

    Returns
    -------
    dict
        Content of `report.json`.

    Raises
    ------
    OutputFolderExistsError
        `out` exists.
    LayoutError
        A file cannot be read, or none of its records is accepted.
    AccountingError
        A record is unaccounted for.
    """
    accounts: list[FileAccount] = []
    with OutputFolder(out) as folder:
        sorter = TimeSorter(folder.path / ".sorting", table.RECORD_WORDS)
        try:
            forms: set[bool] = set()
            with (folder.path / "rejects.ndjson").open(
                "w", encoding="utf-8", newline="\n"
            ) as rejects:
                offset_s = options.utc_offset_h * 3600.0
                for path, clock in zip(files, day_clocks(files, offset_s), strict=True):
                    source = open_source(path, advance, offset_s)
                    forms.add(clock is not None)
                    _check_dates(path, forms)
                    accounts.append(_read(source, clock, options, sorter, rejects))
            _check_some_accepted(accounts)
            start_s = unix_start(options.date) if forms == {True} else 0.0
            quantities = {name for account in accounts for name in account.quantities}
            path = folder.path / "measurements.parquet"
            written = table.write(path, sorter.sorted(), start_s, quantities)
        finally:
            sorter.close()
        (folder.path / "sensors.toml").write_text(sensors_toml(written), encoding="utf-8")
        report = report_json(folder.path / "report.json", accounts, written, options)
        folder.finish()
    return report


def _check_dates(path: Path, forms: set[bool]) -> None:
    if len(forms) > 1:
        msg = f"{path}: some files have dates and some do not; convert them separately"
        raise LayoutError(msg)


def _read(
    source: Source,
    clock: DayClock | None,
    options: Options,
    sorter: TimeSorter,
    rejects: TextIO,
) -> FileAccount:
    account = FileAccount(source.file, source.form, source.layout.figures())
    if clock is not None:
        account.first_day, account.note = clock.first_day, clock.note
    check = ConsistencyCheck(source.file)
    for batch in source.batches:
        if clock is not None:
            clock.push(batch)
        elif not account.accepted:
            _check_date(source.file, batch, options)
        valid = check.push(batch)
        for name, role in _UNREADABLE.items():
            word = batch.words[role - roles.FIRST_WORD]
            account.unreadable[name] += int((word[valid] == roles.UNREADABLE).sum())
        numbers, sigma_m = batch.numbers[:, valid], batch.sigma_of(valid)
        account.quantities |= table.quantities_of(numbers, sigma_m)
        sorter.add(table.records_of(numbers, batch.words[:, valid], sigma_m))
        account.read += batch.found
        account.duplicate += batch.duplicate
        if source.is_feed:
            account.without_position = (account.without_position or 0) + batch.other
            account.old_registers += batch.old
        account.accepted += int(valid.sum())
        for rejected in sorted(batch.rejected, key=lambda each: each.place):
            _reject(rejected, source, account, rejects)
    account.check()
    account.size, account.text_bytes = source.unpacked.packed_bytes, source.unpacked.text_bytes
    account.blank = source.lines.blank if source.lines is not None else 0
    account.repeated, account.stale = check.repeated, check.stale
    account.backwards, account.jumps = check.backwards, check.jumps
    return account


def _check_date(file: str, batch: Batch, options: Options) -> None:
    """Compare the date in the options with that of the first records."""
    dates = dates_of(np.sort(batch.numbers[roles.TIME]).tolist()[:1])
    if options.date is None or dates is None or options.date in dates:
        return
    msg = (
        f"{file}: the file already contains the date {dates[0]}, not {options.date}; omit "
        "--date or specify that date"
    )
    raise LayoutError(msg)


def _reject(
    rejected: RejectedRecord, source: Source, account: FileAccount, rejects: TextIO
) -> None:
    by_line = source.lines is not None
    record = Reject(
        file=source.file,
        line=rejected.place if by_line else None,
        offset=None if by_line else rejected.place,
        reason=rejected.reason,
        code=rejected.code,
        raw=rejected.raw.decode("utf-8", "backslashreplace"),
    )
    rejects.write(record.model_dump_json(exclude_none=True) + "\n")
    account.rejected[rejected.code] += 1
    place = f"{'line' if by_line else 'byte'} {rejected.place}"
    account.examples.setdefault(rejected.code, f"{place}: {rejected.reason}")


def _check_some_accepted(accounts: list[FileAccount]) -> None:
    if any(account.accepted for account in accounts):
        return
    for account in accounts:
        if account.rejected:
            code, count = account.rejected.most_common(1)[0]
            msg = (
                f"{account.file}: none of {account.rejected.total()} records were accepted; "
                f"{count} were rejected as {code}, the first at {account.examples[code]}"
            )
            raise LayoutError(msg)
