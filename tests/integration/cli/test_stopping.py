"""A command that is told to stop ends and cleans up, wherever the signal breaks into it."""

import subprocess
import sys
from pathlib import Path

import pytest

from support import stopped_command
from support.recorded_scene import environment

STOPPED = {"SIGTERM": (143, "multiradar: stopped\n"), "SIGINT": (130, "")}


@pytest.mark.parametrize("case", stopped_command.CASES)
@pytest.mark.parametrize("name", STOPPED)
def test_a_signal_is_not_lost_and_the_clean_up_is_whole(
    name: str, case: str, tmp_path: Path
) -> None:
    """Polars once dropped the exception of a signal, and said that a name was no data type."""
    line = [sys.executable, stopped_command.__file__, name, case, str(tmp_path / "made")]
    done = subprocess.run(
        line, capture_output=True, text=True, check=False, timeout=50.0, env=environment()
    )
    assert (done.returncode, done.stderr) == STOPPED[name]
    assert not done.stdout
    assert not list(tmp_path.iterdir())
