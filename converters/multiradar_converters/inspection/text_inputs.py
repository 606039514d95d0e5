"""Figures of text dumps and of ADS-B trajectories, block by block with bounded memory."""

import os
from collections import Counter
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np

from multiradar_converters.adsb.consistency import ConsistencyCheck
from multiradar_converters.adsb.day_times import DayClock
from multiradar_converters.adsb.reading import roles
from multiradar_converters.adsb.reading.files import open_source
from multiradar_converters.adsb.reading.plain import KINDS
from multiradar_converters.adsb.table import reported_data
from multiradar_converters.aircraft_data.quantities import without
from multiradar_converters.distinct import distinct
from multiradar_converters.inspection.reports import Integers, Numbers, Reports
from multiradar_converters.inspection.survey import FileSurvey, Survey
from multiradar_converters.vid import fields
from multiradar_converters.vid.accounting import Account, RejectsFile
from multiradar_converters.vid.options import Options
from multiradar_converters.vid.survey import DumpFile, clocks
from multiradar_converters.vid.survey import survey as survey_dump
from multiradar_converters.vid.table import ADSB_ID
from multiradar_converters.vid.text.reading import read_rows
from multiradar_converters.vid.text.time_filter import Rows

_SENSOR_BITS = 31


def inspect_dump(folder: Path, survey: Survey, advance: Callable[[int], None]) -> None:
    """Add a text dump to a survey.

    Parameters
    ----------
    folder : Path
        Folder with its files; only the one of plots is necessary.
    survey : Survey
        Extended.
    advance : callable
        Called with bytes read.

    Raises
    ------
    LayoutError
        A file is missing or does not match its layout.
    """
    options = Options(allow_missing=True)
    with ThreadPoolExecutor(options.threads) as pool, RejectsFile(Path(os.devnull)) as rejects:
        files = survey_dump(folder, options)
        times = clocks(files)
        for file in files:
            account = Account(file.path.name, file.size, file.layout.table.name)
            for rows in read_rows(
                file.path,
                file.layout,
                pool=pool,
                account=account,
                rejects=rejects,
                progress=advance,
                clock=times[file.layout.table.name],
            ):
                _add_rows(rows, file, survey, options)
            survey.files.append(_of_account(account))


def _of_account(account: Account) -> FileSurvey:
    rejected = account.rejected.total()
    reasons = Counter[tuple[str, str]]()
    for code, count in account.rejected.items():
        example = account.examples[code]
        reasons[str(code), f"the first in line {example.line}: {example.reason}"] = count
    return FileSurvey(
        file=account.file,
        form=f"text: {account.table}",
        size=account.size,
        read=account.accepted + rejected,
        rejected=rejected,
        reasons=reasons,
    )


def _add_rows(rows: Rows, file: DumpFile, survey: Survey, options: Options) -> None:
    if file.layout.table is fields.REPORTS:
        numbers = {
            "latitude_deg": rows.number(fields.LATITUDE),
            "longitude_deg": rows.number(fields.LONGITUDE),
        }
        _add(survey, (ADSB_ID, "adsb"), _of_rows(rows, numbers, rows.integer(fields.ADDRESS)))
        return
    source, sensor = rows.integer(fields.SOURCE), rows.integer(fields.SENSOR)
    if file.layout.table is not fields.PLOTS:
        survey.system_tracks += int((source == options.profile.multiradar_source).sum())
        return
    names = ("range_m", "azimuth_deg", "latitude_deg", "longitude_deg")
    places = (fields.RANGE, fields.AZIMUTH, fields.LATITUDE, fields.LONGITUDE)
    numbers = {name: rows.number(role) for name, role in zip(names, places, strict=True)}
    reports = _of_rows(rows, numbers, code=rows.integer(fields.CODE))
    pairs = (source << _SENSOR_BITS) | sensor
    for pair in distinct(pairs).tolist():
        name = f"{pair >> _SENSOR_BITS}-{pair & ((1 << _SENSOR_BITS) - 1)}"
        _add(survey, (name, "radar"), reports.select(pairs == pair))


def _of_rows(
    rows: Rows,
    numbers: dict[str, Numbers],
    address: Integers | None = None,
    code: Integers | None = None,
) -> Reports:
    count = len(rows)
    nothing, none = np.full(count, np.nan), np.full(count, -1)
    return Reports(
        time_s=rows.number(fields.TIME),
        range_m=numbers.get("range_m", nothing),
        azimuth_deg=numbers.get("azimuth_deg", nothing),
        latitude_deg=numbers["latitude_deg"],
        longitude_deg=numbers["longitude_deg"],
        height_m=rows.number(fields.HEIGHT),
        code=none if code is None else code,
        address=none if address is None else address,
        on_ground=np.zeros(count, dtype=np.bool_),
        aircraft_data=without(count),
        dropped=np.zeros(count, dtype=np.int64),
    )


def _add(survey: Survey, key: tuple[str, str], reports: Reports) -> None:
    figures = survey.sensor(key)
    figures.reports += len(reports)
    figures.add_times(reports.time_s)
    figures.add(reports)


def inspect_adsb(
    path: Path, survey: Survey, advance: Callable[[int], None], clock: DayClock | None
) -> None:
    """Add a file of ADS-B trajectories to a survey.

    Parameters
    ----------
    path : Path
        The file.
    survey : Survey
        Extended.
    advance : callable
        Called with bytes read.
    clock : DayClock or None
        Days of its times, if they have no date.

    Raises
    ------
    LayoutError
        The file cannot be read, or its form is unknown.
    """
    source = open_source(path, advance)
    account = FileSurvey(source.file, f"trajectories: {source.form}", 0)
    survey.files.append(account)
    check = ConsistencyCheck(source.file)
    for batch in source.batches:
        if clock is not None:
            clock.push(batch)
        valid = check.push(batch)
        account.read += batch.found
        account.duplicates += batch.duplicate
        account.rejected += len(batch.rejected)
        for rejected in batch.rejected:
            account.reasons[str(rejected.code), ""] += 1
        words = {
            name: batch.words[role - roles.FIRST_WORD][valid]
            for name, role in (
                ("address", roles.ADDRESS),
                ("code", roles.CODE),
                ("ground", roles.GROUND),
                ("kind", roles.KIND),
            )
        }
        numbers = batch.numbers[:, valid]
        nothing = np.full(numbers.shape[1], np.nan)
        height = numbers[roles.HEIGHT]
        kind = np.maximum(words["kind"], 0)
        height_m = np.where(np.isnan(height), numbers[roles.GEOMETRIC], height)
        data, dropped = reported_data(numbers, height_m, kind)
        reports = Reports(
            time_s=numbers[roles.TIME],
            range_m=nothing,
            azimuth_deg=nothing,
            latitude_deg=numbers[roles.LATITUDE],
            longitude_deg=numbers[roles.LONGITUDE],
            height_m=height_m,
            code=words["code"],
            address=words["address"],
            on_ground=words["ground"] == 1,
            aircraft_data=data,
            dropped=dropped,
        )
        for number in distinct(kind).tolist():
            _add(survey, (KINDS[number], KINDS[number]), reports.select(kind == number))
    account.size = source.unpacked.packed_bytes
