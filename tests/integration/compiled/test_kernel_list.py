"""The list of kernels contains all calls of commands: nothing is compiled after the start."""

from collections.abc import Iterator
from pathlib import Path

import polars as pl
import pytest

from multiradar_compiled.kernel_list import kernels_for
from support.kernel_list import Recorder, Run, calls_of, make_inputs, runs

#: One run of each kind; `make kernel-list KERNEL_LIST_OPTIONS=--check` compares all.
PURPOSES = ("convert vid", "track imm", "serve two-stage", "track --encounters imm", "bearings imm")
#: Of the sample: the whole of it calls the same kernels.
DURATION_S = 300.0


@pytest.fixture(scope="module")
def inputs(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("inputs")


@pytest.fixture(scope="module")
def recorder(inputs: Path) -> Iterator[Recorder]:
    with Recorder(inputs) as recorder:
        make_inputs(recorder, inputs)
        sample = inputs / "sample" / "measurements.parquet"
        whole = pl.read_parquet(sample)
        begin = pl.col("time_s") - pl.col("time_s").min() < DURATION_S
        whole.filter(begin).write_parquet(sample)
        yield recorder


@pytest.mark.parametrize(
    "run", [one for one in runs() if one.purpose in PURPOSES], ids=lambda run: run.purpose
)
def test_all_that_a_command_calls_is_listed(
    run: Run, recorder: Recorder, inputs: Path, tmp_path: Path
) -> None:
    listed = kernels_for([one for one in (run.builds_on, run.purpose) if one])
    called = {one[:2] for one in calls_of(run, recorder, inputs, tmp_path)}
    assert called
    assert called <= {(one.kernel, one.arguments) for one in listed}
