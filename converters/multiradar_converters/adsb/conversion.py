"""The conversion of trajectories: files in, one folder out."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TextIO

import numpy as np

from multiradar_converters.adsb import table
from multiradar_converters.adsb.judging import Judge
from multiradar_converters.adsb.options import Options
from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.batches import Batch, Refused
from multiradar_converters.adsb.reading.files import Source, open_source
from multiradar_converters.adsb.reading.time_forms import of_day
from multiradar_converters.adsb.report import FileAccount, report_json
from multiradar_converters.adsb.sensors import sensors_toml
from multiradar_converters.errors import LayoutError
from multiradar_converters.output_folder import OutputFolder
from multiradar_converters.vid.spool import TimeSorter
from multiradar_converters.vid.times import dates_of, unix_start
from multiradar_schemas.measurements.reject import Reject

_UNREADABLE = {"code": roles.CODE, "callsign": roles.CALLSIGN}


def convert(
    files: Sequence[Path], out: Path, options: Options, advance: Callable[[int], None]
) -> dict[str, object]:
    """Convert trajectories.

    Parameters
    ----------
    files : sequence of Path
        Files; all with dates, or all without.
    out : Path
        The folder to make.
    options : Options
        The user's choices.
    advance : callable
        Told the bytes that were read, from time to time.

    Returns
    -------
    dict
        What `report.json` says.

    Raises
    ------
    OutputTakenError
        `out` exists.
    LayoutError
        A file cannot be read, or none of its records can be taken.
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
                for path in files:
                    source = open_source(path, advance)
                    forms.add(of_day(source.layout.time))
                    _check_dates(path, forms)
                    accounts.append(_read(source, options, sorter, rejects))
            _check_some_accepted(accounts)
            start_s = unix_start(options.date) if forms == {True} else 0.0
            written = table.write(folder.path / "measurements.parquet", sorter.sorted(), start_s)
        finally:
            sorter.close()
        (folder.path / "sensors.toml").write_text(sensors_toml(written), encoding="utf-8")
        report = report_json(folder.path / "report.json", accounts, written, options)
        folder.finish()
    return report


def _check_dates(path: Path, forms: set[bool]) -> None:
    if len(forms) > 1:
        msg = f"{path}: expected all files with dates, or all without, was one of each"
        raise LayoutError(msg)


def _read(source: Source, options: Options, sorter: TimeSorter, rejects: TextIO) -> FileAccount:
    account = FileAccount(source.file, source.form, source.layout.figures())
    without_date = of_day(source.layout.time)
    judge = Judge(source.file, without_date)
    for batch in source.batches:
        if not (without_date or account.accepted):
            _check_date(source.file, batch, options)
        stands = judge.judge(batch)
        for name, role in _UNREADABLE.items():
            word = batch.words[role - roles.FIRST_WORD]
            account.unreadable[name] += int((word[stands] == roles.UNREADABLE).sum())
        sorter.add(table.records_of(batch.numbers[:, stands], batch.words[:, stands]))
        account.read += batch.found
        account.accepted += int(stands.sum())
        for refused in sorted(batch.refused, key=lambda each: each.place):
            _reject(refused, source, account, rejects)
    account.check()
    account.size, account.text_bytes = source.unpacked.packed_bytes, source.unpacked.text_bytes
    account.blank = source.lines.blank if source.lines is not None else 0
    account.repeated, account.stale = judge.repeated, judge.stale
    account.backwards, account.jumps = judge.backwards, judge.jumps
    return account


def _check_date(file: str, batch: Batch, options: Options) -> None:
    """Compare the date that the user tells with that of the first records."""
    told = dates_of(np.sort(batch.numbers[roles.TIME]).tolist()[:1])
    if options.date is None or told is None or options.date in told:
        return
    msg = f"{file}: expected no --date, or its own ({told[0]}), was {options.date}"
    raise LayoutError(msg)


def _reject(refused: Refused, source: Source, account: FileAccount, rejects: TextIO) -> None:
    by_line = source.lines is not None
    record = Reject(
        file=source.file,
        line=refused.place if by_line else None,
        offset=None if by_line else refused.place,
        reason=refused.reason,
        code=refused.code,
        raw=refused.raw.decode("utf-8", "backslashreplace"),
    )
    rejects.write(record.model_dump_json(exclude_none=True) + "\n")
    account.rejected[refused.code] += 1
    place = f"{'line' if by_line else 'byte'} {refused.place}"
    account.examples.setdefault(refused.code, f"{place}: {refused.reason}")


def _check_some_accepted(accounts: list[FileAccount]) -> None:
    if any(account.accepted for account in accounts):
        return
    for account in accounts:
        if account.rejected:
            code, count = account.rejected.most_common(1)[0]
            msg = (
                f"{account.file}: none of {account.rejected.total()} records can be taken; {count} "
                f"of them for {code}, the first at {account.examples[code]}"
            )
            raise LayoutError(msg)
