"""An output file is whole or absent, and never takes the place of another."""

import errno
import os
from pathlib import Path

import pytest

from multiradar.errors import OutputExistsError
from multiradar.storage.output_file import free_name, new_file


def test_a_file_takes_its_name_when_it_is_whole(tmp_path: Path) -> None:
    path = tmp_path / "a.html"
    with new_file(path) as partial:
        partial.write_text("whole")
        assert not path.exists()
        assert partial.parent == tmp_path
    assert path.read_text() == "whole"
    assert list(tmp_path.iterdir()) == [path]


def test_nothing_is_left_of_a_file_that_failed(tmp_path: Path) -> None:
    def stopped() -> None:
        with new_file(tmp_path / "a.html") as partial:
            partial.write_text("half")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        stopped()
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("links", [True, False])
def test_a_name_that_was_taken_meanwhile_is_left_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool
) -> None:
    def reject(*_names: object) -> None:
        raise OSError(errno.EPERM, os.strerror(errno.EPERM))

    path = tmp_path / "a.html"
    if not links:
        monkeypatch.setattr(os, "link", reject)

    def overtaken() -> None:
        with new_file(path) as partial:
            partial.write_text("mine")
            path.write_text("theirs")

    with pytest.raises(OutputExistsError, match="already exists; choose another file"):
        overtaken()
    assert path.read_text() == "theirs"
    assert list(tmp_path.iterdir()) == [path]
    path.unlink()
    with new_file(path) as partial:
        partial.write_text("mine")
    assert path.read_text() == "mine"


def test_a_link_that_leads_nowhere_is_a_name_taken(tmp_path: Path) -> None:
    path = tmp_path / "a.html"
    path.symlink_to(tmp_path / "nowhere")
    with pytest.raises(OutputExistsError), new_file(path):
        raise AssertionError
    assert free_name(path).name == "a-2.html"
