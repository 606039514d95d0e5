"""Detection of the layout of a dump file from its first lines and the profile."""

import codecs
import dataclasses
import re
from collections import Counter
from pathlib import Path

import numpy as np

from multiradar_converters.errors import LayoutError
from multiradar_converters.vid import fields
from multiradar_converters.vid.fields import Table
from multiradar_converters.vid.profile import Profile
from multiradar_converters.vid.text.layout import (
    BLANK,
    COMMA,
    CR,
    LF,
    SEMICOLON,
    SEPARATORS,
    TAB,
    FileLayout,
    Form,
    TimeForm,
)
from multiradar_converters.vid.text.lines import RejectedError, Row, parse_line, split_columns
from multiradar_schemas.documents.contents import ZIP_ARCHIVE, packed_form

#: Bytes of a file from which its layout is detected.
HEAD_BYTES = 1 << 18

#: Number of places of a file from which its midnights are counted, and bytes read at each.
SAMPLES, SAMPLE_BYTES = 128, 2048

#: Number of lines from which the time format is detected.
_TRIAL_LINES = 200

_PAIR = re.compile(rb"[^=\s;]+=")
_WORD_BREAKS = re.compile(r"[\s;,=]+")

#: Maximum lines before the header.
_LEADING_LINES_MAX = 10

_WIDE_MARKS = (
    (codecs.BOM_UTF32_LE, "UTF-32"),
    (codecs.BOM_UTF32_BE, "UTF-32"),
    (codecs.BOM_UTF16_LE, "UTF-16"),
    (codecs.BOM_UTF16_BE, "UTF-16"),
)


def detect(path: Path, table: Table, profile: Profile) -> FileLayout:
    """Detect the layout of a file.

    Parameters
    ----------
    path : Path
        The file.
    table : Table
        Which of the three it is.
    profile : Profile
        Profile of the dump.

    Returns
    -------
    FileLayout
        The layout; its time format is None without readable rows.

    Raises
    ------
    LayoutError
        The file is empty, not a text of single bytes, or lacks columns.
    """
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    _check_unpacked(path, head)
    _check_text(path, head)
    mark = len(codecs.BOM_UTF8) if head.startswith(codecs.BOM_UTF8) else 0
    terminator = LF if b"\n" in head or b"\r" not in head else CR
    start, line = _header_line(head, mark, terminator, profile.column_names(table))
    if not line:
        msg = f"{path.name}: the file is empty; expected a header line, or lines of name=value"
        raise LayoutError(msg)
    form: Form = "pairs" if _PAIR.match(line.lstrip()) else "columns"
    if profile.form != "auto":
        form = profile.form
    encoding = _encoding(head, profile)
    names = profile.column_names(table)
    header = line if form == "columns" and table.name not in profile.headers else None
    headed = () if table.name in profile.headers else names
    separator = _separator(line, headed, encoding, profile)
    columns: tuple[int, ...] = ()
    if form == "columns":
        given = profile.headers.get(table.name) or _header_names(line, separator, encoding)
        columns = _columns(path, table, names, given)
    keys = [(name.encode(encoding, "replace"), role) for name, role in _named(table, names)]
    layout = FileLayout(
        table=table,
        names=tuple(
            name or fields.NAMES[role] for name, role in zip(names, table.roles, strict=True)
        ),
        form=form,
        terminator=terminator,
        separator=separator,
        columns=columns,
        keys=tuple(key for key, _ in keys),
        key_roles=tuple(role for _, role in keys),
        header=header,
        data_offset=mark if header is None else _after(head, start + len(line), terminator),
        time_form=None,
        encoding=encoding,
        low=fields.LOW,
        high=fields.HIGH,
        scale=profile.units.scale(),
    )
    return with_times(layout, _time_form(layout, head) if profile.time == "auto" else profile.time)


