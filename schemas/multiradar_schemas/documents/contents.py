"""Detects what a folder or file contains, for error messages about a wrong one."""

import json
import tomllib
from collections.abc import Collection
from pathlib import Path

JOURNAL = "the state of `serve`"
BACKUP = "the output of `backup`"
TRACKS = "the output of `track`"
MEASUREMENTS = ("the output of `convert`", "the output of `simulate`")
DUMP = "a dump; convert it first with `convert vid`"
SENSORS = "a sensors file"
SETTINGS = "a settings file"
SCENARIO = "a scenario"
PROFILE = "a layout of a dump"
#: Files that identify a folder, and its description; the first match counts.
_MARKS = (
    ("backup.json", BACKUP),
    ("biases_merged.parquet", "the output of `reprocess`"),
    ("tracks.parquet", TRACKS),
    ("truth.parquet", MEASUREMENTS[1]),
    ("system_tracks.parquet", "the output of `convert asterix`"),
    ("measurements.parquet", MEASUREMENTS[0]),
    ("plots.txt", DUMP),
    ("journal.sqlite", JOURNAL),
)

#: Columns that identify a table.
_COLUMNS = (
    ({"track_id", "position_sigma_m"}, TRACKS),
    ({"sensor_id", "kind", "range_m"}, MEASUREMENTS[0]),
    ({"sensor_id", "parameter", "estimate"}, "the biases of `track`"),
)
#: Tables of a TOML file, of which one identifies it.
_TABLES = (
    ({"duration_s", "aircraft", "traffic"}, SCENARIO),
    ({"sensor"}, SENSORS),
    ({"tracking", "server", "runtime", "journal", "zenoh", "http", "feeds"}, SETTINGS),
    ({"files", "columns", "units"}, PROFILE),
)
#: The first octets of a gzip file.
GZIP = b"\x1f\x8b"
ZIP_ARCHIVE = "a ZIP archive"
#: The first octets of packed files, and what they are.
PACKED = (
    (GZIP, "a gzip file"),
    (b"PK\x03\x04", ZIP_ARCHIVE),
    (b"BZh", "a bzip2 file"),
    (b"\xfd7zXZ", "an xz file"),
    (b"\x28\xb5\x2f\xfd", "a Zstandard file"),
    (b"7z\xbc\xaf", "a 7-Zip archive"),
)
#: The same for other files that are not text.
_OCTETS = ((b"PAR1", "Parquet"), (b"SQLite format 3", "an SQLite database"))
#: Larger texts are neither reports nor configurations, octets.
_TEXT_MAX = 1 << 20


def no_such(path: Path, wanted: str) -> str:
    """Return the error message for a file or folder that is not what a command needs.

    Parameters
    ----------
    path : Path
        What was given, or the file that should be in it.
    wanted : str
        What is needed, such as "the output of `track`".

    Returns
    -------
    str
        That it does not exist, or what it contains instead.
    """
    if path.is_file():
        return f"{path}: expected {wanted}, was {content(path) or 'another file'}"
    # A file expected in the given folder.
    expected = path.name in dict(_MARKS) and path.parent.is_dir()
    if not path.is_dir() and not expected:
        if path.exists():
            return f"{path}: expected {wanted}, was a special file"
        return f"{path}: no such file or folder"
    folder = path if path.is_dir() else path.parent
    found = content(folder)
    if found is None:
        found = "another folder" if any(folder.iterdir()) else "an empty folder"
    return f"{folder}: expected {wanted}, was {found}"


def unreadable(path: Path, wanted: str, reason: object) -> str:
    """Return the error message for a file that cannot be read as a table.

    Parameters
    ----------
    path : Path
        The file.
    wanted : str
        What is needed.
    reason : object
        The error; its first line is used where the content is unknown.
    """
    found = content(path)
    if found not in (None, "Parquet"):
        return f"{path}: expected {wanted} in Parquet, was {found}"
    first = next(iter(str(reason).strip().splitlines()), repr(reason))
    return f"{path}: expected {wanted} in Parquet, but the file cannot be read ({first})"


def content(path: Path) -> str | None:
    """Return what a folder or file contains, such as "the output of `track`".

    Parameters
    ----------
    path : Path
        The folder or file; it need not exist.

    Returns
    -------
    str or None
        None where it is unknown.
    """
    if not path.is_file():
        return next((what for name, what in _MARKS if (path / name).exists()), None)
    try:
        with path.open("rb") as file:
            octets = file.read(_TEXT_MAX)
    except OSError:
        return None
    found = packed_form(octets) or _form_of(octets, _OCTETS)
    return (_of_parquet(path) or found) if found == "Parquet" else found or _of_text(octets)


def packed_form(octets: bytes) -> str | None:
    """Return what a packed file is by its first octets, such as "a gzip file"; None for others."""
    return _form_of(octets, PACKED)


def _form_of(octets: bytes, forms: Collection[tuple[bytes, str]]) -> str | None:
    return next((what for start, what in forms if octets.startswith(start)), None)


def table_content(columns: Collection[str]) -> str | None:
    """Return what a table contains, by its columns; None where it is unknown."""
    return next((what for needed, what in _COLUMNS if needed <= set(columns)), None)


def other_table(found: Collection[str], missing: Collection[str]) -> str | None:
    """Return what a table contains that lacks columns; None where it may be the wanted one."""
    identifying = set().union(*(needed for needed, _ in _COLUMNS))
    return table_content(found) if identifying & set(missing) else None


def toml_content(tables: Collection[str]) -> str | None:
    """Return what a TOML file contains, by its tables; None where it is unknown."""
    return next((what for known, what in _TABLES if known & set(tables)), None)


def _of_parquet(path: Path) -> str | None:
    # Help and version must be fast.
    import polars as pl

    try:
        return table_content(pl.read_parquet_schema(path))
    except (pl.exceptions.PolarsError, OSError):
        return None


def _of_text(octets: bytes) -> str | None:
    if not octets:
        return "an empty file"
    for read in (tomllib.loads, json.loads):
        try:
            found = read(octets.decode("utf-8-sig"))
        except (ValueError, RecursionError):
            continue
        if read is tomllib.loads:
            return toml_content(found)
        command = found.get("command") if isinstance(found, dict) else None
        return f"the report of `{command}`" if command else "JSON"
    return None
