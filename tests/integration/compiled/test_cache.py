"""Cache of compiled kernels: no stale code after changes; copies of the sources share it."""

import os
import shutil
import sys
from pathlib import Path

import pytest

from support.paths import ROOT
from support.processes.waiting import run_to_end

PACKAGES = (
    "service/multiradar",
    "converters/multiradar_converters",
    "compiled/multiradar_compiled",
    "schemas/multiradar_schemas",
)
PROGRAM = """
import numpy as np
from multiradar.geodesy._kernels import geodetic_to_plane, plane_parameters
e, n = geodetic_to_plane(plane_parameters(0.8, 0.1), 0.81, 0.11)
hits, misses = (sum(x.values()) for x in (
    geodetic_to_plane.stats.cache_hits, geodetic_to_plane.stats.cache_misses))
print(e, hits, misses)
"""


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    for package in PACKAGES:
        ignored = shutil.ignore_patterns("__pycache__")
        shutil.copytree(ROOT / package, tmp_path / "tree" / package, ignore=ignored)
    return tmp_path / "tree"


def run(tree: Path, cache: Path) -> tuple[float, int, int]:
    """Run the program on a copy of the sources; return its result, cache hits and misses."""
    paths = os.pathsep.join(str((tree / package).parent) for package in PACKAGES)
    # Python identifies its own bytecode by the time of the source alone; kernels are tested here.
    environment = {
        **os.environ,
        "PYTHONPATH": paths,
        "NUMBA_CACHE_DIR": str(cache),
        "PYTHONDONTWRITEBYTECODE": "1",
    }
    done = run_to_end([sys.executable, "-c", PROGRAM], env=environment)
    assert done.returncode == 0, done.stderr
    east_m, hits, misses = done.stdout.split()
    return float(east_m), int(hits), int(misses)


def test_a_changed_constant_of_another_module_takes_effect(tree: Path, tmp_path: Path) -> None:
    """It is compiled into kernels; the file of the kernels is unchanged."""
    first = run(tree, tmp_path / "cache")
    constants = tree / "service" / "multiradar" / "geodesy" / "wgs84.py"
    text = constants.read_text()
    assert "SEMI_MAJOR_AXIS_M = 6_378_137.0" in text
    before = constants.stat()
    constants.write_text(text.replace("6_378_137.0", "6_370_000.0"))
    # The modification time is unchanged, too.
    os.utime(constants, ns=(before.st_atime_ns, before.st_mtime_ns))
    changed = run(tree, tmp_path / "cache")
    assert (first[1:], changed[1:]) == ((0, 1), (0, 1))
    assert abs(changed[0] / first[0] - 6_370_000.0 / 6_378_137.0) < 1e-4


def test_a_copy_of_the_sources_elsewhere_compiles_nothing_again(tree: Path, tmp_path: Path) -> None:
    first = run(tree, tmp_path / "cache")
    other = shutil.copytree(tree, tmp_path / "elsewhere")
    second = run(other, tmp_path / "cache")
    assert second == (first[0], 1, 0)