def _check_unpacked(path: Path, head: bytes) -> None:
    found = packed_form(head)
    if head.startswith(b"PAR1"):
        found = "a Parquet table, which is already converted"
    elif found == ZIP_ARCHIVE:
        found += " or a spreadsheet; extract it, or export the table as text"
    elif found is not None:
        found += "; extract it"
    if found is not None:
        raise LayoutError(f"{path.name}: expected text, found {found}")


def _check_text(path: Path, head: bytes) -> None:
    found = next((name for mark, name in _WIDE_MARKS if head.startswith(mark)), None)
    even, odd = head[::2].count(0), head[1::2].count(0)
    many = len(head) // 8
    if found is None and len(head) >= 4 and max(even, odd) > 2 * many:
        found = "UTF-16" if min(even, odd) <= many else "mostly NUL bytes"
    if found is not None:
        msg = f"{path.name}: expected ASCII, UTF-8 or Windows-1251 text, found {found}"
        raise LayoutError(msg)


def _first_line(head: bytes, start: int, terminator: int) -> tuple[int, bytes]:
    """Return the start of the first non-blank line, and the line without its end."""
    end_mark = bytes((terminator,))
    while start < len(head):
        end = head.find(end_mark, start)
        end = len(head) if end < 0 else end
        line = head[start:end].rstrip(b"\r")
        if line.strip():
            return start, line
        start = end + 1
    return start, b""


def _header_line(
    head: bytes, start: int, terminator: int, names: tuple[str, ...]
) -> tuple[int, bytes]:
    """Return the first line that names the columns, else the first line."""
    first = start, line = _first_line(head, start, terminator)
    wanted = {name.casefold() for name in names if name}
    for _ in range(_LEADING_LINES_MAX):
        if not line:
            break
        text = line.decode("utf-8", errors="replace").casefold()
        if wanted <= set(_WORD_BREAKS.split(text)):
            return start, line
        start, line = _first_line(head, start + len(line), terminator)
    return first


def _after(head: bytes, place: int, terminator: int) -> int:
    end = head.find(bytes((terminator,)), place)
    return len(head) if end < 0 else end + 1


def _encoding(head: bytes, profile: Profile) -> str:
    if profile.encoding != "auto":
        return profile.encoding
    decoder = codecs.getincrementaldecoder("utf-8")()
    try:
        # Not final: the head may end within a character.
        decoder.decode(head, final=False)
    except UnicodeDecodeError:
        return "windows-1251"
    return "utf-8"


def _separator(line: bytes, names: tuple[str, ...], encoding: str, profile: Profile) -> int:
    """Return the given separator, or the first with which the header has all names."""
    if profile.separator != "auto":
        return SEPARATORS[profile.separator]
    if not names:
        return next((mark for mark in (SEMICOLON, TAB, COMMA) if mark in line), BLANK)
    for separator in (SEMICOLON, TAB, COMMA):
        found = {name.casefold() for name in _header_names(line, separator, encoding)}
        if {name.casefold() for name in names if name} <= found:
            return separator
    return BLANK


def _header_names(line: bytes, separator: int, encoding: str) -> list[str]:
    found = split_columns(line, separator)
    # Spreadsheets quote names.
    return [name.strip(b'"').decode(encoding, errors="backslashreplace") for name in found]


def _named(table: Table, names: tuple[str, ...]) -> list[tuple[str, int]]:
    return [(name, role) for name, role in zip(names, table.roles, strict=True) if name]


