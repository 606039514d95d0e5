"""Measurements in any supported form, opened as one recording."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from multiradar.errors import DataWarning, InputError
from multiradar.toolbox.conversion.convert import convert_dump
from multiradar.toolbox.inputs import DumpChoice
from multiradar.toolbox.messages.warning import warn
from multiradar_converters.leftovers import temporary_folder
from multiradar_schemas.documents.contents import no_such

if TYPE_CHECKING:
    from multiradar.storage.recording import Recording


@contextmanager
def open_measurements(
    given: Path, dump: DumpChoice, horizon_s: float, name: str | None = None
) -> Iterator["Recording"]:
    """Open measurements: a Parquet file, a converted folder, or a dump, converted on the fly.

    Parameters
    ----------
    given : Path
        The file or folder.
    dump : DumpChoice
        Options for a dump.
    horizon_s : float
        Rows out of order by more than this, s, are sorted by time first.
    name : str, optional
        Its name in errors; the path by default.

    Yields
    ------
    Recording
        With at least one measurement; temporary files are removed afterwards.

    Raises
    ------
    InputError
        It cannot be read, or is empty.
    """
    from multiradar.storage.recording import MEASUREMENTS_FILE, Recording, measurements_path

    if not given.is_dir() or (given / MEASUREMENTS_FILE).exists():
        dump.check_unused(name or given)
        recording = Recording(measurements_path(given), name)
        with _in_order(recording, name or str(given), horizon_s) as ordered:
            yield ordered
        return
    options = dump.options(kinds=())
    plots = options.profile.files.plots
    if not (given / plots).exists():
        raise InputError(no_such(given, f"a folder with {MEASUREMENTS_FILE}, or a dump"))
    with temporary_folder("multiradar-dump-") as temporary:
        converted = temporary / "converted"
        # Only the table is needed: no files by aircraft.
        convert_dump(given, converted, options)
        measured = Recording(converted / MEASUREMENTS_FILE)
        with _in_order(measured, str(given), horizon_s) as ordered:
            yield ordered


@contextmanager
def _in_order(recording: "Recording", name: str, horizon_s: float) -> Iterator["Recording"]:
    from multiradar.storage.time_order import disorder_s, in_time_order

    if recording.rows == 0:
        msg = f"{name}: no measurements"
        raise InputError(msg)
    disordered_s = disorder_s(recording)
    if disordered_s <= horizon_s:
        yield recording
        return
    warn(
        f"{name}: rows are up to {round(disordered_s, 1):.10g} s out of order; they were "
        "sorted by time",
        DataWarning,
    )
    with temporary_folder("multiradar-sort-") as temporary:
        yield in_time_order(recording, temporary)
