"""What all conversions show and tell, whatever they read."""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from multiradar.cli.terminal.progress import progress_bar
from multiradar.errors import InputError, OutputExistsError


@contextmanager
def conversion_faults() -> Iterator[None]:
    """Raise what goes wrong in a conversion as commands do.

    Raises
    ------
    OutputExistsError
        The folder to make exists; nothing was touched.
    InputError
        What is converted cannot be read; the folder to make does not exist.
    """
    # Not at the head of the module: help must be fast.
    from multiradar_converters.errors import ConversionError, OutputTakenError

    try:
        yield
    except OutputTakenError as error:
        raise OutputExistsError(str(error)) from error
    except ConversionError as error:
        raise InputError(str(error)) from error


@contextmanager
def bytes_bar(total: int) -> Iterator[Callable[[int], None]]:
    """Show how much is converted.

    Parameters
    ----------
    total : int
        Bytes in all.

    Yields
    ------
    callable
        To be told the bytes that were read since it was told last.
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
        Converts, given what is to be told the bytes that were read.

    Returns
    -------
    dict
        What `report.json` says.

    Raises
    ------
    OutputExistsError
        The folder to make exists; nothing was touched.
    InputError
        A file cannot be read; the folder to make does not exist.
    """
    total = sum(path.stat().st_size for path in files if path.is_file())
    with conversion_faults(), bytes_bar(total) as advance:
        return convert(advance)


def times_line(first_s: float | None, last_s: float | None) -> str:
    """Say of which time a recording is, in UTC where its date is known.

    Parameters
    ----------
    first_s, last_s : float, optional
        First and last time, s; None where it has none.

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
    """Say what became of the records of a conversion."""
    counts = report["counts"]
    by_code = ", ".join(f"{code} {count}" for code, count in report["rejected_by_code"].items())
    return (
        f"read {counts['read']} records: accepted {counts['accepted']}, rejected "
        f"{counts['rejected']}{f' ({by_code})' if by_code else ''}, "
        f"duplicate {counts['duplicate']}"
    )
