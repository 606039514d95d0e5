"""An output folder is either finished or not there, and what stands there already is left alone."""

import fcntl
from collections.abc import Callable
from contextlib import AbstractContextManager
from pathlib import Path

import pytest

from multiradar.errors import InputError, OutputExistsError
from multiradar.storage.output_file import new_file
from multiradar.storage.output_folder import new_folder

New = Callable[[Path], AbstractContextManager[Path]]


def test_the_folder_appears_when_all_went_well(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with new_folder(out) as partial:
        (partial / "a").write_text("a")
        assert not out.exists()
    assert (out / "a").read_text() == "a"
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize("error", [ValueError, KeyboardInterrupt])
def test_nothing_is_left_when_anything_goes_wrong(
    tmp_path: Path, error: type[BaseException]
) -> None:
    def write() -> None:
        with new_folder(tmp_path / "out") as partial:
            (partial / "a").write_text("a")
            raise error

    with pytest.raises(error):
        write()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("taken", ["folder", "file", "dangling link"])
def test_what_stands_there_is_left_alone(tmp_path: Path, taken: str) -> None:
    out = tmp_path / "out"
    if taken == "folder":
        out.mkdir()
    elif taken == "file":
        out.write_text("mine")
    else:
        out.symlink_to(tmp_path / "nowhere")
    expected = "out: already exists; choose another output directory"
    with pytest.raises(OutputExistsError, match=expected), new_folder(out):
        pytest.fail("nothing may be written")
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_folder_that_appears_meanwhile_is_left_alone(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(OutputExistsError), new_folder(out):
        out.mkdir()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def test_a_missing_parent_is_named(tmp_path: Path) -> None:
    out = tmp_path / "nowhere" / "out"
    with pytest.raises(InputError, match="nowhere: no such folder"), new_folder(out):
        pytest.fail("nothing may be written")


def _left_behind(folder: Path, name: str) -> Path:
    partial = folder / name
    partial.mkdir()
    (partial / "tracks.parquet").write_text("half")
    (partial / ".lock").touch()
    return partial


def test_what_a_killed_run_left_is_removed_by_the_next(tmp_path: Path) -> None:
    _left_behind(tmp_path, ".out.partial-99999999")
    other = _left_behind(tmp_path, ".outer.partial-99999999")
    with new_folder(tmp_path / "out"):
        pass
    assert sorted(tmp_path.iterdir()) == [other, tmp_path / "out"]


def test_what_a_living_run_writes_is_left_alone(tmp_path: Path) -> None:
    living = _left_behind(tmp_path, ".out.partial-99999999")
    with (living / ".lock").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with new_folder(tmp_path / "out"):
            pass
        assert (living / "tracks.parquet").read_text() == "half"


def test_a_finished_folder_is_as_open_as_the_user_wants_it(tmp_path: Path) -> None:
    ordinary = tmp_path / "ordinary"
    ordinary.mkdir()
    with new_folder(tmp_path / "out"):
        pass
    assert (tmp_path / "out").stat().st_mode == ordinary.stat().st_mode
    assert not list((tmp_path / "out").iterdir())


def test_a_folder_that_cannot_be_written_to_is_named(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def reject(_path: Path, *_: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(Path, "mkdir", reject)
    with (
        pytest.raises(InputError, match="out: cannot be created: Permission denied"),
        new_folder(tmp_path / "out"),
    ):
        pytest.fail("nothing may be written")


@pytest.mark.parametrize("error", [KeyboardInterrupt(), OSError(28, "No space left on device")])
def test_nothing_is_left_when_it_is_interrupted_while_it_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    def fail(*_arguments: object) -> None:
        raise error

    monkeypatch.setattr("multiradar_converters.output_folder.fcntl.flock", fail)
    expected = KeyboardInterrupt if isinstance(error, KeyboardInterrupt) else InputError
    with pytest.raises(expected), new_folder(tmp_path / "out"):
        pytest.fail("nothing may be written")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("new", [new_folder, new_file])
def test_a_parent_that_is_a_file_is_named(new: New, tmp_path: Path) -> None:
    file = tmp_path / "notes.txt"
    file.write_text("x")
    wanted = r"notes\.txt: expected a folder for out, was a file; choose another folder"
    with pytest.raises(InputError, match=wanted), new(file / "out"):
        raise AssertionError
