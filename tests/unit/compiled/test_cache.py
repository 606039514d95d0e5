"""The cache folder of compiled kernels: one per state of the sources, private to the user."""

import os
import re
from pathlib import Path
from typing import Any

import pytest

from multiradar.geodesy import _kernels as geodesy_kernels
from multiradar_compiled.cache import cache_folder, kernel_folder
from support.references import _mode_kernels


def test_the_folder_is_made_in_the_users_cache_and_named_after_the_state(tmp_path: Path) -> None:
    folder = cache_folder({"HOME": str(tmp_path)}, "abc")
    assert folder == tmp_path / ".cache" / f"multiradar-{os.getuid()}" / "kernels-abc"
    assert folder.is_dir()
    assert folder.stat().st_mode & 0o777 == 0o700


def test_the_cache_of_the_desktop_comes_before_the_home(tmp_path: Path) -> None:
    folder = cache_folder({"HOME": "/nowhere", "XDG_CACHE_HOME": str(tmp_path)}, "abc")
    assert folder is not None
    assert folder.is_relative_to(tmp_path)


def test_another_state_has_another_folder(tmp_path: Path) -> None:
    environment = {"HOME": str(tmp_path)}
    assert cache_folder(environment, "abc") != cache_folder(environment, "abd")
    assert cache_folder(environment, "abc") == cache_folder(environment, "abc")


def test_a_chosen_folder_is_used_in_place_of_the_users(tmp_path: Path) -> None:
    chosen = {"NUMBA_CACHE_DIR": str(tmp_path / "chosen"), "HOME": str(tmp_path)}
    assert cache_folder(chosen, "abc") == tmp_path / "chosen" / "kernels-abc"


@pytest.mark.parametrize("home", [{}, {"HOME": "/proc/none"}])
def test_without_a_writable_home_the_temporary_folder_is_used(
    home: dict[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    folder = cache_folder(home, "abc")
    assert folder is not None
    assert folder.is_relative_to(tmp_path)


def test_a_folder_of_another_user_is_not_trusted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    uid = os.getuid()
    monkeypatch.setattr("os.getuid", lambda: uid + 1)
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    assert cache_folder({"HOME": str(tmp_path)}, "abc") is None


def test_folders_of_states_not_used_for_long_are_removed(tmp_path: Path) -> None:
    environment = {"NUMBA_CACHE_DIR": str(tmp_path)}
    (tmp_path / "kernels-other-program").touch()
    for age in range(8):
        folder = cache_folder(environment, f"{age}")
        assert folder is not None
        (folder / "entry").touch()
        os.utime(folder, (1e9 + age, 1e9 + age))
    os.utime(tmp_path / "kernels-2", (2e9, 2e9))
    cache_folder(environment, "new")
    left = {path.name for path in tmp_path.iterdir() if path.is_dir()}
    assert left == {f"kernels-{name}" for name in ("new", "2", "7", "6", "5", "4")}


def test_kernels_are_kept_in_the_folder_of_this_process() -> None:
    folder = kernel_folder()
    assert folder is not None
    kernel: Any = geodesy_kernels.geodetic_to_plane
    assert Path(kernel.stats.cache_path) == folder / "multiradar.geodesy._kernels"


def test_kernels_outside_the_packages_have_a_folder_for_each_state_of_their_file() -> None:
    folder = kernel_folder()
    assert folder is not None
    kernel: Any = _mode_kernels.pass_and_mix
    parent, name = Path(kernel.stats.cache_path).parent, Path(kernel.stats.cache_path).name
    assert parent == folder
    assert re.fullmatch(r"support\.references\._mode_kernels-[0-9a-f]{16}", name)
