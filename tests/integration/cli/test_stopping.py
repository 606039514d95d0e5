"""A command stopped by a signal exits and leaves nothing, whenever the signal arrives."""

import sys
from pathlib import Path

import pytest

from support.processes import stopped_command
from support.processes.waiting import run_to_end
from support.scenarios.recorded_scene import environment

STOPPED = {"SIGTERM": 143, "SIGINT": 130}


@pytest.mark.parametrize("case", stopped_command.CASES)
@pytest.mark.parametrize("name", STOPPED)
def test_a_signal_is_not_lost_and_leaves_nothing(name: str, case: str, tmp_path: Path) -> None:
    """Regression: an exception for it was dropped by compiled code, or caused a crash."""
    out, temporary = tmp_path / "out", tmp_path / "tmp"
    out.mkdir()
    temporary.mkdir()
    done = run_to_end(
        [sys.executable, stopped_command.__file__, name, case, str(out)],
        env={**environment(), "TMPDIR": str(temporary)},
    )
    assert (done.returncode, done.stderr) == (STOPPED[name], "multiradar: stopped\n")
    assert not done.stdout
    assert not list(out.iterdir())
    assert not list(temporary.iterdir())


def test_ctrl_c_while_the_command_is_imported_is_no_traceback() -> None:
    code = """
import os, signal, sys
class Interrupt:
    def find_spec(self, name, path=None, target=None):
        if name == "multiradar.cli.main":
            os.kill(os.getpid(), signal.SIGINT)
sys.meta_path.insert(0, Interrupt())
from multiradar.__main__ import main
main()
"""
    done = run_to_end([sys.executable, "-c", code], env=environment())
    assert (done.returncode, done.stderr) == (130, "multiradar: stopped\n")
