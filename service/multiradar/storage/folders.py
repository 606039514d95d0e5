"""Detects what a folder or file contains, for error messages about a wrong one."""

from pathlib import Path

JOURNAL = "the state of `serve`"
TRACKS = "the output of `track`"
MEASUREMENTS = ("the output of `convert`", "the output of `simulate`")
#: Files that identify a folder, and its description; the first match counts.
_MARKS = (
    ("tracks.parquet", TRACKS),
    ("truth.parquet", MEASUREMENTS[1]),
    ("system_tracks.parquet", "the output of `convert asterix`"),
    ("measurements.parquet", MEASUREMENTS[0]),
    ("plots.txt", "a dump; `convert vid` it first"),
    ("journal.sqlite", JOURNAL),
)

#: Columns that identify a table.
_COLUMNS = (
    ({"track_id", "position_sigma_m"}, TRACKS),
    ({"sensor_id", "kind", "range_m"}, MEASUREMENTS[0]),
)


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
        return f"{path}: no such file or folder"
    folder = path if path.is_dir() else path.parent
    found = content(folder)
    if found is None:
        found = "another folder" if any(folder.iterdir()) else "an empty folder"
    return f"{folder}: expected {wanted}, was {found}"


def content(path: Path) -> str | None:
    """Return what a folder or table contains, such as "the output of `track`".

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
    # Help and version must be fast.
    import polars as pl

    try:
        columns = pl.read_parquet_schema(path)
    except (pl.exceptions.PolarsError, OSError):
        return None
    return next((what for needed, what in _COLUMNS if needed <= set(columns)), None)
