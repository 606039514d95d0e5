"""A full disk is an error that names the output, and nothing is left."""

import errno
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
