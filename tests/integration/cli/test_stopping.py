"""A command stopped by a signal exits and leaves nothing, whenever the signal arrives."""

import os
import sys
from pathlib import Path

import pytest

from multiradar.__main__ import main
from support.processes import stopped_command
from support.processes.waiting import run_to_end
from support.scenarios.recorded_scene import environment

STOPPED = {"SIGTERM": 143, "SIGINT": 130}

THREADS = "OPENBLAS_NUM_THREADS"


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


@pytest.mark.parametrize("given", [None, "2"])
def test_commands_use_one_thread_for_linear_algebra(
    given: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("multiradar.__main__.end_on_signals", lambda: None)
    monkeypatch.setattr("multiradar.cli.main.main", lambda: None)
    monkeypatch.setenv(THREADS, given or "")
    if given is None:
        monkeypatch.delenv(THREADS)
    main()
    assert os.environ[THREADS] == (given or "1")


@pytest.mark.parametrize("closed", [(0,), (1,), (2,), (0, 1, 2)])
def test_a_command_with_closed_streams_works(closed: tuple[int, ...], tmp_path: Path) -> None:
    def close() -> None:
        for number in closed:
            os.close(number)

    file, out = tmp_path / "a.csv", tmp_path / "out"
    rows = [f"{1_533_110_400 + k},3c6444,{47.0 + 0.002 * k},8.5,35000\n" for k in range(3)]
    file.write_text("timestamp,icao24,latitude,longitude,altitude\n" + "".join(rows))
    command: list[str | Path] = [sys.executable, "-m", "multiradar"]
    command += ["convert", "adsb", file, "--out", out]
    done = run_to_end(command, env=environment(), preexec_fn=close)
    assert done.returncode == 0
    assert ("read 3 " in done.stdout) == (1 not in closed)
    assert done.stderr == ""
    table = (out / "measurements.parquet").read_bytes()
    assert table[:4] == table[-4:] == b"PAR1"
