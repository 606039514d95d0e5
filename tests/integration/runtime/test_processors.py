"""The same measurements give the same bytes, whatever the processor offers numpy and its BLAS."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from multiradar.tracking.input.measurements import COLUMNS
from support.processes.waiting import run_to_end
from support.scenarios.scenes import make_scene, random_flights, three_radars

DIGEST = """
import sys
import numpy as np
from multiradar.runtime.engine.digest import OutputDigest
from multiradar.runtime.engine.epoch_engine import Engine
from multiradar.tracking.input.measurements import MeasurementBatch
from multiradar.tracking.settings import TrackingSettings
from support.scenarios.scenes import sensor_table, three_radars

path, *filters = sys.argv[1:]
for name in filters:
    digest = OutputDigest()
    engine = Engine(sensor_table(three_radars()), TrackingSettings(filter_name=name), 1)
    digest.add(engine.push(MeasurementBatch(**np.load(path))))
    digest.add(engine.flush())
    engine.close()
    print(name, digest.hexdigest())
"""
FILTERS = ("two-stage", "imm", "blom-macro")


@pytest.fixture(scope="module")
def measurements(tmp_path_factory: pytest.TempPathFactory) -> Path:
    draw = np.random.default_rng(1)
    batch = make_scene(draw, three_radars(), random_flights(draw, 20, 120.0)).batch
    path = tmp_path_factory.mktemp("scene") / "measurements.npz"
    np.savez(path, allow_pickle=False, **{name: getattr(batch, name) for name in COLUMNS})
    return path


def _digests(measurements: Path, environment: dict[str, str]) -> list[str]:
    run = run_to_end(
        [sys.executable, "-c", DIGEST, measurements, *FILTERS],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **environment},
    )
    assert run.returncode == 0, run.stderr
    return run.stdout.split()


def test_the_kernels_of_numerical_libraries_leave_no_trace(measurements: Path) -> None:
    found = np.show_config(mode="dicts")["SIMD Extensions"]["found"]
    plain = {"OPENBLAS_CORETYPE": "Nehalem", "NPY_DISABLE_CPU_FEATURES": " ".join(found)}
    assert _digests(measurements, plain) == _digests(measurements, {})
