"""A full disk is an error that names the output, and nothing is left."""

import errno
import os
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import polars as pl
import pytest

from multiradar.cli.main import run
from multiradar.errors import InputError
from multiradar.storage import full_disk
from multiradar.storage.output_file import new_file
from multiradar.storage.output_folder import new_folder
from support.processes.waiting import run_to_end

FULL = [
    OSError(errno.ENOSPC, "No space left on device"),
    pl.exceptions.ComputeError("parquet: IO error: No space left on device (os error 28)"),
]


@pytest.mark.parametrize("new", [new_file, new_folder])
@pytest.mark.parametrize("error", FULL)
def test_the_output_on_the_full_disk_is_named(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    new: Callable[[Path], AbstractContextManager[Path]],
    error: Exception,
) -> None:
    monkeypatch.setattr(full_disk, "_lacks_space", lambda folder: folder == tmp_path)
    expected = f"{tmp_path}/out: cannot write: No space left on device; no output was kept"
    with pytest.raises(InputError, match=f"^{expected}$"), new(tmp_path / "out"):
        raise error
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("error", [*FULL, OSError(errno.EIO, "Input/output error")])
def test_an_error_of_another_disk_is_not_that_of_this_output(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: Exception
) -> None:
    monkeypatch.setattr(full_disk, "_lacks_space", lambda _folder: False)
    with pytest.raises(type(error)), new_file(tmp_path / "out"):
        raise error


@pytest.mark.parametrize("error", FULL)
def test_a_full_disk_of_temporary_files_is_one_sentence(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], error: Exception
) -> None:
    def fail(*_arguments: object) -> None:
        raise error

    monkeypatch.setattr("multiradar.cli.main._invoke", fail)
    assert run(["track"]) == 1
    assert capsys.readouterr().err.startswith("multiradar: no space left on device for the output")


def test_the_output_beyond_a_limit_on_the_size_of_files_is_named(tmp_path: Path) -> None:
    error = pl.exceptions.ComputeError("parquet: IO error: File too large (os error 27)")
    expected = f"{tmp_path}/out: cannot write: File too large; no output was kept"
    with pytest.raises(InputError, match=f"^{expected}$"), new_file(tmp_path / "out"):
        raise error


_QUOTA = """
import errno
import os
import random
import sys
from pathlib import Path
from multiradar.errors import JournalError, JournalFullError
from multiradar.storage.sqlite.sqlite_journal import SqliteJournal
from support.inputs.journal_entries import entry
from support.simulation.disk import VirtualDisk

IOERR_WRITE = 778

class Disk(VirtualDisk):
    exceeded = False

    def write(self, name, place, octets):
        grows = octets and place + len(octets) > (folder / name).stat().st_size
        return IOERR_WRITE if self.exceeded and grows else super().write(name, place, octets)

def exceeded(*_):
    raise OSError(errno.EDQUOT, os.strerror(errno.EDQUOT))

folder = Path(sys.argv[1])
path = folder / "journal.db"
disk = Disk(folder, random.Random(1), {})
journal = SqliteJournal(path, "a" * 64)
write = os.write
for number in range(3):
    journal.append([entry(2 * number)])
    disk.exceeded, os.write = True, exceeded
    for _ in range(2):
        try:
            journal.append([entry(99, size=20_000)])
        except JournalFullError as error:
            print(error)
    # A start, too: what it writes of its own does not matter.
    journal.close()
    journal = SqliteJournal(path, "a" * 64)
    disk.exceeded, os.write = False, write
    journal.append([entry(2 * number + 1)])
assert [one.entry for one in journal.read(0)] == [entry(number) for number in range(6)]
disk.exceeded = True
try:
    journal.append([entry(99)])
except JournalError as error:
    print(error)
journal.close()
"""


@pytest.mark.fault(24)
def test_a_journal_whose_quota_is_exceeded_is_full_and_continues(tmp_path: Path) -> None:
    """SQLite reports a quota as any other error of a write: the service ended."""
    line = [sys.executable, "-c", _QUOTA, str(tmp_path)]
    done = run_to_end(line, env={"PYTHONPATH": os.pathsep.join(sys.path)})
    assert done.returncode == 0, done.stderr
    *full, failed = done.stdout.splitlines()
    path = tmp_path / "journal.db"
    assert full == [f"{path}: disk quota exceeded; free some space"] * 6
    assert failed == f"{path}: disk I/O error (SQLITE_IOERR_WRITE)"
    assert sorted(one.name for one in tmp_path.iterdir() if "journal" not in one.name) == []


@pytest.mark.fault(24)
def test_the_last_octets_of_a_quota_are_not_enough(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sizes, write = [4096], os.write

    def limited(file: int, octets: memoryview) -> int:
        if not sizes:
            raise OSError(errno.EDQUOT, os.strerror(errno.EDQUOT))
        return write(file, octets[: sizes.pop()])

    monkeypatch.setattr(os, "write", limited)
    assert full_disk.space_error(tmp_path) == errno.EDQUOT
    monkeypatch.undo()
    assert full_disk.space_error(tmp_path) is None
