"""The days of a folder: recordings in folders that are named after their date."""

import datetime as dt
import hashlib
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from multiradar.errors import ArgumentError, DataWarning, InputError
from multiradar.storage.recording import measurements_path
from multiradar.toolbox.messages.warning import warn
from multiradar_schemas.documents.contents import DUMP, MEASUREMENTS, content

_DATE = re.compile(r"\d{4}-\d{2}-\d{2}")
_CHUNK = 1 << 20
_DAY_S = 86_400.0
# Local times minus UTC, s: from Baker Island to Kiribati.
_ZONES_S = (-12.0 * 3600.0, 14.0 * 3600.0)


@dataclass(frozen=True, slots=True)
class Day:
    """A recording of a day.

    Attributes
    ----------
    region : str
        Its folder of a region; empty without regions.
    date : str
        Such as 2026-11-20.
    path : Path
        The recording, as `track` takes it.
    """

    region: str
    date: str
    path: Path

    @property
    def name(self) -> str:
        """Region and date, as in the output directory."""
        return f"{self.region}/{self.date}" if self.region else self.date

    @property
    def is_dump(self) -> bool:
        """Whether it is a dump, whose times may lack the date."""
        return not measurements_path(self.path).is_file()

    def has(self, first_s: float, last_s: float, *, any_zone: bool) -> bool:
        """Return whether a part of a time span, Unix time, s, is of this date, UTC or local."""
        start_s = dt.datetime.fromisoformat(self.date).replace(tzinfo=dt.UTC).timestamp()
        west_s, east_s = _ZONES_S if any_zone else (0.0, 0.0)
        return first_s < start_s + _DAY_S - west_s and last_s >= start_s - east_s


def find_days(folder: Path) -> list[Day]:
    """Return the days of a folder by region and date.

    Parameters
    ----------
    folder : Path
        With folders such as 2026-11-20, or with folders of regions that have such folders.

    Raises
    ------
    InputError
        There are none, or days both in the folder and in regions.
    """
    if not folder.is_dir():
        what = "not a folder" if folder.exists() else "no such folder"
        raise InputError(f"{folder}: {what}")
    days = [Day("", date, path) for date, path in _dated(folder)]
    was = None if days else content(folder)
    if was in (*MEASUREMENTS, DUMP):
        raise InputError(
            f"{folder}: expected a folder with day folders such as {folder}/2026-11-20, was {was}; "
            "use `track` for a single recording, or move it into a folder named after its date"
        )
    regions: list[Day] = []
    for inner in sorted(folder.iterdir()):
        if not inner.is_dir() or inner.name.startswith(".") or _is_date(inner.name):
            continue
        found = [Day(inner.name, date, path) for date, path in _dated(inner)]
        if not found:
            warn(f"{inner}: no day folders such as 2026-11-20; skipped", DataWarning)
        regions += found
    if days and regions:
        raise InputError(
            f"{folder}: expected either day or region folders, found {days[0].name} and "
            f"{regions[0].name}"
        )
    if not days and not regions:
        raise InputError(
            f"{folder}: no day folders found; expected folders such as {folder}/2026-11-20 or "
            f"{folder}/REGION/2026-11-20, each the output of `convert` or a dump"
        )
    return days or regions


def check_apart(folder: Path, out: Path) -> None:
    """Raise `ArgumentError` if the output directory is within the folder of days, or around it."""
    inputs, output = folder.resolve(), out.resolve()
    if output.is_relative_to(inputs) or inputs.is_relative_to(output):
        raise ArgumentError(
            f"`out`: expected a directory neither inside nor containing {folder}, was {out}", "out"
        )


def input_sha256(path: Path) -> str:
    """Return the SHA-256 of the files of a recording, hexadecimal.

    Parameters
    ----------
    path : Path
        The folder: of its measurements, if it has been converted, else of all its files.
    """
    measurements = measurements_path(path)
    files = [measurements] if measurements.is_file() else sorted(path.rglob("*"))
    digest = hashlib.sha256()
    for file in files:
        if file.is_file():
            digest.update(f"{file.relative_to(path)}\0{file.stat().st_size}\0".encode())
            with file.open("rb") as stream:
                while chunk := stream.read(_CHUNK):
                    digest.update(chunk)
    return digest.hexdigest()


def _dated(folder: Path) -> Iterator[tuple[str, Path]]:
    for path in sorted(folder.iterdir()):
        if path.is_dir() and _is_date(path.name):
            yield path.name, path


def _is_date(name: str) -> bool:
    try:
        return bool(_DATE.fullmatch(name)) and bool(dt.date.fromisoformat(name))
    except ValueError:
        return False
