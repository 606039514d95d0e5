"""The whole service under faults, from fixed seeds; `make simulate-faults` makes more runs."""

import os
import sys

import pytest

from support.paths import TESTS
from support.processes.waiting import run_to_end

pytestmark = pytest.mark.slow


def test_no_acknowledged_measurement_is_lost_in_sixty_runs() -> None:
    # In a process of its own: it replaces clocks, threads and files of the modules it runs.
    command = [sys.executable, "-m", "support.simulation", "--runs", "60", "--workers", "1"]
    path = os.pathsep.join([str(TESTS), *sys.path])
    done = run_to_end(command, cwd=TESTS, env=os.environ | {"PYTHONPATH": path})
    assert done.returncode == 0, done.stdout + done.stderr
    assert "60 runs, 0 failed, " in done.stdout