def _columns(path: Path, table: Table, names: tuple[str, ...], given: list[str]) -> tuple[int, ...]:
    expected = dict(_named(table, names))
    # Without an exact match, case is ignored.
    folded = {name.casefold(): name for name in expected if name not in given}
    given = [name if name in expected else folded.get(name.casefold(), name) for name in given]
    missing = [name for name in expected if name not in given]
    if missing and len(missing) == len(expected) and any(map(_is_number, given)):
        msg = (
            f"{path.name}: the header line is missing: the first line contains values, not names "
            f"({_shown(given)}); add a line with the names of the columns, or name them in "
            "[headers] of a profile"
        )
        raise LayoutError(msg)
    if missing:
        msg = (
            f"{path.name}: missing column{'s' * (len(missing) > 1)} {', '.join(missing)}; expected "
            f"{', '.join(expected)}, found {_shown(given)}"
        )
        raise LayoutError(msg)
    twice = [name for name in expected if given.count(name) > 1]
    if twice:
        msg = f"{path.name}: the header repeats {', '.join(twice)}"
        raise LayoutError(msg)
    return tuple(expected.get(name, fields.IGNORED) for name in given)


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _shown(names: list[str]) -> str:
    """Return the first names for a message, without control characters."""
    text = ", ".join(names[:20])[:100]
    shown = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
    return shown if len(names) <= 20 and len(", ".join(names)) <= 100 else f"{shown} …"


def with_times(layout: FileLayout, form: TimeForm | None) -> FileLayout:
    """Return a layout with the time format and bounds of times; None if not known yet."""
    low, high = list(fields.LOW), list(fields.HIGH)
    if form == "seconds-of-day":
        high[fields.TIME] = fields.TIME_OF_DAY_MAX_S
    elif form == "unix":
        low[fields.TIME] = fields.UNIX_TIME_MIN_S
    return dataclasses.replace(layout, time_form=form, low=tuple(low), high=tuple(high))


def first_times(path: Path, layout: FileLayout) -> list[float]:
    """Return the times of the first readable rows of a file.

    Returns
    -------
    list of float
        Times of the file, s.
    """
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    rows = (_row(line, layout) for line in _trial_lines(layout, head))
    return [row.numbers[fields.TIME] for row in rows if row is not None]


def sampled_times(path: Path, layout: FileLayout) -> list[float]:
    """Return the times of readable rows at places all over a file, in file order.

    Returns
    -------
    list of float
        Times of the file, s: of all rows of a small file; of a large one, of the first and last
        rows and of those at places between them.
    """
    begins, octets = [layout.data_offset], -1
    last = path.stat().st_size - SAMPLE_BYTES
    if last - layout.data_offset > SAMPLES * SAMPLE_BYTES:
        begins = np.linspace(layout.data_offset, last, SAMPLES).astype(int).tolist()
        octets = SAMPLE_BYTES
    lines: list[bytes] = []
    with path.open("rb") as file:
        for number, begin in enumerate(begins):
            file.seek(begin)
            parts = file.read(octets).split(bytes((layout.terminator,)))
            # The first and last line of a sample may be incomplete.
            lines += parts[int(number > 0) : len(parts) - int(number < len(begins) - 1)]
    rows = (_row(line, layout) for line in lines)
    return [row.numbers[fields.TIME] for row in rows if row is not None]


def _time_form(layout: FileLayout, head: bytes) -> TimeForm | None:
    """Return the time format of the majority of the first rows; None without rows."""
    iso = dataclasses.replace(layout, time_form="iso8601")
    found: Counter[TimeForm] = Counter()
    for line in _trial_lines(layout, head):
        row = _row(line, layout)
        if row is not None:
            late = row.numbers[fields.TIME] >= fields.UNIX_TIME_MIN_S
            found["unix" if late else "seconds-of-day"] += 1
        elif _row(line, iso) is not None:
            found["iso8601"] += 1
    return found.most_common(1)[0][0] if found else None


def _trial_lines(layout: FileLayout, head: bytes) -> list[bytes]:
    lines = head[layout.data_offset :].split(bytes((layout.terminator,)), _TRIAL_LINES)
    return lines[:_TRIAL_LINES]


def _row(line: bytes, layout: FileLayout) -> Row | None:
    try:
        row = parse_line(line, layout)
    except RejectedError:
        return None
    return row if isinstance(row, Row) else None
