"""Line numbers of the keys of a TOML text, for error messages."""

import re
from collections.abc import Mapping

_PART = r"""(?:"[^"\\]*"|'[^']*'|[A-Za-z0-9_-]+)"""
_KEY = rf"{_PART}(?:\s*\.\s*{_PART})*"
_HEADER = re.compile(rf"\s*(\[\[?)\s*({_KEY})\s*\]\]?\s*(?:#.*)?$")
_ASSIGNMENT = re.compile(rf"\s*({_KEY})\s*=(.*)$", re.DOTALL)
_PARTS = re.compile(_PART)
# Brackets, quotes and comments within a value.
_MARKS = re.compile(r"\"\"\"|'''|\"(?:[^\"\\]|\\.)*\"|'[^']*'|[][{}]|#.*")

Path = tuple[int | str, ...]


def key_lines(text: str) -> dict[Path, int]:
    """Return the line of every key and table of a TOML text, counted from 1.

    Parameters
    ----------
    text : str
        A valid TOML text.

    Returns
    -------
    dict of tuple to int
        By path, such as `("sensor", 2, "bias", "range_gain")`. Keys within inline tables and lists
        are not included: `line_of` finds the key that contains them.
    """
    lines: dict[Path, int] = {}
    tables: dict[Path, int] = {}
    table: Path = ()
    held = _Held()
    for number, line in enumerate(text.splitlines(), start=1):
        if held.open:
            held.read(line)
        elif header := _HEADER.match(line):
            table = _opened(header[2], tables, many=header[1] == "[[")
            for length in range(1, len(table) + 1):
                lines.setdefault(table[:length], number)
        elif assignment := _ASSIGNMENT.match(line):
            path = table
            for part in _split(assignment[1]):
                path = (*path, part)
                lines.setdefault(path, number)
            held.read(assignment[2])
    return lines


def line_of(path: Path, lines: Mapping[Path, int]) -> int | None:
    """Return the line of a key, or of the nearest table or key around it; None at the top."""
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None


def _opened(name: str, tables: dict[Path, int], *, many: bool) -> Path:
    # An element of an array of tables is identified by its index; later headers refer to the last.
    path: Path = ()
    parts = _split(name)
    for index, part in enumerate(parts):
        path = (*path, part)
        last = index == len(parts) - 1
        if last and many:
            tables[path] = tables.get(path, -1) + 1
        if path in tables:
            path = (*path, tables[path])
    return path


def _split(key: str) -> list[str]:
    return [part.strip("\"'") for part in _PARTS.findall(key)]


class _Held:
    # Whether a value continues on the next line: within brackets or triple quotes.
    def __init__(self) -> None:
        self._depth = 0
        self._quotes = ""

    @property
    def open(self) -> bool:
        return self._depth > 0 or bool(self._quotes)

    def read(self, line: str) -> None:
        rest = line
        while True:
            if self._quotes:
                _, closed, rest = rest.partition(self._quotes)
                if not closed:
                    return
                self._quotes = ""
            mark = _MARKS.search(rest)
            if mark is None:
                return
            rest = rest[mark.end() :]
            self._update(mark[0])

    def _update(self, mark: str) -> None:
        if mark in {'"""', "'''"}:
            self._quotes = mark
        elif mark in {"[", "{"}:
            self._depth += 1
        elif mark in {"]", "}"}:
            self._depth -= 1
