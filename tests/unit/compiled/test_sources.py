"""Source files of compiled kernels: their digest names the cache."""

import shutil
import sys
from importlib import import_module
from pathlib import Path

import pytest
from numba.core.dispatcher import Dispatcher

from multiradar_compiled.kernel_list import kernels_by_purpose
from multiradar_compiled.sources import compiled_sources, package_folders, sources_digest


def write(folder: Path, **files: str) -> dict[str, Path]:
    for name, text in files.items():
        path = folder / f"{name.replace('__', '/')}.py"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return {folder.name: folder}


@pytest.mark.parametrize(
    "line",
    [
        "from pack.sub.limits import LIMIT",
        "from pack.sub import limits",
        "from pack.sub import (\n    other,\n    limits as bounds,\n)",
        "from pack.sub import other, limits",
        "import pack.sub.limits",
        "def f():\n    from pack.sub.limits import LIMIT",
    ],
)
def test_what_a_module_of_kernels_imports_is_compiled_in(tmp_path: Path, line: str) -> None:
    folders = write(
        tmp_path / "pack",
        **{"_kernels": f"{line}\n", "sub__limits": "import numpy\n", "sub__other": "", "cli": ""},
    )
    names = {path.name for path in compiled_sources(folders)}
    assert "limits.py" in names
    assert "cli.py" not in names


def test_imports_are_followed_from_module_to_module(tmp_path: Path) -> None:
    folders = write(
        tmp_path / "pack",
        _kernels="from pack.a import A\n",
        a="from pack.b import B\n",
        b="from pack.a import A\nfrom pack.c import C\n",
        c="",
    )
    names = {path.name for path in compiled_sources(folders)}
    assert names == {"_kernels.py", "a.py", "b.py", "c.py"}


def test_the_digest_follows_every_one_of_them_and_nothing_else(tmp_path: Path) -> None:
    kernels = "from pack.a import A\n"
    folders = write(tmp_path / "pack", _kernels=kernels, a="A = 1\n", other="B = 1\n")
    before = sources_digest(folders)
    (tmp_path / "pack" / "other.py").write_text("B = 2\n")
    assert sources_digest(folders) == before
    (tmp_path / "pack" / "a.py").write_text("A = 2\n")
    assert sources_digest(folders) != before


def test_a_copy_in_another_folder_has_the_same_digest(tmp_path: Path) -> None:
    folders = write(tmp_path / "pack", _kernels="from pack.a import A\n", a="A = 1\n")
    shutil.copytree(tmp_path / "pack", tmp_path / "elsewhere" / "pack")
    assert sources_digest(folders) == sources_digest({"pack": tmp_path / "elsewhere" / "pack"})


def test_every_module_that_compiles_anything_is_among_them() -> None:
    """Regression: constants and functions of other modules were left out."""
    for kernels in kernels_by_purpose().values():
        for one in kernels:
            import_module(one.kernel.partition(":")[0])
    known = set(compiled_sources(package_folders()))
    compiling = {
        Path(value.py_func.__code__.co_filename)
        for name, module in list(sys.modules.items())
        if name.partition(".")[0] in package_folders()
        for value in vars(module).values()
        if isinstance(value, Dispatcher)
    }
    assert len(compiling) > 40
    assert compiling <= known
    named = {path.name for path in known}
    assert {
        "_lane_intrinsics.py",
        "wgs84.py",
        "_layout.py",
        "report_integrity.py",
        "lane_kernels.py",
    } <= named
