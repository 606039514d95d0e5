"""The same measurements give the same bytes, whatever the processor offers numpy and its BLAS."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from multiradar.tracking.input.measurements import COLUMNS
from support.processes import digests
from support.processes.waiting import run_to_end
from support.scenarios.scenes import make_scene, random_flights, three_radars

FILTERS = ("two-stage", "imm", "blom-macro")


@pytest.fixture(scope="module")
def measurements(tmp_path_factory: pytest.TempPathFactory) -> Path:
    draw = np.random.default_rng(1)
    batch = make_scene(draw, three_radars(), random_flights(draw, 20, 120.0)).batch
    path = tmp_path_factory.mktemp("scene") / "measurements.npz"
    np.savez(path, allow_pickle=False, **{name: getattr(batch, name) for name in COLUMNS})
    return path


def test_the_kernels_of_numerical_libraries_leave_no_trace(measurements: Path) -> None:
    found = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
    plain = {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": " ".join(found)}
    run = run_to_end(
        [sys.executable, digests.__file__, measurements, *FILTERS],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **plain},
    )
    assert run.returncode == 0, run.stderr
    # In this process with all that the processor offers.
    assert run.stdout.split() == digests.digests(measurements, FILTERS)
