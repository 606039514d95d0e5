"""`make fuzz` finds what is rare, says how to see it again, and ends in its time."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from support import fuzzing
from support.paths import TESTS
from support.processes.waiting import WAIT_TIMEOUT_S

pytestmark = pytest.mark.slow

PROPERTY = """
from hypothesis import given, strategies as st

@given(st.integers(0, 2**40))
def test_most_numbers_are_good(number: int) -> None:
    assert number {condition}
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    shutil.copy(TESTS / "conftest.py", tmp_path)
    # As in the project; it hides the values of a failing test case.
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = -p no:schemathesis\n")
    return tmp_path


def write_property(folder: Path, condition: str) -> None:
    (folder / "test_it.py").write_text(PROPERTY.format(condition=condition))


def test_a_failure_is_reported_with_its_seed_and_can_be_repeated(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    write_property(folder, "% 97 != 5")
    assert fuzzing.fuzz(folder, 1e6, seed=1) == pytest.ExitCode.TESTS_FAILED
    out = capfd.readouterr().out
    shown = re.search(r"to repeat: (pytest .* --hypothesis-seed=(\d+)) '.*test_it.py::", out)
    assert shown is not None, out
    assert f"seed {shown[2]}, " in out
    example = re.search(r"number=\d+", out)
    assert example is not None
    command = [sys.executable, "-m", *shown[1].split(), "test_it.py"]
    again = subprocess.run(
        command, cwd=folder, capture_output=True, text=True, check=False, timeout=WAIT_TIMEOUT_S
    )
    assert again.returncode == pytest.ExitCode.TESTS_FAILED
    assert example[0] in again.stdout


def test_when_nothing_is_found_it_ends_with_its_time(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    write_property(folder, ">= 0")
    # The time asked for before each round, and once when it is over.
    times = iter([0.0, 10.0, 50.0, 100.0])
    assert fuzzing.fuzz(folder, 100.0, 7, clock=lambda: next(times)) == 0
    assert [line for line in capfd.readouterr().out.splitlines() if "left" in line] == [
        "seed 7, 90 s left",
        "seed 8, 50 s left",
    ]


def test_no_test_begins_when_the_time_is_over(
    folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    write_property(folder, "< 0")
    times = iter([0.0, 0.0, 100.0])
    assert fuzzing.fuzz(folder, 1e-9, 7, clock=lambda: next(times)) == 0
    assert "1 failed" not in capfd.readouterr().out
