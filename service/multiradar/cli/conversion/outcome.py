"""Progress, errors and summaries common to all conversions."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import typer

from multiradar.cli.terminal.progress import progress_bar
from multiradar.errors import InputError, OutputExistsError


@contextmanager
def conversion_errors() -> Iterator[None]:
    """Raise errors of a conversion as errors of a command.

    Raises
    ------
    OutputExistsError
        The output folder exists; nothing was touched.
    InputError
        The input cannot be read; no output folder was created.
    """
    # Imported here: help must be fast.
    from multiradar_converters.errors import ConversionError, OutputFolderExistsError

    try:
        yield
    except OutputFolderExistsError as error:
        raise OutputExistsError(str(error)) from error
    except ConversionError as error:
        raise InputError(str(error)) from error


@contextmanager
def bytes_bar(total: int) -> Iterator[Callable[[int], None]]:
    """Show the progress of a conversion.

    Parameters
    ----------
    total : int
        Bytes in all.

    Yields
    ------
    callable
        To be called with the number of bytes read since the last call.
    """
    with progress_bar("converting", total) as show:
        done = 0

        def advance(read: int) -> None:
            nonlocal done
            done += read
            show(done)

        yield advance


def convert_files(
    files: Iterable[Path], convert: Callable[[Callable[[int], None]], dict[str, object]]
) -> dict[str, Any]:
    """Convert files, with a progress bar on a terminal.

    Parameters
    ----------
    files : iterable of Path
        What is converted.
    convert : callable
        Converts; its argument is to be called with the bytes read since the last call.

    Returns
    -------
    dict
        Contents of `report.json`.

    Raises
    ------
    OutputExistsError
        The output folder exists; nothing was touched.
    InputError
        A file cannot be read; no output folder was created.
    """
    given: set[Path] = set()
    for path in files:
        if path.resolve() in given:
            raise typer.BadParameter(f"{path}: given twice")
        given.add(path.resolve())
    total = sum(path.stat().st_size for path in files if path.is_file())
    with conversion_errors(), bytes_bar(total) as advance:
        return convert(advance)


def times_line(first_s: float | None, last_s: float | None) -> str:
    """Return the time span of a recording as text, in UTC where its date is known.

    Parameters
    ----------
    first_s, last_s : float, optional
        First and last time, s; None without times.

    Returns
    -------
    str
        One line.
    """
    from multiradar.report.times import is_dated, time_text

    if first_s is None or last_s is None:
        return "times: none"
    span = f"times: {time_text(first_s)} to {time_text(last_s)}"
    if is_dated(last_s):
        return span
    return f"{span}, without a date; convert with --date YYYY-MM-DD to compare with other data"


def records_line(report: dict[str, Any]) -> str:
    """Return the counts of the records of a conversion as text."""
    counts = report["counts"]
    by_code = ", ".join(f"{code} {count}" for code, count in report["rejected_by_code"].items())
    return (
        f"read {counts['read']} records: accepted {counts['accepted']}, rejected "
        f"{counts['rejected']}{f' ({by_code})' if by_code else ''}, "
        f"duplicate {counts['duplicate']}"
    )
