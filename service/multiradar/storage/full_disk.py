"""Errors of a full disk, as one sentence that names the output; sizes in words."""

import errno
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from multiradar.errors import InputError

_FULL = (errno.ENOSPC, errno.EDQUOT)
#: A disk with more free space was not the full one, octets.
_FREE_MAX = 1 << 20
#: Octets that are written to find a quota: more than a block of any file system.
_TRIED_OCTETS = 1 << 16


@contextmanager
def named_if_full(output: Path) -> Iterator[None]:
    """Name an output in an error of its full disk: errors of a write have no name of a file.

    Parameters
    ----------
    output : Path
        The file or folder to create; its parent exists.

    Raises
    ------
    InputError
        The disk of the output is full. Other errors are raised as they are.
    """
    try:
        yield
    except Exception as error:
        code = _code(error, (*_FULL, errno.EFBIG))
        # The full disk may be that of temporary files. EFBIG: a limit on the size of files.
        if code is None or (code in _FULL and not _lacks_space(output.absolute().parent)):
            raise
        msg = f"{output}: cannot write: {os.strerror(code)}; no output was kept"
        raise InputError(msg) from error


def is_full(error: Exception) -> bool:
    """Return whether an error of Python or of polars is that of a full disk or quota."""
    return _code(error, _FULL) is not None


def space_error(folder: Path) -> int | None:
    """Return why nothing can be written to a folder, full disk or quota; None if it can.

    A quota is not seen in the free space of the disk: a temporary file is written.
    """
    try:
        with tempfile.TemporaryFile(dir=folder) as file:
            left = memoryview(bytes(_TRIED_OCTETS))
            while left:  # The last octets of a quota are written without an error.
                left = left[os.write(file.fileno(), left) :]
    except OSError as error:
        return error.errno if error.errno in _FULL else None
    return None


def size_text(octets: float) -> str:
    """Return a size in MiB, or from 1 GiB on in GiB."""
    mib = octets / (1 << 20)
    return f"{mib:.0f} MiB" if mib < 1024.0 else f"{mib / 1024.0:.1f} GiB"


def _code(error: Exception, codes: tuple[int, ...]) -> int | None:
    if isinstance(error, OSError) and error.errno in codes:
        return error.errno
    return next((code for code in codes if f"(os error {code})" in str(error)), None)


def _lacks_space(folder: Path) -> bool:
    found = os.statvfs(folder)
    return found.f_bavail * found.f_frsize < _FREE_MAX
