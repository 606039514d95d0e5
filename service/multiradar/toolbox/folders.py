"""Detects what a folder or file contains, for error messages about a wrong one."""

from pathlib import Path

#: Files that identify a folder, and its description; the first match counts.
_MARKS = (
    ("tracks.parquet", "the output of `track`"),
    ("truth.parquet", "the output of `simulate`"),
    ("system_tracks.parquet", "the output of `convert asterix`"),
    ("measurements.parquet", "the output of `convert`"),
    ("plots.txt", "a dump; `convert vid` it first"),
    ("journal.sqlite", "the state of `serve`"),
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
        return f"{path}: expected {wanted}, was another file"
    # A file expected in the given folder.
    expected = path.name in dict(_MARKS) and path.parent.is_dir()
    if not path.is_dir() and not expected:
        return f"{path}: no such file or folder"
    folder = path if path.is_dir() else path.parent
    found = next((what for name, what in _MARKS if (folder / name).exists()), None)
    if found is None:
        found = "another folder" if any(folder.iterdir()) else "an empty folder"
    return f"{folder}: expected {wanted}, was {found}"
