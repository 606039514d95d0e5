"""Processes of commands begin with what commands load."""

import os
import sys

import pytest

from multiradar_compiled.ahead import missing_kernels
from multiradar_compiled.kernel_list import kernels_for
from support.processes.commands import ended, fork


def report() -> None:
    """Write the names of the loaded modules, and how many kernels are compiled."""
    # Loading it by the name of a command that uses it would load what it is to show.
    kernels = sys.modules.get("multiradar.estimation.filters.imm._imm_step_kernels")
    step = getattr(kernels, "imm_step", None)
    os.write(1, f"{len(getattr(step, 'overloads', ()))} {' '.join(sys.modules)}".encode())


@pytest.mark.slow
def test_a_forked_process_has_modules_and_kernels() -> None:
    reading, writing = os.pipe()
    process = fork(report, streams={1: writing})
    os.close(writing)
    with open(reading, encoding="utf-8") as said:
        count, *modules = said.read().split()
    assert ended(process) == 0
    assert {"multiradar.app", "multiradar.toolbox.tracking.track", "polars"} <= set(modules)
    # Where it was compiled ahead.
    step = [one for one in kernels_for(["track imm"]) if one.kernel.endswith(":imm_step")]
    assert int(count) == len(step) - len(missing_kernels(step))
