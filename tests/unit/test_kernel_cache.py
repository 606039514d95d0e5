"""The folder of compiled kernels follows their sources and is nobody else's."""

import os
from pathlib import Path

import pytest

from multiradar import kernel_cache
from multiradar.kernel_cache import choose_kernel_cache


def test_the_folder_is_made_in_the_users_cache_and_named_after_the_kernels(tmp_path: Path) -> None:
    environment = {"HOME": str(tmp_path)}
    choose_kernel_cache(environment)
    folder = Path(environment["NUMBA_CACHE_DIR"])
    assert folder.is_dir()
    assert folder.is_relative_to(tmp_path / ".cache")


def test_another_state_of_the_kernels_has_another_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = {"HOME": str(tmp_path)}, {"HOME": str(tmp_path)}
    choose_kernel_cache(first)
    monkeypatch.setattr(kernel_cache, "_PACKAGES", ("multiradar",))
    choose_kernel_cache(second)
    assert first["NUMBA_CACHE_DIR"] != second["NUMBA_CACHE_DIR"]


def test_a_folder_that_was_chosen_stays() -> None:
    environment = {"NUMBA_CACHE_DIR": "/somewhere", "HOME": "/nowhere"}
    choose_kernel_cache(environment)
    assert environment["NUMBA_CACHE_DIR"] == "/somewhere"


def test_without_a_home_the_temporary_folder_serves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    environment: dict[str, str] = {}
    choose_kernel_cache(environment)
    assert Path(environment["NUMBA_CACHE_DIR"]).is_relative_to(tmp_path)


def test_a_folder_of_another_user_is_not_trusted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    uid = os.getuid()
    monkeypatch.setattr("os.getuid", lambda: uid + 1)
    monkeypatch.setattr("tempfile.gettempdir", lambda: str(tmp_path))
    environment = {"HOME": str(tmp_path)}
    choose_kernel_cache(environment)
    assert "NUMBA_CACHE_DIR" not in environment
