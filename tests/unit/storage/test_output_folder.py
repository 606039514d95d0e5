"""An output folder is either finished or not there, and what stands there already is left alone."""

import fcntl
import shutil
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from pathlib import Path

import pytest

from multiradar.errors import InputError, OutputExistsError
from multiradar.storage.output_file import new_file
from multiradar.storage.output_folder import new_folder, remove_abandoned

New = Callable[[Path], AbstractContextManager[Path]]


class _KilledError(Exception):
    pass


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


@pytest.mark.parametrize("step", ["rename", "unlink"])
def test_what_a_kill_at_the_end_leaves_is_complete_or_removed_by_the_next(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, step: str
) -> None:
    out = tmp_path / "out"

    def killed(*_: object, **__: object) -> None:
        raise _KilledError

    with monkeypatch.context() as patch, suppress(_KilledError):
        patch.setattr(Path, step, killed)
        # Of a killed process nothing is removed.
        patch.setattr("multiradar_converters.output_folder.shutil.rmtree", lambda *_, **__: None)
        with new_folder(out) as folder:
            (folder / "tracks.parquet").write_text("whole")
    if step == "unlink":
        assert (out / "tracks.parquet").read_text() == "whole"
        shutil.rmtree(out)
    with new_folder(out):
        pass
    assert list(tmp_path.iterdir()) == [out]


def test_what_killed_runs_left_with_a_file_is_removed_whatever_its_name(tmp_path: Path) -> None:
    left = [_left_behind(tmp_path, f".2026-11-2{day}.partial-9999999") for day in range(4)]
    (left[2] / "tracks.parquet").unlink()
    (left[3] / ".lock").unlink()
    with (left[1] / ".lock").open() as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        remove_abandoned(tmp_path, "tracks.parquet")
    assert sorted(tmp_path.iterdir()) == left[1:]


def test_the_name_of_a_durable_folder_is_on_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[tuple[Path, bool]] = []
    out = tmp_path / "out"
    monkeypatch.setattr(
        "multiradar.storage.output_folder.sync", lambda path: synced.append((path, out.exists()))
    )
    with new_folder(out, durable=True):
        pass
    assert synced == [(tmp_path, True)]


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
