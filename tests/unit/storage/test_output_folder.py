"""An output folder is either finished or not there, and what stands there already is left alone."""

from pathlib import Path

import pytest

from multiradar.errors import InputError, OutputExistsError
from multiradar.storage.output_folder import new_folder


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
    expected = "out: expected a folder that does not exist"
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
    with pytest.raises(InputError, match="nowhere: expected a folder"), new_folder(out):
        pytest.fail("nothing may be written")
