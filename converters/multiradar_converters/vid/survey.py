"""The files of a dump and their layouts."""

import dataclasses
import datetime as dt
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from multiradar_converters.errors import LayoutError
from multiradar_converters.vid.fields import PLOTS, TABLES
from multiradar_converters.vid.options import Options
from multiradar_converters.vid.profile import Profile
from multiradar_converters.vid.text.detection import (
    detect,
    first_times,
    sampled_times,
    with_times,
)
from multiradar_converters.vid.text.layout import FileLayout, TimeForm
from multiradar_converters.vid.text.times import (
    TimeUnwrapper,
    agreed_start,
    first_days,
    span,
)
from multiradar_schemas.documents.contents import DUMP, content, no_such

_WANTED = "a folder with the text files of a dump, such as plots.txt"


@dataclass(frozen=True)
class DumpFile:
    """A file of the dump."""

    path: Path
    size: int
    layout: FileLayout


def survey(dump: Path, options: Options) -> list[DumpFile]:
    """Find the files of a dump and detect their layouts.

    Returns
    -------
    list of DumpFile
        In the order of reading.

    Raises
    ------
    LayoutError
        The folder or a file is missing, or does not match its layout.
    """
    if not dump.is_dir():
        raise LayoutError(no_such(dump, _WANTED))
    files = []
    for table in TABLES:
        path = dump / options.profile.files.of(table)
        if not path.exists():
            if options.allow_missing and table is not PLOTS:
                continue
            raise LayoutError(_missing(dump, path, options.profile, optional=table is not PLOTS))
        if not path.is_file():
            msg = f"{path}: expected a file, was a {'folder' if path.is_dir() else 'special file'}"
            raise LayoutError(msg)
        files.append(_file(path, detect(path, table, options.profile)))
    return _with_times(dump, files, options.date)


def clocks(files: Sequence[DumpFile]) -> dict[str, TimeUnwrapper]:
    """Return the conversion of the times of each file of a dump, by the name of its table.

    Times of day do not contain the day on which a file starts: the one on which the files overlap.
    """
    starts, spans_s = [], []
    for file in files:
        form = file.layout.time_form
        starts.append(agreed_start(first_times(file.path, file.layout), form))
        sampled = sampled_times(file.path, file.layout) if form == "seconds-of-day" else []
        spans_s.append(span(sampled, form, starts[-1]))
    return {
        file.layout.table.name: TimeUnwrapper(file.layout.time_form, start=start_s, day=day)
        for file, start_s, day in zip(files, starts, first_days(spans_s), strict=True)
    }


def _missing(dump: Path, path: Path, profile: Profile, *, optional: bool) -> str:
    found = content(dump)
    if found not in (None, DUMP):
        return f"{dump}: expected a dump, found {found}"
    hint = "; use --allow-missing to convert without it" if optional else ""
    packed = path.with_name(f"{path.name}.gz")
    inside = [one.parent for one in sorted(dump.glob(f"*/{path.name}"))[:1]]
    if packed.exists():
        hint = f"; {packed.name} exists: decompress it first"
    elif inside:
        hint = f"; specify the folder {inside[0]}"
    elif not any((dump / profile.files.of(table)).exists() for table in TABLES):
        return no_such(dump, _WANTED)
    return f"{dump}: missing file {path.name}{hint}"


def _file(path: Path, layout: FileLayout) -> DumpFile:
    return DumpFile(path, path.stat().st_size, layout)


def _with_times(dump: Path, files: list[DumpFile], date: dt.date | None) -> list[DumpFile]:
    """Compare the forms of times; a file without rows gets that of the others."""
    forms: set[TimeForm] = {file.layout.time_form for file in files if file.layout.time_form}
    if "seconds-of-day" in forms and len(forms) > 1 and date is None:
        msg = (
            f"{dump}: some files have times of day and others have dates; specify the date of "
            f"the former with --date"
        )
        raise LayoutError(msg)
    common: TimeForm = min(forms, default="seconds-of-day")
    return [
        file
        if file.layout.time_form
        else dataclasses.replace(file, layout=with_times(file.layout, common))
        for file in files
    ]


def dump_bytes(dump: Path, options: Options) -> int:
    """Return the total size of the existing files of a dump, bytes."""
    paths = (dump / options.profile.files.of(table) for table in TABLES)
    return sum(path.stat().st_size for path in paths if path.is_file())
